//! Random states, and what an effect answers there.

use sinew_model::{Lanes, Model, Scalar};

use crate::{
    Act, Actuation, At, Call, Coefficients, Deflection, Derivative, Effect, Kind, LANES, Reading, Relaxation,
    Sensor, Wide,
};

/// Every act once; loaded motor forces are asked as motor forces.
pub(super) const ACTS: [Act; 8] = [
    Act::Coefficients,
    Act::Deflection,
    Act::SpringTorque,
    Act::LinkForce,
    Act::MotorForce,
    Act::State,
    Act::Actuation,
    Act::Reading,
];

// q, q̇, θ, θ̇, δ, δ̇, τ_J
const VECTORS: usize = 7;
// Temperature of the joints, °C.
const WARM: f64 = 30.0;

/// A state of the robot: seven vectors, then the own states.
#[derive(Debug, Clone)]
pub(super) struct Sample<S> {
    pub(super) numbers: Vec<S>,
    nv: usize,
    // No sweep of any velocity.
    still: Vec<f64>,
    temperature: Vec<Option<f64>>,
    before: Coefficients<S>,
    coefficients: Coefficients<S>,
}

impl Sample<f64> {
    /// At rest at zero, with the constants of `model`.
    pub(super) fn rest(model: &Model, states: usize) -> Self {
        let before = Coefficients::of(model);
        Self {
            numbers: vec![0.0; VECTORS * model.nv + states],
            nv: model.nv,
            still: vec![0.0; model.nv],
            temperature: vec![Some(WARM); model.nv],
            coefficients: before.clone(),
            before,
        }
    }
    /// Numbers of size one that keep off zero, where laws have their corners.
    pub(super) fn random(model: &Model, states: usize, random: &mut Random) -> Self {
        let mut x = Self::rest(model, states);
        for number in &mut x.numbers {
            let sign = if random.between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
            *number = sign * random.between(0.05, 1.0);
        }
        for dof in 0..model.nv {
            x.coefficients.coulomb[dof] = random.between(1.0, 2.0);
            x.coefficients.smoothing_velocity[dof] = random.between(0.1, 0.5);
        }
        x
    }
    /// The same state in another kind of number.
    pub(super) fn map<S: Scalar>(&self, f: impl Fn(f64) -> S) -> Sample<S> {
        Sample {
            numbers: self.numbers.iter().map(|&x| f(x)).collect(),
            nv: self.nv,
            still: self.still.clone(),
            temperature: self.temperature.clone(),
            before: constants(&self.before, S::constant),
            coefficients: constants(&self.coefficients, S::constant),
        }
    }
    /// Four states as the lanes of one.
    pub(super) fn side_by_side(four: &[Self]) -> Sample<Wide> {
        let mut wide = four[0].map(Wide::constant);
        for lane in 0..LANES {
            for (wide, number) in wide.numbers.iter_mut().zip(&four[lane].numbers) {
                wide.0[lane] = *number;
            }
        }
        for dof in 0..wide.nv {
            let of = |c: fn(&Coefficients<f64>) -> &Vec<f64>| {
                Lanes(core::array::from_fn(|lane| c(&four[lane].coefficients)[dof]))
            };
            wide.coefficients.coulomb[dof] = of(|c| &c.coulomb);
            wide.coefficients.smoothing_velocity[dof] = of(|c| &c.smoothing_velocity);
        }
        wide
    }
    /// The same state without torque through the gears.
    pub(super) fn without_load(&self) -> Self {
        let mut x = self.clone();
        x.numbers[6 * self.nv..7 * self.nv].fill(0.0);
        x
    }
    /// The same state with the own states where they go.
    pub(super) fn settled(&self, effect: &dyn Effect, p: &[f64]) -> Self {
        let mut x = self.clone();
        for (z, r) in x.numbers[VECTORS * self.nv..].iter_mut().zip(self.relaxations(effect, p)) {
            *z = r.target;
        }
        x
    }
    /// Where the own states go and how fast.
    pub(super) fn relaxations(&self, effect: &dyn Effect, p: &[f64]) -> Vec<Relaxation<f64>> {
        let mut out = vec![Relaxation::default(); effect.states()];
        if !out.is_empty() {
            effect.call_f64(p, Call::Relaxation(&self.at(), &mut out));
        }
        out
    }
    /// dU/dt along the motion of this state.
    pub(super) fn energy_rate(&self, effect: &dyn Effect, p: &[f64]) -> f64 {
        let nv = self.nv;
        let mut x = self.map(Derivative::constant);
        // q ← q̇, θ ← θ̇, δ ← δ̇
        for first in [0, 2 * nv, 4 * nv] {
            for k in first..first + nv {
                x.numbers[k].derivative[0] = self.numbers[k + nv];
            }
        }
        // ż = rate (target − z)
        for (k, r) in self.relaxations(effect, p).iter().enumerate() {
            let z = VECTORS * nv + k;
            x.numbers[z].derivative[0] = r.rate * (r.target - self.numbers[z]);
        }
        let p: Vec<_> = p.iter().map(|&x| Derivative::constant(x)).collect();
        energy(effect, &p, &x).derivative[0]
    }
}

impl<S> Sample<S> {
    /// The state as laws see it.
    pub(super) fn at(&self) -> At<'_, S> {
        let vector = |k: usize| &self.numbers[k * self.nv..(k + 1) * self.nv];
        At {
            q: vector(0),
            qd: vector(1),
            theta: vector(2),
            thetad: vector(3),
            thetad_sweep: &self.still,
            qd_sweep: &self.still,
            temperature: &self.temperature,
            deflection: vector(4),
            deflection_rate: vector(5),
            tau_j: vector(6),
            z: &self.numbers[VECTORS * self.nv..],
            coefficients: &self.coefficients,
        }
    }
}

/// What the effect does there to one of the things it may act on, number by number.
pub(super) fn answer<S: Kind>(effect: &dyn Effect, act: Act, p: &[S], x: &Sample<S>) -> Vec<S> {
    let (at, nv) = (x.at(), x.nv);
    let mut tau = vec![S::ZERO; nv];
    match act {
        Act::Coefficients => {
            let mut c = x.before.clone();
            S::call(effect, p, Call::Coefficients(&mut c));
            return numbers(&c);
        }
        Act::Deflection => {
            let mut gears = vec![Deflection::default(); nv];
            S::call(effect, p, Call::Deflection(&at, &mut gears));
            return gears.iter().flat_map(|d| [d.shift, d.slope, d.half_gap]).collect();
        }
        Act::State => {
            let mut z = vec![Relaxation::default(); effect.states()];
            if !z.is_empty() {
                S::call(effect, p, Call::Relaxation(&at, &mut z));
            }
            return z.iter().flat_map(|r| [r.target, r.rate]).collect();
        }
        Act::Actuation => {
            let mut drives = vec![Actuation::default(); nv];
            S::call(effect, p, Call::Actuation(&at, &mut drives));
            return drives.iter().flat_map(|a| [a.gain, a.lag, a.delay, a.limit]).collect();
        }
        Act::Reading => {
            let of = |sensor| {
                let mut readings = vec![Reading::default(); nv];
                S::call(effect, p, Call::Reading(sensor, &mut readings));
                readings.into_iter().flat_map(|r| [r.gain, r.offset, r.delay])
            };
            let sensors = [Sensor::MotorTorque, Sensor::JointPosition, Sensor::JointTorque];
            return sensors.into_iter().flat_map(of).collect();
        }
        Act::SpringTorque => S::call(effect, p, Call::SpringTorque(&at, &mut tau)),
        Act::LinkForce => S::call(effect, p, Call::LinkForce(&at, &mut tau)),
        Act::MotorForce | Act::LoadedMotorForce => S::call(effect, p, Call::MotorForce(&at, &mut tau)),
    }
    tau
}

/// The energy it stores there.
pub(super) fn energy<S: Kind>(effect: &dyn Effect, p: &[S], x: &Sample<S>) -> S {
    let mut sum = S::ZERO;
    S::call(effect, p, Call::Energy(&x.at(), &mut sum));
    sum
}

fn numbers<S: Scalar>(c: &Coefficients<S>) -> Vec<S> {
    let bodies = c.inertia.iter().flat_map(|i| {
        let (h, s) = (i.first_moment, i.second_moment);
        [i.mass, h.x, h.y, h.z, s.xx, s.yy, s.zz, s.xy, s.xz, s.yz]
    });
    let vectors =
        [&c.rotor, &c.compliance, &c.damping, &c.coulomb, &c.smoothing_velocity, &c.crosstalk, &c.rotor_link];
    bodies.chain(c.gravity.to_array()).chain(vectors.into_iter().flatten().copied()).collect()
}

fn constants<S: Scalar>(c: &Coefficients<f64>, f: impl Fn(f64) -> S + Copy) -> Coefficients<S> {
    let vector = |v: &Vec<f64>| v.iter().map(|&x| f(x)).collect();
    Coefficients {
        inertia: c.inertia.iter().map(sinew_model::Inertia::constant).collect(),
        gravity: sinew_model::Vector3::constant(c.gravity),
        rotor: vector(&c.rotor),
        compliance: vector(&c.compliance),
        damping: vector(&c.damping),
        coulomb: vector(&c.coulomb),
        smoothing_velocity: vector(&c.smoothing_velocity),
        crosstalk: vector(&c.crosstalk),
        rotor_link: vector(&c.rotor_link),
    }
}

/// Repeatable chance (splitmix64).
#[derive(Debug)]
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }
}
