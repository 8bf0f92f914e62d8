//! The innovation residual: what the sensors show beyond a filter that knows the model and the noise.
//!
//! A smoother of the model, driven by the measured torque, gives a reference motion. What the model predicts along it
//! and what was measured differ by little; a Kalman filter of the deviation, with its gains frozen, turns the
//! difference into innovations. They are white where the model is right, torque noise enters no derivative, and an
//! error of the reference enters to second order only.

mod commanded;
mod filter;
mod held;
mod kalman;
mod linearise;
mod motion;
mod noise;
mod pass;
mod rows;
mod slip;
mod step;
mod system;

use std::ops::Range;
use std::sync::{Arc, PoisonError, RwLock};

use rayon::prelude::*;

use sinew_data::Run;
use sinew_effect::Sensor;
use sinew_model::Robot;
use sinew_plant::Plant;

use crate::freedom::Springs;
use crate::record::{Channel, Record, Reduction, Sensors};
use crate::residual::{Grid, Layout, LoggedTorques, ResidualForm, Rows, Samples, Start, TRANSIENT};
use crate::scale::Scales;
use filter::Filters;
pub(crate) use held::Held;
use kalman::Kalman;
use linearise::{Along, INERTIA_EVERY};
use motion::{Even, Motion};
use pass::{Misfits, Pass};
pub(crate) use rows::Innovations;
use rows::JointChannels;
use slip::unsure;
use step::Linear;
use system::{MOST_JOINTS, Readings, System};

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
    /// True if the model leaves no more than the noise that was read of torques, and sensors show no more beyond its filter than they
    /// should.
    pub leaves_noise: bool,
    /// True if the same holds but for what is far less than torques that were not held as they were read would leave.
    pub takes_torques_as_held: bool,
    /// True if torque noise acts and is not small beside what accelerates the joints.
    pub noise_matters: bool,
    // What the next reference begins with.
    motions: Vec<Motion>,
    // The parameters with which its own motion makes it again; none of one about a kernel's motion.
    made_again_by: Option<Vec<f64>>,
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
// Times the noise that was read within which torque noise is no more than that, and the mean square of innovations that is no
// more than expected.
const AS_READ: f64 = 1.3;
const AS_EXPECTED: f64 = 1.02;
// The same where torques at 250 Hz were held as they were read: 1.03 to 1.09 of one and two joints with little noise in their encoders,
// who leave 2 to 20 where every fourth torque of 1 kHz is all that is known.
const AS_HELD: f64 = 1.4;
// Standard deviations of a velocity from rest within which it may be rest.
const UNSURE: f64 = 6.0;

impl Innovation {
    /// Why runs with these sensors have no such residual; none if they have one.
    pub fn impossible(sensors: &Sensors) -> Option<&'static str> {
        let has = |channel| sensors.channels.contains(&channel);
        if !sensors.moving().all(|dof| has(Channel { sensor: Sensor::MotorTorque, dof })) {
            Some("not every joint that moves has a motor torque")
        } else if sensors.moving().count() > MOST_JOINTS {
            Some("more joints move than are coupled")
        } else {
            None
        }
    }

    /// The form about a kernel's motion to begin with; none where it is impossible.
    pub fn new(robot: &Robot, runs: &[Run], sensors: &Sensors, scales: Scales) -> Option<Self> {
        if Self::impossible(sensors).is_some() {
            return None;
        }
        let channels = sensors.channels.clone();
        let find = |sensor, dof| channels.iter().position(|c| *c == Channel { sensor, dof });
        let joint = |dof| {
            let torque = find(Sensor::MotorTorque, dof)?;
            let [position, gear] = [Sensor::JointPosition, Sensor::JointTorque].map(|s| find(s, dof));
            let is_rigid = robot.joints[dof].stiffness.is_none();
            Some(JointChannels { dof, torque, position, gear, is_rigid })
        };
        let joints: Vec<JointChannels> = (0..sensors.imposed.len()).filter_map(joint).collect();
        let (runs, motions): (Vec<Even>, Vec<Motion>) =
            runs.iter().map(|run| Even::new(robot, run, sensors, scales)).unzip();
        let records: Vec<Record> = runs
            .iter()
            .zip(&motions)
            .map(|(run, motion)| run.record(motion, LoggedTorques::default()))
            .collect();
        let layout = layout_of(&records, &channels, &joints, |_, _| 0.0);
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
        self.layout = layout_of(&reference.records, &self.channels, &self.joints, |run, dof| {
            let joint = self.joints.iter().position(|j| j.dof == dof);
            joint.and_then(|joint| speed_noise[run].get(joint)).map_or(0.0, |std| UNSURE * std)
        });
        self
    }

    /// Begins with the kernel's motion of every run, torques taken so, and torque noise that is known.
    pub fn begin_known(&self, torques: LoggedTorques, torque_noise: Vec<f64>) {
        let motions = self.smooth.clone();
        self.adopt(&Arc::new(Reference { torques, motions, torque_noise, ..Reference::default() }));
    }

    /// Leaves out rows.
    #[cfg(test)]
    pub fn leave_out_rows(&mut self, rows: Range<usize>) {
        self.layout.keep[rows].fill(false);
    }

    /// The present reference.
    pub fn present(&self) -> Arc<Reference> {
        Arc::clone(&self.reference.read().unwrap_or_else(PoisonError::into_inner))
    }

    // Torque noise of every joint, at most as it was read: what a model leaves besides makes no velocity unsure.
    fn own_noise(&self, noise: &[f64]) -> Vec<f64> {
        self.read_noise().iter().zip(noise).map(|(read, n)| n.min(*read)).collect()
    }

    // True if torque noise of every joint is no more than was read.
    fn is_as_read(&self, noise: &[f64]) -> bool {
        self.read_noise().iter().zip(noise).all(|(read, n)| *n < AS_READ * read)
    }

    // The joints of a group, without its hinges.
    fn joints_of(&self, group: &Range<usize>) -> Range<usize> {
        group.start..group.end.min(self.joints.len())
    }

    // The equations of the moving joints, and of the hinges behind them, along a run.
    fn system(&self, run: &Even, motion: &Motion, torques: LoggedTorques, along: &Along) -> System {
        let square = |x: f64| (x * x).max(1e-24);
        let alike = |c: Option<usize>| c.map(|c| run.alike[c].clone()).unwrap_or_default();
        let readings = |j: &JointChannels| Readings {
            motor: Some(square(run.theta_noise[j.dof])),
            link: j.position.map(|c| square(run.noise[c])),
            gear: j.gear.map(|c| square(run.noise[c])),
            shown: if along.links.motion[j.dof].is_none() { 0 } else { 2 },
            alike: [run.theta_alike[j.dof].clone(), alike(j.position), alike(j.gear)],
        };
        let of_robot = along.linear.len() - along.hinges;
        let moving = || self.joints.iter().map(|j| j.dof).chain(of_robot..along.linear.len());
        let linear: Vec<&[Linear]> = moving().map(|body| along.linear[body].as_slice()).collect();
        let n = along.linear.len();
        let of_moving = |m: &Vec<f64>| moving().flat_map(|i| moving().map(move |j| m[i * n + j])).collect();
        let mobility: Vec<Vec<f64>> = along.mobility.iter().map(of_moving).collect();
        let hinges = (0..along.hinges).map(|_| Readings::default());
        let readings = self.joints.iter().map(readings).chain(hinges).collect();
        let mut system = System::new(readings, &linear, &mobility, INERTIA_EVERY, run.scales.period);
        for (joint, channels) in system.joints.iter_mut().zip(&self.joints) {
            joint.unsure = unsure(motion, along, channels.dof);
        }
        system.unsure_friction = torques.unsure_friction;
        system
    }

    fn renewed(&self, plant: &Plant, p: &[f64], from: Start) -> Reference {
        let present = self.present();
        let about = |motions| Pass::new(self, motions, present.torques, plant, p);
        let Settled { pass, noise, misfits } = match from {
            Start::Kernel => {
                let pass = about(self.smooth.clone()).without_slip();
                let noise = pass.torque_noise(None);
                Settled::of(pass, noise)
            }
            Start::Reference => self.settled(&present, (plant, p)),
            Start::Same => Settled::of(about(present.motions.clone()), present.torque_noise.clone()),
        };
        let torques = pass.torques;
        let noise_matters = pass.noise_matters(&noise);
        let motions = if from == Start::Kernel { pass.held() } else { pass.motions.clone() };
        let commanded = torques.move_without_noise.then(|| pass.commanded(&noise));
        let (records, smooth, measured) = pass.frozen(&noise, commanded.as_deref(), (plant, p));
        let is_within = |most: f64| self.is_as_read(&noise) && misfits.squares().all(|square| square < most);
        Reference {
            records,
            smooth,
            measured,
            leaves_noise: is_within(AS_EXPECTED),
            takes_torques_as_held: is_within(AS_HELD),
            torque_noise: noise,
            misfit_by_joint: misfits.by_joint(),
            torques,
            noise_matters,
            motions,
            made_again_by: (from != Start::Kernel).then(|| p.to_vec()),
        }
    }

    // A motion that is too rough turns friction about at the wrong time, one that is too smooth turns it late: model and noise
    // are led to agree with each other, from the motion of the present reference. Where friction near rest resists that, it is taken
    // for unsure over holds in which it changes if the log is likelier so, until it is likelier without.
    fn settled(&self, present: &Reference, (plant, p): (&Plant, &[f64])) -> Settled<'_> {
        let about = |motions, torques| Pass::new(self, motions, torques, plant, p);
        let mut pass = about(present.motions.clone(), present.torques);
        let mut before = present.torque_noise.clone();
        let (mut rounds, mut may_doubt) = (0, true);
        loop {
            let noise = pass.torque_noise(Some(&before));
            let (smoothed, of_pass) = pass.smoothed(&noise);
            let (mut next, mut misfits, fall) = pass.bettered(smoothed, of_pass, &noise, about);
            rounds += 1;
            let doubts = fall.is_none() && may_doubt && next.takes_friction_as(true, &mut misfits, &noise);
            let is_alike = before.iter().zip(&noise).all(|(a, b)| (a / b).ln().abs() < SETTLED_NOISE);
            let is_settled = !doubts && fall.is_none_or(|fall| is_alike && fall < SETTLED_MISFIT);
            if is_settled || rounds == ROUNDS {
                let is_sure_again = next.takes_friction_as(false, &mut misfits, &noise);
                if !is_sure_again || rounds == ROUNDS {
                    return Settled { pass: next, noise, misfits };
                }
                may_doubt = false;
            }
            (pass, before) = (next, noise);
        }
    }
}

// A pass whose motion agrees with the noise that was found along it.
struct Settled<'a> {
    pass: Pass<'a>,
    noise: Vec<f64>,
    misfits: Misfits,
}

impl<'a> Settled<'a> {
    fn of(pass: Pass<'a>, noise: Vec<f64>) -> Self {
        let misfits = pass.misfits(&noise);
        Self { pass, noise, misfits }
    }
}

impl Reference {
    /// The reference motion of every run, with what makes rows of it.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The same motion without what makes rows of it.
    pub fn motion(&self) -> Vec<Record> {
        self.records.iter().map(Record::without_filters).collect()
    }

    /// −2 log likelihood of what was measured.
    pub fn misfit(&self) -> f64 {
        self.misfit_by_joint.iter().sum()
    }

    /// The same without what makes rows, most of its memory; none if it cannot be made again.
    pub fn lightened(&self) -> Option<Self> {
        self.made_again_by.as_ref()?;
        Some(Self {
            records: Vec::new(),
            smooth: Vec::new(),
            measured: Vec::new(),
            torque_noise: self.torque_noise.clone(),
            misfit_by_joint: self.misfit_by_joint.clone(),
            torques: self.torques,
            leaves_noise: self.leaves_noise,
            takes_torques_as_held: self.takes_torques_as_held,
            noise_matters: self.noise_matters,
            motions: self.motions.clone(),
            made_again_by: self.made_again_by.clone(),
        })
    }

    /// The parameters with which [`Start::Same`] makes it again as it was, if it is lightened.
    pub fn to_make_again(&self) -> Option<&[f64]> {
        self.made_again_by.as_deref().filter(|_| self.records.is_empty())
    }
}

// Where the rows are. What is behind a rigid gear rests with the motor.
fn layout_of(
    records: &[Record],
    channels: &[Channel],
    joints: &[JointChannels],
    unsure: impl Fn(usize, usize) -> f64,
) -> Layout {
    let mut layout = Layout::of(records, channels, TRANSIENT, unsure);
    for joint in joints.iter().filter(|j| j.is_rigid) {
        joint.gear.iter().for_each(|gear| layout.leave_out_with(joint.torque, *gear));
    }
    layout
}

// How uncertain the velocity of every joint that moves is along a run with frozen filters, under torque noise of this size.
fn speed_noise(record: &Record, noise: &[f64]) -> Vec<f64> {
    let Reduction::Innovations(rows) = &record.reduction else { return Vec::new() };
    let Filters { system, groups, .. } = &rows.filters;
    let of = |group: &Range<usize>| Kalman { system, group: group.clone(), noise }.speed_noise();
    groups.iter().flat_map(|(group, _)| of(group)).collect()
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
    fn residual_taking(&self, early: f64, plant: &Plant, p: &[f64]) -> Vec<f64> {
        let now = self.present();
        let mut records = now.records.clone();
        records.iter_mut().for_each(|record| record.scales.early += early);
        Rows { records: &records, ..self.rows(&now) }.residual(plant, p)
    }
    fn begin_as_read(&self, reference: &Reference) {
        let as_read = |(read, left): (&f64, &f64)| if *read > 0.0 { left.min(*read) } else { *left };
        let noise = self.read_noise().iter().zip(&reference.torque_noise).map(as_read).collect();
        self.begin_known(reference.torques, noise);
    }
    fn begin_anew(&self, torques: LoggedTorques) {
        let now = self.present();
        let (motions, torque_noise) = (now.motions.clone(), now.torque_noise.clone());
        self.adopt(&Arc::new(Reference { torques, motions, torque_noise, ..Reference::default() }));
    }
    fn misfit(
        &self,
        samples: Samples,
        about: &Reference,
        torque_noise: &[f64],
        plant: &Plant,
        p: &[f64],
    ) -> Option<f64> {
        let pass = Pass::new(self, about.motions.clone(), about.torques, plant, p);
        Some(pass.misfits_of(samples, torque_noise).sum())
    }
    fn read_noise(&self) -> Vec<f64> {
        let read = |channel: usize| self.runs.iter().map(|run| run.noise[channel]).fold(0.0, f64::max);
        self.joints.iter().map(|joint| read(joint.torque)).collect()
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
