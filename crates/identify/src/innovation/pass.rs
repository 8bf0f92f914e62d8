//! One pass of the model along a motion of all runs: what it leaves there, and the motion that the smoother makes of that.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use sinew_effect::Actuation;
use sinew_plant::Plant;

use super::Innovation;
use super::filter::Filters;
use super::kalman::{GROUP, Input, Kalman, Smoothed, Told};
use super::linearise::{Along, along};
use super::motion::{Even, Motion, at_sample, where_holds_meet};
use super::rows::{Arrival, Innovations, JointChannels, deviation_readings, read_late};
use super::slip::slip;
use super::system::System;
use crate::freedom::{Freedom, Links, Springs};
use crate::imposed::predict;
use crate::record::{Record, Reduction};
use crate::residual::{LoggedTorques, Passing, Samples};
use crate::series::{balanced, delivered, driven, whole_samples};

// Shares of the way that are tried, each half of the one before, and what −2 log likelihood may rise by a sample.
const TRIES: usize = 3;
const WORSE: f64 = 0.01;

// What the readings of a joint add up to.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    misfit: f64,
    square: f64,
    readings: f64,
}

/// −2 log likelihood by run and joint.
pub(super) struct Misfits(Vec<Vec<Tally>>);

impl Misfits {
    fn by_run(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|of_joints| of_joints.iter().map(|tally| tally.misfit).sum())
    }

    fn joints(&self) -> Range<usize> {
        0..self.0.first().map_or(0, Vec::len)
    }

    fn sum_of(&self, joint: usize, of: impl Fn(&Tally) -> f64) -> f64 {
        self.0.iter().map(|of_joints| of(&of_joints[joint])).sum()
    }

    pub fn by_joint(&self) -> Vec<f64> {
        self.joints().map(|joint| self.sum_of(joint, |tally| tally.misfit)).collect()
    }

    /// The mean square of the innovations of every joint in units of what is expected of them.
    pub fn squares(&self) -> impl Iterator<Item = f64> {
        let mean = move |joint| {
            self.sum_of(joint, |tally| tally.square) / self.sum_of(joint, |tally| tally.readings).max(1.0)
        };
        self.joints().map(mean)
    }

    pub fn sum(&self) -> f64 {
        self.by_run().sum()
    }
}

/// A pass of the model along the present motions of all runs.
pub(super) struct Pass<'a> {
    pub form: &'a Innovation,
    pub torques: LoggedTorques,
    pub motions: Vec<Motion>,
    pub records: Vec<Record>,
    // Measured minus predicted of every joint, by run and sample.
    inputs: Vec<Vec<Vec<Input>>>,
    // What the mean torque of a hold differs from that in its middle, by run.
    hold_means: Vec<Vec<Vec<f64>>>,
    // Where the links are, by run.
    links: Vec<Links>,
    // How late what is behind the gears is read, by run.
    late: Vec<Vec<[isize; 2]>>,
    // How the logged torques come to act, by run.
    arrivals: Vec<Vec<Arrival>>,
    // What the torque in the middle of a hold differs from that where it begins, by run; empty where
    // no sensor shows it, and where predictions are smooth.
    steps: Vec<Vec<Vec<f64>>>,
    /// The equations of the joints about the motions, by run.
    pub systems: Vec<System>,
}

impl<'a> Pass<'a> {
    pub fn new(
        form: &'a Innovation,
        motions: Vec<Motion>,
        torques: LoggedTorques,
        plant: &Plant,
        p: &[f64],
    ) -> Self {
        let parts: Vec<_> = form
            .runs
            .par_iter()
            .zip(&motions)
            .map(|(run, motion)| {
                let record = run.record(motion, torques);
                let along = along(plant, p, &record, &form.channels);
                let system = form.system(run, motion, torques, &along);
                let arrivals = arrivals(&along, torques, record.scales.step());
                let inputs = inputs((run, motion, torques), &along, &arrivals, &form.joints, &system);
                (record, along, system, arrivals, inputs)
            })
            .collect();
        let mut pass = Self {
            form,
            torques,
            motions,
            records: Vec::new(),
            inputs: Vec::new(),
            hold_means: Vec::new(),
            links: Vec::new(),
            late: Vec::new(),
            arrivals: Vec::new(),
            steps: Vec::new(),
            systems: Vec::new(),
        };
        for (record, along, system, arrivals, inputs) in parts {
            let shows = torques.is_whole() && system.joints.iter().any(|joint| !joint.at_once(0).is_empty());
            pass.steps.push(if shows { steps(&along, &arrivals, &form.joints) } else { Vec::new() });
            pass.arrivals.push(arrivals);
            pass.records.push(record);
            pass.inputs.push(inputs);
            pass.hold_means.push(along.hold_means);
            pass.links.push(along.links);
            pass.late.push(along.late);
            pass.systems.push(system);
        }
        pass
    }

    /// The same without slip: a kernel's velocities change over many holds, so that none of them has a decay of its own.
    pub fn without_slip(mut self) -> Self {
        self.inputs.iter_mut().flatten().flatten().for_each(|input| input.slip = 0.0);
        self
    }

    /// Takes friction over a hold as unsure, or as sure, if the log is likelier with that; true if it does.
    pub fn takes_friction_as(&mut self, is_unsure: bool, misfits: &mut Misfits, noise: &[f64]) -> bool {
        if self.torques.unsure_friction == is_unsure {
            return false;
        }
        self.set_unsure_friction(is_unsure);
        let taken = self.misfits(noise);
        let is_likelier = taken.sum() < misfits.sum();
        if is_likelier {
            *misfits = taken;
        } else {
            self.set_unsure_friction(!is_unsure);
        }
        is_likelier
    }

    fn set_unsure_friction(&mut self, is_unsure: bool) {
        self.torques.unsure_friction = is_unsure;
        self.systems.iter_mut().for_each(|system| system.unsure_friction = is_unsure);
    }

    /// Measured minus predicted of one joint at a sample; nothing of a hinge.
    pub fn input(&self, run: usize, joint: usize, k: usize) -> Input {
        self.inputs[run].get(joint).map_or(Input::default(), |of_joint| of_joint[k])
    }

    /// The motions with the smoothed deviation added, and −2 log likelihood without it. Friction near rest takes a motor
    /// to its velocity within a sample, so that nothing shows the first one, and a link that begins with a wrong one swings for
    /// long: from pass to pass both would leave all reason. A run begins with the kernel's motion, which fades out while its springs
    /// are led.
    pub fn smoothed(&self, noise: &[f64]) -> (Vec<Motion>, Misfits) {
        let mut motions = self.motions.clone();
        // σ of a velocity goes with the noise of the torque to the power of ¾; what a model leaves besides makes none unsure.
        let own = self.form.own_noise(noise);
        let shares: Vec<f64> = own.iter().zip(noise).map(|(own, all)| (own / all).powf(0.75)).collect();
        let smoothed = self.of_each_group(noise, |kalman, run| {
            let with_speed_noise = self.form.runs[run].asks_speed_noise();
            let input = |joint, k| self.input(run, joint, k);
            self.summed(&kalman, run, Samples::All, |told| kalman.smoothed(with_speed_noise, input, told))
        });
        let (smoothed, misfits): (Vec<Vec<_>>, Vec<Vec<_>>) =
            smoothed.into_iter().map(|groups| groups.into_iter().unzip()).unzip();
        let misfits = misfits.iter().map(|groups: &Vec<Vec<Tally>>| groups.concat()).collect();
        let runs = motions.iter_mut().zip(smoothed).zip(&self.systems).zip(&self.form.smooth);
        for (((motion, groups), system), kernel) in runs {
            let of_joints = self.form.joints.iter().zip(&shares).zip(groups.into_iter().flatten());
            for ((joint, share), deviation) in of_joints {
                // The sample after the last hold goes with it.
                let last = deviation.last().copied();
                motion.speed_noise[joint.dof].clear();
                for (k, Smoothed { x, speed_noise }) in deviation.into_iter().chain(last).enumerate() {
                    motion.deviate(joint.dof, k, [x[0], x[1]]);
                    let is_led = k < system.led;
                    if is_led {
                        motion.fade_in(joint.dof, k, k as f64 / system.led as f64, kernel);
                    }
                    let told = speed_noise.map(|std| if is_led { 0.0 } else { share * std });
                    motion.speed_noise[joint.dof].extend(told);
                }
            }
        }
        (motions, Misfits(misfits))
    }

    // What `work` gives, and the likelihood that it tells of every joint of a group in a run; hinges have no rows.
    fn summed<T>(
        &self,
        kalman: &Kalman,
        run: usize,
        samples: Samples,
        work: impl FnOnce(&mut dyn FnMut(usize, usize, Told)) -> T,
    ) -> (T, Vec<Tally>) {
        let joints = self.form.joints_of(&kalman.group);
        let (first, mut tallies) = (joints.start, vec![Tally::default(); joints.len()]);
        let every = self.records[run].scales.every;
        let kept: Option<Vec<&[bool]>> = match samples {
            Samples::All => None,
            Samples::OfRows => Some(joints.clone().map(|joint| self.rows_kept(run, joint)).collect()),
        };
        let is_asked = |joint: usize, k: usize| {
            kept.as_ref().is_none_or(|kept| kept[joint - first].get(k / every) == Some(&true))
        };
        let found = work(&mut |joint, k, told: Told| {
            if self.counts(run, k) && is_asked(joint, k) {
                let tally = &mut tallies[joint - first];
                tally.misfit += told.misfit;
                tally.square += told.square;
                tally.readings += 1.0;
            }
        });
        (found, tallies)
    }

    // True if a sample adds to the likelihood of a run.
    fn counts(&self, run: usize, k: usize) -> bool {
        let record = &self.records[run];
        let is_left_out = || record.time.get(k).is_some_and(|time| record.leaves_out(*time));
        k >= self.systems[run].led && !is_left_out()
    }

    /// The pass along the motions asked for, its −2 log likelihood, and by how much that falls from what it was `before`.
    /// Friction near rest bends within less than a smoother's correction, which may then lead further off than it came from: where
    /// a run fits worse, half of the way is tried; if one still does, this pass and none. A pass of a long log is large, so one at
    /// a time is kept.
    pub fn bettered(
        self,
        mut motions: Vec<Motion>,
        before: Misfits,
        noise: &[f64],
        about: impl Fn(Vec<Motion>, LoggedTorques) -> Self,
    ) -> (Self, Misfits, Option<f64>) {
        let lengths: Vec<f64> = self.records.iter().map(|record| record.len() as f64).collect();
        let torques = self.torques;
        let present = self.into_motions();
        for _ in 0..TRIES {
            let next = about(motions.clone(), torques);
            let after = next.misfits(noise);
            let worse: Vec<bool> = (after.by_run().zip(before.by_run()).zip(&lengths))
                .map(|((after, before), length)| after > before + WORSE * length)
                .collect();
            if !worse.contains(&true) {
                let fall = before.sum() - after.sum();
                return (next, after, Some(fall));
            }
            for ((to, from), _) in motions.iter_mut().zip(&present).zip(&worse).filter(|(_, worse)| **worse) {
                to.halve(from);
            }
        }
        (about(present, torques), before, None)
    }

    fn into_motions(self) -> Vec<Motion> {
        self.motions
    }

    /// −2 log likelihood of what was measured.
    pub fn misfits(&self, noise: &[f64]) -> Misfits {
        self.misfits_of(Samples::All, noise)
    }

    /// The same of these samples.
    pub fn misfits_of(&self, samples: Samples, noise: &[f64]) -> Misfits {
        let misfits = self.of_each_group(noise, |kalman, run| {
            let input = |joint, k| self.input(run, joint, k);
            self.summed(&kalman, run, samples, |told| kalman.misfit(usize::MAX, input, told)).1
        });
        Misfits(misfits.into_iter().map(|groups| groups.concat()).collect())
    }

    // Which rows of a joint's motor torque in a run count.
    fn rows_kept(&self, run: usize, joint: usize) -> &[bool] {
        let layout = &self.form.layout;
        let segment = layout.of_channel(self.form.joints[joint].torque).nth(run);
        segment.map_or(&[], |s| &layout.keep[s.first..s.first + s.len])
    }

    /// Joints and hinges whose covariance is carried along together: all that may be, since the torque noise of one moves the others.
    /// Of more, groups as alike in size as may be, the larger ones nearer to the tip, where light links move each other most.
    pub fn groups(&self) -> Vec<Range<usize>> {
        let n = self.systems.first().map_or(0, |system| system.joints.len());
        let count = n.div_ceil(GROUP).max(1);
        (0..count).map(|group| group * n / count..(group + 1) * n / count).collect()
    }

    // What `work` gives for each group of joints in each run.
    fn of_each_group<T: Send>(&self, noise: &[f64], work: impl Fn(Kalman, usize) -> T + Sync) -> Vec<Vec<T>> {
        let groups = self.groups();
        let of_run = |run: usize| {
            let kalman =
                |group: &Range<usize>| Kalman { system: &self.systems[run], group: group.clone(), noise };
            groups.par_iter().map(|group| work(kalman(group), run)).collect()
        };
        (0..self.records.len()).into_par_iter().map(of_run).collect()
    }

    /// The motions of a kernel, whose velocities are those of a smooth motion; where held torques drive it, the jerk of every hold
    /// is less than that of the whole motion by what the torques step at the samples.
    ///
    /// θ_{k+1} − θ_k = h/2 (θ̇_k + θ̇_{k+1}) − h³/12 θ⃛:   δθ̇ = −h²/12 ∂θ̈/∂τ τ̇
    pub fn held(&self) -> Vec<Motion> {
        let joints = &self.form.joints;
        let mut motions = self.motions.clone();
        for ((motion, system), even) in motions.iter_mut().zip(&self.systems).zip(&self.form.runs) {
            let last = system.len().saturating_sub(1);
            for (to, joint) in joints.iter().enumerate() {
                for (k, thetad) in motion.thetad[joint.dof].iter_mut().enumerate() {
                    let kick = |from: usize| {
                        system.kick(to, from, k.min(last)) * even.torque_steps[joints[from].torque][k]
                    };
                    *thetad -= (0..joints.len()).map(kick).sum::<f64>() / 12.0;
                }
            }
        }
        motions
    }

    /// Records whose rows come from filters with frozen gains, and the rows of what was measured. With `commanded` more
    /// acceleration than that of the motion; what the model predicts for it besides counts as measured, so that the rows of
    /// this model stay as they are.
    pub fn frozen(
        self,
        noise: &[f64],
        commanded: Option<&[Vec<Vec<f64>>]>,
        (plant, p): (&Plant, &[f64]),
    ) -> (Vec<Record>, Vec<Record>, Vec<f64>) {
        let groups = self.groups();
        let Self { form, torques, motions, records, systems, .. } = self;
        let measures = (&motions, self.hold_means, self.links, self.late, self.arrivals, self.steps);
        let runs = 0..records.len();
        let parts: Vec<((Record, Record), Vec<f64>)> = (records, systems, &form.runs, measures, runs)
            .into_par_iter()
            .map(|(mut record, system, even, (motion, means, links, late, arrivals, steps), run)| {
                let commanded = commanded.map(|of_runs| &of_runs[run]);
                let predicted = |record: &Record| {
                    let freedom = Freedom::of(plant, p, record, Springs::Simulated);
                    predict(plant, p, record, &form.channels, &freedom)
                };
                let gains = |group: &Range<usize>| {
                    let kalman = Kalman { system: &system, group: group.clone(), noise };
                    (group.clone(), kalman.gains())
                };
                let gains = || groups.par_iter().map(gains).collect();
                let (groups, before) = rayon::join(gains, || commanded.map(|_| predicted(&record)));
                let filters = Filters { system, groups, every: even.scales.every };
                let channels = form.channels.len();
                let filters = Arc::new(Innovations {
                    filters,
                    joints: form.joints.clone(),
                    channels,
                    late,
                    arrivals,
                    is_whole: torques.is_whole(),
                });
                let of_joints = || form.joints.iter().zip(commanded.into_iter().flatten());
                of_joints().for_each(|(joint, more)| record.accelerate(joint.dof, more));
                let rows = || {
                    let smooth = even.thinned(motion, &links, &filters, torques);
                    let measured = filters.measured(even, motion, &means, &steps);
                    (smooth, measured, before.map(|before| filters.rows(&before)))
                };
                let after = || commanded.map(|_| filters.rows(&predicted(&record)));
                let ((mut smooth, mut measured, before), after) = rayon::join(rows, after);
                of_joints().for_each(|(joint, more)| smooth.accelerate(joint.dof, &where_holds_meet(more)));
                for ((m, b), a) in
                    measured.iter_mut().zip(before.iter().flatten()).zip(after.iter().flatten())
                {
                    *m += a - b;
                }
                record.links = Some(Arc::new(links));
                record.reduction = Reduction::Innovations(filters);
                ((record, smooth), measured)
            })
            .collect();
        let (records, measured): (Vec<(Record, Record)>, Vec<Vec<f64>>) = parts.into_iter().unzip();
        let (records, smooth) = records.into_iter().unzip();
        (records, smooth, measured.concat())
    }
}

// What the torque in the middle of a hold differs from that where it begins, by degree of freedom; empty of one that does not step.
fn steps(along: &Along, arrivals: &[Arrival], joints: &[JointChannels]) -> Vec<Vec<f64>> {
    let mut steps = vec![Vec::new(); arrivals.len()];
    for joint in joints.iter().filter(|joint| arrivals[joint.dof].is_held) {
        let acting = &along.acting[joint.torque];
        steps[joint.dof] = (0..acting.len()).map(|k| acting[k] - begun(acting, k)).collect();
    }
    steps
}

// How logged torques come to act, by degree of freedom; one with what was logged in its prediction knows of that itself.
fn arrivals(along: &Along, torques: LoggedTorques, step: f64) -> Vec<Arrival> {
    let of = |drive: &Actuation<f64>| Arrival {
        late: if torques.is_whole() { 0 } else { whole_samples(drive, step) },
        is_held: drive.lag == 0.0,
    };
    along.drives.iter().map(of).collect()
}

// A smooth torque where a hold begins.
fn begun(acting: &[f64], k: usize) -> f64 {
    at_sample(acting.len(), k, |hold| [acting[hold]])[0]
}

// Measured minus predicted of every joint along a run.
fn inputs(
    (run, motion, torques): (&Even, &Motion, LoggedTorques),
    along: &Along,
    arrivals: &[Arrival],
    joints: &[JointChannels],
    system: &System,
) -> Vec<Vec<Input>> {
    let acting = |joint: &JointChannels| -> &[f64] { &along.acting[joint.torque] };
    let delivered: Vec<Vec<f64>> =
        joints.par_iter().map(|joint| delivered_to(run, torques, along, *joint)).collect();
    // At a sample, what stays over the hold that begins beside the mean of the holds that meet.
    let beside = |j: usize, k: usize| {
        let arrival = arrivals[joints[j].dof];
        arrival.begun(delivered[j].len(), k, |hold| [delivered[j][hold]])[0] - begun(acting(&joints[j]), k)
    };
    let of_joint = |(i, joint): (usize, &JointChannels)| {
        let late = along.late[joint.dof];
        let told = |c: Option<usize>, late, k| {
            let of =
                |c: usize| read_late(along.predicted[c].len(), k, late, |hold| [along.predicted[c][hold]]);
            c.map_or(0.0, |c| of(c)[0])
        };
        let is_held = is_held(&along.drives[joint.dof], torques);
        let of = |k: usize| {
            let [motor, link, gear] = deviation_readings(run, motion, *joint, late, k);
            let at_once = system.joints[i].at_once(k).iter().zip(0..joints.len());
            let passed: f64 = at_once.map(|(weight, j)| weight * beside(j, k)).sum();
            let (link, gear) = (link - told(joint.position, late[0], k), gear - told(joint.gear, late[1], k));
            let torque = delivered[i][k] - along.hold_means[joint.dof][k] - acting(joint)[k];
            let slip = slip(motion, along, joint.dof, k, run.scales.period, is_held);
            Input { torque, slip, read: [motor, link, gear - passed] }
        };
        (0..acting(joint).len()).map(of).collect()
    };
    joints.par_iter().enumerate().map(of_joint).collect()
}

// True if a drive gives at once what is logged.
fn is_held(drive: &Actuation<f64>, torques: LoggedTorques) -> bool {
    drive.lag == 0.0 && drive.delay == 0.0 && torques.early == 0.0
}

// The torque of a motor hold by hold, as it acts: what a drive delays is not in the motion yet, and a smoother that took it for
// that would chase its own noise.
fn delivered_to(run: &Even, torques: LoggedTorques, along: &Along, joint: JointChannels) -> Vec<f64> {
    let (drive, acting) = (&along.drives[joint.dof], &along.acting[joint.torque]);
    let (logged, step) = (&run.torque[joint.torque], run.scales.step());
    match torques.passing {
        _ if is_held(drive, torques) => logged.clone(),
        Passing::Foretold => delivered(logged, &run.smoothed(acting), drive, torques.early, step),
        Passing::Whole { smoothed } => driven(balanced(logged, smoothed, step), drive, step),
    }
}
