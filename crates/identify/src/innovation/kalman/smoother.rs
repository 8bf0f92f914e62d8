//! The smoother: what all samples of a run together tell of each.
//!
//! Bryson and Frazier's form, which inverts no covariance: one that is nearly singular, of a joint with little noise or
//! without a link encoder, would be amplified from round to round.
//!
//! ```text
//! x̂_k = x_k − P_k λ_k,   P̂_k = P_k − P_k Λ_k P_k
//! λ_{k−1} = Φᵀ λ⁻_k,   sensor by sensor backwards:  λ⁻ = λ − c (Kᵀλ + e/S)
//! Λ_{k−1} = Φᵀ Λ⁻_k Φ,   Λ⁻ = (1 − c Kᵀ) Λ (1 − K cᵀ) + c cᵀ/S
//! ```
//!
//! Source: Bierman, *Fixed interval smoothing with discrete measurements*, Int. J. Control 18, 1973.

use std::ops::Range;

use super::{Input, Kalman, Known, Matrix, Read, Shown, Step, Told, add, forward};
use crate::innovation::step::State;

/// The deviation of a joint in a sample.
#[derive(Debug, Clone, Copy)]
pub(in crate::innovation) struct Smoothed {
    pub x: State,
    /// How uncertain its motor's velocity is, by the standard deviation, if that was asked for.
    pub speed_noise: Option<f64>,
}

// What the samples after one tell of it.
struct Ahead<const D: usize> {
    // λ
    pull: [f64; D],
    // Λ, if it was asked for.
    information: Option<Matrix<D>>,
}

// Samples of which is kept at once what the filter saw: some 8 kB each of six elastic joints.
const STRETCH: usize = 512;

// What a filter saw of some samples: after the sensors of each x and P, and what every sensor read.
struct Seen<'s, const D: usize> {
    states: Vec<Known<D>>,
    read: Vec<Read<'s, D>>,
}

impl Kalman<'_> {
    pub(super) fn smoothed_of<const D: usize, const S: usize>(
        &self,
        with_speed_noise: bool,
        input: &(impl Fn(usize, usize) -> Input + Sync),
        told: &mut impl FnMut(usize, usize, Told),
    ) -> Vec<Vec<Smoothed>> {
        let n = self.system.len();
        // What is known where each stretch begins.
        let mut begun: Vec<Known<D>> = Vec::with_capacity(n.div_ceil(STRETCH));
        let mut known = self.begin::<D, S>();
        for stretch in 0..n.div_ceil(STRETCH) {
            begun.push(known);
            let tell = |k, one: Read<D>| told(self.group.start + one.joint, k, one.told());
            self.over::<D, S>(self.stretch(stretch), &mut known, input, tell, |_| {});
        }
        let seen = |stretch: usize| self.seen::<D, S>(stretch, begun[stretch], input);
        let mut ahead = Ahead { pull: [0.0; D], information: with_speed_noise.then_some([[0.0; D]; D]) };
        let unknown = Smoothed { x: [0.0; 4], speed_noise: None };
        let mut smoothed = vec![vec![unknown; n]; self.group.len()];
        let mut next = begun.len().checked_sub(1).map(seen);
        for stretch in (0..begun.len()).rev() {
            let Some(now) = next.take() else { break };
            // The filter goes over the stretch before while this one is smoothed.
            let back = || self.back_over::<D, S>(stretch * STRETCH, &now, &mut ahead, &mut smoothed);
            (next, ()) = rayon::join(|| stretch.checked_sub(1).map(seen), back);
        }
        smoothed
    }

    fn stretch(&self, number: usize) -> Range<usize> {
        number * STRETCH..((number + 1) * STRETCH).min(self.system.len())
    }

    // What the filter sees of a stretch, from where it begins.
    fn seen<'s, const D: usize, const S: usize>(
        &'s self,
        stretch: usize,
        mut known: Known<D>,
        input: &impl Fn(usize, usize) -> Input,
    ) -> Seen<'s, D> {
        let samples = self.stretch(stretch);
        let sensors = self.system.sensor_count(self.group.clone());
        let mut states = Vec::with_capacity(samples.len());
        let mut all_read = Vec::with_capacity(samples.len() * sensors);
        let (read, seen) = (|_, one| all_read.push(one), |known: &Known<D>| states.push(*known));
        self.over::<D, S>(samples, &mut known, input, read, seen);
        Seen { states, read: all_read }
    }

    // The samples of a stretch from `first` on, smoothed from its end to its beginning.
    fn back_over<const D: usize, const S: usize>(
        &self,
        first: usize,
        seen: &Seen<D>,
        ahead: &mut Ahead<D>,
        smoothed: &mut [Vec<Smoothed>],
    ) {
        let sensors = self.system.sensor_count(self.group.clone());
        for (step, (x, p)) in seen.states.iter().enumerate().rev() {
            let k = first + step;
            let x = ahead.smooth(x, p);
            for (i, of_joint) in smoothed.iter_mut().enumerate() {
                of_joint[k].x[..S].copy_from_slice(&x[S * i..S * (i + 1)]);
                of_joint[k].speed_noise = ahead.variance(p, S * i + 1).map(|square| square.max(0.0).sqrt());
            }
            for one in seen.read[step * sensors..(step + 1) * sensors].iter().rev() {
                ahead.take::<S>(one);
            }
            if k > 0 {
                ahead.turn_back(&self.step::<D, S>(k - 1));
            }
        }
    }
}

impl<const D: usize> Ahead<D> {
    // x̂ = x − P λ
    fn smooth(&self, x: &[f64; D], p: &Matrix<D>) -> [f64; D] {
        let mut x = *x;
        for (pull, p) in self.pull.iter().zip(p) {
            add(&mut x, -pull, p);
        }
        x
    }

    // A diagonal entry of P − P Λ P.
    fn variance(&self, p: &Matrix<D>, state: usize) -> Option<f64> {
        let row = &p[state];
        self.information.as_ref().map(|information| row[state] - dot(&image(information, row), row))
    }

    // What one more sensor tells: with u = Λ K,
    // λ ← λ − c (Kᵀλ + e/S),   Λ ← Λ − c uᵀ − u cᵀ + c cᵀ (Kᵀu + 1/S)
    fn take<const S: usize>(&mut self, Read { joint, shown, at_once, gain, e }: &Read<D>) {
        let mut c = [0.0; D];
        match shown {
            Shown::State(state) => c[S * joint + state] = 1.0,
            Shown::Sum(sum) => c[S * joint..S * (joint + 1)].copy_from_slice(&sum[..S]),
        }
        at_once.iter().enumerate().for_each(|(j, weight)| c[S * j + 2] += weight);
        let pull = dot(&self.pull, &gain.column) + e * gain.white * gain.white;
        add(&mut self.pull, -pull, &c);
        let Some(information) = &mut self.information else { return };
        let u = image(information, &gain.column);
        let own = dot(&u, &gain.column) + gain.white * gain.white;
        for ((row, c_row), u_row) in information.iter_mut().zip(&c).zip(&u) {
            add(row, own * c_row - u_row, &c);
            add(row, -c_row, &u);
        }
    }

    // λ ← Φᵀ λ,   Λ ← Φᵀ Λ Φ
    fn turn_back(&mut self, step: &Step<D>) {
        self.pull = step.turned.map(|column| dot(&column, &self.pull));
        let Some(information) = &mut self.information else { return };
        let rows = std::array::from_fn(|i| step.turned.map(|column| column[i]));
        *information = forward(&Step { turned: rows, ..Step::still() }, information);
    }
}

// Λ v
fn image<const D: usize>(information: &Matrix<D>, v: &[f64; D]) -> [f64; D] {
    let mut image = [0.0; D];
    for (row, v) in information.iter().zip(v) {
        add(&mut image, *v, row);
    }
    image
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
