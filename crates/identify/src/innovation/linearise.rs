//! The equations of each joint, linearised along the reference.

use faer::Mat;

use sinew_effect::{Actuation, Derivative, Relaxation, Sensor};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedOut, LinkState, Plant};
use sinew_rigid::{Bodies, Scratch, mass_matrix_with};

use super::kalman::GROUP;
use super::step::Linear;
use crate::freedom::{Freedom, Links, Springs};
use crate::least_squares::Normal;
use crate::record::{Channel, Record};
use crate::series::Series;
use crate::walk::Walk;

/// What the model predicts along a reference, and how each joint answers to small deviations from it.
pub(super) struct Along {
    /// Channels at the middles of the holds.
    pub predicted: Vec<Vec<f64>>,
    /// Motor torques there as they act; empty of other channels.
    pub acting: Vec<Vec<f64>>,
    /// Equations by degree of freedom and hold; behind those of the robot's own joints those of its hinges.
    pub linear: Vec<Vec<Linear>>,
    /// Hinges that swing with the joints.
    pub hinges: usize,
    /// Where the links are; none of joints that move with their motor.
    pub links: Links,
    /// By how much the mean motor torque over a hold differs from that in its middle, by degree of freedom and hold.
    pub hold_means: Vec<Vec<f64>>,
    /// Inverse inertia, by rows, of joints and hinges at every [`INERTIA_EVERY`]th hold.
    pub mobility: Vec<Vec<f64>>,
    /// The drives, by degree of freedom.
    pub drives: Vec<Actuation<f64>>,
    /// Samples by which link positions and torques behind gears are read late, by degree of freedom.
    pub late: Vec<[isize; 2]>,
}

// Inertia of a motor of which none is stated, as a share of its link's.
const LEAST_ROTOR: f64 = 0.01;

// Directions of the derivatives: positions and velocities of the motors and of the links on springs, and those of the joints
// that are one body. Springs push these too, but that is their neighbours' doing.
const MOTOR: [usize; 2] = [0, 1];
const LINK: [usize; 2] = [2, 3];
const BOTH: [usize; 2] = [4, 5];
/// Holds after which the inertia is evaluated anew.
pub(super) const INERTIA_EVERY: usize = 8;
// Holds that the walk goes over while those before are linearised.
const TOGETHER: usize = 512;

/// The model along a record of a reference.
///
/// ```text
/// free joint        B θ̈̃ = δτ − ∂τ_m x̃,   push = ∂(τ_j + f_link) x̃ + δτ_ℓ
/// imposed joint     push = δτ − ∂τ_m x̃,   τ̃_j = ∂τ_j x̃ + (1 − B M⁻¹) push   of its own motion
/// hinge             push = ∂f_link x̃
/// bodies            q̈̃ = (M + B_imposed)⁻¹ push
/// ```
pub(super) fn along(plant: &Plant, p: &[f64], record: &Record, channels: &[Channel]) -> Along {
    let (nv, joints) = (plant.model().nv, plant.joints());
    let freedom = Freedom::of(plant, p, record, Springs::Simulated);
    let imposed = &freedom.imposed;
    let mut walk = Walk::new(Dynamics::new(plant, p), record, &freedom);
    let mut series = Series::new(channels, nv, record);
    let room = |imposed: &bool| (!imposed).then(|| Vec::with_capacity(record.len()));
    let mut links: Vec<Option<Vec<[f64; 3]>>> = joints.iter().map(|&i| room(&imposed[i])).collect();
    // τ_j at the instants of the walk, by degree of freedom, where springs swing in parts of a step.
    let parts = freedom.parts;
    let mut gears: Vec<Vec<f64>> = vec![Vec::new(); joints.len()];
    let mut push_gears = |walk: &Walk<f64>| {
        let swinging = gears.iter_mut().zip(joints).filter(|(_, i)| parts > 1 && !imposed[**i]);
        swinging.for_each(|(gear, &i)| gear.push(walk.out.tau_j[i]));
    };
    let mut walk_on = |k: usize| {
        walk.torque(k);
        push_gears(&walk);
        series.store(&walk.dynamics, &walk.x, &freedom, &walk.out, &walk.actuation);
        for (link, &i) in links.iter_mut().zip(joints) {
            link.iter_mut().for_each(|l| l.push([walk.x.q[i], walk.x.qd[i], walk.out.qdd[i]]));
        }
        let (acceleration, qdd) = (walk.acceleration.clone(), walk.out.qdd.clone());
        let instant = Instant { x: walk.x.clone(), acceleration, qdd };
        for part in 0..if k + 1 < record.len() { parts } else { 0 } {
            if part > 0 {
                walk.accelerations();
                push_gears(&walk);
            }
            walk.part(k, part);
        }
        instant
    };
    let mut equations = Linearisation::new(plant, p, record, &freedom);
    // While the walk goes over some holds, those before are linearised.
    let mut before: Vec<Instant> = Vec::new();
    for first in (0..record.len()).step_by(TOGETHER) {
        let walked = || (first..record.len().min(first + TOGETHER)).map(&mut walk_on).collect();
        (before, ()) = rayon::join(walked, || equations.extend(&before));
    }
    equations.extend(&before);
    let Linearisation { mobility, linear, mut hold_means, drags, hinges, .. } = equations;
    let acting = series.acting(&walk.dynamics);
    let predicted = series.logged(&walk.dynamics, record.scales.step()).channels;
    for (((means, drags), link), gear) in hold_means.iter_mut().zip(&drags).zip(&links).zip(&gears) {
        match link {
            Some(_) if parts > 1 => add_swings(means, gear, parts),
            Some(link) => add_drags(means, drags, link, record.scales.step()),
            None => {}
        }
    }
    let links = Links { motion: links };
    let drives = joints.iter().map(|&i| walk.actuation[i]).collect();
    let late =
        |sensor, i: usize| (walk.dynamics.reading(sensor)[i].delay / record.scales.step()).round() as isize;
    let late =
        joints.iter().map(|&i| [Sensor::JointPosition, Sensor::JointTorque].map(|s| late(s, i))).collect();
    Along { predicted, acting, linear, hinges: hinges.len(), links, hold_means, mobility, drives, late }
}

// h²/24 τ̈_m of a damper whose motor's velocity is the mean of the hold, its link's that in the middle:
// h²/24 ∂τ_m/∂q̇ q⃛,   q⃛_k = (q̈_{k+1} − q̈_{k−1})/2h
fn add_drags(means: &mut [f64], drags: &[f64], link: &[[f64; 3]], h: f64) {
    for k in 1..link.len().saturating_sub(1) {
        means[k] += h / 48.0 * drags[k] * (link[k + 1][2] - link[k - 1][2]);
    }
}

// The mean of τ_j over a hold less that in its middle, from so many instants in a hold: Simpson's rule, half of the weights
// before the middle and half after it.
fn add_swings(means: &mut [f64], gear: &[f64], parts: usize) {
    for k in 1..means.len().saturating_sub(1) {
        let hold = &gear[k * parts - parts / 2..=k * parts + parts / 2];
        let weight = |n: usize| match n {
            0 => 1.0,
            n if n == parts => 1.0,
            n if n % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let sum: f64 = hold.iter().enumerate().map(|(n, tau)| weight(n) * tau).sum();
        means[k] += sum / (3.0 * parts as f64) - hold[parts / 2];
    }
}

// Where the walk is in the middle of a hold.
struct Instant {
    x: LinkState<f64>,
    acceleration: Vec<f64>,
    qdd: Vec<f64>,
}

// The equations hold by hold, by degree of freedom.
struct Linearisation<'a> {
    record: &'a Record,
    freedom: &'a Freedom,
    hinges: Vec<usize>,
    dynamics: Dynamics<'a, f64>,
    dual: Dual<'a>,
    // At every so many holds.
    mobility: Vec<Vec<f64>>,
    linear: Vec<Vec<Linear>>,
    hold_means: Vec<Vec<f64>>,
    // ∂τ_m/∂q̇
    drags: Vec<Vec<f64>>,
}

impl<'a> Linearisation<'a> {
    fn new(plant: &'a Plant, p: &[f64], record: &'a Record, freedom: &'a Freedom) -> Self {
        let (nv, joints, hinges) = (plant.model().nv, plant.joints().len(), hinges(plant));
        let constants: Vec<Derivative> = p.iter().map(|&x| Derivative::constant(x)).collect();
        let mut dual = Dual {
            dynamics: Dynamics::new(plant, &constants),
            x: LinkState::zero(plant),
            acceleration: vec![Derivative::ZERO; nv],
            relaxations: vec![Relaxation::default(); plant.state_len()],
            out: ImposedOut::new(nv),
        };
        dual.seed(&freedom.imposed);
        fn rooms<T>(joints: usize, holds: usize) -> Vec<Vec<T>> {
            (0..joints).map(|_| Vec::with_capacity(holds)).collect()
        }
        Self {
            record,
            freedom,
            dynamics: Dynamics::new(plant, p),
            dual,
            mobility: Vec::with_capacity(record.len().div_ceil(INERTIA_EVERY)),
            linear: rooms(joints + hinges.len(), record.len()),
            hinges,
            hold_means: rooms(joints, record.len()),
            drags: rooms(joints, record.len()),
        }
    }

    // By the holds that follow.
    fn extend(&mut self, instants: &[Instant]) {
        let (record, freedom) = (self.record, self.freedom);
        let (imposed, h) = (&freedom.imposed, record.scales.step());
        let joints = self.dynamics.plant().joints();
        let bodies = joints.len() + self.hinges.len();
        for instant in instants {
            if self.linear.first().is_some_and(|holds| holds.len().is_multiple_of(INERTIA_EVERY)) {
                self.mobility.push(mobilities(&self.dynamics, &instant.x.q, imposed, &self.hinges));
            }
            let own = |body: usize| self.mobility.last().map_or(0.0, |m| m[body * bodies + body]);
            self.dual.evaluate(instant, freedom, h * record.scales.every as f64);
            for (body, &i) in self.hinges.iter().enumerate() {
                let body = joints.len() + body;
                self.linear[body].push(self.dual.linear_hinge(i, own(body)));
            }
            for (joint, &i) in joints.iter().enumerate() {
                self.linear[joint].push(self.dual.linear(i, imposed[i], own(joint)));
                let mean = self.dual.hold_mean(i, imposed[i], freedom.parts > 1, instant.qdd[i], h);
                self.hold_means[joint].push(mean);
                self.drags[joint].push(self.dual.out.tau_m[i].derivative[LINK[1]]);
            }
        }
    }
}

struct Dual<'a> {
    dynamics: Dynamics<'a, Derivative>,
    x: LinkState<Derivative>,
    acceleration: Vec<Derivative>,
    relaxations: Vec<Relaxation<Derivative>>,
    out: ImposedOut<Derivative>,
}

impl Dual<'_> {
    fn seed(&mut self, imposed: &[bool]) {
        for (i, &imposed) in imposed.iter().enumerate() {
            let [motor, link] = if imposed { [BOTH; 2] } else { [MOTOR, LINK] };
            self.x.theta[i].derivative[motor[0]] = 1.0;
            self.x.thetad[i].derivative[motor[1]] = 1.0;
            self.x.q[i].derivative[link[0]] = 1.0;
            self.x.qd[i].derivative[link[1]] = 1.0;
        }
    }

    // `row`: the time of a row, s.
    fn evaluate(&mut self, at: &Instant, freedom: &Freedom, row: f64) {
        self.x.set_values(&at.x);
        self.x.z.iter_mut().for_each(|z| z.derivative = Derivative::ZERO.derivative);
        self.torques(at, freedom);
        if !self.x.z.is_empty() {
            self.follow(row);
            self.torques(at, freedom);
        }
    }

    // Own states follow a deviation that lasts a row T as far as they do not forget it meanwhile; a loop of a gear is as stiff as its
    // spring.
    //
    // z̃ = ∂ż/∂ẋ x̃ / (1 + rate T)
    fn follow(&mut self, row: f64) {
        self.dynamics.relaxations(&self.x, &mut self.relaxations);
        for (z, to) in self.x.z.iter_mut().zip(&self.relaxations) {
            let slope = (to.rate * (to.target - *z)).derivative;
            for [position, velocity] in [MOTOR, LINK, BOTH] {
                z.derivative[position] = slope[velocity] / (1.0 + to.rate.value * row);
            }
        }
    }

    fn torques(&mut self, at: &Instant, freedom: &Freedom) {
        for (to, from) in self.acceleration.iter_mut().zip(&at.acceleration) {
            to.value = *from;
        }
        if freedom.is_free() {
            for (to, from) in self.out.qdd.iter_mut().zip(&at.qdd) {
                *to = Derivative::constant(*from);
            }
            return self.dynamics.gear_torque(&self.x, &self.acceleration, &mut self.out);
        }
        let motor = freedom.motion(&self.acceleration, &[]);
        self.dynamics.imposed_torque(&self.x, motor, &mut self.out);
    }

    // h²/24 τ̈_m ≈ h²/24 (∂τ_m/∂θ θ̈ + ∂τ_m/∂q q̈), without τ_j of a spring that swings in parts of a hold.
    fn hold_mean(&self, dof: usize, imposed: bool, in_parts: bool, qdd: f64, h: f64) -> f64 {
        let (slope, gear) = (self.out.tau_m[dof].derivative, self.out.tau_j[dof].derivative);
        let theta = self.acceleration[dof].value;
        let second_rate = match (imposed, in_parts) {
            (true, _) => slope[BOTH[0]] * theta,
            (false, true) => (slope[MOTOR[0]] - gear[MOTOR[0]]) * theta,
            (false, false) => slope[MOTOR[0]] * theta + slope[LINK[0]] * qdd,
        };
        h * h / 24.0 * second_rate
    }

    fn linear(&self, dof: usize, imposed: bool, mobility: f64) -> Linear {
        let tau_m = self.out.tau_m[dof].derivative;
        let mut linear = Linear { is_elastic: !imposed, link: mobility, ..Linear::default() };
        if imposed {
            linear.motor = mobility;
            let tau_j = self.out.tau_j[dof].derivative;
            let passed = 1.0 - self.dynamics.coefficients().rotor[dof].value * mobility;
            for s in 0..2 {
                linear.push[s] = -tau_m[BOTH[s]];
                linear.rate[s] = mobility * linear.push[s];
                linear.gear[s] = tau_j[BOTH[s]] - passed * tau_m[BOTH[s]];
            }
            linear.gear[2] = passed;
            return linear;
        }
        let rotor = self.dynamics.coefficients().rotor[dof].value.max(LEAST_ROTOR / mobility);
        let gear = self.out.tau_j[dof];
        let link = (gear + self.dynamics.link_force()[dof]).derivative;
        linear.motor = 1.0 / rotor;
        for s in 0..4 {
            linear.rate[s] = -tau_m[s] / rotor;
            linear.gear[s] = gear.derivative[s];
            linear.push[s] = link[s];
        }
        linear
    }

    // A hinge is one body; forces hold it alone.
    fn linear_hinge(&self, dof: usize, mobility: f64) -> Linear {
        let force = self.dynamics.link_force()[dof].derivative;
        let push = [force[LINK[0]], force[LINK[1]], 0.0, 0.0];
        Linear {
            rate: push.map(|push| mobility * push),
            motor: mobility,
            link: mobility,
            push,
            ..Linear::default()
        }
    }
}

// Hinges: virtual joints, of bending links and of effects that swing, as many as are carried along with the joints; of more
// only what they give way counts.
fn hinges(plant: &Plant) -> Vec<usize> {
    let hinges = (0..plant.model().nv).filter(|&dof| !plant.driven()[dof]);
    hinges.take(GROUP.saturating_sub(plant.joints().len())).collect()
}

// Inverse of the inertia of the links, with the motors of imposed joints, by rows, for joints and hinges.
fn mobilities(dynamics: &Dynamics<f64>, q: &[f64], imposed: &[bool], hinges: &[usize]) -> Vec<f64> {
    let (plant, coefficients) = (dynamics.plant(), dynamics.coefficients());
    let nv = imposed.len();
    let rotor = |i: usize| if imposed[i] { coefficients.rotor[i] } else { 0.0 };
    let armature: Vec<f64> = (0..nv).map(rotor).collect();
    let bodies = Bodies {
        model: plant.model(),
        inertia: &coefficients.inertia,
        gravity: coefficients.gravity,
        armature: &armature,
    };
    let mut mass = vec![0.0; nv * nv];
    let all = || plant.joints().iter().chain(hinges).copied();
    mass_matrix_with(&bodies, &mut Scratch::new(plant.model()), q, &mut mass);
    let Some(normal) = Normal::new(&Mat::from_fn(nv, nv, |i, j| mass[i * nv + j])) else {
        let alone = |i: usize, j: usize| if i == j { 1.0 / mass[i * (nv + 1)].max(1e-9) } else { 0.0 };
        return all().flat_map(|i| all().map(move |j| alone(i, j))).collect();
    };
    let inverse = &normal.solve_many(&Mat::<f64>::identity(nv, nv));
    all().flat_map(|i| all().map(move |j| inverse[(i, j)])).collect()
}
