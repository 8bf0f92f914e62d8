//! The imposed residual's prediction: the measured motor motion goes in, every other sensor comes out.

use sinew_effect::{Actuation, Kind, Reading, Relaxation, Sensor};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant};
use sinew_rigid::{Bodies, Scratch, inertias, mass_matrix_with};

use crate::record::{Channel, Record, START};

// A spring is simulated while its mode turns by less than this in a grid step; a stiffer one follows its load.
const FASTEST_TURN: f64 = 0.7;

// ω of the lead at the start, rad/s.
const LEAD: f64 = 60.0;

/// The degrees of freedom that move with their motor in this plant: rigid ones, and springs too stiff for the grid.
pub(crate) fn imposed_dofs(plant: &Plant, p: &[f64], record: &Record) -> Vec<bool> {
    let nv = plant.model().nv;
    let dynamics = Dynamics::new(plant, p);
    let middle = record.len() / 2;
    let q: Vec<f64> = record.theta.iter().map(|t| t[middle]).collect();
    let bodies_inertia = inertias::<f64>(plant.model());
    let armature = vec![0.0; nv];
    let bodies = Bodies {
        model: plant.model(),
        inertia: &bodies_inertia,
        gravity: plant.model().gravity,
        armature: &armature,
    };
    let mut mass = vec![0.0; nv * nv];
    mass_matrix_with(&bodies, &mut Scratch::new(plant.model()), &q, &mut mass);
    let mut stiffness: Vec<f64> = dynamics
        .coefficients()
        .compliance
        .iter()
        .map(|&c| if c > 0.0 { 1.0 / c } else { f64::INFINITY })
        .collect();
    for coupling in plant.couplings() {
        let n = coupling.dofs.len();
        for (k, &dof) in coupling.dofs.iter().enumerate() {
            stiffness[dof] = coupling.stiffness[k * n + k];
        }
    }
    (0..nv)
        .map(|i| {
            // ω h of the spring against its own link
            let turn = (stiffness[i] / mass[i * nv + i].max(1e-12)).sqrt() * record.scales.step();
            !(plant.elastic()[i] && turn < FASTEST_TURN)
        })
        .collect()
}

/// Predicted channels on the grid, in any kind of number.
pub(crate) fn predict<S: Kind>(
    plant: &Plant,
    p: &[S],
    record: &Record,
    channels: &[Channel],
    imposed: &[bool],
) -> Vec<Vec<S>> {
    let mut walk = Walk::new(plant, p, record, imposed);
    let mut series = Series::new(plant.model().nv, record.len());
    for k in 0..record.len() {
        walk.torque(k);
        series.store(k, &walk);
        if k + 1 < record.len() {
            walk.step(k);
        }
    }
    channels.iter().map(|c| series.channel(c, &walk.dynamics, record.scales.step())).collect()
}

// The raw predictions of every degree of freedom, before drives and sensors.
struct Series<S> {
    tau_m: Vec<Vec<S>>,
    tau_j: Vec<Vec<S>>,
    q: Vec<Vec<S>>,
    actuation: Vec<Actuation<S>>,
}

impl<S: Kind> Series<S> {
    fn new(nv: usize, len: usize) -> Self {
        let series = vec![Vec::with_capacity(len); nv];
        Self {
            tau_m: series.clone(),
            tau_j: series.clone(),
            q: series,
            actuation: vec![Actuation::default(); nv],
        }
    }

    // û = τ_m / gain;   q̂ = q where the spring is simulated, θ + e − τ_j/K ∓ gap where it follows its load
    fn store(&mut self, _k: usize, walk: &Walk<S>) {
        for i in 0..self.q.len() {
            self.tau_m[i].push(walk.out.tau_m[i] / walk.actuation[i].gain);
            self.tau_j[i].push(walk.out.tau_j[i]);
            let q = if walk.imposed[i] {
                let load = walk.out.tau_j[i];
                let gear = walk.dynamics.gears()[i];
                let gap = S::select(load.lt(S::ZERO), -gear.half_gap, gear.half_gap);
                walk.x.theta[i] + gear.shift - walk.dynamics.coefficients().compliance[i] * load - gap
            } else {
                walk.x.q[i]
            };
            self.q[i].push(q);
        }
        self.actuation.copy_from_slice(&walk.actuation);
    }

    fn channel(&self, channel: &Channel, dynamics: &Dynamics<S>, step: f64) -> Vec<S> {
        let i = channel.dof;
        let (mut series, mut delay) = match channel.sensor {
            Sensor::MotorTorque => {
                // logged = u(t + d) + T u̇: the inverse of lag and delay, on the noise-free prediction
                let (lag, dead) = (self.actuation[i].lag, self.actuation[i].delay);
                (led(&self.tau_m[i], lag, step), -dead)
            }
            Sensor::JointPosition => (self.q[i].clone(), S::ZERO),
            Sensor::JointTorque => (self.tau_j[i].clone(), S::ZERO),
        };
        let reading = dynamics.reading(channel.sensor)[i];
        delay += reading.delay;
        if delay != S::ZERO {
            series = shifted(&series, delay, step);
        }
        for x in &mut series {
            *x = *x * reading.gain + reading.offset;
        }
        series
    }
}

// x + T ẋ by central differences
fn led<S: Scalar>(x: &[S], lag: S, step: f64) -> Vec<S> {
    if lag == S::ZERO {
        return x.to_vec();
    }
    let last = x.len() - 1;
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        (x[b] - x[a]) / ((b - a) as f64 * step)
    };
    (0..x.len()).map(|k| x[k] + lag * slope(k)).collect()
}

// x(t − d) by the cubic through four neighbours
fn shifted<S: Scalar>(x: &[S], delay: S, step: f64) -> Vec<S> {
    let last = x.len() as isize - 1;
    let whole = (delay.value() / step).floor();
    // 0 ≤ f < 1 counts back from sample k − whole
    let f = delay / step - whole;
    let at = |k: isize| x[k.clamp(0, last) as usize];
    (0..x.len() as isize)
        .map(|k| {
            let k = k - whole as isize;
            let (a, b, c, d) = (at(k + 1), at(k), at(k - 1), at(k - 2));
            // Lagrange through f = −1, 0, 1, 2
            let (m, p, g) = (f - 1.0, f + 1.0, f - 2.0);
            -a * (f * m * g) / 6.0 + b * (p * m * g) / 2.0 - c * (p * f * g) / 2.0 + d * (p * f * m) / 6.0
        })
        .collect()
}

// The state along a run.
struct Walk<'a, S> {
    dynamics: Dynamics<'a, S>,
    record: &'a Record,
    imposed: &'a [bool],
    any_free: bool,
    x: LinkState<S>,
    stage: LinkState<S>,
    acceleration: Vec<S>,
    out: ImposedOut<S>,
    encoder: Vec<Reading<S>>,
    actuation: Vec<Actuation<S>>,
    relax: Vec<Relaxation<S>>,
    relax_next: Vec<Relaxation<S>>,
}

impl<'a, S: Kind> Walk<'a, S> {
    fn new(plant: &'a Plant, p: &[S], record: &'a Record, imposed: &'a [bool]) -> Self {
        let nv = plant.model().nv;
        let x = LinkState::zero(plant);
        let dynamics = Dynamics::new(plant, p);
        let mut walk = Self {
            encoder: dynamics.reading(Sensor::JointPosition),
            dynamics,
            record,
            imposed,
            any_free: imposed.iter().any(|&i| !i),
            stage: x.clone(),
            x,
            acceleration: vec![S::ZERO; nv],
            out: ImposedOut::new(nv),
            actuation: vec![Actuation::default(); nv],
            relax: vec![Relaxation::default(); plant.state_len()],
            relax_next: vec![Relaxation::default(); plant.state_len()],
        };
        walk.start();
        walk
    }

    // Static equilibrium of the springs under the load of the first pose: two rounds of q = θ − c τ_j.
    fn start(&mut self) {
        let nv = self.imposed.len();
        let all = vec![true; nv];
        self.set_motor(0);
        for i in 0..nv {
            (self.x.q[i], self.x.qd[i]) = (self.x.theta[i], self.x.thetad[i]);
        }
        if !self.any_free {
            return;
        }
        for _ in 0..2 {
            let motor = MotorMotion { acceleration: &self.acceleration, imposed: &all };
            let plant_q = self.x.q.clone();
            self.dynamics.imposed_motion(&self.x, motor, &mut self.out);
            for i in (0..nv).filter(|&i| !self.imposed[i]) {
                let load = self.out.tau_j[i] * self.dynamics.coefficients().compliance[i];
                self.x.q[i] = self.x.theta[i] - load;
            }
            if plant_q == self.x.q {
                break;
            }
        }
    }

    fn set_motor(&mut self, k: usize) {
        for i in 0..self.imposed.len() {
            self.x.theta[i] = S::constant(self.record.theta[i][k]);
            self.x.thetad[i] = S::constant(self.record.thetad[i][k]);
            self.acceleration[i] = S::constant(self.record.thetadd[i][k]);
            if self.imposed[i] {
                (self.x.q[i], self.x.qd[i]) = (self.x.theta[i], self.x.thetad[i]);
            }
        }
    }

    // Everything at grid step k.
    fn torque(&mut self, k: usize) {
        self.set_motor(k);
        let motor = MotorMotion { acceleration: &self.acceleration, imposed: self.imposed };
        self.dynamics.imposed_torque(&self.x, motor, &mut self.out);
        self.dynamics.actuation(&self.x, &mut self.actuation);
    }

    // From grid step k to k + 1: own states by their exact exponential, springs by Runge–Kutta.
    fn step(&mut self, k: usize) {
        let h = self.record.scales.step();
        let states = self.relax.len();
        if states > 0 {
            self.dynamics.relaxations(&self.x, &mut self.relax);
        }
        let z = self.x.z.clone();
        if self.any_free {
            self.runge_kutta(k, h, &z);
        }
        if states > 0 {
            // Rates of both ends, at the motion of the next step.
            self.stage.clone_from(&self.x);
            self.set_motor(k + 1);
            self.dynamics.relaxations(&self.x, &mut self.relax_next);
            for s in 0..states {
                let (a, b) = (self.relax[s], self.relax_next[s]);
                let mean = Relaxation { target: (a.target + b.target) * 0.5, rate: (a.rate + b.rate) * 0.5 };
                self.x.z[s] = relaxed(z[s], mean, h);
            }
        }
    }

    fn runge_kutta(&mut self, k: usize, h: f64, z: &[S]) {
        let nv = self.imposed.len();
        let free: Vec<usize> = (0..nv).filter(|&i| !self.imposed[i]).collect();
        let (q0, v0) = (self.x.q.clone(), self.x.qd.clone());
        self.lead(k, 0.0, h);
        let a1 = self.out.qdd.clone();
        let mut dq = vec![S::ZERO; nv];
        let mut dv = a1.clone();
        for &i in &free {
            dq[i] = v0[i];
        }
        let mut a_stage = a1;
        let mut v_stage = v0.clone();
        for (stage, share) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            self.motor_between(k, share, h);
            for &i in &free {
                self.x.q[i] = q0[i] + v_stage[i] * (share * h);
                self.x.qd[i] = v0[i] + a_stage[i] * (share * h);
            }
            for (s, r) in self.relax.iter().enumerate() {
                self.x.z[s] = relaxed(z[s], *r, share * h);
            }
            let motor = MotorMotion { acceleration: &self.acceleration, imposed: self.imposed };
            self.dynamics.imposed_motion(&self.x, motor, &mut self.out);
            self.lead(k, share, h);
            let weight = if stage == 3 { 1.0 } else { 2.0 };
            for &i in &free {
                v_stage[i] = self.x.qd[i];
                a_stage[i] = self.out.qdd[i];
                dq[i] += v_stage[i] * weight;
                dv[i] += a_stage[i] * weight;
            }
        }
        for &i in &free {
            self.x.q[i] = q0[i] + dq[i] * (h / 6.0);
            self.x.qd[i] = v0[i] + dv[i] * (h / 6.0);
        }
    }

    // The start of a spring is not known: for a moment its link is led to where its encoder saw it, or damped if it has
    // none, by a gain that fades away.
    //
    // q̈ ← q̈ + s (ω²(q_m − q) + 2ω(q̇_m − q̇)),   s = (1 − t/T)²
    fn lead(&mut self, k: usize, share: f64, h: f64) {
        let time = (k as f64 + share) * h;
        if time >= START {
            return;
        }
        let fade = (1.0 - time / START).powi(2);
        for i in (0..self.imposed.len()).filter(|&i| !self.imposed[i]) {
            let Some([q, qd]) = self.seen(i, k, share) else {
                self.out.qdd[i] += (self.x.thetad[i] - self.x.qd[i]) * (2.0 * LEAD * fade);
                continue;
            };
            // The encoder's own offset and lateness are taken out.
            let encoder = self.encoder[i];
            let true_q = (S::constant(q) - encoder.offset) / encoder.gain + encoder.delay * qd;
            let pull = (true_q - self.x.q[i]) * (LEAD * LEAD) - (self.x.qd[i] - qd) * (2.0 * LEAD);
            self.out.qdd[i] += pull * fade;
        }
    }

    fn seen(&self, dof: usize, k: usize, share: f64) -> Option<[f64; 2]> {
        let start = self.record.start[dof].as_ref()?;
        let (a, b) = (start.get(k)?, start.get(k + 1)?);
        Some([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])])
    }

    // The motor between two grid steps: the sample there, or the cubic through positions and velocities of both ends.
    fn motor_between(&mut self, k: usize, share: f64, h: f64) {
        if share == 1.0 {
            return self.set_motor(k + 1);
        }
        for i in 0..self.imposed.len() {
            let r = self.record;
            let (p0, p1) = (r.theta[i][k], r.theta[i][k + 1]);
            let (v0, v1) = (r.thetad[i][k], r.thetad[i][k + 1]);
            let (a0, a1) = (r.thetadd[i][k], r.thetadd[i][k + 1]);
            let [position, velocity, acceleration] = match &r.middle {
                Some([p, v, a]) => [p[i][k], v[i][k], a[i][k]],
                None => [
                    0.5 * (p0 + p1) + 0.125 * h * (v0 - v1),
                    1.5 * (p1 - p0) / h - 0.25 * (v0 + v1),
                    0.5 * (a0 + a1),
                ],
            };
            self.x.theta[i] = S::constant(position);
            self.x.thetad[i] = S::constant(velocity);
            self.acceleration[i] = S::constant(acceleration);
            if self.imposed[i] {
                (self.x.q[i], self.x.qd[i]) = (self.x.theta[i], self.x.thetad[i]);
            }
        }
    }
}

// z(h) = target + (z − target) e^(−rate·h)
fn relaxed<S: Scalar>(z: S, r: Relaxation<S>, h: f64) -> S {
    r.target + (z - r.target) * (-(r.rate * h)).exp()
}
