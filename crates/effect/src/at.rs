//! Where an effect is evaluated, and what it may add to.

use sinew_model::Scalar;

use crate::Coefficients;

/// The state of the robot as a law sees it. Slices are by degree of freedom.
#[derive(Debug, Clone, Copy)]
pub struct At<'a, S> {
    /// Link-side position, rad (m).
    pub q: &'a [S],
    /// Link-side velocity.
    pub qd: &'a [S],
    /// Motor-side position reflected to the link side; equals `q` in rigid joints.
    pub theta: &'a [S],
    /// Motor-side velocity; equals `qd` in rigid joints.
    pub thetad: &'a [S],
    /// Deflection of the spring after transmission error and gap; zero in rigid joints.
    pub deflection: &'a [S],
    /// Rate of the deflection: θ̇ (1 + slope) − q̇, see [`Deflection`].
    pub deflection_rate: &'a [S],
    /// Torque that the gear hands to the link, N·m. Known to motor forces; zero for spring and link forces.
    pub tau_j: &'a [S],
    /// The effect's own states.
    pub z: &'a [S],
    /// The constants of the robot.
    pub coefficients: &'a Coefficients<S>,
}

impl<S: Scalar> At<'_, S> {
    /// The smooth sign of the motor velocity, tanh(θ̇/v₀).
    #[inline(always)]
    pub fn motor_sign(&self, dof: usize) -> S {
        (self.thetad[dof] / self.coefficients.smoothing_velocity[dof]).tanh()
    }
    /// The smooth sign of the link velocity, tanh(q̇/v₀).
    #[inline(always)]
    pub fn link_sign(&self, dof: usize) -> S {
        (self.qd[dof] / self.coefficients.smoothing_velocity[dof]).tanh()
    }
}

/// How the gear bends position before its spring.
///
/// ```text
/// δ = dz(θ + shift(θ) − q, half_gap),   δ̇ = θ̇ (1 + slope) − q̇,   slope = ∂shift/∂θ
/// ```
///
/// What the spring hands to the link acts on the motor multiplied by ∂δ/∂θ = 1 + slope: a gear makes no energy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deflection<S> {
    /// Position error of the gear, rad.
    pub shift: S,
    /// Its derivative with respect to the motor's position.
    pub slope: S,
    /// Half of the free play, rad.
    pub half_gap: S,
}

/// What lies between the logged motor torque and the torque that acts.
///
/// ```text
/// acting torque = gain · lag(delay(logged torque))
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation<S> {
    /// Acting by logged torque; one for an ideal drive.
    pub gain: S,
    /// Time constant of a first-order lag, s.
    pub lag: S,
    /// Dead time, s.
    pub delay: S,
}

impl<S: Scalar> Default for Actuation<S> {
    fn default() -> Self {
        Self { gain: S::ONE, lag: S::ZERO, delay: S::ZERO }
    }
}

/// A sensor of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sensor {
    /// The logged motor torque.
    MotorTorque,
    /// The link-side encoder.
    JointPosition,
    /// The torque sensor between gear and link.
    JointTorque,
}

/// The error of a sensor: reads gain · (true value a delay ago) + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading<S> {
    /// Reading by true value; one for an ideal sensor.
    pub gain: S,
    /// Reading at zero.
    pub offset: S,
    /// How late the reading is, s.
    pub delay: S,
}

impl<S: Scalar> Default for Reading<S> {
    fn default() -> Self {
        Self { gain: S::ONE, offset: S::ZERO, delay: S::ZERO }
    }
}

/// How an own state moves: ż = rate · (target − z).
///
/// Every memory of the catalogue has this form, so a simulator may integrate ż and a fitter may step exactly,
/// z ← target + (z − target) e^(−rate·Δt), however fast the state is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Relaxation<S> {
    /// Where the state goes.
    pub target: S,
    /// How fast, 1/s; not negative.
    pub rate: S,
}
