//! The Kalman filter of the deviations of a group of joints: its gains, its likelihood, its smoother.
//!
//! The sensors are taken one after the other, which gives the factor of their covariance without factoring it.
//!
//! Source: Kalman, *A new approach to linear filtering and prediction problems*, J. Basic Engineering 82, 1960.

use std::ops::Range;

use super::system::{Joint, SENSORS, Sensor, Shown, System};
use crate::least_squares::add;
pub(super) use smoother::Smoothed;

/// Most joints whose covariance is carried along together.
pub(super) const GROUP: usize = 7;

// The gain of one sensor in one sample, on the states of its group.
#[derive(Debug, Clone, Copy)]
struct Gain<const D: usize> {
    // K, by state of the group.
    column: [f64; D],
    // 1/√S
    white: f64,
}

/// A number to three digits: the upper half of one in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Short(u16);

impl From<f64> for Short {
    // To the nearest.
    fn from(x: f64) -> Self {
        Self(((x as f32).to_bits().saturating_add(1 << 15) >> 16) as u16)
    }
}

impl From<Short> for f64 {
    #[inline(always)]
    fn from(x: Short) -> Self {
        f32::from_bits(u32::from(x.0) << 16).into()
    }
}

/// Frozen gains of a group of joints along a run. To three digits: whatever gains a filter has, it treats measurement and
/// prediction alike, its innovations are white to second order in what the gains are off by, and these are most of what a long log
/// keeps.
#[derive(Debug, Clone)]
pub(super) struct Gains {
    // Of the group, and of each of its joints.
    states: usize,
    each: usize,
    sensors: usize,
    // Sensor by sensor, sample by sample: 1/√S, and K by state.
    white: Vec<f32>,
    columns: Vec<Short>,
}

impl Gains {
    fn push<const D: usize>(&mut self, gain: &Gain<D>) {
        self.white.push(gain.white as f32);
        self.columns.extend(gain.column.iter().map(|k| Short::from(*k)));
    }

    /// States of every joint that have a gain: the first so many.
    pub fn states_of_joint(&self) -> usize {
        self.each
    }

    /// Of every sensor in sample `k`: 1/√S, and K by state.
    #[inline(always)]
    pub fn of_sample(&self, k: usize) -> impl Iterator<Item = (f64, &[Short])> {
        let sensors = k * self.sensors..(k + 1) * self.sensors;
        let columns = &self.columns[sensors.start * self.states..sensors.end * self.states];
        let white = self.white[sensors].iter().map(|white| f64::from(*white));
        white.zip(columns.chunks_exact(self.states))
    }
}

/// Inputs of one sample.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Input {
    /// Torque of the hold that follows.
    pub torque: f64,
    /// By how much farther the motor moves in that hold than between the positions of the reference.
    pub slip: f64,
    /// What the sensors show.
    pub read: [f64; SENSORS],
}

// Standard deviation of the deviation at the start: position, velocity.
const START: [f64; 2] = [1e-3, 0.1];
// Noise of a link's torque as a share of its motor's; a link that is lighter than its rotor would answer to it more than the
// rotor does to its own.
const LINK_SHARE: f64 = 0.04;
// Both while a link or a hinge that no sensor shows is led to where it may have started: no torque is known there.
const LED: [f64; 2] = [30.0, 30.0];
// Least part of the variance that was read behind a rigid gear that is the sensor's own.
const LEAST_OWN: f64 = 0.1;

/// What one reading adds to the likelihood of a log.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    /// −2 log likelihood.
    pub misfit: f64,
    /// The square of its innovation in units of what is expected; one on the average, if model and noise are right.
    pub square: f64,
}

/// The Kalman filter of a group of joints about their reference.
pub(super) struct Kalman<'a> {
    pub system: &'a System,
    pub group: Range<usize>,
    /// Standard deviation of the torque noise of every joint of the system; a hinge has none.
    pub noise: &'a [f64],
}

// A group has four states a joint, or two where all joints are rigid: the size of its matrices is known where they are
// multiplied.
macro_rules! by_size {
    ($kalman:expr, $method:ident($($argument:expr),*)) => {
        match ($kalman.group.len(), $kalman.states()) {
            (1, 2) => $kalman.$method::<2, 2>($($argument),*),
            (2, 2) => $kalman.$method::<4, 2>($($argument),*),
            (3, 2) => $kalman.$method::<6, 2>($($argument),*),
            (4, 2) => $kalman.$method::<8, 2>($($argument),*),
            (5, 2) => $kalman.$method::<10, 2>($($argument),*),
            (6, 2) => $kalman.$method::<12, 2>($($argument),*),
            (_, 2) => $kalman.$method::<{ 2 * GROUP }, 2>($($argument),*),
            (1, _) => $kalman.$method::<4, 4>($($argument),*),
            (2, _) => $kalman.$method::<8, 4>($($argument),*),
            (3, _) => $kalman.$method::<12, 4>($($argument),*),
            (4, _) => $kalman.$method::<16, 4>($($argument),*),
            (5, _) => $kalman.$method::<20, 4>($($argument),*),
            (6, _) => $kalman.$method::<24, 4>($($argument),*),
            _ => $kalman.$method::<{ 4 * GROUP }, 4>($($argument),*),
        }
    };
}

// A function of a group's states in the form that suits the machine: all do the same operations in the same order on each
// number.
macro_rules! widest_form {
    (fn $name:ident<$(const $size:ident: usize),+>($($argument:ident: $type:ty),+ $(,)?) -> $result:ty $body:block) => {
        fn $name<$(const $size: usize),+>($($argument: $type),+) -> $result {
            #[inline(always)]
            fn plain<$(const $size: usize),+>($($argument: $type),+) -> $result $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn four<$(const $size: usize),+>($($argument: $type),+) -> $result {
                plain::<$($size),+>($($argument),+)
            }

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512dq")]
            fn eight<$(const $size: usize),+>($($argument: $type),+) -> $result {
                plain::<$($size),+>($($argument),+)
            }

            #[cfg(target_arch = "x86_64")]
            if sinew_model::wide::eight() {
                // SAFETY: the machine has the instructions that the function is compiled for.
                return unsafe { eight::<$($size),+>($($argument),+) };
            }
            #[cfg(target_arch = "x86_64")]
            if sinew_model::wide::four() {
                // SAFETY: as above.
                return unsafe { four::<$($size),+>($($argument),+) };
            }
            plain::<$($size),+>($($argument),+)
        }
    };
}

pub(super) use widest_form;

mod smoother;

impl Kalman<'_> {
    fn joints(&self) -> &[Joint] {
        &self.system.joints[self.group.clone()]
    }

    // States of every joint of the group that are carried along: a rigid one has no link of its own.
    fn states(&self) -> usize {
        let has_two = |joint: &Joint| joint.is_rigid() && !joint.readings.shows_noise();
        if self.joints().iter().all(has_two) { 2 } else { 4 }
    }

    // Variance of a reading. What was read of that of a torque behind a rigid gear has the torque noise in it that is a state.
    fn variance(&self, sensor: &Sensor) -> f64 {
        if sensor.at_once.is_empty() {
            return sensor.variance;
        }
        let noise = sensor.at_once.iter().zip(self.noise).enumerate();
        let is_state =
            |joint: usize| self.group.contains(&joint) && self.system.joints[joint].readings.shows_noise();
        let shown: f64 = noise
            .filter(|(joint, _)| is_state(*joint))
            .map(|(_, (weight, noise))| (weight * noise).powi(2))
            .sum();
        (sensor.variance - shown).max(LEAST_OWN * sensor.variance)
    }

    // What a sensor shows at once of the torques of the joints of the group.
    fn at_once<'s>(&self, sensor: &Sensor<'s>) -> &'s [f64] {
        sensor.at_once.get(self.group.clone()).unwrap_or_default()
    }

    /// The gains of every sensor in every sample, joint by joint.
    pub fn gains(&self) -> Gains {
        by_size!(self, gains_of())
    }

    fn gains_of<const D: usize, const S: usize>(&self) -> Gains {
        let sensors = self.system.sensor_count(self.group.clone());
        let count = self.system.len() * sensors;
        let (white, columns) = (Vec::with_capacity(count), Vec::with_capacity(count * D));
        let mut gains = Gains { states: D, each: S, sensors, white, columns };
        self.follow::<D, S>(|gain| gains.push(&gain), |_, _, _| {});
        gains
    }

    /// How uncertain the velocity of each motor of the group is along the run once it has begun, by its standard deviation.
    pub fn speed_noise(&self) -> Vec<f64> {
        by_size!(self, speed_noise_of())
    }

    fn speed_noise_of<const D: usize, const S: usize>(&self) -> Vec<f64> {
        let begun = self.system.led.min(self.system.len() / 2);
        let mut squares = vec![0.0; self.group.len()];
        let add =
            |k: usize, joint: usize, variance: f64| squares[joint] += if k < begun { 0.0 } else { variance };
        self.follow::<D, S>(|_| {}, add);
        squares.into_iter().map(|sum| (sum / (self.system.len() - begun).max(1) as f64).sqrt()).collect()
    }

    // The gains of every sensor, and after those of a sample the variance of the velocity of every motor.
    fn follow<const D: usize, const S: usize>(
        &self,
        mut gain: impl FnMut(Gain<D>),
        mut variance: impl FnMut(usize, usize, f64),
    ) {
        let mut p = self.start::<D, S>();
        for k in 0..self.system.len() {
            for (i, joint) in self.joints().iter().enumerate() {
                let mut read =
                    |s: Sensor| gain(update::<D, S>(&mut p, i, s.shown, self.at_once(&s), self.variance(&s)));
                joint.sensors(k).for_each(&mut read);
            }
            (0..self.group.len()).for_each(|i| variance(k, i, p[S * i + 1][S * i + 1]));
            p = forward(&self.step::<D, S>(k), &p);
        }
    }

    /// −2 log likelihood of the first `samples` about the reference, told joint by joint and sample by sample.
    pub fn misfit(
        &self,
        samples: usize,
        input: impl Fn(usize, usize) -> Input,
        mut told: impl FnMut(usize, usize, Told),
    ) {
        by_size!(self, misfit_of(samples, &input, &mut told))
    }

    fn misfit_of<const D: usize, const S: usize>(
        &self,
        samples: usize,
        input: &impl Fn(usize, usize) -> Input,
        told: &mut impl FnMut(usize, usize, Told),
    ) {
        let tell = |k, one: Read<D>| told(self.group.start + one.joint, k, one.told());
        let samples = 0..samples.min(self.system.len());
        self.over::<D, S>(samples, &mut self.begin::<D, S>(), input, tell, |_| {});
    }

    /// The deviation of every joint of the group in every sample, by all of them: filter forwards, smoother backwards. The
    /// filter tells what [`Kalman::misfit`] does.
    pub fn smoothed(
        &self,
        with_speed_noise: bool,
        input: impl Fn(usize, usize) -> Input + Sync,
        mut told: impl FnMut(usize, usize, Told),
    ) -> Vec<Vec<Smoothed>> {
        by_size!(self, smoothed_of(with_speed_noise, &input, &mut told))
    }

    fn start<const D: usize, const S: usize>(&self) -> Matrix<D> {
        let mut p = [[0.0; D]; D];
        for (i, joint) in self.joints().iter().enumerate() {
            for s in 0..joint.readings.shown + 2 {
                p[S * i + s][S * i + s] = START[s % 2] * START[s % 2];
            }
            if joint.readings.shows_noise() {
                p[S * i + 2][S * i + 2] = self.torque_variance(i, 0)[0];
            }
        }
        p
    }

    // Nothing is known of the deviation yet.
    fn begin<const D: usize, const S: usize>(&self) -> Known<D> {
        ([0.0; D], self.start::<D, S>())
    }

    // The filter over some samples; `read` is given what each sensor reads, `seen` what is known after those of a sample.
    fn over<'s, const D: usize, const S: usize>(
        &'s self,
        samples: Range<usize>,
        known: &mut Known<D>,
        input: &impl Fn(usize, usize) -> Input,
        mut read: impl FnMut(usize, Read<'s, D>),
        mut seen: impl FnMut(&Known<D>),
    ) {
        for k in samples {
            let (x, p) = known;
            self.correct::<D, S>(k, p, x, input, |one| read(k, one));
            seen(known);
            let (x, p) = known;
            self.pass_on::<D, S>(k, p, x, input);
        }
    }

    // One sample's sensors; `told` is given what each reads.
    fn correct<'s, const D: usize, const S: usize>(
        &'s self,
        k: usize,
        p: &mut Matrix<D>,
        x: &mut [f64; D],
        input: &impl Fn(usize, usize) -> Input,
        mut told: impl FnMut(Read<'s, D>),
    ) {
        for (i, joint) in self.joints().iter().enumerate() {
            let read = input(self.group.start + i, k).read;
            for sensor in joint.sensors(k) {
                let at_once = self.at_once(&sensor);
                let gain = update::<D, S>(p, i, sensor.shown, at_once, self.variance(&sensor));
                let of_torques: f64 = at_once.iter().enumerate().map(|(j, w)| w * x[S * j + 2]).sum();
                let e = read[sensor.which] - sensor.shown.of(&x[S * i..S * (i + 1)]) - of_torques;
                told(Read { joint: i, shown: sensor.shown, at_once, gain, e });
                for (x, column) in x.iter_mut().zip(gain.column) {
                    *x += column * e;
                }
            }
        }
    }

    // On to the next sample.
    fn pass_on<const D: usize, const S: usize>(
        &self,
        k: usize,
        p: &mut Matrix<D>,
        x: &mut [f64; D],
        input: &impl Fn(usize, usize) -> Input,
    ) {
        let step = self.step::<D, S>(k);
        *p = forward(&step, p);
        *x = self.predict::<D, S>(&step, k, x, input);
    }

    // Φ x̃ + g δτ
    fn predict<const D: usize, const S: usize>(
        &self,
        step: &Step<D>,
        k: usize,
        x: &[f64; D],
        input: &impl Fn(usize, usize) -> Input,
    ) -> [f64; D] {
        let mut next = [0.0; D];
        for (column, x) in step.turned.iter().zip(x) {
            add(&mut next, *x, column);
        }
        for (i, joint) in self.group.clone().enumerate() {
            let input = input(joint, k);
            let is_state = self.joints()[i].readings.shows_noise();
            let push = if is_state { &step.turned[S * i + 2] } else { &step.pushes[2 * i] };
            add(&mut next, input.torque, push);
            next[S * i] += input.slip;
        }
        next
    }

    // The step after sample k.
    fn step<const D: usize, const S: usize>(&self, k: usize) -> Step<D> {
        let (mut turned, mut pushes) = ([[0.0; D]; D], [[0.0; D]; 2 * GROUP]);
        self.system.step::<D, S>(self.group.clone(), k, &mut turned, &mut pushes);
        let mut variance = [0.0; 2 * GROUP];
        for (i, joint) in self.joints().iter().enumerate() {
            let mut hold = k;
            if joint.readings.shows_noise() {
                // It acts by the third state, from the hold on that begins with the next sample.
                pushes[2 * i] = [0.0; D];
                pushes[2 * i][S * i + 2] = 1.0;
                hold = (k + 1).min(self.system.len() - 1);
            }
            variance[2 * i..2 * i + 2].copy_from_slice(&self.torque_variance(i, hold));
        }
        Step { turned, pushes, variance }
    }

    // Of the torques on motor and link of a joint of the group over a hold.
    fn torque_variance(&self, i: usize, hold: usize) -> [f64; 2] {
        let joint = &self.joints()[i];
        let is_led = hold < self.system.led && joint.readings.is_led();
        let shares = if is_led { LED } else { [1.0, LINK_SHARE * joint.lightness] };
        let Some(noise) = self.noise.get(self.group.start + i) else {
            // No torque acts on a hinge by itself.
            let noise = if is_led { self.noise.iter().copied().fold(0.0, f64::max) } else { 0.0 };
            return shares.map(|share| (noise * share).powi(2));
        };
        let [motor, link] = shares.map(|share| (noise * share).powi(2));
        let unsure = if self.system.unsure_friction { f64::from(joint.unsure[hold]).powi(2) } else { 0.0 };
        [motor + unsure, link]
    }
}

// What a sensor of a joint of the group reads in a sample.
struct Read<'s, const D: usize> {
    joint: usize,
    shown: Shown,
    // Of the torques of the joints of the group.
    at_once: &'s [f64],
    gain: Gain<D>,
    e: f64,
}

impl<const D: usize> Read<'_, D> {
    // (e/√S)² + ln S
    fn told(&self) -> Told {
        let square = (self.e * self.gain.white).powi(2);
        Told { misfit: square - 2.0 * self.gain.white.ln(), square }
    }
}

type Matrix<const D: usize> = [[f64; D]; D];
// x and P.
type Known<const D: usize> = ([f64; D], Matrix<D>);

// A sample period of a group: x̃ ← Φ x̃ + Σ g δτ.
struct Step<const D: usize> {
    // Φᵀ
    turned: Matrix<D>,
    // g of the motor and of the link of every joint, with the variances of their torques.
    pushes: [[f64; D]; 2 * GROUP],
    variance: [f64; 2 * GROUP],
}

impl<const D: usize> Step<D> {
    // Nothing moves and nothing pushes.
    fn still() -> Self {
        Self { turned: [[0.0; D]; D], pushes: [[0.0; D]; 2 * GROUP], variance: [0.0; 2 * GROUP] }
    }
}

widest_form! {
    // P⁻ = Φ P Φᵀ + Σ σ² g gᵀ
    fn forward<const D: usize>(step: &Step<D>, p: &Matrix<D>) -> Matrix<D> {
        let Step { turned, pushes, variance } = step;
        let mut right = [[0.0; D]; D];
        sum_products(&[(p, turned)], false, &mut right);
        let scaled: [[f64; D]; 2 * GROUP] = std::array::from_fn(|m| pushes[m].map(|g| variance[m] * g));
        let acting = variance.iter().rposition(|variance| *variance > 0.0).map_or(0, |last| last + 1);
        let mut next = [[0.0; D]; D];
        sum_products(&[(turned, &right), (&scaled[..acting], &pushes[..acting])], true, &mut next);
        for i in 1..D {
            for j in 0..i {
                next[i][j] = next[j][i];
            }
        }
        next
    }
}

// Σ a bᵀ over pairs of vectors; below the diagonal not everything where only the upper half is asked for.
#[inline(always)]
fn sum_products<const D: usize>(terms: &[Pairs<D>], upper: bool, sum: &mut Matrix<D>) {
    if D.is_multiple_of(8) {
        sum_in_blocks::<D, 4, 8>(terms, upper, sum);
    } else if D.is_multiple_of(4) {
        sum_in_blocks::<D, 4, 4>(terms, upper, sum);
    } else {
        sum_in_blocks::<D, 2, 2>(terms, upper, sum);
    }
}

// Vectors a and as many b.
type Pairs<'a, const D: usize> = (&'a [[f64; D]], &'a [[f64; D]]);

// R rows and C columns at a time, which stay in registers.
#[inline(always)]
fn sum_in_blocks<const D: usize, const R: usize, const C: usize>(
    terms: &[Pairs<D>],
    upper: bool,
    sum: &mut Matrix<D>,
) {
    for row in 0..D / R {
        let first = if upper { row * R / C } else { 0 };
        for column in first..D / C {
            let mut block = [[0.0; C]; R];
            for (a, b) in terms.iter().flat_map(|(a, b)| a.iter().zip(*b)) {
                let (a, b) = (&a.as_chunks::<R>().0[row], &b.as_chunks::<C>().0[column]);
                for r in 0..R {
                    for c in 0..C {
                        block[r][c] += a[r] * b[c];
                    }
                }
            }
            for (sum, block) in sum[row * R..].iter_mut().zip(block) {
                sum.as_chunks_mut::<C>().0[column] = block;
            }
        }
    }
}

widest_form! {
    // K = P c/S,   P ← P − K S Kᵀ,   S = cᵀ P c + R
    fn update<const D: usize, const S: usize>(
        p: &mut Matrix<D>,
        joint: usize,
        shown: Shown,
        at_once: &[f64],
        variance: f64,
    ) -> Gain<D> {
        let mut row = match shown {
            Shown::State(state) => p[S * joint + state],
            Shown::Sum(c) => {
                let mut row = [0.0; D];
                (0..S).for_each(|s| add(&mut row, c[s], &p[S * joint + s]));
                row
            }
        };
        at_once.iter().enumerate().for_each(|(j, weight)| add(&mut row, *weight, &p[S * j + 2]));
        let of_torques: f64 = at_once.iter().enumerate().map(|(j, weight)| weight * row[S * j + 2]).sum();
        let s = shown.of(&row[S * joint..S * (joint + 1)]) + of_torques + variance;
        let gain = Gain { column: row.map(|seen| seen / s), white: 1.0 / s.sqrt() };
        // A sensor tells nothing of the link that a rigid joint does not have.
        for (p, k) in p.iter_mut().zip(gain.column).filter(|(_, k)| *k != 0.0) {
            add(p, -k, &row);
        }
        gain
    }
}

#[cfg(test)]
mod tests;
