//! The plant driven by its motors: ẋ = f(x, τ_m).

use sinew_effect::{Act, Call, Kind, Relaxation};
use sinew_rigid::{forward_dynamics_with, kinetic_energy_with, potential_energy_with};

use crate::condensed::{By, Condensation};
use crate::{Dynamics, LinkState, Plant, PlantError};

/// The state of a driven plant; in rigid joints the motor's part repeats the link's.
pub type State<S> = LinkState<S>;

/// The rate of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Rates<S> {
    /// q̈.
    pub qdd: Vec<S>,
    /// θ̈; equals q̈ in rigid joints.
    pub thetadd: Vec<S>,
    /// ż of the effects' own states.
    pub zd: Vec<S>,
    /// Torque that the gears hand to the links, N·m.
    pub tau_j: Vec<S>,
    relaxation: Vec<Relaxation<S>>,
}

impl<S: Kind> Rates<S> {
    /// Room for the rates of `plant`.
    pub fn new(plant: &Plant) -> Self {
        let zeros = vec![S::ZERO; plant.model().nv];
        Self {
            qdd: zeros.clone(),
            thetadd: zeros.clone(),
            zd: vec![S::ZERO; plant.state_len()],
            tau_j: zeros,
            relaxation: vec![Relaxation::default(); plant.state_len()],
        }
    }
}

// Rounds of the fixed point between load-dependent friction and the load of rigid joints; each shrinks the error by
// the load coefficient, a few per cent.
const LOAD_ROUNDS: usize = 4;
// Rounds of that between coupled rotors and their links; each shrinks the error by the rotor's share in the inertia of
// its link, and by κB of a rigid joint in that of the joint: a few per cent, a fifth at worst.
const ROTOR_ROUNDS: usize = 16;

impl<S: Kind> Dynamics<'_, S> {
    /// Accelerations under the acting motor torque `tau_m` (gain, lag and delay of the drives already applied).
    ///
    /// ```text
    /// M q̈ + C q̇ + g = τ_j + f_link,   B θ̈ = τ_m − τ_j ∂δ/∂θ + f_motor  elastic joints
    /// (M + B) q̈ + C q̇ + g = τ_m + f_motor + f_link                     rigid joints
    ///  with −J_ωᵀ κB (θ̈ u + θ̇ ω × u) in f_link and −κB u·ω̇ in f_motor of rotors coupled with their links
    ///  M q̈ + C q̇ + g = −K_v q − D_v q̇                                  virtual joints; their τ_m is not looked at
    /// ```
    ///
    /// Quasi-static virtual joints are eliminated: their entries in the state are not looked at, their acceleration is
    /// zero, and [`Dynamics::settled`] says where they stand. An elastic joint's coordinate then counts with what links
    /// behind it bend.
    pub fn forward(&mut self, x: &State<S>, tau_m: &[S], out: &mut Rates<S>) {
        let plant = self.plant;
        let nv = plant.model.nv;
        let mut bent = self.settle(x, By::SpringsAndDampers);
        let stands = bent.as_ref().map_or(x, |c| &c.settled);
        self.springs(stands, |i| plant.elastic[i]);
        self.link_forces(stands);
        if let Some(bent) = &mut bent {
            self.change_of_levers(bent);
        }
        let stands = bent.as_ref().map_or(x, |c| &c.settled);
        for i in (0..nv).filter(|&i| !plant.elastic[i]) {
            self.tau_j[i] = if plant.driven[i] { tau_m[i] } else { S::ZERO };
        }
        if let Some(rotors) = &mut self.rotors {
            rotors.turn(&x.q, &x.qd);
            self.qdd.fill(S::ZERO);
            out.thetadd.fill(S::ZERO);
        }
        for _ in 0..self.rounds() {
            self.accelerate(x, bent.as_deref(), tau_m, &mut out.thetadd);
        }
        out.qdd.copy_from_slice(&self.qdd);
        out.tau_j.copy_from_slice(&self.tau_j);
        self.relaxations(stands, &mut out.relaxation);
        for (k, r) in out.relaxation.iter().enumerate() {
            out.zd[k] = r.rate * (r.target - x.z[k]);
        }
        self.condensation = bent;
    }

    fn rounds(&self) -> usize {
        match self.rotors {
            Some(_) => ROTOR_ROUNDS,
            None if self.loaded() && !self.plant.elastic.iter().all(|&e| e) => LOAD_ROUNDS,
            None => 1,
        }
    }

    // One round of q̈ and θ̈, from the load of rigid joints and the accelerations of the round before.
    fn accelerate(&mut self, x: &State<S>, bent: Option<&Condensation<S>>, tau_m: &[S], thetadd: &mut [S]) {
        let (plant, nv) = (self.plant, self.plant.model.nv);
        let torque = |i: usize| if plant.driven[i] { tau_m[i] } else { S::ZERO };
        self.motor_forces(bent.map_or(x, |c| &c.settled));
        if let Some(rotors) = &mut self.rotors {
            rotors.accelerate(&x.qd, &self.qdd);
            rotors.load_motors(&mut self.motor_force);
        }
        for i in 0..nv {
            let elastic = plant.elastic[i];
            let drive = if elastic { self.tau_j[i] } else { torque(i) + self.motor_force[i] };
            self.armature[i] = if elastic { S::ZERO } else { self.coefficients.rotor[i] };
            self.tau[i] = drive + self.link_force[i];
        }
        if let Some(rotors) = &mut self.rotors {
            rotors.load_links(&x.thetad, thetadd, &mut self.tau);
        }
        match bent {
            Some(bent) => bent.accelerate(self),
            None => {
                let bodies = Self::bodies(plant, &self.coefficients, &self.armature);
                let (scratch, tau, qdd) = (&mut self.scratch, &self.tau, &mut self.qdd);
                forward_dynamics_with(&bodies, scratch, &x.q, &x.qd, tau, qdd);
            }
        }
        for i in 0..nv {
            let (motor, rotor) = (torque(i) + self.motor_force[i], self.coefficients.rotor[i]);
            if plant.elastic[i] {
                thetadd[i] = (motor - self.reaction(i)) / rotor;
            } else {
                thetadd[i] = self.qdd[i];
                self.tau_j[i] = motor - rotor * self.qdd[i];
            }
        }
    }

    /// Total energy, J: kinetic of links and rotors, gravity, springs of joints and links, and what the effects store.
    ///
    /// ```text
    /// H = ½ q̇ᵀM q̇ + ½ θ̇ᵀB θ̇ + Σ κB θ̇ u·ω + V(q) + ½ δᵀK δ + ½ q_vᵀK_v q_v + Σ effects
    /// ```
    pub fn energy(&mut self, x: &State<S>) -> S {
        let plant = self.plant;
        let bent = self.settle(x, By::Springs);
        let stands = bent.as_ref().map_or(x, |c| &c.settled);
        let moves = bent.as_ref().map_or(x, |c| c.straight());
        self.springs(stands, |i| plant.elastic[i]);
        self.armature.fill(S::ZERO);
        let bodies = Self::bodies(plant, &self.coefficients, &self.armature);
        let mut sum = kinetic_energy_with(&bodies, &mut self.scratch, &moves.q, &moves.qd)
            + potential_energy_with(&bodies, &mut self.scratch, &stands.q);
        for i in 0..plant.model.nv {
            sum += self.coefficients.rotor[i] * x.thetad[i] * x.thetad[i] * 0.5;
            if !plant.coupled[i] {
                sum += self.stiffness[i] * self.deflection[i] * self.deflection[i] * 0.5;
            }
        }
        for coupling in &plant.couplings {
            let n = coupling.dofs.len();
            for (r, &i) in coupling.dofs.iter().enumerate() {
                for (c, &j) in coupling.dofs.iter().enumerate() {
                    sum += self.deflection[i] * self.deflection[j] * (0.5 * coupling.stiffness[r * n + c]);
                }
            }
        }
        if let Some(rotors) = &mut self.rotors {
            sum += rotors.energy(x);
        }
        for v in &plant.virtual_joints {
            sum += stands.q[v.dof] * stands.q[v.dof] * (0.5 * v.stiffness);
        }
        for k in 0..plant.effects.len() {
            let at = self.at(stands, k);
            S::call(plant.effect(k), &self.p[plant.range(k)], Call::Energy(&at, &mut sum));
        }
        self.condensation = bent;
        sum
    }
}

impl Plant {
    /// Refuses plants that a motor torque cannot drive: an elastic joint without rotor inertia.
    ///
    /// # Errors
    /// Names the first joint whose motor has no inertia.
    pub fn check_driven(&self) -> Result<(), PlantError> {
        let dynamics = Dynamics::new(self, &self.parameters());
        for dof in (0..self.model.nv).filter(|&i| self.elastic[i]) {
            if dynamics.coefficients().rotor[dof] <= 0.0 {
                let joint = self.model.dof_name(dof);
                return Err(PlantError::Unsupported {
                    robot: self.model.name.clone(),
                    what: format!("the elastic joint \"{joint}\" has a motor without inertia"),
                    help: format!("state `rotor_inertia` in [joints.{joint}]"),
                });
            }
        }
        Ok(())
    }

    /// True if some effect keeps states of its own.
    pub fn has_states(&self) -> bool {
        !self.acting(Act::State).is_empty()
    }
}
