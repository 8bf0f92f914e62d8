//! The innovation residual: what the sensors show beyond a filter that knows the model and the noise.
//!
//! A smoother of the model, driven by the measured torque, gives a reference motion. What the model predicts along it
//! and what was measured differ by little; a Kalman filter of the deviation, with its gains frozen, turns the
//! difference into innovations. They are white where the model is right, torque noise enters no derivative, and an
//! error of the reference enters to second order only.

mod commanded;
mod filter;
mod kalman;
mod linearise;
mod motion;
mod noise;
mod rows;
mod slip;
mod system;

use std::ops::Range;
use std::sync::{Arc, PoisonError, RwLock};

use rayon::prelude::*;

use sinew_data::Run;
use sinew_effect::Sensor;
use sinew_model::Robot;
use sinew_plant::Plant;

use crate::freedom::{Freedom, Links, Springs};
use crate::imposed::predict;
use crate::record::{Channel, Record, Reduction, Sensors};
use crate::residual::{Grid, Layout, LoggedTorques, ResidualForm, Rows, Start, TRANSIENT};
use crate::scale::Scales;
use crate::series::delivered;
use filter::Filters;
use kalman::{GROUP, Input, Kalman, Smoothed};
use linearise::{Along, INERTIA_EVERY, along};
use motion::{Even, Motion, where_holds_meet};
pub(crate) use rows::Innovations;
use rows::{JointChannels, deviation_readings, read_late};
use slip::slip;
use system::{Linear, MOST_JOINTS, Readings, System};

/// What the rows of an innovation residual are formed about: reference motions with their frozen filters.
#[derive(Default)]
pub(crate) struct Reference {
    records: Vec<Record>,
    // On the grid on which derivatives are taken.
    smooth: Vec<Record>,
    measured: Vec<f64>,
    /// Standard deviation of the torque noise of every joint that moves, N·m.
    pub torque_noise: Vec<f64>,
    /// −2 log likelihood of what each joint that moves shows beyond what is known of the others, by the model that the
    /// reference was taken from.
    pub misfit_by_joint: Vec<f64>,
    /// How the logged torques are taken.
    pub torques: LoggedTorques,
    /// True if torque noise acts and is not small beside what accelerates the joints.
    pub noise_matters: bool,
    // What the next reference begins with.
    motions: Vec<Motion>,
}

/// The innovation residual of some runs.
pub(crate) struct Innovation {
    channels: Vec<Channel>,
    joints: Vec<JointChannels>,
    runs: Vec<Even>,
    layout: Layout,
    // The kernel's motion of every run.
    smooth: Vec<Motion>,
    reference: RwLock<Arc<Reference>>,
}

// Most rounds of noise and smoothing; the change of ln noise, and the fall of −2 log likelihood, below which they end.
const ROUNDS: usize = 8;
const SETTLED_NOISE: f64 = 0.15;
const SETTLED_MISFIT: f64 = 10.0;
// Shares of the way that are tried, each half of the one before, and what −2 log likelihood may rise by a sample.
const TRIES: usize = 3;
const WORSE: f64 = 0.01;
// Standard deviations of a velocity from rest within which it may be rest.
const UNSURE: f64 = 6.0;

impl Innovation {
    /// Why runs with these sensors have no such residual; none if they have one.
    pub fn impossible(robot: &Robot, sensors: &Sensors) -> Option<&'static str> {
        let has = |channel| sensors.channels.contains(&channel);
        let is_rigid = |c: &Channel| robot.joints[c.dof].stiffness.is_none();
        if sensors.channels.iter().any(|c| c.sensor == Sensor::JointTorque && is_rigid(c)) {
            Some("the log has torques of joints without springs")
        } else if !sensors.moving().all(|dof| has(Channel { sensor: Sensor::MotorTorque, dof })) {
            Some("not every joint that moves has a motor torque")
        } else if sensors.moving().count() > MOST_JOINTS {
            Some("more joints move than are coupled")
        } else {
            None
        }
    }

    /// The form about a kernel's motion to begin with; none where it is impossible.
    pub fn new(robot: &Robot, runs: &[Run], sensors: &Sensors, scales: Scales) -> Option<Self> {
        if Self::impossible(robot, sensors).is_some() {
            return None;
        }
        let channels = sensors.channels.clone();
        let find = |sensor, dof| channels.iter().position(|c| *c == Channel { sensor, dof });
        let joint = |dof| {
            let torque = find(Sensor::MotorTorque, dof)?;
            let [position, gear] = [Sensor::JointPosition, Sensor::JointTorque].map(|s| find(s, dof));
            Some(JointChannels { dof, torque, position, gear })
        };
        let joints = (0..sensors.imposed.len()).filter_map(joint).collect();
        let (runs, motions): (Vec<Even>, Vec<Motion>) =
            runs.iter().map(|run| Even::new(robot, run, sensors, scales)).unzip();
        let records: Vec<Record> =
            runs.iter().zip(&motions).map(|(run, motion)| run.record(motion, 0.0)).collect();
        let layout = Layout::of(&records, &channels, TRANSIENT, |_, _| 0.0);
        let reference = Reference { records, ..Reference::default() };
        let reference = RwLock::new(Arc::new(reference));
        Some(Self { channels, joints, runs, layout, smooth: motions, reference })
    }

    /// The same with the present reference's velocities known as well as its noise lets them: where a motor may rest or
    /// not, friction is no row of a linear filter, unless it is told how uncertain velocities are.
    pub fn sure(mut self) -> Self {
        let reference = self.present();
        let noise = self.own_noise(&reference.torque_noise);
        let of_run = |(run, record): (&Even, &Record)| {
            if run.asks_speed_noise() { Vec::new() } else { speed_noise(record, &noise) }
        };
        let speed_noise: Vec<Vec<f64>> = self.runs.par_iter().zip(&reference.records).map(of_run).collect();
        self.layout = Layout::of(&reference.records, &self.channels, TRANSIENT, |run, dof| {
            let joint = self.joints.iter().position(|j| j.dof == dof);
            joint.and_then(|joint| speed_noise[run].get(joint)).map_or(0.0, |std| UNSURE * std)
        });
        self
    }

    /// Begins with the kernel's motion of every run, torques taken so, and torque noise that is known.
    pub fn begin_known(&self, torques: LoggedTorques, torque_noise: &[f64]) {
        let (motions, torque_noise) = (self.smooth.clone(), torque_noise.to_vec());
        self.adopt(&Arc::new(Reference { torques, motions, torque_noise, ..Reference::default() }));
    }

    /// The present reference.
    pub fn present(&self) -> Arc<Reference> {
        Arc::clone(&self.reference.read().unwrap_or_else(PoisonError::into_inner))
    }

    // Torque noise of every joint, at most as it was read in the noisiest run: what a model leaves besides makes no velocity
    // unsure.
    fn own_noise(&self, noise: &[f64]) -> Vec<f64> {
        let read = |channel: usize| self.runs.iter().map(|run| run.noise[channel]).fold(0.0, f64::max);
        self.joints.iter().zip(noise).map(|(joint, n)| n.min(read(joint.torque))).collect()
    }

    // Joints whose covariance is carried along together: all that may be, since the torque noise of one moves the others. Of
    // more, groups as alike in size as may be, the larger ones nearer to the tip, where light links move each other most.
    fn groups(&self) -> Vec<Range<usize>> {
        let n = self.joints.len();
        let count = n.div_ceil(GROUP).max(1);
        (0..count).map(|group| group * n / count..(group + 1) * n / count).collect()
    }

    // The equations of the moving joints along a run.
    fn system(&self, run: &Even, along: &Along) -> System {
        let square = |x: f64| (x * x).max(1e-24);
        let alike = |c: Option<usize>| c.map(|c| run.alike[c].clone()).unwrap_or_default();
        let readings = |j: &JointChannels| Readings {
            motor: square(run.theta_noise[j.dof]),
            link: j.position.map(|c| square(run.noise[c])),
            gear: j.gear.map(|c| square(run.noise[c])),
            shown: if along.links.motion[j.dof].is_none() { 0 } else { 2 },
            alike: [run.theta_alike[j.dof].clone(), alike(j.position), alike(j.gear)],
        };
        let linear: Vec<&[Linear]> = self.joints.iter().map(|j| along.linear[j.dof].as_slice()).collect();
        let mobility: Vec<Vec<f64>> = along.mobility.iter().map(|m| self.of_joints(m)).collect();
        let readings = self.joints.iter().map(readings).collect();
        System::new(readings, &linear, &mobility, INERTIA_EVERY, run.scales.period)
    }

    // The rows and columns of the joints that move in a matrix of all degrees of freedom, by rows.
    fn of_joints(&self, matrix: &[f64]) -> Vec<f64> {
        let nv = matrix.len().isqrt();
        let joints = || self.joints.iter().map(|j| j.dof);
        joints().flat_map(|i| joints().map(move |j| matrix[i * nv + j])).collect()
    }

    // A motion that is too rough turns friction about at the wrong time, one that is too smooth turns it late: model and noise
    // are led to agree with each other.
    fn renewed(&self, plant: &Plant, p: &[f64], from: Start) -> Reference {
        let present = self.present();
        let torques = present.torques;
        let about = |motions| Pass::new(self, motions, torques.early, plant, p);
        let (motions, mut noise) = match from {
            Start::Kernel => (self.smooth.clone(), None),
            Start::Reference => (present.motions.clone(), Some(present.torque_noise.clone())),
        };
        let mut pass = match from {
            Start::Kernel => about(motions).without_slip(),
            Start::Reference => about(motions),
        };
        for round in 0..ROUNDS {
            let found = pass.torque_noise(noise.as_deref());
            let smoothed = pass.smoothed(&found);
            let next = if from == Start::Kernel && round == 0 { pass.held(smoothed) } else { smoothed };
            let (next, fall) = pass.bettered(next, &found, about);
            pass = next;
            let alike = |(a, b): (&f64, &f64)| (a / b).ln().abs() < SETTLED_NOISE;
            let settled = noise.as_ref().is_some_and(|n| n.iter().zip(&found).all(alike));
            noise = Some(found);
            if fall.is_none_or(|fall| settled && fall < SETTLED_MISFIT) {
                break;
            }
        }
        let noise = noise.unwrap_or_default();
        let misfit_by_joint = pass.misfit_by_joint(&noise);
        let noise_matters = pass.noise_matters(&noise);
        let motions = pass.motions.clone();
        let commanded = torques.move_without_noise.then(|| pass.commanded(&noise));
        let (records, smooth, measured) = pass.frozen(&noise, commanded.as_deref(), (plant, p));
        Reference {
            records,
            smooth,
            measured,
            torque_noise: noise,
            misfit_by_joint,
            torques,
            noise_matters,
            motions,
        }
    }
}

impl Reference {
    /// The reference motion of every run, with what makes rows of it.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// −2 log likelihood of what was measured.
    pub fn misfit(&self) -> f64 {
        self.misfit_by_joint.iter().sum()
    }
}

// One pass of the model along the present motions of all runs.
struct Pass<'a> {
    form: &'a Innovation,
    motions: Vec<Motion>,
    records: Vec<Record>,
    // Measured minus predicted of every joint, by run and sample.
    inputs: Vec<Vec<Vec<Input>>>,
    // What the mean torque of a hold differs from that in its middle, by run.
    hold_means: Vec<Vec<Vec<f64>>>,
    // Where the links are, by run.
    links: Vec<Links>,
    // How late what is behind the gears is read, by run.
    late: Vec<Vec<[isize; 2]>>,
    // The equations of the joints about the motions, by run.
    systems: Vec<System>,
}

impl<'a> Pass<'a> {
    // Logged torques act so much before the middles of their holds.
    fn new(form: &'a Innovation, motions: Vec<Motion>, early: f64, plant: &Plant, p: &[f64]) -> Self {
        let parts: Vec<(Record, Along, System, Vec<Vec<Input>>)> = form
            .runs
            .par_iter()
            .zip(&motions)
            .map(|(run, motion)| {
                let record = run.record(motion, early);
                let along = along(plant, p, &record, &form.channels);
                let system = form.system(run, &along);
                let inputs =
                    form.joints.par_iter().map(|joint| inputs(run, motion, early, &along, *joint)).collect();
                (record, along, system, inputs)
            })
            .collect();
        let mut pass = Self {
            form,
            motions,
            records: Vec::new(),
            inputs: Vec::new(),
            hold_means: Vec::new(),
            links: Vec::new(),
            late: Vec::new(),
            systems: Vec::new(),
        };
        for (record, along, system, inputs) in parts {
            pass.records.push(record);
            pass.inputs.push(inputs);
            pass.hold_means.push(along.hold_means);
            pass.links.push(along.links);
            pass.late.push(along.late);
            pass.systems.push(system);
        }
        pass
    }

    // A kernel's velocities change over many holds, so that none of them has a decay of its own.
    fn without_slip(mut self) -> Self {
        self.inputs.iter_mut().flatten().flatten().for_each(|input| input.slip = 0.0);
        self
    }

    // Measured minus predicted of one joint at a sample.
    fn input(&self, run: usize, joint: usize, k: usize) -> Input {
        self.inputs[run][joint][k]
    }

    // The motions with the smoothed deviation added. Friction near rest takes a motor to its velocity within a sample, so that
    // nothing shows the first one, and a link that begins with a wrong one swings for long: from pass to pass both would leave
    // all reason. A run begins with the kernel's motion, which fades out while its springs are led.
    fn smoothed(&self, noise: &[f64]) -> Vec<Motion> {
        let mut motions = self.motions.clone();
        // σ of a velocity goes with the noise of the torque to the power of ¾; what a model leaves besides makes none unsure.
        let own = self.form.own_noise(noise);
        let shares: Vec<f64> = own.iter().zip(noise).map(|(own, all)| (own / all).powf(0.75)).collect();
        let smoothed = self.of_each_group(noise, |kalman, run| {
            kalman.smoothed(self.form.runs[run].asks_speed_noise(), |joint, k| self.input(run, joint, k))
        });
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
        motions
    }

    // The pass along the motions asked for, and by how much −2 log likelihood falls. Friction near rest bends within less than a
    // smoother's correction, which may then lead further off than it came from: where a run fits worse, half of the way is
    // tried; if one still does, this pass and none. A pass of a long log is large, so one at a time is kept.
    fn bettered(
        self,
        mut motions: Vec<Motion>,
        noise: &[f64],
        about: impl Fn(Vec<Motion>) -> Self,
    ) -> (Self, Option<f64>) {
        let before = self.misfits(noise);
        let lengths: Vec<f64> = self.records.iter().map(|record| record.len() as f64).collect();
        let present = self.into_motions();
        for _ in 0..TRIES {
            let next = about(motions.clone());
            let after = next.misfits(noise);
            let worse: Vec<bool> = (after.iter().zip(&before).zip(&lengths))
                .map(|((after, before), length)| *after > before + WORSE * length)
                .collect();
            if !worse.contains(&true) {
                let fall = before.iter().sum::<f64>() - after.iter().sum::<f64>();
                return (next, Some(fall));
            }
            for ((to, from), _) in motions.iter_mut().zip(&present).zip(&worse).filter(|(_, worse)| **worse) {
                to.halve(from);
            }
        }
        (about(present), None)
    }

    fn into_motions(self) -> Vec<Motion> {
        self.motions
    }

    // −2 log likelihood of every run.
    fn misfits(&self, noise: &[f64]) -> Vec<f64> {
        self.misfits_by_joint(noise).iter().map(|of_joints| of_joints.iter().sum()).collect()
    }

    // The same of every joint in all runs.
    fn misfit_by_joint(&self, noise: &[f64]) -> Vec<f64> {
        let of_runs = self.misfits_by_joint(noise);
        (0..self.form.joints.len()).map(|joint| of_runs.iter().map(|run| run[joint]).sum()).collect()
    }

    // By run and joint.
    fn misfits_by_joint(&self, noise: &[f64]) -> Vec<Vec<f64>> {
        let misfits = self.of_each_group(noise, |kalman, run| {
            let (led, first, record) = (kalman.system.led, kalman.group.start, &self.records[run]);
            let mut sums = vec![0.0; kalman.group.len()];
            let input = |joint, k| self.input(run, joint, k);
            kalman.misfit(usize::MAX, input, |joint, k, value| {
                let counts = k >= led && !record.time.get(k).is_some_and(|time| record.leaves_out(*time));
                sums[joint - first] += if counts { value } else { 0.0 };
            });
            sums
        });
        misfits.into_iter().map(|groups| groups.concat()).collect()
    }

    // What `work` gives for each group of joints in each run.
    fn of_each_group<T: Send>(&self, noise: &[f64], work: impl Fn(Kalman, usize) -> T + Sync) -> Vec<Vec<T>> {
        let groups = self.form.groups();
        let of_run = |run: usize| {
            let kalman =
                |group: &Range<usize>| Kalman { system: &self.systems[run], group: group.clone(), noise };
            groups.par_iter().map(|group| work(kalman(group), run)).collect()
        };
        (0..self.records.len()).into_par_iter().map(of_run).collect()
    }

    // A kernel's velocity is that of a smooth motion; where held torques drive it, the jerk of every hold is less than that
    // of the whole motion by what the torques step at the samples.
    //
    // θ_{k+1} − θ_k = h/2 (θ̇_k + θ̇_{k+1}) − h³/12 θ⃛:   δθ̇ = −h²/12 ∂θ̈/∂τ τ̇
    fn held(&self, mut motions: Vec<Motion>) -> Vec<Motion> {
        let joints = &self.form.joints;
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

    // Records whose rows come from filters with frozen gains, and the rows of what was measured. With `commanded` more
    // acceleration than that of the motion; what the model predicts for it besides counts as measured, so that the rows of
    // this model stay as they are.
    fn frozen(
        self,
        noise: &[f64],
        commanded: Option<&[Vec<Vec<f64>>]>,
        (plant, p): (&Plant, &[f64]),
    ) -> (Vec<Record>, Vec<Record>, Vec<f64>) {
        let groups = self.form.groups();
        let Self { form, motions, records, systems, hold_means, links, late, .. } = self;
        let measures = (&motions, hold_means, links, late);
        let runs = 0..records.len();
        let parts: Vec<((Record, Record), Vec<f64>)> = (records, systems, &form.runs, measures, runs)
            .into_par_iter()
            .map(|(mut record, system, even, (motion, means, links, late), run)| {
                let gains = |group: &Range<usize>| {
                    let kalman = Kalman { system: &system, group: group.clone(), noise };
                    (group.clone(), kalman.gains())
                };
                let groups = groups.par_iter().map(gains).collect();
                let filters = Filters { system, groups, every: even.scales.every };
                let channels = form.channels.len();
                let filters = Innovations { filters, joints: form.joints.clone(), channels, late };
                let mut measured = filters.measured(even, motion, &means);
                let filters = Arc::new(filters);
                let mut smooth = even.thinned(motion, &links, &filters, record.scales.early);
                if let Some(commanded) = commanded {
                    let predicted = |record: &Record| {
                        let freedom = Freedom::of(plant, p, record, Springs::Simulated);
                        predict(plant, p, record, &form.channels, &freedom)
                    };
                    let before = predicted(&record);
                    for (joint, more) in form.joints.iter().zip(&commanded[run]) {
                        record.accelerate(joint.dof, more);
                        smooth.accelerate(joint.dof, &where_holds_meet(more));
                    }
                    let after = predicted(&record);
                    for ((m, b), a) in
                        measured.iter_mut().zip(filters.rows(&before)).zip(filters.rows(&after))
                    {
                        *m += a - b;
                    }
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

// How uncertain the velocity of every joint that moves is along a run with frozen filters, under torque noise of this size.
fn speed_noise(record: &Record, noise: &[f64]) -> Vec<f64> {
    let Reduction::Innovations(rows) = &record.reduction else { return Vec::new() };
    let Filters { system, groups, .. } = &rows.filters;
    let of = |group: &Range<usize>| Kalman { system, group: group.clone(), noise }.speed_noise();
    groups.iter().flat_map(|(group, _)| of(group)).collect()
}

// Measured minus predicted of a joint along a run. Of the torque what acts: what a drive delays is not in the motion yet,
// and a smoother that took it for that would chase its own noise.
fn inputs(run: &Even, motion: &Motion, early: f64, along: &Along, joint: JointChannels) -> Vec<Input> {
    let Along { predicted, acting, .. } = along;
    let told = |c: Option<usize>, late, k| {
        c.map_or(0.0, |c| read_late(predicted[c].len(), k, late, |hold| [predicted[c][hold]])[0])
    };
    let (late, torque) = (along.late[joint.dof], joint.torque);
    let drive = &along.drives[joint.dof];
    let is_held = drive.lag == 0.0 && drive.delay == 0.0 && early == 0.0;
    let delivered = if is_held {
        run.torque[torque].clone()
    } else {
        delivered(&run.torque[torque], &run.smoothed(&acting[torque]), drive, early, run.scales.step())
    };
    (0..acting[torque].len())
        .map(|k| {
            let [motor, link, gear] = deviation_readings(run, motion, joint, late, k);
            let (link, gear) = (link - told(joint.position, late[0], k), gear - told(joint.gear, late[1], k));
            let torque = delivered[k] - along.hold_means[joint.dof][k] - acting[torque][k];
            let slip = slip(motion, along, joint.dof, k, run.scales.period, is_held);
            Input { torque, slip, read: [motor, link, gear] }
        })
        .collect()
}

impl ResidualForm for Innovation {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn residual(&self, plant: &Plant, p: &[f64]) -> Vec<f64> {
        let now = self.present();
        self.rows(&now).residual(plant, p)
    }
    fn residuals(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs, grid: Grid) -> Vec<Vec<f64>> {
        let now = self.present();
        self.rows(&now).residuals(plant, sets, springs, grid)
    }
    fn holds_on_coarse(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs) -> bool {
        let now = self.present();
        self.rows(&now).holds_on_coarse(plant, sets, springs)
    }
    fn columns(&self, plant: &Plant, p: &[f64], positions: &[usize], springs: Springs) -> Vec<Vec<f64>> {
        let now = self.present();
        self.rows(&now).columns(plant, p, positions, springs)
    }
    fn position_noise(&self, _plant: &Plant, _p: &[f64], _seeds: &[u64]) -> Vec<Vec<f64>> {
        Vec::new()
    }
    fn is_white(&self) -> bool {
        true
    }
    fn renew(&self, plant: &Plant, p: &[f64], from: Start) {
        let renewed = Arc::new(self.renewed(plant, p, from));
        self.adopt(&renewed);
    }
    fn reference(&self) -> Option<Arc<Reference>> {
        Some(self.present())
    }
    fn begin_anew(&self, torques: LoggedTorques) {
        let now = self.present();
        let (motions, torque_noise) = (now.motions.clone(), now.torque_noise.clone());
        self.adopt(&Arc::new(Reference { torques, motions, torque_noise, ..Reference::default() }));
    }
    fn misfit(&self, about: &Reference, torque_noise: &[f64], plant: &Plant, p: &[f64]) -> Option<f64> {
        let pass = Pass::new(self, about.motions.clone(), about.torques.early, plant, p);
        Some(pass.misfits(torque_noise).iter().sum())
    }
    fn adopt(&self, reference: &Arc<Reference>) {
        *self.reference.write().unwrap_or_else(PoisonError::into_inner) = Arc::clone(reference);
    }
}

impl Innovation {
    fn rows<'r>(&'r self, reference: &'r Reference) -> Rows<'r> {
        Rows {
            records: &reference.records,
            smooth: &reference.smooth,
            channels: &self.channels,
            measured: &reference.measured,
        }
    }
}
