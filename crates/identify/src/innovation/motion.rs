//! Runs at their own sample rate, and the reference motion about which deviations are taken.

use std::ops::Range;
use std::sync::Arc;

use sinew_data::{Quantity, Run, Signal, Smoother, Uniform, resample, white_noise_std};
use sinew_effect::Sensor;
use sinew_model::Robot;

use super::rows::Innovations;
use super::slip::width_of_decay;
use super::system::Alike;
use crate::freedom::Links;
use crate::record::{Record, Reduction, START, Sensors, channel_signal, noise_of};
use crate::residual::LoggedTorques;
use crate::scale::Scales;

/// A run on an even grid at its own rate, within the reach of the smoothing kernel.
pub(super) struct Even {
    pub name: String,
    pub scales: Scales,
    pub time: Vec<f64>,
    /// Motor torque held after each sample, by channel; empty for other channels.
    pub torque: Vec<Vec<f64>>,
    /// By how much it changes from hold to hold at each sample, smoothed.
    pub torque_steps: Vec<Vec<f64>>,
    /// Motor position as read, by degree of freedom.
    pub theta: Vec<Vec<f64>>,
    /// What other channels read at each sample; empty of motor torques.
    pub read: Vec<Vec<f64>>,
    /// Standard deviation of a reading: of each channel, of each motor position.
    pub noise: Vec<f64>,
    pub theta_noise: Vec<f64>,
    /// For how long they step alike.
    pub alike: Vec<Alike>,
    pub theta_alike: Vec<Alike>,
    // Windows whose rows do not count.
    left_out: Vec<[f64; 2]>,
    // Temperature of each joint, where it was logged.
    temperature: Vec<Option<Vec<f64>>>,
    // Link motion of the first moments.
    start: Vec<Option<Vec<[f64; 2]>>>,
}

/// Motor positions and velocities at the samples of a run, by degree of freedom.
#[derive(Clone)]
pub(super) struct Motion {
    pub theta: Vec<Vec<f64>>,
    pub thetad: Vec<Vec<f64>>,
    /// How uncertain each velocity is, by its standard deviation; empty where nobody knows.
    pub speed_noise: Vec<Vec<f64>>,
}

impl Motion {
    /// Position of a motor in the middle of hold k.
    ///
    /// θ = ½(θ_k + θ_{k+1}) + h/8 (θ̇_k − θ̇_{k+1})
    pub fn middle(&self, dof: usize, k: usize, h: f64) -> f64 {
        let (theta, thetad) = (&self.theta[dof], &self.thetad[dof]);
        0.5 * (theta[k] + theta[k + 1]) + h / 8.0 * (thetad[k] - thetad[k + 1])
    }

    /// Adds a deviation of position and velocity to a sample.
    pub fn deviate(&mut self, dof: usize, k: usize, [position, velocity]: [f64; 2]) {
        self.theta[dof][k] += position;
        self.thetad[dof][k] += velocity;
    }

    /// Keeps a share of the way of a sample from another motion.
    pub fn fade_in(&mut self, dof: usize, k: usize, share: f64, from: &Self) {
        let between = |to: &mut f64, from: f64| *to = from + share * (*to - from);
        between(&mut self.theta[dof][k], from.theta[dof][k]);
        between(&mut self.thetad[dof][k], from.thetad[dof][k]);
    }

    /// Takes back half of the way from another motion.
    pub fn halve(&mut self, from: &Self) {
        let series = self.theta.iter_mut().chain(&mut self.thetad);
        for (to, from) in series.zip(from.theta.iter().chain(&from.thetad)) {
            to.iter_mut().zip(from).for_each(|(x, from)| *x = 0.5 * (*x + from));
        }
    }
}

// Shortest step, s, in which springs swing.
const SPRING_STEP: f64 = 0.0005;
// Seconds of a row.
const ROW: f64 = 0.016;
// Rounds in which torques are taken out of each other's differences.
const SWEEPS: usize = 2;

impl Even {
    /// True if friction is told how uncertain velocities are: behind fine encoders it is as sharp as it is without.
    pub fn asks_speed_noise(&self) -> bool {
        self.scales.coarse
    }

    /// A series of the run, smoothed like its motion; at its ends as if it stood still beyond them.
    pub fn smoothed(&self, x: &[f64]) -> Vec<f64> {
        let width = self.scales.smooth;
        let ends = |x: Option<&f64>| vec![x.copied().unwrap_or(0.0); width];
        let padded = [ends(x.first()), x.to_vec(), ends(x.last())].concat();
        Smoother::new(width, self.scales.period).value(&padded)
    }

    /// The run, and its motion smoothed by a kernel: the reference to begin with.
    pub fn new(robot: &Robot, run: &Run, sensors: &Sensors, scales: Scales) -> (Self, Motion) {
        let nv = robot.model.nv;
        let scales = scales.of_samples();
        let grid = Uniform::within(&run.time, scales.period);
        let smoother = Smoother::new(scales.smooth, scales.period);
        let reach = |x: &[f64]| x[scales.smooth..x.len() - scales.smooth].to_vec();
        let every = ((ROW / scales.period).round() as usize).max(1);
        let own = Scales { stride: 1, kernel: every / 2, every, held: true, ..scales };
        let time = reach(&grid.times());
        let still = vec![0.0; time.len()];
        let mut even = Self {
            name: run.name.clone(),
            scales: own,
            torque: vec![Vec::new(); sensors.channels.len()],
            torque_steps: vec![Vec::new(); sensors.channels.len()],
            read: vec![Vec::new(); sensors.channels.len()],
            theta: vec![still.clone(); nv],
            noise: Vec::new(),
            theta_noise: vec![0.0; nv],
            alike: Vec::new(),
            theta_alike: vec![Alike::default(); nv],
            left_out: run.left_out.clone(),
            temperature: Vec::new(),
            start: vec![None; nv],
            time,
        };
        let mut motion = Motion {
            theta: vec![still.clone(); nv],
            thetad: vec![still; nv],
            speed_noise: vec![Vec::new(); nv],
        };
        let signal = |quantity: Option<Quantity>, dof| run.signal(quantity?, robot.model.dof_name(dof));
        for dof in 0..nv {
            let temperature = signal(Some(Quantity::Temperature), dof);
            let read = |signal: &Signal| reach(&resample(&run.time, &signal.values, &grid));
            even.temperature.push(temperature.map(read));
            let Some(signal) = signal(sensors.imposed[dof], dof) else { continue };
            let x = resample(&run.time, &signal.values, &grid);
            even.theta_noise[dof] = noise_of(signal, &x);
            (motion.theta[dof], motion.thetad[dof]) = (smoother.value(&x), smoother.rate(&x));
            even.theta[dof] = reach(&x);
            even.theta_alike[dof] = alike(&even.theta[dof], even.theta_noise[dof]);
        }
        let is_rigid = |dof: usize| robot.joints[dof].stiffness.is_none();
        for (c, channel) in sensors.channels.iter().enumerate() {
            let signal = channel_signal(robot, run, channel);
            let x = resample(&run.time, &signal.values, &grid);
            let is_passed = channel.sensor == Sensor::JointTorque && is_rigid(channel.dof);
            let motors =
                sensors.channels.iter().filter(|c| c.sensor == Sensor::MotorTorque && is_rigid(c.dof));
            let torque = |motor| resample(&run.time, &channel_signal(robot, run, motor).values, &grid);
            let beside: Vec<Vec<f64>> = motors.filter(|_| is_passed).map(torque).collect();
            even.noise.push(noise_beside(&signal, &x, &beside));
            match channel.sensor {
                Sensor::MotorTorque => {
                    even.torque[c] = reach(&x);
                    // A hold's torque is that of its middle: the rate at a sample is the mean of the holds that meet there.
                    let rate = smoother.rate(&x);
                    let step = |k: usize| 0.5 * own.period * (rate[k] + rate[k.saturating_sub(1)]);
                    even.torque_steps[c] = (0..rate.len()).map(step).collect();
                }
                Sensor::JointPosition => {
                    let (value, rate) = (smoother.value(&x), smoother.rate(&x));
                    let first = ((START / own.period).round() as usize).min(value.len());
                    even.start[channel.dof] = Some((0..first).map(|k| [value[k], rate[k]]).collect());
                    even.read[c] = reach(&x);
                }
                Sensor::JointTorque => even.read[c] = reach(&x),
            }
            even.alike.push(alike(&even.read[c], even.noise[c]));
        }
        (even, motion)
    }

    /// The reference as a record whose grid steps are the middles of the holds, with the mean acceleration of each; logged
    /// torques act so much before these middles.
    ///
    /// θ = ½(θ_k + θ_{k+1}) + h/8 (θ̇_k − θ̇_{k+1}),   θ̇ = (θ_{k+1} − θ_k)/h,   θ̈ = (θ̇_{k+1} − θ̇_k)/h
    pub fn record(&self, motion: &Motion, torques: LoggedTorques) -> Record {
        let h = self.scales.period;
        let between = |x: &[f64], f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            x.windows(2).map(|pair| f(pair[0], pair[1])).collect()
        };
        let mean = |x: &Vec<f64>| between(x, &|a, b| 0.5 * (a + b));
        let rate = |x: &Vec<f64>| between(x, &|a, b| (b - a) / h);
        let thetad: Vec<Vec<f64>> = motion.theta.iter().map(rate).collect();
        let ends = |i: usize| motion.thetad[i].windows(2).map(|pair| [pair[0], pair[1]]);
        let noise = |i: usize| motion.speed_noise[i].windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let sweep = (0..thetad.len()).map(|i| sweeps(ends(i), &thetad[i], noise(i))).collect();
        let thetadd = motion.thetad.iter().map(|v| between(v, &|a, b| (b - a) / h)).collect();
        let theta = motion.theta.iter().zip(&motion.thetad).map(|(x, v)| {
            let bend = between(v, &|a, b| h / 8.0 * (a - b));
            mean(x).into_iter().zip(bend).map(|(x, b)| x + b).collect()
        });
        let time = mean(&self.time);
        let most_parts = ((h / SPRING_STEP).round() as usize).max(1);
        let measured =
            self.torque.iter().zip(&self.read).map(|(torque, read)| {
                if read.is_empty() { torque[..time.len()].to_vec() } else { mean(read) }
            });
        Record {
            name: self.name.clone(),
            scales: Scales { early: torques.early, whole: torques.is_whole(), ..self.scales },
            left_out: self.left_out.clone(),
            repeats: Vec::new(),
            theta: theta.collect(),
            thetad_wide: thetad.clone(),
            thetad,
            thetadd,
            sweep,
            temperature: self.temperature.iter().map(|t| t.as_ref().map(mean)).collect(),
            middle: (most_parts > 1).then(|| self.met(motion)),
            most_parts,
            start: self.start.clone(),
            measured: measured.collect(),
            noise: self.noise.clone(),
            position_noise: self.theta_noise.clone(),
            reduction: Reduction::Mean,
            links: None,
            time,
        }
    }
}

impl Even {
    // Position, velocity and acceleration where two holds meet, of all holds but the last.
    fn met(&self, motion: &Motion) -> [Vec<Vec<f64>>; 3] {
        let inner = |x: &Vec<f64>| x.get(1..x.len() - 1).unwrap_or_default().to_vec();
        let h = self.scales.period;
        let slope = |v: &Vec<f64>| v.windows(3).map(|v| (v[2] - v[0]) / (2.0 * h)).collect();
        [
            motion.theta.iter().map(inner).collect(),
            motion.thetad.iter().map(inner).collect(),
            motion.thetad.iter().map(slope).collect(),
        ]
    }

    /// The reference at every second sample, where two holds meet: derivatives along a run are smooth enough for this
    /// grid.
    ///
    /// θ = θ_k,   θ̇ = (θ_{k+1} − θ_{k−1})/2h,   θ̈ = (θ̇_{k+1} − θ̇_{k−1})/2h,   k = 1, 3, …
    pub fn thinned(
        &self,
        motion: &Motion,
        links: &Links,
        filters: &Arc<Innovations>,
        torques: LoggedTorques,
    ) -> Record {
        let h = self.scales.period;
        let odd = |x: &Vec<f64>| -> Vec<f64> { x.iter().skip(1).step_by(2).copied().collect() };
        let slope = |v: &Vec<f64>| -> Vec<f64> {
            let last = v.len() - 1;
            let of =
                |k: usize| (v[(k + 1).min(last)] - v[k - 1]) / (((k + 1).min(last) - (k - 1)) as f64 * h);
            (1..v.len()).step_by(2).map(of).collect()
        };
        let thetad: Vec<Vec<f64>> = motion.theta.iter().map(slope).collect();
        let ends = |i: usize| {
            let v = &motion.thetad[i];
            (1..v.len()).step_by(2).map(move |k| [v[k - 1], v[(k + 1).min(v.len() - 1)]])
        };
        let noise = |i: usize| motion.speed_noise[i].iter().skip(1).step_by(2).copied();
        let sweep = (0..thetad.len()).map(|i| sweeps(ends(i), &thetad[i], noise(i))).collect();
        let samples = motion.thetad.first().map_or(0, |v| v.len());
        let met = |link: &Vec<[f64; 3]>| {
            (1..samples).step_by(2).map(|k| at_sample(link.len(), k, |hold| link[hold])).collect()
        };
        let links = Links { motion: links.motion.iter().map(|link| link.as_ref().map(met)).collect() };
        let start = self.start.iter().map(|s| Some(s.as_ref()?.iter().skip(1).step_by(2).copied().collect()));
        Record {
            name: self.name.clone(),
            scales: Scales { stride: 2, early: torques.early, whole: torques.is_whole(), ..self.scales },
            time: odd(&self.time),
            left_out: self.left_out.clone(),
            repeats: Vec::new(),
            theta: motion.theta.iter().map(odd).collect(),
            thetadd: motion.thetad.iter().map(slope).collect(),
            sweep,
            thetad_wide: thetad.clone(),
            thetad,
            temperature: self.temperature.iter().map(|t| t.as_ref().map(odd)).collect(),
            middle: None,
            most_parts: 1,
            start: start.collect(),
            measured: self.torque.iter().map(|torque| where_holds_meet(torque)).collect(),
            noise: self.noise.clone(),
            position_noise: self.theta_noise.clone(),
            reduction: Reduction::Thinned(Arc::clone(filters)),
            links: Some(Arc::new(links)),
        }
    }
}

/// What is held between samples at every second sample, where two holds meet; empty of what has no holds.
pub(super) fn where_holds_meet(held: &[f64]) -> Vec<f64> {
    (1..held.len()).step_by(2).map(|k| 0.5 * (held[k - 1] + held[k])).collect()
}

// The width of the velocities of a motor in each hold, evenly spread: from end to end where they change evenly, less where
// friction near rest takes it to its final velocity within the hold. A velocity that is not known has a width, too:
// friction's mean over all that it may be is not that of their mean.
//
// w² = w_hold² + 12 σ²
fn sweeps(ends: impl Iterator<Item = [f64; 2]>, mean: &[f64], noise: impl Iterator<Item = f64>) -> Vec<f64> {
    let noise = noise.chain(std::iter::repeat(0.0));
    let sweep = |(([from, to], mean), noise): (([f64; 2], &f64), f64)| {
        let (change, off) = (to - from, mean - 0.5 * (from + to));
        width_of_decay(change, off).hypot(12.0f64.sqrt() * noise)
    };
    ends.zip(mean).zip(noise).map(sweep).collect()
}

// Share of its noise by which steps of a reading that are the same may differ: logs are rounded, and put on an even grid.
const ROUNDED: f64 = 0.05;
// Steps alike that white noise of counts shows, too.
const BY_CHANCE: usize = 4;

// For how many samples about each the reading steps alike: a joint rests, creeps, or moves on by as many counts in each.
fn alike(read: &[f64], noise: f64) -> Alike {
    let steps: Vec<f64> = read.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let runs = steps.chunk_by(|a, b| (a - b).abs() < ROUNDED * noise).map(<[f64]>::len);
    let told = |steps: usize| if steps > BY_CHANCE { steps } else { 1 };
    let runs: Vec<(usize, usize)> = runs.map(|steps| (steps, told(steps))).collect();
    if runs.iter().all(|(_, told)| *told == 1) {
        return Alike::default();
    }
    let samples = runs.into_iter().flat_map(|(steps, told)| std::iter::repeat_n(told as f32, steps));
    let last = samples.clone().last();
    samples.chain(last).collect()
}

/// What a series at every second sample is in the middle of hold k.
pub(super) fn in_hold<const W: usize>(len: usize, k: usize, samples: impl Fn(usize) -> [f64; W]) -> [f64; W] {
    // Hold k reaches from sample k to k + 1; entry m belongs to sample 2m + 1.
    let (near, far) = (k / 2, if k.is_multiple_of(2) { (k / 2).saturating_sub(1) } else { k / 2 + 1 });
    let (a, b) = (samples(near.min(len - 1)), samples(far.min(len - 1)));
    std::array::from_fn(|w| 0.75 * a[w] + 0.25 * b[w])
}

/// Entries of a series at every second sample where so many holds meet.
pub(super) fn met(holds: usize) -> usize {
    holds.div_ceil(2)
}

/// Which of them [`in_hold`] looks at in the middles of these holds.
pub(super) fn met_around(range: Range<usize>, holds: usize) -> Range<usize> {
    let last = met(holds).saturating_sub(1);
    (range.start / 2).saturating_sub(1).min(last)..(range.end / 2 + 1).min(last) + 1
}

/// Which holds of so many [`at_sample`] looks at about these samples.
pub(super) fn holds_around(range: Range<usize>, holds: usize) -> Range<usize> {
    range.start.saturating_sub(2).min(holds - 1)..(range.end + 1).min(holds)
}

// Noise of a signal; that of the torque behind a rigid gear beside those of the motors, since of these it shows a part at once: what
// is left of its fourth differences, with the torque noise in it that no log has.
fn noise_beside(signal: &Signal, x: &[f64], torques: &[Vec<f64>]) -> f64 {
    if torques.is_empty() {
        return noise_of(signal, x);
    }
    let mut left = x.to_vec();
    let square = |x: &[f64]| white_noise_std(x).powi(2);
    for torque in torques.iter().cycle().take(SWEEPS * torques.len()) {
        let with = |share: f64| -> Vec<f64> { left.iter().zip(torque).map(|(x, t)| x + share * t).collect() };
        let product = 0.25 * (square(&with(1.0)) - square(&with(-1.0)));
        let share = product / square(torque).max(f64::MIN_POSITIVE);
        left = with(-share.clamp(-1.0, 1.0));
    }
    noise_of(&Signal { std: None, ..signal.clone() }, &left)
}

// Weights of the cubic through four middles, in their middle.
const CUBIC: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

/// What a series at the middles of the holds is at sample k, which the holds k − 1 and k meet at.
pub(super) fn at_sample<const W: usize>(len: usize, k: usize, holds: impl Fn(usize) -> [f64; W]) -> [f64; W] {
    if k < 2 || k + 1 >= len {
        let (a, b) = (holds(k.saturating_sub(1).min(len - 1)), holds(k.min(len - 1)));
        return std::array::from_fn(|w| 0.5 * (a[w] + b[w]));
    }
    let mut sum = [0.0; W];
    for (i, weight) in CUBIC.into_iter().enumerate() {
        for (sum, x) in sum.iter_mut().zip(holds(k + i - 2)) {
            *sum += weight * x;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_alike_are_counted() {
        let read = |step: fn(i32) -> f64| -> Vec<f64> { (0..12).map(step).collect() };
        // At rest from the fifth sample on, where white noise would show two or three.
        let rests = alike(&read(|k| f64::from(k.min(5))), 0.3);
        assert_eq!(rests[..], [[5.0; 5].as_slice(), &[6.0; 7]].concat());
        let whole_counts = alike(&read(|k| f64::from(22 * k)), 0.3);
        assert_eq!(whole_counts[..], [11.0; 12]);
        assert!(alike(&read(|k| (0.3 * f64::from(k)).round()), 0.3).is_empty());
    }

    // The standard deviation of a uniform spread of width w is w/√12.
    #[test]
    fn a_velocity_that_is_not_known_has_a_width() {
        let widths = |noise: Vec<f64>| sweeps([[1.0, 1.3]].into_iter(), &[1.15], noise.into_iter())[0];
        assert!((widths(Vec::new()) - 0.3).abs() < 1e-12);
        assert!((widths(vec![0.1]) - (0.09f64 + 0.12).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_is_fetched_around_some_holds_is_all_that_is_looked_at() {
        for holds in 2..20 {
            let parts = (0..holds).flat_map(|from| (from + 1..=holds).map(move |to| from..to));
            for range in parts {
                let (of_met, of_holds) =
                    (met_around(range.clone(), holds), holds_around(range.clone(), holds));
                assert!(of_met.end <= met(holds) && of_holds.end <= holds, "{range:?} of {holds}");
                for k in range {
                    let seen = |around: &Range<usize>, x: usize| {
                        assert!(around.contains(&x), "{x} in {k} of {holds}");
                        [0.0]
                    };
                    in_hold(met(holds), k, |m| seen(&of_met, m));
                    at_sample(holds, k, |hold| seen(&of_holds, hold));
                }
            }
        }
    }
}
