//! The plant with its motors' motion imposed: what the links do, and which torque the motors must give.

use sinew_effect::Kind;
use sinew_rigid::hybrid_dynamics_with;

use crate::{Dynamics, LinkState};

/// A motion of the motors, by degree of freedom, reflected.
#[derive(Debug, Clone, Copy)]
pub struct MotorMotion<'a, S> {
    /// θ̈.
    pub acceleration: &'a [S],
    /// True for the degrees of freedom that move with their motor; the springs of the others are simulated.
    pub imposed: &'a [bool],
}

/// What follows from an imposed motor motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedOut<S> {
    /// q̈.
    pub qdd: Vec<S>,
    /// Torque that the gears hand to the links, N·m.
    pub tau_j: Vec<S>,
    /// Torque that must act on the motors, N·m; filled by [`Dynamics::imposed_torque`] only.
    pub tau_m: Vec<S>,
}

impl<S: Kind> ImposedOut<S> {
    /// Room for `nv` degrees of freedom.
    pub fn new(nv: usize) -> Self {
        let zeros = vec![S::ZERO; nv];
        Self { qdd: zeros.clone(), tau_j: zeros.clone(), tau_m: zeros }
    }
}

impl<S: Kind> Dynamics<'_, S> {
    /// Accelerations of the links and torques of the gears. Where a joint is imposed, `x.q` and `x.qd` must
    /// equal the motor's.
    ///
    /// ```text
    /// M(q) q̈ + C q̇ + g = τ_j + f_link,   q̈ = θ̈ in joints that move with their motor
    /// ```
    pub fn imposed_motion(&mut self, x: &LinkState<S>, motor: MotorMotion<S>, out: &mut ImposedOut<S>) {
        self.springs(x, |i| !motor.imposed[i]);
        self.link_forces(x);
        let nv = self.plant.model.nv;
        for i in 0..nv {
            self.armature[i] = S::ZERO;
            self.qdd[i] = motor.acceleration[i];
            self.tau[i] = self.tau_j[i] + self.link_force[i];
        }
        let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
        let (qdd, tau) = (&mut self.qdd, &mut self.tau);
        hybrid_dynamics_with(&bodies, &mut self.scratch, &x.q, &x.qd, motor.imposed, qdd, tau);
        for i in (0..nv).filter(|&i| motor.imposed[i]) {
            self.tau_j[i] = self.tau[i] - self.link_force[i];
        }
        out.qdd.copy_from_slice(&self.qdd);
        out.tau_j.copy_from_slice(&self.tau_j);
    }

    /// As [`Dynamics::imposed_motion`], and the torque that must act on the motors.
    ///
    /// ```text
    /// τ_m = B θ̈ + τ_j − f_motor
    /// ```
    pub fn imposed_torque(&mut self, x: &LinkState<S>, motor: MotorMotion<S>, out: &mut ImposedOut<S>) {
        self.imposed_motion(x, motor, out);
        self.motor_forces(x);
        for i in 0..self.plant.model.nv {
            out.tau_m[i] =
                self.coefficients.rotor[i] * motor.acceleration[i] + self.tau_j[i] - self.motor_force[i];
        }
    }
}
