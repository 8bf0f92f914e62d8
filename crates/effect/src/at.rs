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
    /// By how much the motor velocity changes over the time that the forces are the mean of; zero at an instant.
    pub thetad_sweep: &'a [f64],
    /// By how much the link velocity does.
    pub qd_sweep: &'a [f64],
    /// Temperature of each joint, °C; none where nobody told it.
    pub temperature: &'a [Option<f64>],
    /// The effect's own states.
    pub z: &'a [S],
    /// The constants of the robot.
    pub coefficients: &'a Coefficients<S>,
}

impl<S: Scalar> At<'_, S> {
    /// The smooth sign of the motor velocity, tanh(θ̇/v₀), or its mean over a sweep of the velocity.
    #[inline(always)]
    pub fn motor_sign(&self, dof: usize) -> S {
        sign(self.thetad[dof], self.thetad_sweep[dof], self.coefficients.smoothing_velocity[dof])
    }
    /// The smooth sign of the link velocity, tanh(q̇/v₀) of width v₀, or its mean over a sweep of the velocity.
    #[inline(always)]
    pub fn link_sign(&self, dof: usize, width: S) -> S {
        sign(self.qd[dof], self.qd_sweep[dof], width)
    }
}

// Widths v₀ beyond which a sign is one, and below which a sweep is none.
const FAR: f64 = 40.0;
const NARROW: f64 = 1e-3;

// The mean of tanh(v/v₀) from v − w/2 to v + w/2:  v₀/w (ln cosh((v + w/2)/v₀) − ln cosh((v − w/2)/v₀))
#[inline(always)]
fn sign<S: Scalar>(v: S, sweep: f64, width: S) -> S {
    let (half, v0) = (0.5 * sweep.abs(), width.value());
    if half < NARROW * v0 || v.value().abs() > half + FAR * v0 {
        return (v / width).tanh();
    }
    (ln_cosh((v + half) / width) - ln_cosh((v - half) / width)) * width / (2.0 * half)
}

// ln cosh x + ln 2 = |x| + ln(1 + e^(−2|x|))
#[inline(always)]
fn ln_cosh<S: Scalar>(x: S) -> S {
    let size = x.abs();
    size + ((size * -2.0).exp() + 1.0).ln()
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
/// acting torque = gain · lag(delay(clamp(logged torque, ±1/limit)))
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation<S> {
    /// Acting by logged torque; one for an ideal drive.
    pub gain: S,
    /// Time constant of a first-order lag, s.
    pub lag: S,
    /// Dead time, s.
    pub delay: S,
    /// One by the largest torque that the drive gives, 1/(N·m); zero for a drive that gives any.
    pub limit: S,
}

impl<S: Scalar> Actuation<S> {
    /// By how much a logged torque is beyond what the drive gives.
    ///
    /// ```text
    /// u − clamp(u, ±1/limit)
    /// ```
    ///
    /// # Example
    /// ```
    /// use sinew_effect::Actuation;
    /// let drive = Actuation { limit: 1.0 / 25.0, ..Actuation::default() };
    /// assert_eq!([20.0, 50.0, -100.0].map(|u| drive.excess(u)), [0.0, 25.0, -75.0]);
    /// ```
    #[inline(always)]
    pub fn excess(&self, logged: f64) -> S {
        if logged == 0.0 {
            return S::ZERO;
        }
        // u (1 − 1/(|u| limit)) where |u| limit > 1
        let beyond = self.limit * logged.abs();
        let safe = S::select(S::ONE.lt(beyond), beyond, S::ONE);
        (S::ONE - safe.recip()) * logged
    }
}

impl<S: Scalar> Default for Actuation<S> {
    fn default() -> Self {
        Self { gain: S::ONE, lag: S::ZERO, delay: S::ZERO, limit: S::ZERO }
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

#[cfg(test)]
mod tests {
    use super::*;

    // The mean of tanh(v/v₀) by 2000 midpoints.
    #[test]
    fn a_swept_sign_is_the_mean_of_signs() {
        let v0 = 2e-3;
        for (v, sweep) in [(0.0, 0.01), (1e-3, 5e-3), (-4e-3, 0.01), (0.03, 0.02), (0.2, 0.3), (1e-3, 1e-9)] {
            let n = 2000;
            let at = |k: i32| v + sweep * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
            let mean = (0..n).map(|k| (at(k) / v0).tanh()).sum::<f64>() / f64::from(n);
            let swept = sign(v, sweep, v0);
            assert!((swept - mean).abs() < 1e-5, "{v} {sweep}: {swept} {mean}");
        }
    }
}
