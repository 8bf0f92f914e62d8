//! Small deviations of all joints from a reference motion: linear equations, their bodies coupled.

use std::ops::Range;
use std::sync::Arc;

use faer::Mat;
use faer::linalg::solvers::Solve;
use rayon::prelude::*;

use super::step::{DOUBLINGS, Discrete, Kept, Linear, Single, State};
use crate::record::START;

/// How well the sensors of a joint are read.
#[derive(Debug, Clone, Default)]
pub(super) struct Readings {
    /// Variance of a reading of the motor's position; a hinge has no motor.
    pub motor: Option<f64>,
    /// The same of the link's, where it has an encoder.
    pub link: Option<f64>,
    /// The same of the torque behind the gear, where it is measured; of a rigid gear with what that shows of the torque noise.
    pub gear: Option<f64>,
    /// State that the link's encoder shows: 2, or 0 of a rigid joint.
    pub shown: usize,
    /// For how long each sensor steps alike.
    pub alike: [Alike; SENSORS],
}

/// For how many samples about each the steps of a reading are all alike, by sample; empty where they never are. What was
/// rounded away is then nearly the same in all, so they tell as much as one.
pub(super) type Alike = Arc<[f32]>;

impl Readings {
    /// True if nothing shows where a link on a spring, or a hinge, is.
    pub fn is_led(&self) -> bool {
        self.is_hinge() || self.shown == 2 && self.link.is_none() && self.gear.is_none()
    }

    fn is_hinge(&self) -> bool {
        self.motor.is_none()
    }

    // The torque behind the gear; at once or by a spring.
    fn shown_behind(&self, linear: &Linear) -> State {
        let [x, v, ..] = linear.gear;
        if self.shows_noise() { [x, v, 0.0, 0.0] } else { linear.gear }
    }

    fn kept(&self, step: Discrete) -> Kept {
        let kept = Kept::from(step);
        if self.shows_noise() { kept.pushed_by_third() } else { kept }
    }

    /// True if a sensor shows the torque noise of the hold that begins, which is the third state of the joint then.
    pub fn shows_noise(&self) -> bool {
        self.shown == 0 && self.gear.is_some()
    }
}

/// Sensors that a joint may have: encoders of motor and link, torque behind the gear.
pub(super) const SENSORS: usize = 3;
/// The last of them.
pub(super) const GEAR: usize = 2;

/// What a sensor shows of its joint.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shown {
    /// This state.
    State(usize),
    /// The sum of all states with these weights.
    Sum(State),
}

impl Shown {
    /// c x̃ of the states of the joint.
    pub fn of(&self, x: &[f64]) -> f64 {
        match self {
            Self::State(state) => x[*state],
            Self::Sum(c) => c.iter().zip(x).map(|(c, x)| c * x).sum(),
        }
    }
}

/// A sensor in one sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensor<'s> {
    /// Which of the [`SENSORS`] it is.
    pub which: usize,
    pub shown: Shown,
    /// What it shows at once of a torque of the motor of every joint; empty if nothing.
    pub at_once: &'s [f64],
    /// Variance of a reading.
    pub variance: f64,
}

/// The equations of a joint, or of a hinge, along a run.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub readings: Readings,
    /// By sample.
    pub steps: Vec<Kept>,
    /// How unsure the motor's friction over each hold may be, by its standard deviation, N·m.
    pub unsure: Vec<f32>,
    /// Of a link that is lighter than its rotor, the root of its share of the rotor's inertia; else one.
    pub lightness: f64,
    // The torque behind the gear by sample; empty where it is not read.
    gear: Vec<State>,
    // What of the motors' torques is behind a rigid gear at once, by joint, once every so many samples; empty of any other.
    at_once: Vec<Vec<f64>>,
    at_once_every: usize,
}

// Torque of a rigid joint's own motor accelerates the motor, too, those of others by way of the links:
// τ̃_j = τ̃_i − B Σ_j (M⁻¹)_ij τ̃_j,   which is `passed` of its own. Springs come between.
fn at_once(i: usize, passed: f64, mobility: &[f64], is_rigid: &[bool]) -> Vec<f64> {
    let n = is_rigid.len();
    let of = |j: usize| match is_rigid[j] {
        _ if j == i => passed,
        true => (passed - 1.0) * mobility[i * n + j] / mobility[i * (n + 1)],
        false => 0.0,
    };
    (0..n).map(of).collect()
}

// √(J/B) of the mean pose, at most one.
fn lightness(linear: &[Linear]) -> f64 {
    let sum: f64 = linear.iter().map(|l| l.motor / l.link).sum();
    (sum / linear.len().max(1) as f64).min(1.0).sqrt()
}

/// What the joints do to each other over one sample period, beyond what each would do by itself: `n` × `n` blocks, by
/// rows, of the link of one joint and the state of another.
#[derive(Debug, Clone)]
struct Coupling {
    // Position and velocity of the link.
    blocks: Vec<[Single; 2]>,
    motor: Vec<[f32; 2]>,
    link: Vec<[f32; 2]>,
}

/// The equations of all joints and, behind them, of all hinges, their bodies coupled.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub joints: Vec<Joint>,
    // Couplings that occur along the run, and which of them each sample has; none of a single joint.
    couplings: Vec<Coupling>,
    coupling: Vec<usize>,
    /// Samples during which the start of the springs is being found.
    pub led: usize,
    /// True if friction over a hold is as unsure as it may be.
    pub unsure_friction: bool,
}

/// Torques on the motor and on the link of a joint, W sets of them at once.
pub(super) type Torques<const W: usize> = [[f64; W]; 2];

/// Deviations of some joints, W of them at once.
pub(super) type Deviations<const W: usize> = [[[f64; W]; 4]];

/// Most joints of a robot whose deviations are coupled.
pub(super) const MOST_JOINTS: usize = 32;

// Change of what a joint does to itself in a sample by which a coupling may be out of date.
const OUT_OF_DATE: f64 = 0.01;

impl System {
    /// The joints with their equations by sample; `mobility`: inverse inertia, by rows, once every so many samples;
    /// `period`: the sample period, s.
    ///
    /// Joint i:  q̈̃_i = Σ_j (M⁻¹)_ij push_j · x̃_j
    pub fn new(
        readings: Vec<Readings>,
        linear: &[&[Linear]],
        mobility: &[Vec<f64>],
        mobility_every: usize,
        period: f64,
    ) -> Self {
        let is_rigid: Vec<bool> = readings.iter().map(|r| r.shown == 0 && !r.is_hinge()).collect();
        let passed = |i: usize| {
            let of = |(block, m): (usize, &Vec<f64>)| {
                at_once(i, linear[i][block * mobility_every].gear[2], m, &is_rigid)
            };
            mobility.iter().enumerate().map(of).collect()
        };
        let joint = |(i, (readings, linear)): (usize, (Readings, &&[Linear]))| Joint {
            at_once: if readings.shows_noise() { passed(i) } else { Vec::new() },
            at_once_every: mobility_every,
            steps: linear.iter().map(|l| readings.kept(l.over(period))).collect(),
            lightness: lightness(linear),
            unsure: Vec::new(),
            gear: readings
                .gear
                .map_or_else(Vec::new, |_| linear.iter().map(|l| readings.shown_behind(l)).collect()),
            readings,
        };
        let joints: Vec<Joint> = readings.into_par_iter().zip(linear).enumerate().map(joint).collect();
        // The holds at which joints are coupled anew, and of each hold which of them it goes by.
        let (mut anew, mut coupling) = (Vec::new(), Vec::new());
        let n = joints.len();
        if n > 1 {
            let samples = joints.iter().map(|j| j.steps.len()).min().unwrap_or(0);
            let mut last = 0;
            for k in 0..samples {
                let mobility = &mobility[k / mobility_every];
                // Of a decay over the period, or of the square of a turn.
                let changed = |i: usize| {
                    let change = |s: usize| (linear[i][k].push[s] - linear[i][last].push[s]).abs();
                    let to_first = change(1) + change(3) + period * (change(0) + change(2));
                    period * mobility[i * (n + 1)] * to_first > OUT_OF_DATE
                };
                if k % mobility_every == 0 || (0..n).any(changed) {
                    anew.push(k);
                    last = k;
                }
                coupling.push(anew.len() - 1);
            }
        }
        let shown: Vec<usize> = joints.iter().map(|j| j.readings.shown).collect();
        let coupled = |k: usize| {
            let at: Vec<&Linear> = linear.iter().map(|l| &l[k]).collect();
            let mut coupling = Coupling::new(&at, &shown, &mobility[k / mobility_every], period);
            for (entry, motor) in coupling.motor.iter().enumerate() {
                if joints[entry % n].readings.shows_noise() {
                    (0..2).for_each(|r| coupling.blocks[entry][r][2] = motor[r]);
                }
            }
            coupling
        };
        let couplings = anew.into_par_iter().map(coupled).collect();
        let led = (START / period) as usize;
        Self { joints, couplings, coupling, led, unsure_friction: false }
    }

    /// Sensors of some of the joints.
    pub fn sensor_count(&self, joints: Range<usize>) -> usize {
        self.joints[joints].iter().map(Joint::sensor_count).sum()
    }

    /// Samples of the run.
    pub fn len(&self) -> usize {
        self.joints.iter().map(|j| j.steps.len()).min().unwrap_or(0)
    }

    /// By how much the motor of one joint is faster after a hold with one more N·m on that of another.
    pub fn kick(&self, to: usize, from: usize, k: usize) -> f64 {
        let own = if to == from { f64::from(self.joints[to].steps[k].motor[1]) } else { 0.0 };
        let is_rigid = self.joints[to].is_rigid();
        let coupling = self.coupling.get(k).filter(|_| is_rigid).map(|&c| &self.couplings[c]);
        own + coupling.map_or(0.0, |c| f64::from(c.motor[to * self.joints.len() + from][1]))
    }

    /// `next` = Φ x̃ + g δτ + g_ℓ δτ_ℓ of some of the joints, coupled among themselves.
    #[inline(always)]
    pub fn advance<'t, const W: usize>(
        &self,
        joints: Range<usize>,
        k: usize,
        torques: impl Fn(usize) -> &'t Torques<W>,
        x: &Deviations<W>,
        next: &mut Deviations<W>,
    ) {
        for (i, joint) in self.joints[joints.clone()].iter().enumerate() {
            next[i] = joint.advanced(k, &x[i], torques(i));
        }
        let Some(coupling) = self.coupling.get(k).map(|&c| &self.couplings[c]) else { return };
        let n = self.joints.len();
        for (next, to) in next.iter_mut().zip(joints.clone()) {
            let link = self.joints[to].readings.shown;
            let of_row = to * n + joints.start..to * n + joints.end;
            let entries = coupling.blocks[of_row.clone()].iter();
            let pushes = coupling.motor[of_row.clone()].iter().zip(&coupling.link[of_row]);
            for (j, ((block, (motor, link_torque)), x)) in entries.zip(pushes).zip(x).enumerate() {
                let torques = torques(j);
                for r in 0..2 {
                    add_terms(&mut next[link + r], &block[r], [motor[r], link_torque[r]], x, torques);
                }
            }
        }
    }

    /// The same as matrices of zeros to be filled: Φᵀ of the first S states of every joint, g of the motor and of the link of every
    /// joint in turn.
    pub fn step<const D: usize, const S: usize>(
        &self,
        joints: Range<usize>,
        k: usize,
        turned: &mut [[f64; D]; D],
        pushes: &mut [[f64; D]],
    ) {
        for (i, joint) in self.joints[joints.clone()].iter().enumerate() {
            let step = &joint.steps[k];
            for r in 0..S {
                for s in 0..S {
                    turned[S * i + s][S * i + r] = f64::from(u8::from(r == s)) + f64::from(step.change[r][s]);
                }
                pushes[2 * i][S * i + r] = f64::from(step.motor[r]);
                pushes[2 * i + 1][S * i + r] = f64::from(step.link[r]);
            }
        }
        let Some(coupling) = self.coupling.get(k).map(|&c| &self.couplings[c]) else { return };
        for (i, to) in joints.clone().enumerate() {
            let link = S * i + self.joints[to].readings.shown;
            for (j, from) in joints.clone().enumerate() {
                let entry = to * self.joints.len() + from;
                for (r, of_row) in coupling.blocks[entry].iter().enumerate() {
                    for (s, x) in of_row.iter().take(S).enumerate() {
                        turned[S * j + s][link + r] += f64::from(*x);
                    }
                    pushes[2 * j][link + r] += f64::from(coupling.motor[entry][r]);
                    pushes[2 * j + 1][link + r] += f64::from(coupling.link[entry][r]);
                }
            }
        }
    }
}

impl Coupling {
    /// The step of all joints together, as [`Linear::over`] makes that of one, less that of each by itself.
    fn new(at: &[&Linear], shown: &[usize], mobility: &[f64], period: f64) -> Self {
        let own: Vec<Discrete> = at.iter().map(|linear| linear.over(period)).collect();
        let h = period * 0.5f64.powi(DOUBLINGS);
        let n = at.len();
        let d = 4 * n;
        let is_rigid = |j: usize| shown[j] == 0;
        let mut a = Mat::<f64>::zeros(d, d);
        let mut b = Mat::<f64>::zeros(d, 2 * n);
        for j in 0..n {
            let (alone, [motor, link]) = (at[j].matrix(), at[j].torques());
            for i in 0..n {
                for s in 0..4 {
                    for r in (0..4).filter(|_| i == j) {
                        a[(4 * i + r, 4 * j + s)] = alone[r][s];
                    }
                    if i != j {
                        a[(4 * i + shown[i] + 1, 4 * j + s)] = mobility[i * n + j] * at[j].push[s];
                    }
                }
                let m = if i == j { 0.0 } else { mobility[i * n + j] };
                b[(4 * i + shown[i] + 1, 2 * j + 1)] = m;
                if is_rigid(j) {
                    b[(4 * i + shown[i] + 1, 2 * j)] = m;
                }
            }
            for r in 0..4 {
                b[(4 * j + r, 2 * j)] += motor[r];
                b[(4 * j + r, 2 * j + 1)] += link[r];
            }
        }
        let square = &a * &a;
        let part = |i: usize, j: usize, sign: f64| {
            f64::from(u8::from(i == j)) + sign * 0.5 * h * a[(i, j)] + h * h / 12.0 * square[(i, j)]
        };
        let left = Mat::from_fn(d, d, |i, j| part(i, j, -1.0));
        let right =
            Mat::from_fn(d, d + 2 * n, |i, j| if j < d { part(i, j, 1.0) } else { h * b[(i, j - d)] });
        let mut step = left.partial_piv_lu().solve(&right);
        for _ in 0..DOUBLINGS {
            let twice = step.subcols(0, d) * &step;
            step = Mat::from_fn(d, d + 2 * n, |i, j| twice[(i, j)] + if j < d { 0.0 } else { step[(i, j)] });
        }
        let mut coupling = Self { blocks: Vec::new(), motor: Vec::new(), link: Vec::new() };
        for i in 0..n {
            for j in 0..n {
                let alone = f64::from(u8::from(i == j));
                let rows = [shown[i], shown[i] + 1];
                let state = |r: usize, s: usize| step[(4 * i + r, 4 * j + s)] - alone * own[i].phi[r][s];
                coupling.blocks.push(rows.map(|r| std::array::from_fn(|s| state(r, s) as f32)));
                let torque = |r: usize, which: usize| step[(4 * i + r, d + 2 * j + which)];
                coupling.motor.push(rows.map(|r| (torque(r, 0) - alone * own[i].motor[r]) as f32));
                coupling.link.push(rows.map(|r| (torque(r, 1) - alone * own[i].link[r]) as f32));
            }
        }
        coupling
    }
}

// sum ← sum + φ · x̃ + g · δτ.  One loop over the sets goes round all of it: separate loops do not end in full registers.
#[inline(always)]
fn add_terms<const W: usize>(
    sum: &mut [f64; W],
    phi: &Single,
    push: [f32; 2],
    x: &[[f64; W]; 4],
    torques: &Torques<W>,
) {
    let (phi, push) = (phi.map(f64::from), push.map(f64::from));
    for w in 0..W {
        let of_state = phi[0] * x[0][w] + phi[1] * x[1][w] + phi[2] * x[2][w] + phi[3] * x[3][w];
        let of_torques = push[0] * torques[0][w] + push[1] * torques[1][w];
        sum[w] += of_state + of_torques;
    }
}

impl Joint {
    /// Φ x̃ + g δτ + g_ℓ δτ_ℓ
    #[inline(always)]
    pub fn advanced<const W: usize>(
        &self,
        k: usize,
        x: &[[f64; W]; 4],
        torques: &Torques<W>,
    ) -> [[f64; W]; 4] {
        let step = &self.steps[k];
        let mut next = *x;
        for (i, next) in next.iter_mut().enumerate() {
            add_terms(next, &step.change[i], [step.motor[i], step.link[i]], x, torques);
        }
        next
    }

    /// Its sensors in sample k.
    #[inline(always)]
    pub fn sensors(&self, k: usize) -> impl Iterator<Item = Sensor<'_>> {
        let Readings { motor, link, gear, shown, alike } = &self.readings;
        let sensor = |which: usize, shown, variance: &f64| {
            let samples = alike[which].get(k).map_or(1.0, |n| f64::from(*n));
            let at_once = if which == GEAR { self.at_once(k) } else { &[] };
            Sensor { which, shown, at_once, variance: variance * samples }
        };
        let motor = motor.as_ref().map(|variance| sensor(0, Shown::State(0), variance));
        let link = link.as_ref().map(|variance| sensor(1, Shown::State(*shown), variance));
        let gear = gear.as_ref().map(|variance| sensor(GEAR, Shown::Sum(self.gear[k]), variance));
        motor.into_iter().chain(link).chain(gear)
    }

    /// What the sensor behind a rigid gear shows at once in sample k of a torque of the motor of every joint; empty of any other.
    #[inline(always)]
    pub fn at_once(&self, k: usize) -> &[f64] {
        if self.at_once.is_empty() { &[] } else { &self.at_once[k / self.at_once_every] }
    }

    /// True if its link moves with its motor.
    pub fn is_rigid(&self) -> bool {
        self.readings.shown == 0
    }

    // How many it has.
    fn sensor_count(&self) -> usize {
        let Readings { motor, link, gear, .. } = &self.readings;
        [motor, link, gear].into_iter().filter(|sensor| sensor.is_some()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // A light elastic joint with friction near rest, and a rigid one that its body is bound to.
    fn joints(period: f64) -> System {
        let mobility = [900.0, -200.0, -200.0, 250.0];
        let elastic = Linear {
            is_elastic: true,
            rate: [-900.0 / 0.04, -500.0 / 0.04, 900.0 / 0.04, 0.6 / 0.04],
            motor: 1.0 / 0.04,
            link: mobility[0],
            push: [900.0, 0.6, -900.0, -0.6],
            ..Linear::default()
        };
        let push = [-30.0, -2.0, 0.0, 0.0];
        let (rate, motor, link) = (push.map(|p| mobility[3] * p), mobility[3], mobility[3]);
        let rigid = Linear { rate, motor, link, push, ..Linear::default() };
        let readings = [2, 0].map(|shown| Readings { motor: Some(1e-10), shown, ..Readings::default() });
        System::new(readings.to_vec(), &[&[elastic], &[rigid]], &[mobility.to_vec()], 1, period)
    }

    // Of 1/900 kg·m² behind a rotor of 1/25 kg·m²; a rigid joint is one body.
    #[test]
    fn a_light_link_is_known_as_such() {
        let system = joints(1e-3);
        assert!((system.joints[0].lightness - (25.0f64 / 900.0).sqrt()).abs() < 1e-12);
        assert_eq!(system.joints[1].lightness, 1.0);
    }

    // The gains and the rows must step alike.
    #[test]
    fn a_step_as_matrices_is_the_step() {
        let system = joints(1e-3);
        let (torques, x) = (
            [[[0.3], [0.1]], [[-0.2], [0.05]]],
            [[[1e-3], [0.2], [9e-4], [-0.1]], [[2e-3], [0.3], [0.0], [0.0]]],
        );
        let mut next = x;
        system.advance(0..2, 0, |j| &torques[j], &x, &mut next);
        let (mut turned, mut pushes) = ([[0.0; 8]; 8], [[0.0; 8]; 4]);
        system.step::<8, 4>(0..2, 0, &mut turned, &mut pushes);
        for i in 0..8 {
            let moved: f64 = (0..8).map(|s| turned[s][i] * x[s / 4][s % 4][0]).sum();
            let pushed: f64 = (0..4).map(|m| pushes[m][i] * torques[m / 2][m % 2][0]).sum();
            let want = next[i / 4][i % 4][0];
            assert!((moved + pushed - want).abs() < 1e-12 * want.abs().max(1.0), "{i}");
        }
    }

    // The motion of a hold is that of its parts, however stiff: what one joint does reaches the other's link.
    #[test]
    fn a_step_of_coupled_joints_is_that_of_its_parts() {
        let (whole, part) = (joints(1e-3), joints(1e-3 / 64.0));
        let torques = [[[0.3], [0.1]], [[-0.2], [0.05]]];
        let mut x = [[[1e-3], [0.2], [9e-4], [-0.1]], [[2e-3], [0.3], [0.0], [0.0]]];
        let mut next = x;
        whole.advance(0..2, 0, |j| &torques[j], &x, &mut next);
        let in_one = next;
        for _ in 0..64 {
            part.advance(0..2, 0, |j| &torques[j], &x, &mut next);
            x = next;
        }
        for (a, b) in in_one.iter().zip(&x) {
            for (s, size) in [(0, 1e-3), (1, 0.3), (2, 1e-3), (3, 0.3)] {
                assert!((a[s][0] - b[s][0]).abs() < 1e-3 * size, "{a:?} {b:?}");
            }
        }
    }
}
