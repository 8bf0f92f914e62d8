//! What the equations of motion are made of, before anything moves.

use sinew_model::{Inertia, Model, Scalar, Vector3};

/// The constants of a robot in one kind of number: effects of mass, gravity and springs act here, once for each set
/// of parameters, and cost nothing along a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficients<S> {
    /// The bodies, one for each joint of the model, in the joint's frame.
    pub inertia: Vec<Inertia<S>>,
    /// Acceleration of gravity in the world, m/s².
    pub gravity: Vector3<S>,
    /// B, reflected rotor inertia of each degree of freedom, kg·m².
    pub rotor: Vec<S>,
    /// 1/K of each degree of freedom, rad/(N·m); zero for a rigid joint.
    pub compliance: Vec<S>,
    /// D across the spring of each degree of freedom, N·m·s/rad.
    pub damping: Vec<S>,
    /// F_c, Coulomb torque on the motor side of each degree of freedom, N·m.
    pub coulomb: Vec<S>,
    /// v₀ of the smooth sign function sgn v ≈ tanh(v/v₀), rad/s.
    pub smoothing_velocity: Vec<S>,
    /// κ, nv × nv by rows: the share of the torque of drive j (column) that acts at joint i (row) besides that of its
    /// own drive.
    pub crosstalk: Vec<S>,
    /// s of each degree of freedom: how much of its rotor's spin its carrying link feels, 1 for all of it.
    pub rotor_link: Vec<S>,
}

/// v₀ where nothing states it, rad/s.
pub(crate) const SMOOTHING_VELOCITY: f64 = 2e-3;

impl<S: Scalar> Coefficients<S> {
    /// The constants of a rigid robot without rotors: what `model` says and nothing else.
    pub fn of(model: &Model) -> Self {
        let zeros = vec![S::ZERO; model.nv];
        Self {
            inertia: model.joints.iter().map(|j| Inertia::constant(&j.inertia)).collect(),
            gravity: Vector3::constant(model.gravity),
            rotor: zeros.clone(),
            compliance: zeros.clone(),
            damping: zeros.clone(),
            coulomb: zeros.clone(),
            rotor_link: zeros,
            smoothing_velocity: vec![S::constant(SMOOTHING_VELOCITY); model.nv],
            crosstalk: vec![S::ZERO; model.nv * model.nv],
        }
    }
}
