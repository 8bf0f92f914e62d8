//! A plant with one set of parameters, in one kind of number, ready to be evaluated along a run.

use sinew_effect::{
    Act, Actuation, At, Call, Coefficients, Deflection, Derivative, Kind, Reading, Relaxation, Sensor,
};
use sinew_model::Scalar;
use sinew_rigid::{Bodies, Scratch};

use crate::Plant;
use crate::condensed::Condensation;
use crate::rotors::Rotors;

/// The positions and velocities on both sides of the gears, by degree of freedom, and the effects' own states.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkState<S> {
    /// Link-side position.
    pub q: Vec<S>,
    /// Link-side velocity.
    pub qd: Vec<S>,
    /// Motor-side position, reflected.
    pub theta: Vec<S>,
    /// Motor-side velocity, reflected.
    pub thetad: Vec<S>,
    /// By how much the motor velocity changes over the time that the forces are the mean of; zero at an instant.
    pub thetad_sweep: Vec<f64>,
    /// By how much the link velocity does.
    pub qd_sweep: Vec<f64>,
    /// Temperature of the joints, °C; none where nobody told it.
    pub temperature: Vec<Option<f64>>,
    /// Own states of the effects, stacked.
    pub z: Vec<S>,
}

impl<S: Scalar> LinkState<S> {
    /// At rest at zero.
    pub fn zero(plant: &Plant) -> Self {
        let zeros = vec![S::ZERO; plant.model().nv];
        Self {
            q: zeros.clone(),
            qd: zeros.clone(),
            theta: zeros.clone(),
            thetad: zeros,
            thetad_sweep: vec![0.0; plant.model().nv],
            qd_sweep: vec![0.0; plant.model().nv],
            temperature: vec![None; plant.model().nv],
            z: vec![S::ZERO; plant.state_len()],
        }
    }
}

impl LinkState<Derivative> {
    /// Takes the values of a state and keeps the derivatives.
    pub fn set_values(&mut self, from: &LinkState<f64>) {
        for (to, from) in [
            (&mut self.q, &from.q),
            (&mut self.qd, &from.qd),
            (&mut self.theta, &from.theta),
            (&mut self.thetad, &from.thetad),
            (&mut self.z, &from.z),
        ] {
            to.iter_mut().zip(from).for_each(|(to, from)| to.value = *from);
        }
        self.thetad_sweep.copy_from_slice(&from.thetad_sweep);
        self.qd_sweep.copy_from_slice(&from.qd_sweep);
        self.temperature.copy_from_slice(&from.temperature);
    }
}

/// A plant with one set of parameters. Buffers are its own, so evaluations do not allocate.
#[derive(Debug)]
pub struct Dynamics<'a, S> {
    pub(crate) plant: &'a Plant,
    pub(crate) p: Vec<S>,
    pub(crate) coefficients: Coefficients<S>,
    pub(crate) stiffness: Vec<S>,
    pub(crate) armature: Vec<S>,
    pub(crate) scratch: Scratch<S>,
    pub(crate) deflection: Vec<S>,
    pub(crate) deflection_rate: Vec<S>,
    pub(crate) tau_j: Vec<S>,
    pub(crate) link_force: Vec<S>,
    pub(crate) motor_force: Vec<S>,
    pub(crate) tau: Vec<S>,
    pub(crate) qdd: Vec<S>,
    gears: Vec<Deflection<S>>,
    acting: Acting,
    pub(crate) condensation: Option<Box<Condensation<S>>>,
    pub(crate) rotors: Option<Box<Rotors<'a, S>>>,
    // Some drive acts at a joint that is not its own.
    crosstalk: bool,
}

#[derive(Debug)]
struct Acting {
    deflection: Vec<usize>,
    spring: Vec<usize>,
    link: Vec<usize>,
    motor: Vec<usize>,
    state: Vec<usize>,
    actuation: Vec<usize>,
    reading: Vec<usize>,
    loaded: bool,
}

// Terms of the inverse of 1 + κ: exact where no drives couple in a ring, to κ⁸ where two do.
const CROSSTALK_TERMS: usize = 8;

// Damping left in the gap of a backlash, as a share of D.
const GAP_DAMPING: f64 = 0.02;

impl<'a, S: Kind> Dynamics<'a, S> {
    /// The plant at parameters `p`, in the order of [`Plant::parameters`].
    ///
    /// # Panics
    /// If `p` has the wrong length.
    pub fn new(plant: &'a Plant, p: &[S]) -> Self {
        Self::of_some(plant, p, |_| true, |_| true)
    }

    /// The plant in which only some effects act: gears are bent by the effects for which `bends` holds, forces come
    /// from those for which `acts` holds. Constants, drives, sensors and own states are those of all effects.
    ///
    /// An effect whose strengths are all zero can be left out without a change; a derivative along the parameters of
    /// a few effects needs the forces of these few only.
    ///
    /// # Panics
    /// If `p` has the wrong length.
    pub fn of_some(
        plant: &'a Plant,
        p: &[S],
        bends: impl Fn(usize) -> bool,
        acts: impl Fn(usize) -> bool,
    ) -> Self {
        let expected = plant.ranges.last().map_or(0, |r| r.end);
        assert_eq!(p.len(), expected, "p: the plant has {expected} parameters");
        let mut coefficients = Coefficients::of(&plant.model);
        for k in plant.acting(Act::Coefficients) {
            S::call(plant.effect(k), &p[plant.range(k)], Call::Coefficients(&mut coefficients));
        }
        let zeros = vec![S::ZERO; plant.model.nv];
        let forces = |act| -> Vec<usize> { plant.acting(act).into_iter().filter(|&k| acts(k)).collect() };
        let mut motor = forces(Act::MotorForce);
        let loaded = forces(Act::LoadedMotorForce);
        motor.extend(&loaded);
        Self {
            plant,
            p: p.to_vec(),
            stiffness: coefficients.compliance.iter().map(|&c| stiffness(c)).collect(),
            crosstalk: coefficients.crosstalk.iter().any(|&share| share != S::ZERO),
            armature: zeros.clone(),
            condensation: Condensation::new(plant),
            rotors: Rotors::new(&plant.model, &plant.mounts, &coefficients).map(Box::new),
            coefficients,
            scratch: Scratch::new(&plant.model),
            deflection: zeros.clone(),
            deflection_rate: zeros.clone(),
            tau_j: zeros.clone(),
            link_force: zeros.clone(),
            motor_force: zeros.clone(),
            tau: zeros.clone(),
            qdd: zeros,
            gears: vec![Deflection::default(); plant.model.nv],
            acting: Acting {
                deflection: plant.acting(Act::Deflection).into_iter().filter(|&k| bends(k)).collect(),
                spring: forces(Act::SpringTorque),
                link: forces(Act::LinkForce),
                motor,
                state: plant.acting(Act::State),
                actuation: plant.acting(Act::Actuation),
                reading: plant.acting(Act::Reading),
                loaded: !loaded.is_empty(),
            },
        }
    }

    /// The constants of the robot at these parameters.
    pub fn coefficients(&self) -> &Coefficients<S> {
        &self.coefficients
    }
    /// S, nv × nv by columns, of rotors coupled with their links: what a link's velocity (column) adds to the momentum of a
    /// motor (row), with links at `q`. None where no rotor is coupled.
    pub fn rotor_link_coupling(&mut self, q: &[S]) -> Option<Vec<S>> {
        self.rotors.as_mut().map(|rotors| rotors.coupling(q))
    }
    /// Position error and free play of every gear, at the state last evaluated.
    pub fn gears(&self) -> &[Deflection<S>] {
        &self.gears
    }
    /// Forces of the effects, of bending links' own springs and of rotors on the links, N·m, at the state last evaluated.
    pub fn link_force(&self) -> &[S] {
        &self.link_force
    }
    /// The plant.
    pub fn plant(&self) -> &'a Plant {
        self.plant
    }
    /// True if some motor force depends on the load.
    pub(crate) fn loaded(&self) -> bool {
        self.acting.loaded
    }

    pub(crate) fn bodies<'b>(
        plant: &'b Plant,
        coefficients: &'b Coefficients<S>,
        armature: &'b [S],
    ) -> Bodies<'b, S> {
        Bodies {
            model: &plant.model,
            inertia: &coefficients.inertia,
            gravity: coefficients.gravity,
            armature,
        }
    }

    // δ = dz(θ + shift − q),   δ̇ = θ̇ (1 + slope) − q̇,   τ_j = K δ + D δ̇ + Σ effects;   only where `elastic`
    pub(crate) fn springs(&mut self, x: &LinkState<S>, elastic: impl Fn(usize) -> bool) {
        self.deflection.fill(S::ZERO);
        self.deflection_rate.fill(S::ZERO);
        self.gears.fill(Deflection::default());
        self.tau_j.fill(S::ZERO);
        let nv = self.plant.model.nv;
        let mut gears = core::mem::take(&mut self.gears);
        self.each(x, Group::Deflection, |effect, p, at| S::call(effect, p, Call::Deflection(at, &mut gears)));
        for i in (0..nv).filter(|&i| elastic(i)) {
            let raw = x.theta[i] + gears[i].shift - x.q[i];
            let gap = gears[i].half_gap;
            let size = raw.abs();
            let inside = size.lt(gap);
            let beyond = raw - S::select(raw.lt(S::ZERO), -gap, gap);
            self.deflection[i] = S::select(inside, S::ZERO, beyond);
            self.deflection_rate[i] = x.thetad[i] * (gears[i].slope + 1.0) - x.qd[i];
            if !self.plant.coupled[i] {
                let d = self.coefficients.damping[i];
                let d = S::select(inside, d * GAP_DAMPING, d);
                self.tau_j[i] = self.stiffness[i] * self.deflection[i] + d * self.deflection_rate[i];
            }
        }
        self.gears = gears;
        for coupling in &self.plant.couplings {
            let n = coupling.dofs.len();
            for (r, &i) in coupling.dofs.iter().enumerate() {
                for (c, &j) in coupling.dofs.iter().enumerate() {
                    self.tau_j[i] += self.deflection[j] * coupling.stiffness[r * n + c]
                        + self.deflection_rate[j] * coupling.damping[r * n + c];
                }
            }
        }
        let mut tau_j = core::mem::take(&mut self.tau_j);
        self.each(x, Group::Spring, |effect, p, at| S::call(effect, p, Call::SpringTorque(at, &mut tau_j)));
        self.tau_j = tau_j;
    }

    // What a gear asks of its motor: τ_j ∂δ/∂θ = τ_j (1 + slope).
    pub(crate) fn reaction(&self, dof: usize) -> S {
        self.tau_j[dof] * (self.gears[dof].slope + 1.0)
    }

    pub(crate) fn link_forces(&mut self, x: &LinkState<S>) {
        let mut force = core::mem::take(&mut self.link_force);
        force.fill(S::ZERO);
        self.each(x, Group::Link, |effect, p, at| S::call(effect, p, Call::LinkForce(at, &mut force)));
        for v in &self.plant.virtual_joints {
            // τ_v = −K q_v − D q̇_v
            force[v.dof] -= x.q[v.dof] * v.stiffness + x.qd[v.dof] * v.damping;
        }
        self.link_force = force;
    }

    // Needs τ_j.
    pub(crate) fn motor_forces(&mut self, x: &LinkState<S>) {
        let mut force = core::mem::take(&mut self.motor_force);
        force.fill(S::ZERO);
        self.each(x, Group::Motor, |effect, p, at| S::call(effect, p, Call::MotorForce(at, &mut force)));
        self.motor_force = force;
    }

    /// Where the own states go and how fast, at the state last evaluated.
    pub fn relaxations(&self, x: &LinkState<S>, out: &mut [Relaxation<S>]) {
        self.relaxations_of(&self.acting.state, x, out);
    }

    /// [`Dynamics::relaxations`] of some effects; the places of others are left as they are.
    pub fn relaxations_of(&self, effects: &[usize], x: &LinkState<S>, out: &mut [Relaxation<S>]) {
        let plant = self.plant;
        for &k in effects {
            let call = |at: &At<S>, z: &mut [Relaxation<S>]| {
                S::call(plant.effect(k), &self.p[plant.range(k)], Call::Relaxation(at, z));
            };
            call(&self.at(x, k), &mut out[plant.states[k].clone()]);
        }
    }

    /// The path from logged to acting motor torque at the motor motion of `x`.
    pub fn actuation(&mut self, x: &LinkState<S>, out: &mut [Actuation<S>]) {
        out.fill(Actuation::default());
        self.each(x, Group::Actuation, |effect, p, at| S::call(effect, p, Call::Actuation(at, out)));
    }

    /// Adds to the torque of every drive what the others give beside it.
    ///
    /// ```text
    /// τ_m = (1 + κ) τ_drive
    /// ```
    pub fn add_crosstalk(&self, tau: &mut [S]) {
        if self.crosstalk {
            let drives = tau.to_vec();
            for (i, tau) in tau.iter_mut().enumerate() {
                *tau += self.beside(i, &drives);
            }
        }
    }

    /// The torques of the drives that together give `tau_m`, into `drives`.
    ///
    /// ```text
    /// τ_drive = (1 + κ)⁻¹ τ_m = τ_m − κ τ_m + κ² τ_m − …
    /// ```
    pub fn of_drives(&self, tau_m: &[S], drives: &mut [S]) {
        drives.copy_from_slice(tau_m);
        if !self.crosstalk {
            return;
        }
        let mut before = drives.to_vec();
        for _ in 0..CROSSTALK_TERMS {
            for (i, (drive, tau)) in drives.iter_mut().zip(tau_m).enumerate() {
                *drive = *tau - self.beside(i, &before);
            }
            before.copy_from_slice(drives);
        }
    }

    // Σ_j κ_ij τ_j
    fn beside(&self, i: usize, drives: &[S]) -> S {
        let row = &self.coefficients.crosstalk[i * drives.len()..(i + 1) * drives.len()];
        row.iter().zip(drives).fold(S::ZERO, |sum, (share, tau)| sum + *share * *tau)
    }

    /// The errors of one sensor in every joint.
    pub fn reading(&self, sensor: Sensor) -> Vec<Reading<S>> {
        let mut out = vec![Reading::default(); self.plant.model.nv];
        for &k in &self.acting.reading {
            S::call(self.plant.effect(k), &self.p[self.plant.range(k)], Call::Reading(sensor, &mut out));
        }
        out
    }

    pub(crate) fn at<'s>(&'s self, x: &'s LinkState<S>, effect: usize) -> At<'s, S> {
        At {
            q: &x.q,
            qd: &x.qd,
            theta: &x.theta,
            thetad: &x.thetad,
            thetad_sweep: &x.thetad_sweep,
            qd_sweep: &x.qd_sweep,
            temperature: &x.temperature,
            deflection: &self.deflection,
            deflection_rate: &self.deflection_rate,
            tau_j: &self.tau_j,
            z: &x.z[self.plant.states[effect].clone()],
            coefficients: &self.coefficients,
        }
    }

    fn each(
        &self,
        x: &LinkState<S>,
        group: Group,
        mut ask: impl FnMut(&dyn sinew_effect::Effect, &[S], &At<S>),
    ) {
        let list = match group {
            Group::Deflection => &self.acting.deflection,
            Group::Spring => &self.acting.spring,
            Group::Link => &self.acting.link,
            Group::Motor => &self.acting.motor,
            Group::Actuation => &self.acting.actuation,
        };
        for &k in list {
            ask(self.plant.effect(k), &self.p[self.plant.range(k)], &self.at(x, k));
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Group {
    Deflection,
    Spring,
    Link,
    Motor,
    Actuation,
}

// 1/c; a rigid joint (c = 0) has no spring torque of its own.
fn stiffness<S: Scalar>(compliance: S) -> S {
    if compliance.value() == 0.0 { S::ZERO } else { compliance.recip() }
}
