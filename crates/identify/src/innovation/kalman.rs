//! The Kalman filter of the deviations of a group of joints: its gains, its likelihood, its smoother.
//!
//! The encoders are taken one after the other, which gives the factor of their covariance without factoring it.
//!
//! Source: Kalman, *A new approach to linear filtering and prediction problems*, J. Basic Engineering 82, 1960;
//! Rauch, Tung, Striebel, *Maximum likelihood estimates of linear dynamic systems*, AIAA Journal 3, 1965.

use std::ops::Range;

use super::system::{Deviations, Joint, State, System, Torques};

/// Most joints whose covariance is carried along together.
pub(super) const GROUP: usize = 3;

/// The gain of one encoder in one sample, on the states of its group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// K, by state of the group.
    pub column: [f64; 4 * GROUP],
    /// 1/√S
    pub white: f64,
}

/// Inputs of one sample: torque of the hold that follows, motor and link position.
pub(super) type Input = [f64; 3];

// Standard deviation of the deviation at the start: position, velocity.
const START: [f64; 2] = [1e-3, 0.1];
// Noise of the link's torque as a share of the motor's.
const LINK_SHARE: f64 = 0.04;

/// The Kalman filter of a group of joints about their reference.
pub(super) struct Kalman<'a> {
    pub system: &'a System,
    pub group: Range<usize>,
    /// Standard deviation of the torque noise of every joint of the system.
    pub noise: &'a [f64],
}

// Covariance of a group's states, by rows.
type Covariance = Vec<f64>;

impl Kalman<'_> {
    fn joints(&self) -> &[Joint] {
        &self.system.joints[self.group.clone()]
    }
    fn size(&self) -> usize {
        4 * self.group.len()
    }

    /// The gains of every encoder in every sample, joint by joint.
    pub fn gains(&self) -> Vec<Gain> {
        let mut p = self.start();
        let mut gains = Vec::new();
        for k in 0..self.system.len() {
            for (i, joint) in self.joints().iter().enumerate() {
                for (state, variance) in joint.sensors() {
                    gains.push(self.update(&mut p, 4 * i + state, variance));
                }
            }
            p = self.forward(&p, k).1;
        }
        gains
    }

    /// −2 log likelihood of those of the first `samples` for which `counts`, about the reference.
    pub fn misfit(
        &self,
        samples: usize,
        input: impl Fn(usize, usize) -> Input,
        counts: impl Fn(usize, usize) -> bool,
    ) -> f64 {
        let (mut p, mut x, mut sum) = (self.start(), vec![[[0.0]; 4]; self.group.len()], 0.0);
        for k in 0..samples.min(self.system.len()) {
            self.correct(k, &mut p, &mut x, &input, |joint, z, white| {
                if counts(joint, k) {
                    sum += z * z - 2.0 * white.ln();
                }
            });
            p = self.forward(&p, k).1;
            self.predict(k, &mut x, &input);
        }
        sum
    }

    /// The deviation of every joint of the group in every sample, by all of them: filter forwards, smoother backwards.
    pub fn smoothed(&self, input: impl Fn(usize, usize) -> Input) -> Vec<Vec<State>> {
        let (n, d) = (self.system.len(), self.size());
        let flat = |x: &[[[f64; 1]; 4]]| -> Vec<f64> { x.iter().flatten().map(|[x]| *x).collect() };
        let mut seen: Vec<Vec<f64>> = Vec::with_capacity(n);
        // Of each step: x⁻, Φ P and P⁻ after it.
        let mut ahead: Vec<(Vec<f64>, Covariance, Covariance)> = Vec::with_capacity(n);
        let (mut p, mut x) = (self.start(), vec![[[0.0]; 4]; self.group.len()]);
        for k in 0..n {
            self.correct(k, &mut p, &mut x, &input, |_, _, _| ());
            seen.push(flat(&x));
            let (half, next) = self.forward(&p, k);
            self.predict(k, &mut x, &input);
            ahead.push((flat(&x), half, next.clone()));
            p = next;
        }
        // x̂_k = x_k + (Φ P_k)ᵀ P⁻_{k+1}⁻¹ (x̂_{k+1} − x⁻_{k+1})
        for k in (0..n.saturating_sub(1)).rev() {
            let (predicted, half, covariance) = &ahead[k];
            let change: Vec<f64> = seen[k + 1].iter().zip(predicted).map(|(a, b)| a - b).collect();
            let y = solved(covariance, &change);
            for i in 0..d {
                seen[k][i] += (0..d).map(|j| half[j * d + i] * y[j]).sum::<f64>();
            }
        }
        let of_joint = |i: usize| seen.iter().map(|x| std::array::from_fn(|s| x[4 * i + s])).collect();
        (0..self.group.len()).map(of_joint).collect()
    }

    fn start(&self) -> Covariance {
        let d = self.size();
        let mut p = vec![0.0; d * d];
        for (i, joint) in self.joints().iter().enumerate() {
            for s in 0..joint.encoders.shown + 2 {
                p[(4 * i + s) * (d + 1)] = START[s % 2] * START[s % 2];
            }
        }
        p
    }

    // K = P c/S,   P ← P − K S Kᵀ,   S = cᵀ P c + R
    fn update(&self, p: &mut Covariance, state: usize, variance: f64) -> Gain {
        let d = self.size();
        let s = p[state * (d + 1)] + variance;
        let mut gain = Gain { column: [0.0; 4 * GROUP], white: 1.0 / s.sqrt() };
        for i in 0..d {
            gain.column[i] = p[i * d + state] / s;
        }
        for i in 0..d {
            for j in 0..d {
                p[i * d + j] -= gain.column[i] * gain.column[j] * s;
            }
        }
        gain
    }

    // One sample's encoders: `told` is given joint, whitened innovation and 1/√S of each.
    fn correct(
        &self,
        k: usize,
        p: &mut Covariance,
        x: &mut Deviations<1>,
        input: &impl Fn(usize, usize) -> Input,
        mut told: impl FnMut(usize, f64, f64),
    ) {
        for (i, joint) in self.joints().iter().enumerate() {
            let [_, motor, link] = input(self.group.start + i, k);
            for ((state, variance), y) in joint.sensors().zip([motor, link]) {
                let gain = self.update(p, 4 * i + state, variance);
                let e = y - x[i][state][0];
                told(self.group.start + i, e * gain.white, gain.white);
                for (n, x) in x.iter_mut().flatten().enumerate() {
                    x[0] += gain.column[n] * e;
                }
            }
        }
    }

    fn predict(&self, k: usize, x: &mut Deviations<1>, input: &impl Fn(usize, usize) -> Input) {
        let torques: Vec<Torques<1>> = self.group.clone().map(|j| [[input(j, k)[0]], [0.0]]).collect();
        let mut next = [[[0.0]; 4]; GROUP];
        self.system.advance(self.group.clone(), k, &torques, x, &mut next);
        x.copy_from_slice(&next[..x.len()]);
    }

    // Φ P  and  P⁻ = Φ P Φᵀ + Q
    fn forward(&self, p: &Covariance, k: usize) -> (Covariance, Covariance) {
        let d = self.size();
        let half = self.carried(p, k);
        let mut turned = vec![0.0; d * d];
        for i in 0..d {
            for j in 0..d {
                turned[j * d + i] = half[i * d + j];
            }
        }
        let mut next = self.carried(&turned, k);
        for of_motor in [true, false] {
            for (g, variance) in self.effects(k, of_motor) {
                for i in (0..d).filter(|&i| g[i] != 0.0) {
                    for j in 0..d {
                        next[i * d + j] += variance * g[i] * g[j];
                    }
                }
            }
        }
        for i in 0..d {
            for j in 0..i {
                let mean = 0.5 * (next[i * d + j] + next[j * d + i]);
                (next[i * d + j], next[j * d + i]) = (mean, mean);
            }
        }
        (half, next)
    }

    // Φ times a matrix, four columns at a time.
    fn carried(&self, matrix: &[f64], k: usize) -> Covariance {
        let (d, n) = (self.size(), self.group.len());
        let still = [[[0.0; 4]; 2]; GROUP];
        let mut out = vec![0.0; d * d];
        for block in 0..n {
            let at = |i: usize, s: usize, w: usize| (4 * i + s) * d + 4 * block + w;
            let mut x = [[[0.0; 4]; 4]; GROUP];
            for (i, x) in x[..n].iter_mut().enumerate() {
                for (s, x) in x.iter_mut().enumerate() {
                    *x = std::array::from_fn(|w| matrix[at(i, s, w)]);
                }
            }
            let mut next = x;
            self.system.advance(self.group.clone(), k, &still[..n], &x[..n], &mut next[..n]);
            for (i, x) in next[..n].iter().enumerate() {
                for (s, x) in x.iter().enumerate() {
                    (0..4).for_each(|w| out[at(i, s, w)] = x[w]);
                }
            }
        }
        out
    }

    // What a torque noise of one joint, on its motor or on its link, does to the states of the group in one step, with its
    // variance.
    fn effects(&self, k: usize, of_motor: bool) -> impl Iterator<Item = ([f64; 4 * GROUP], f64)> {
        let n = self.group.len();
        let still = [[[0.0]; 4]; GROUP];
        (0..n).map(move |j| {
            let (mut torques, mut next) = ([[[0.0]; 2]; GROUP], still);
            torques[j][usize::from(!of_motor)] = [1.0];
            self.system.advance(self.group.clone(), k, &torques[..n], &still[..n], &mut next[..n]);
            let noise = self.noise[self.group.start + j];
            let share = if of_motor { 1.0 } else { LINK_SHARE };
            (std::array::from_fn(|i| next[i / 4][i % 4][0]), (share * noise).powi(2))
        })
    }
}

// P⁻¹ b by Cholesky's factors of P scaled to unit diagonal; directions without variance give nothing.
fn solved(p: &[f64], b: &[f64]) -> Vec<f64> {
    let d = b.len();
    let scale: Vec<f64> =
        (0..d).map(|i| if p[i * (d + 1)] > 0.0 { 1.0 / p[i * (d + 1)].sqrt() } else { 0.0 }).collect();
    let mut l = vec![0.0; d * d];
    for i in 0..d {
        for j in 0..=i {
            let entry = if i == j { 1.0 + 1e-12 } else { p[i * d + j] * scale[i] * scale[j] };
            let sum = entry - (0..j).map(|m| l[i * d + m] * l[j * d + m]).sum::<f64>();
            l[i * d + j] = if i == j { sum.max(1e-14).sqrt() } else { sum / l[j * (d + 1)] };
        }
    }
    let mut y: Vec<f64> = b.iter().zip(&scale).map(|(b, s)| b * s).collect();
    for i in 0..d {
        y[i] = (y[i] - (0..i).map(|j| l[i * d + j] * y[j]).sum::<f64>()) / l[i * (d + 1)];
    }
    for i in (0..d).rev() {
        y[i] = (y[i] - (i + 1..d).map(|j| l[j * d + i] * y[j]).sum::<f64>()) / l[i * (d + 1)];
    }
    y.iter().zip(&scale).map(|(y, s)| y * s).collect()
}
