//! A run made ready: smoothed motor motion and smoothed sensors on one grid.

use std::iter::repeat_n;
use std::sync::Arc;

use sinew_data::{
    Kernel, Quantity, Run, Signal, Smoother, Uniform, instrument_noise, quantisation_step, resample,
    resample_through,
};
use sinew_effect::{DIRECTIONS, Derivative, Sensor};
use sinew_model::{Model, Robot};

use crate::IdentifyError;
use crate::freedom::{Freedom, Links};
use crate::innovation::{Held, Innovations};
use crate::scale::Scales;
use crate::series::Predicted;

/// A sensor of a joint, of which there is one residual series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Channel {
    /// What it measures.
    pub sensor: Sensor,
    /// Of which degree of freedom.
    pub dof: usize,
}

impl Channel {
    /// The quantity that its sensor measures.
    pub fn quantity(&self) -> Quantity {
        match self.sensor {
            Sensor::MotorTorque => Quantity::MotorTorque,
            Sensor::JointPosition => Quantity::JointPosition,
            Sensor::JointTorque => Quantity::JointTorque,
        }
    }
    pub fn signal(&self) -> &'static str {
        self.quantity().name()
    }
    pub fn unit(&self, model: &Model) -> &'static str {
        let slides = model.joints[model.joint_of_dof(self.dof).0].kind.slides();
        match (self.sensor, slides) {
            (Sensor::JointPosition, false) => "rad",
            (Sensor::JointPosition, true) => "m",
            (_, false) => "N·m",
            (_, true) => "N",
        }
    }
}

/// Time in which a simulated spring is led to the measured motion of its link, or damped, s.
pub(crate) const START: f64 = 0.6;
// Values in the time of a row of a torque that is no physics.
const HOLDS: usize = 4;

/// How series on the grid become residual rows.
#[derive(Debug, Clone)]
pub(crate) enum Reduction {
    /// φ of each channel, decimated.
    Kernel,
    /// Means of as many grid steps as a row has.
    Mean,
    /// Innovations of the deviation filter, summed.
    Innovations(Arc<Innovations>),
    /// The same of derivatives on a grid of every second sample.
    Thinned(Arc<Innovations>),
}

/// A run on the grid of the analysis. Outer index: degree of freedom or channel; inner: grid step.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub name: String,
    pub scales: Scales,
    /// Grid times, s.
    pub time: Vec<f64>,
    /// Windows, s, whose rows do not count.
    pub left_out: Vec<[f64; 2]>,
    /// Motions of this run that occur again, here or in another.
    pub repeats: Vec<Again>,
    /// Imposed position, velocity, acceleration.
    pub theta: Vec<Vec<f64>>,
    pub thetad: Vec<Vec<f64>>,
    pub thetadd: Vec<Vec<f64>>,
    /// The width of the velocities over which the torques of a grid step are the mean; empty where they are those of an
    /// instant.
    pub sweep: Vec<Vec<f64>>,
    /// Temperature of each joint, °C, where it was logged.
    pub temperature: Vec<Option<Vec<f64>>>,
    /// Position, velocity, acceleration halfway to the next grid step, where the log has samples there.
    pub middle: Option<[Vec<Vec<f64>>; 3]>,
    /// Most steps in which springs swing from one grid step to the next.
    pub most_parts: usize,
    /// Measured link position and velocity of the first steps, where there is a link encoder.
    pub start: Vec<Option<Vec<[f64; 2]>>>,
    /// The velocity seen through the wider kernel.
    pub thetad_wide: Vec<Vec<f64>>,
    /// Measured channels, smoothed like the motion.
    pub measured: Vec<Vec<f64>>,
    /// Standard deviation of the white noise of each channel, raw, in parts of a sample period: that of a sample by the root of
    /// its share of one.
    pub noise: Vec<f64>,
    /// The same of the imposed positions.
    pub position_noise: Vec<f64>,
    /// How its rows come about.
    pub reduction: Reduction,
    /// Where the links of its reference are, if a model gave it one.
    pub links: Option<Arc<Links>>,
}

/// A motion that occurs again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Again {
    /// Stamps between which it occurs first.
    pub window: [f64; 2],
    /// Number of the record in which it occurs again.
    pub record: usize,
    /// By how much later it does, by the stamps.
    pub lag: f64,
}

/// What the runs of a robot measure.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    /// Residual channels, by sensor and joint.
    pub channels: Vec<Channel>,
    /// The quantity that is imposed for each degree of freedom; none: held at zero.
    pub imposed: Vec<Option<Quantity>>,
}

impl Sensors {
    /// The logged torque of a joint's motor in all records; nothing where none was logged.
    pub fn motor_torque<'a>(&self, records: &'a [Record], dof: usize) -> impl Iterator<Item = f64> + 'a {
        let torque = Channel { sensor: Sensor::MotorTorque, dof };
        let c = self.channels.iter().position(|c| *c == torque);
        records.iter().flat_map(move |r| c.map_or(&[][..], |c| &r.measured[c]).iter().copied())
    }

    /// The channels that every run has.
    ///
    /// # Errors
    /// If no joint has a position, or no channel is left to compare.
    pub fn of(robot: &Robot, runs: &[Run]) -> Result<Self, IdentifyError> {
        let model = &robot.model;
        let Some(first) = runs.first() else {
            return Err(IdentifyError::Question {
                what: "no run was given".to_owned(),
                help: "name one or more measured runs after the robot".to_owned(),
            });
        };
        let has = |quantity, dof| all_have(runs, quantity, model.dof_name(dof));
        let mut imposed = Vec::new();
        let mut channels = Vec::new();
        for dof in 0..model.nv {
            let position =
                [Quantity::MotorPosition, Quantity::JointPosition].into_iter().find(|&q| has(q, dof));
            imposed.push(position);
            if position.is_none() {
                continue;
            }
            let current = has(Quantity::MotorCurrent, dof) && robot.joints[dof].torque_constant.is_some();
            if has(Quantity::MotorTorque, dof) || current {
                channels.push(Channel { sensor: Sensor::MotorTorque, dof });
            }
            if position == Some(Quantity::MotorPosition) && has(Quantity::JointPosition, dof) {
                channels.push(Channel { sensor: Sensor::JointPosition, dof });
            }
            if has(Quantity::JointTorque, dof) {
                channels.push(Channel { sensor: Sensor::JointTorque, dof });
            }
        }
        if channels.is_empty() {
            let joints: Vec<_> = (0..model.nv).map(|d| model.dof_name(d)).collect();
            let found = first.joints().join(", ");
            return Err(IdentifyError::run(
                &first.name,
                format!(
                    "no joint of robot \"{}\" has a position and something to compare it with (run has: {found}; robot has: {})",
                    model.name,
                    joints.join(", ")
                ),
                "needed are motor_position.J (or joint_position.J) and motor_torque.J (or motor_current.J with torque_constant, joint_torque.J) under the URDF's joint names",
            ));
        }
        channels.sort();
        Ok(Self { channels, imposed })
    }

    /// That a run has all of them.
    ///
    /// # Errors
    /// If it lacks one.
    pub fn are_all_in(&self, robot: &Robot, run: &Run) -> Result<(), IdentifyError> {
        let name = |dof| robot.model.dof_name(dof);
        let lacks_position = |&(dof, quantity): &(usize, Quantity)| run.signal(quantity, name(dof)).is_none();
        let lacks_channel = |c: &&Channel| logged(robot, run, c).is_none();
        let mut positions = self.imposed.iter().enumerate().filter_map(|(dof, q)| q.map(|q| (dof, q)));
        let channel = || self.channels.iter().find(lacks_channel).map(|c| (c.dof, c.quantity()));
        let Some((dof, quantity)) = positions.find(lacks_position).or_else(channel) else { return Ok(()) };
        let column = format!("{quantity}.{}", name(dof));
        let what = format!("no {column}, which the other runs have");
        let help = format!("leave this run out, or do without {column} in all of them");
        Err(IdentifyError::run(&run.name, what, help))
    }

    /// Degrees of freedom of which a position is imposed.
    pub fn moving(&self) -> impl Iterator<Item = usize> {
        (0..self.imposed.len()).filter(|&dof| self.imposed[dof].is_some())
    }

    /// True if so few joints move that rows near rest are chosen about a reference: on six a search takes three times as long.
    pub fn few_move(&self) -> bool {
        self.moving().count() <= FEW_JOINTS
    }
}

// Most joints that are few.
const FEW_JOINTS: usize = 3;

/// True if every run has this quantity of this joint.
pub(crate) fn all_have(runs: &[Run], quantity: Quantity, joint: &str) -> bool {
    runs.iter().all(|run| run.signal(quantity, joint).is_some())
}

impl Record {
    /// Prepares one run: stamps interpolated, one smoothing kernel on everything.
    ///
    /// # Errors
    /// If the run is too short for the kernels.
    pub fn new(robot: &Robot, run: &Run, sensors: &Sensors, scales: Scales) -> Result<Self, IdentifyError> {
        let model = &robot.model;
        let grid = Uniform::within(&run.time, scales.part());
        let needed = 2 * scales.wide + 4 * scales.stride * (scales.kernel + scales.every);
        if grid.len < needed {
            let (samples, seconds) = (run.time.len(), run.duration());
            return Err(IdentifyError::run(
                &run.name,
                format!("too short: {seconds:.2} s, {samples} samples (needed: some seconds)"),
                "record a motion of a few seconds; check the unit of time",
            ));
        }
        let thin = Thinning::new(&grid, scales);
        let mut record = Self {
            name: run.name.clone(),
            scales,
            time: thin.thinned(&grid.times(), scales.wide),
            left_out: run.left_out.clone(),
            repeats: Vec::new(),
            theta: Vec::new(),
            thetad: Vec::new(),
            thetadd: Vec::new(),
            sweep: Vec::new(),
            temperature: Vec::new(),
            middle: scales.stride.is_multiple_of(2).then(Default::default),
            most_parts: 1,
            start: vec![None; model.nv],
            thetad_wide: Vec::new(),
            measured: Vec::new(),
            noise: Vec::new(),
            position_noise: Vec::new(),
            reduction: Reduction::Kernel,
            links: None,
        };
        for (dof, quantity) in sensors.imposed.iter().enumerate() {
            record.impose(quantity.and_then(|q| run.signal(q, model.dof_name(dof))), run, &thin);
            let temperature = run
                .signal(Quantity::Temperature, model.dof_name(dof))
                .map(|signal| thin.smoothed(&thin.smooth.value(&thin.even(&run.time, &signal.values))));
            record.temperature.push(temperature);
        }
        for channel in &sensors.channels {
            record.measure(channel, &channel_signal(robot, run, channel), run, &thin);
        }
        Ok(record)
    }

    // The motion of the next degree of freedom; held at zero without a signal.
    fn impose(&mut self, signal: Option<&Signal>, run: &Run, thin: &Thinning) {
        let Some(signal) = signal else {
            let still = vec![0.0; self.time.len()];
            for series in [&mut self.theta, &mut self.thetad, &mut self.thetadd, &mut self.thetad_wide] {
                series.push(still.clone());
            }
            self.middle.iter_mut().flatten().for_each(|m| m.push(still.clone()));
            self.position_noise.push(0.0);
            return;
        };
        let x = thin.even(&run.time, &signal.values);
        let smooth = &thin.smooth;
        let motion = [smooth.value(&x), smooth.rate(&x), smooth.second_rate(&x)];
        for (m, series) in self.middle.iter_mut().flatten().zip(&motion) {
            m.push(thin.halfway(series));
        }
        for (grid, series) in [&mut self.theta, &mut self.thetad, &mut self.thetadd].into_iter().zip(motion) {
            grid.push(thin.smoothed(&series));
        }
        self.thetad_wide.push(thin.thinned(&thin.wide.rate(&x), 0));
        self.position_noise.push(thin.noise_of(signal, run, &x));
    }

    // The next channel, smoothed like the motion.
    fn measure(&mut self, channel: &Channel, signal: &Signal, run: &Run, thin: &Thinning) {
        let x = thin.even(&run.time, &signal.values);
        self.noise.push(thin.noise_of(signal, run, &x));
        let x = match channel.sensor {
            Sensor::MotorTorque if self.scales.held => thin.even(&run.time, &centred(&signal.values)),
            _ => x,
        };
        let values = thin.smoothed(&thin.smooth.value(&x));
        if channel.sensor == Sensor::JointPosition {
            let rate = thin.smoothed(&thin.smooth.rate(&x));
            let first = ((START / self.scales.step()).round() as usize).min(values.len());
            self.start[channel.dof] = Some((0..first).map(|k| [values[k], rate[k]]).collect());
        }
        self.measured.push(values);
    }

    /// The same run with rows that are means: filters and the links that they go with take most of the memory.
    pub fn without_filters(&self) -> Self {
        Self { reduction: Reduction::Mean, links: None, ..self.clone() }
    }

    /// The motion of a link that moves as given, by degree of freedom of the plant.
    pub fn given(&self, freedom: &Freedom, dof: usize) -> Option<&[[f64; 3]]> {
        let links = self.links.as_ref().filter(|_| freedom.given[dof])?;
        links.motion[freedom.joints[dof]?].as_deref()
    }

    /// Adds to the acceleration of a degree of freedom.
    pub fn accelerate(&mut self, dof: usize, more: &[f64]) {
        self.thetadd[dof].iter_mut().zip(more).for_each(|(thetadd, more)| *thetadd += more);
    }

    /// The stamp of a row.
    pub fn stamp(&self, row: usize) -> f64 {
        self.time[self.centre(row).min(self.len() - 1)]
    }

    /// The row nearest to a stamp, if there is one within half a row.
    pub fn row_at(&self, stamp: f64) -> Option<usize> {
        let apart = self.scales.step() * self.scales.every as f64;
        let row = ((stamp - self.stamp(0)) / apart).round();
        let is_near = row >= 0.0 && (self.stamp(row as usize) - stamp).abs() <= 0.51 * apart;
        is_near.then_some(row as usize)
    }

    /// True if what happens at a stamp does not count.
    pub fn leaves_out(&self, time: f64) -> bool {
        self.left_out.iter().any(|window| is_within(time, *window))
    }

    /// Steps of the grid.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// The kernel of the residual rows.
    pub fn kernel(&self) -> Kernel {
        Kernel::new(self.scales.kernel)
    }

    /// What a series on the grid is at the rows: φ of it, or its means.
    pub fn rows(&self, series: &[f64]) -> Vec<f64> {
        let every = self.scales.every;
        match self.reduction {
            Reduction::Kernel => self.kernel().decimate(series, every),
            _ => series.chunks_exact(every).map(|part| part.iter().sum::<f64>() / every as f64).collect(),
        }
    }

    /// Rows of predicted channels, one channel after another.
    pub fn channel_rows(&self, predicted: &Predicted<f64>) -> Vec<f64> {
        self.channel_rows_of_each(std::slice::from_ref(predicted)).concat()
    }

    /// The same of several predictions of one walk.
    pub fn channel_rows_of_each(&self, predicted: &[Predicted<f64>]) -> Vec<Vec<f64>> {
        match &self.reduction {
            Reduction::Innovations(filter) => filter.rows_of_each(predicted, false),
            Reduction::Thinned(filter) => filter.rows_of_each(predicted, true),
            Reduction::Kernel | Reduction::Mean => {
                predicted.iter().map(|one| one.channels.iter().flat_map(|s| self.rows(s)).collect()).collect()
            }
        }
    }

    /// The same of the derivatives of predicted channels along their first `count` directions.
    pub fn channel_rows_along(&self, predicted: &Predicted<Derivative>, count: usize) -> Vec<Vec<f64>> {
        match &self.reduction {
            Reduction::Innovations(filter) => return filter.rows_along(predicted, count, false),
            Reduction::Thinned(filter) => return filter.rows_along(predicted, count, true),
            Reduction::Kernel | Reduction::Mean => {}
        }
        let along = |direction: usize| {
            let one = |s: &Vec<Derivative>| {
                self.rows(&s.iter().map(|x| x.derivative[direction]).collect::<Vec<_>>())
            };
            predicted.channels.iter().flat_map(one).collect()
        };
        (0..count.min(DIRECTIONS)).map(along).collect()
    }

    /// Grid steps for which a torque that is no physics is held, a few times in a row.
    pub fn hold(&self) -> usize {
        let hold = (self.scales.every / HOLDS).max(1);
        if self.scales.every.is_multiple_of(hold) { hold } else { 1 }
    }

    /// A series in the middle of each hold.
    pub fn held<T: Copy>(&self, series: &[T]) -> Vec<T> {
        let hold = self.hold();
        let middle = |first: usize| series[(first + hold / 2).min(series.len() - 1)];
        (0..series.len()).step_by(hold).map(middle).collect()
    }

    /// What makes rows of a channel of things that no physics tells, hold by hold.
    pub fn generic(&self, channel: usize) -> Generic<'_> {
        match &self.reduction {
            Reduction::Innovations(filter) => Generic::Filtered(filter.of_torques(channel, self.hold())),
            _ => Generic::Smoothed(self),
        }
    }

    /// Grid step of a row's centre.
    pub fn centre(&self, row: usize) -> usize {
        self.scales.kernel + row * self.scales.every
    }
}

/// What makes rows of things that no physics tells.
pub(crate) enum Generic<'r> {
    /// The filter of a joint by itself; none of a channel that no joint has.
    Filtered(Option<Held>),
    /// What makes rows of a series on the grid.
    Smoothed(&'r Record),
}

impl Generic<'_> {
    /// Rows that each of several such things gives.
    pub fn rows(&self, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let record = match self {
            Self::Filtered(held) => return held.iter().flat_map(|held| held.rows(series)).collect(),
            Self::Smoothed(record) => record,
        };
        let along = |held: &Vec<f64>| -> Vec<f64> {
            held.iter().flat_map(|x| repeat_n(*x, record.hold())).take(record.len()).collect()
        };
        series.iter().map(|held| record.rows(&along(held))).collect()
    }
}

/// True for a stamp in a window.
pub(crate) fn is_within(time: f64, [from, to]: [f64; 2]) -> bool {
    time >= from && time <= to
}

// From even parts to the grid of the analysis: what the wider kernel cannot reach is left out at both ends.
struct Thinning<'a> {
    grid: &'a Uniform,
    smooth: Smoother,
    wide: Smoother,
    trim: usize,
    stride: usize,
    parts: usize,
}

// Samples through which a signal goes between two of a slow log.
const BETWEEN_SAMPLES: usize = 16;

impl<'a> Thinning<'a> {
    fn new(grid: &'a Uniform, scales: Scales) -> Self {
        Self {
            grid,
            smooth: Smoother::new(scales.smooth, scales.part()),
            wide: Smoother::new(scales.wide, scales.part()),
            trim: scales.wide - scales.smooth,
            stride: scales.stride,
            parts: scales.parts,
        }
    }
    // A signal in even parts of its sample period.
    fn even(&self, time: &[f64], values: &[f64]) -> Vec<f64> {
        match self.parts {
            1 => resample(time, values, self.grid),
            _ => resample_through(BETWEEN_SAMPLES, time, values, self.grid),
        }
    }
    // The noise of as many independent parts that smoothing leaves as much of.
    fn noise_of(&self, signal: &Signal, run: &Run, even: &[f64]) -> f64 {
        if self.parts == 1 {
            return noise_of(signal, even);
        }
        let period = self.grid.step * self.parts as f64;
        let of_samples = resample(&run.time, &signal.values, &Uniform::within(&run.time, period));
        noise_of(signal, &of_samples) * (self.parts as f64).sqrt()
    }
    fn thinned(&self, x: &[f64], trim: usize) -> Vec<f64> {
        x[trim..x.len() - trim].iter().step_by(self.stride).copied().collect()
    }
    fn smoothed(&self, x: &[f64]) -> Vec<f64> {
        self.thinned(x, self.trim)
    }
    // Samples halfway between grid steps exist where the stride is even.
    fn halfway(&self, x: &[f64]) -> Vec<f64> {
        let first = self.trim + self.stride / 2;
        x[first..x.len() - self.trim].iter().step_by(self.stride).copied().collect()
    }
}

/// Standard deviation of the noise of a signal that was read at even times: stamps that jitter are no noise. Its steps are those
/// of the readings, since what is interpolated has others.
pub(crate) fn noise_of(signal: &Signal, even: &[f64]) -> f64 {
    let found = || signal.std.is_none().then(|| quantisation_step(&signal.values)).flatten();
    let resolution = signal.resolution.or_else(found);
    instrument_noise(&Signal { values: even.to_vec(), resolution, ..signal.clone() })
}

/// What a channel's sensor logged in a run that has it.
pub(crate) fn channel_signal(robot: &Robot, run: &Run, channel: &Channel) -> Signal {
    let (signal, constant) = logged(robot, run, channel).expect("runs that lack a channel are refused");
    let mut signal = signal.clone();
    if let Some(constant) = constant {
        signal.values.iter_mut().for_each(|x| *x *= constant);
        signal.std = signal.std.map(|s| s * constant.abs());
        signal.resolution = signal.resolution.map(|s| s * constant.abs());
    }
    signal
}

// What a channel's sensor logged, or a current and its torque constant; none of a run that lacks it.
fn logged<'r>(robot: &Robot, run: &'r Run, channel: &Channel) -> Option<(&'r Signal, Option<f64>)> {
    let joint = robot.model.dof_name(channel.dof);
    if let Some(signal) = run.signal(channel.quantity(), joint) {
        return Some((signal, None));
    }
    let constant =
        robot.joints[channel.dof].torque_constant.filter(|_| channel.sensor == Sensor::MotorTorque)?;
    Some((run.signal(Quantity::MotorCurrent, joint)?, Some(constant)))
}

// A torque held from one sample to the next acts, at a sample, with the mean of the holds before and after it.
fn centred(values: &[f64]) -> Vec<f64> {
    let mut out = values.to_vec();
    for k in 1..values.len() {
        out[k] = 0.5 * (values[k - 1] + values[k]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    // A count is 0.01. One in every second sample, then nine in each, have hardly a fourth difference; between the stamps there are
    // no counts either.
    #[test]
    fn what_an_encoder_rounds_away_is_seen_in_its_readings() {
        let mut values = vec![0.0; 400];
        for k in 1..values.len() {
            values[k] = values[k - 1] + if k >= 40 { 0.09 } else { 0.01 * (k % 2) as f64 };
        }
        let even: Vec<f64> = values.iter().enumerate().map(|(k, x)| x + 1e-15 * (k % 3) as f64).collect();
        let signal = Signal::new(Quantity::MotorPosition, "elbow", values);
        let noise = noise_of(&signal, &even);
        assert!((noise / (0.01 / 12f64.sqrt()) - 1.0).abs() < 1e-6, "{noise}");
        // A noise that is stated is not added to.
        let stated = Signal { std: Some(1e-4), ..signal };
        assert_eq!(noise_of(&stated, &even), 1e-4);
    }
}
