//! The state of a plant along a run, its motors' motion imposed.

use sinew_effect::{Actuation, Kind, Reading, Relaxation, Sensor};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion};

use crate::freedom::Freedom;
use crate::record::{Record, START};

// ω of the lead at the start, rad/s.
const LEAD: f64 = 60.0;

/// The state along a run.
pub(crate) struct Walk<'a, S> {
    pub dynamics: Dynamics<'a, S>,
    pub record: &'a Record,
    pub freedom: &'a Freedom,
    /// Degrees of freedom whose springs are simulated.
    pub free: Vec<usize>,
    pub x: LinkState<S>,
    /// θ̈.
    pub acceleration: Vec<S>,
    /// q̈ of given links.
    pub link_acceleration: Vec<S>,
    pub out: ImposedOut<S>,
    pub actuation: Vec<Actuation<S>>,
    /// Own states' relaxation at the grid step left and at the one reached.
    pub relax: [Vec<Relaxation<S>>; 2],
    encoder: Vec<Reading<S>>,
    stages: Stages<S>,
    // The motors halfway between grid steps. A step over the kink that their motion has where two holds meet takes the cubic
    // through its ends instead.
    middle: Option<&'a [Vec<Vec<f64>>; 3]>,
}

// What a Runge–Kutta step remembers: the state at its start, slopes of the last stage, weighted sums.
struct Stages<S> {
    q: Vec<S>,
    qd: Vec<S>,
    z: Vec<S>,
    slope: [Vec<S>; 2],
    sum: [Vec<S>; 2],
}

impl<'a, S: Kind> Walk<'a, S> {
    /// At the start of a run, its springs at rest under their load.
    pub fn new(dynamics: Dynamics<'a, S>, record: &'a Record, freedom: &'a Freedom) -> Self {
        let plant = dynamics.plant();
        let (nv, states) = (plant.model().nv, plant.state_len());
        let zeros = || vec![S::ZERO; nv];
        let mut walk = Self {
            encoder: dynamics.reading(Sensor::JointPosition),
            middle: record.middle.as_ref().filter(|_| record.most_parts == 1 || freedom.parts > 1),
            x: LinkState::zero(plant),
            dynamics,
            record,
            freedom,
            free: (0..nv).filter(|&i| !freedom.imposed[i]).collect(),
            acceleration: zeros(),
            link_acceleration: zeros(),
            out: ImposedOut::new(nv),
            actuation: vec![Actuation::default(); nv],
            relax: [vec![Relaxation::default(); states], vec![Relaxation::default(); states]],
            stages: Stages {
                q: zeros(),
                qd: zeros(),
                z: vec![S::ZERO; states],
                slope: [zeros(), zeros()],
                sum: [zeros(), zeros()],
            },
        };
        walk.start();
        walk
    }

    // Static equilibrium of the springs under the load of the first pose: two rounds of q = θ − c τ_j.
    fn start(&mut self) {
        let nv = self.freedom.imposed.len();
        let all = vec![true; nv];
        self.set_motor(0);
        if self.free.is_empty() {
            return;
        }
        for i in 0..nv {
            (self.x.q[i], self.x.qd[i]) = (self.x.theta[i], self.x.thetad[i]);
        }
        for _ in 0..2 {
            let motor = MotorMotion { acceleration: &self.acceleration, imposed: &all, links: None };
            let plant_q = self.x.q.clone();
            self.dynamics.imposed_motion(&self.x, motor, &mut self.out);
            for &i in &self.free {
                let load = self.out.tau_j[i] * self.dynamics.coefficients().compliance[i];
                self.x.q[i] = self.x.theta[i] - load;
            }
            if plant_q == self.x.q {
                break;
            }
        }
        self.set_motor(0);
    }

    /// The motors, and the links that are told how to move, at grid step `k`.
    pub fn set_motor(&mut self, k: usize) {
        let r = self.record;
        for (i, joint) in self.freedom.joints.iter().enumerate() {
            let Some(j) = *joint else { continue };
            self.set(i, [r.theta[j][k], r.thetad[j][k], r.thetadd[j][k]], |series| series[k]);
            self.x.temperature[i] = r.temperature[j].as_ref().map(|t| t[k]);
            let Some(sweep) = r.sweep.get(j).map(|s| s[k]) else { continue };
            self.x.thetad_sweep[i] = sweep;
            // A link turns about with its motor, or as it accelerates.
            self.x.qd_sweep[i] = match r.given(self.freedom, i) {
                Some(link) => r.scales.step() * link[k][2],
                None if self.freedom.imposed[i] => sweep,
                None => r.scales.step() * self.out.qdd[i].value(),
            };
        }
    }

    // Motor and link of one joint; `link` takes from a series of a given link.
    fn set(&mut self, i: usize, motor: [f64; 3], link: impl Fn(&[[f64; 3]]) -> [f64; 3]) {
        let [theta, thetad, acceleration] = motor.map(S::constant);
        (self.x.theta[i], self.x.thetad[i], self.acceleration[i]) = (theta, thetad, acceleration);
        if let Some(series) = self.record.given(self.freedom, i) {
            let [q, qd, qdd] = link(series).map(S::constant);
            (self.x.q[i], self.x.qd[i], self.link_acceleration[i]) = (q, qd, qdd);
        } else if self.freedom.imposed[i] {
            (self.x.q[i], self.x.qd[i]) = (theta, thetad);
        }
    }

    /// Everything at grid step `k`.
    pub fn torque(&mut self, k: usize) {
        self.set_motor(k);
        let motor = self.freedom.motion(&self.acceleration, &self.link_acceleration);
        self.dynamics.imposed_torque(&self.x, motor, &mut self.out);
        self.dynamics.actuation(&self.x, &mut self.actuation);
    }

    /// From grid step `k` to `k + 1`.
    pub fn step(&mut self, k: usize) {
        for part in 0..self.freedom.parts {
            if part > 0 && !self.free.is_empty() {
                self.accelerations();
            }
            self.part(k, part);
        }
    }

    /// q̈ and τ_j where the walk is.
    pub fn accelerations(&mut self) {
        let motor = self.freedom.motion(&self.acceleration, &self.link_acceleration);
        self.dynamics.imposed_motion(&self.x, motor, &mut self.out);
    }

    /// One part of that step, whose accelerations at its start are known: own states by their exact exponential, springs by
    /// Runge–Kutta.
    pub fn part(&mut self, k: usize, part: usize) {
        let parts = self.freedom.parts as f64;
        let (h, from) = (self.record.scales.step() / parts, part as f64 / parts);
        let states = !self.x.z.is_empty();
        if states {
            self.dynamics.relaxations(&self.x, &mut self.relax[0]);
        }
        self.stages.z.copy_from_slice(&self.x.z);
        if !self.free.is_empty() {
            self.runge_kutta(k, from, h);
        }
        if states {
            // Rates of both ends, at the motion of the next step.
            self.motor_between(k, from + 1.0 / parts);
            self.dynamics.relaxations(&self.x, &mut self.relax[1]);
            for s in 0..self.x.z.len() {
                self.x.z[s] = relaxed(self.stages.z[s], mean(self.relax[0][s], self.relax[1][s]), h);
            }
        }
    }

    // From a share of the step after grid step `k`, over a time h.
    fn runge_kutta(&mut self, k: usize, from: f64, h: f64) {
        let width = 1.0 / self.freedom.parts as f64;
        self.stages.q.copy_from_slice(&self.x.q);
        self.stages.qd.copy_from_slice(&self.x.qd);
        for (stage, share) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            let at = from + share * width;
            if stage > 0 {
                self.motor_between(k, at);
                let Stages { q, qd, z, slope, .. } = &self.stages;
                for &i in &self.free {
                    self.x.q[i] = q[i] + slope[0][i] * (share * h);
                    self.x.qd[i] = qd[i] + slope[1][i] * (share * h);
                }
                for (s, r) in self.relax[0].iter().enumerate() {
                    self.x.z[s] = relaxed(z[s], *r, share * h);
                }
                self.accelerations();
            }
            self.lead(k, at);
            let weight = [1.0, 2.0, 2.0, 1.0][stage];
            let Stages { slope, sum, .. } = &mut self.stages;
            for &i in &self.free {
                for (n, value) in [self.x.qd[i], self.out.qdd[i]].into_iter().enumerate() {
                    slope[n][i] = value;
                    let before = if stage == 0 { S::ZERO } else { sum[n][i] };
                    sum[n][i] = before + value * weight;
                }
            }
        }
        let Stages { q, qd, sum, .. } = &self.stages;
        for &i in &self.free {
            self.x.q[i] = q[i] + sum[0][i] * (h / 6.0);
            self.x.qd[i] = qd[i] + sum[1][i] * (h / 6.0);
        }
    }

    fn lead(&mut self, k: usize, share: f64) {
        lead(self.record, self.freedom, &self.encoder, &self.x, (k, share), &mut self.out.qdd);
    }

    /// The motors a share of a step after grid step `k`: by cubics through positions and velocities of both ends, and of the
    /// sample halfway where there is one.
    pub fn motor_between(&mut self, k: usize, share: f64) {
        if share == 0.0 || share == 1.0 {
            return self.set_motor(k + usize::from(share == 1.0));
        }
        let r = self.record;
        let h = r.scales.step();
        for (i, joint) in self.freedom.joints.iter().enumerate() {
            let Some(j) = *joint else { continue };
            let at = |k: usize| [r.theta[j][k], r.thetad[j][k], r.thetadd[j][k]];
            let motor = match self.middle.map(|m| m.each_ref().map(|series| series[j][k])) {
                Some(middle) if share == 0.5 => middle,
                Some(middle) if share < 0.5 => between(at(k), middle, 0.5 * h, 2.0 * share),
                Some(middle) => between(middle, at(k + 1), 0.5 * h, 2.0 * share - 1.0),
                None => between(at(k), at(k + 1), h, share),
            };
            self.set(i, motor, |series| between(series[k], series[k + 1], h, share));
        }
    }
}

// Position, velocity and acceleration a share u of a time h after the first of two instants.
//
// x = (1 + 2u)(1 − u)² x₀ + u(1 − u)² h v₀ + u²(3 − 2u) x₁ − u²(1 − u) h v₁
fn between([p0, v0, a0]: [f64; 3], [p1, v1, a1]: [f64; 3], h: f64, u: f64) -> [f64; 3] {
    let w = 1.0 - u;
    let position =
        (1.0 + 2.0 * u) * w * w * p0 + u * u * (3.0 - 2.0 * u) * p1 + u * w * h * (w * v0 - u * v1);
    let velocity = 6.0 * u * w * (p1 - p0) / h + w * (1.0 - 3.0 * u) * v0 + u * (3.0 * u - 2.0) * v1;
    [position, velocity, w * a0 + u * a1]
}

/// The start of a spring is not known: for a moment its link is led to where its encoder saw it, or damped if it has
/// none, by a gain that fades away. Adds to the accelerations at the share of a step after grid step `k`.
///
/// q̈ ← q̈ + s (ω²(q_m − q) + 2ω(q̇_m − q̇)),   s = (1 − t/T)²
pub(crate) fn lead<S: Kind>(
    record: &Record,
    freedom: &Freedom,
    encoder: &[Reading<S>],
    x: &LinkState<S>,
    (k, share): (usize, f64),
    qdd: &mut [S],
) {
    let time = (k as f64 + share) * record.scales.step();
    if time >= START {
        return;
    }
    let fade = (1.0 - time / START).powi(2);
    for i in (0..qdd.len()).filter(|&i| !freedom.imposed[i]) {
        let Some([q, qd]) = freedom.joints[i].and_then(|joint| seen(record, joint, k, share)) else {
            qdd[i] += (x.thetad[i] - x.qd[i]) * (2.0 * LEAD * fade);
            continue;
        };
        // The encoder's own offset and lateness are taken out.
        let true_q = (S::constant(q) - encoder[i].offset) / encoder[i].gain + encoder[i].delay * qd;
        let pull = (true_q - x.q[i]) * (LEAD * LEAD) - (x.qd[i] - qd) * (2.0 * LEAD);
        qdd[i] += pull * fade;
    }
}

fn seen(record: &Record, dof: usize, k: usize, share: f64) -> Option<[f64; 2]> {
    let start = record.start[dof].as_ref()?;
    let (a, b) = (start.get(k)?, start.get(k + 1)?);
    Some([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])])
}

/// z(h) = target + (z − target) e^(−rate·h)
pub(crate) fn relaxed<S: Scalar>(z: S, r: Relaxation<S>, h: f64) -> S {
    r.target + (z - r.target) * (-(r.rate * h)).exp()
}

/// The relaxation of a step by those of its ends.
pub(crate) fn mean<S: Scalar>(a: Relaxation<S>, b: Relaxation<S>) -> Relaxation<S> {
    Relaxation { target: (a.target + b.target) * 0.5, rate: (a.rate + b.rate) * 0.5 }
}
