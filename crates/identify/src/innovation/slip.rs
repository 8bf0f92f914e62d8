//! How far a motor moves while its torque is held.
//!
//! Friction near rest takes a motor to its velocity within a fraction of a hold, so that its mean velocity is not that of the
//! ends. A smoother's step is linear about the motion that was there before: what it gets wrong by that stays in the
//! positions of the reference, and friction is told by the mean velocity between them.

use super::linearise::Along;
use super::motion::Motion;
use super::step::Linear;

// Decay over a hold above which friction decides how far a motor moves.
const STIFF: f64 = 1.0;
// (ω h)² of a motor on its spring up to which the torque of the spring bends evenly over a hold.
const EVEN: f64 = 0.25;
// Decay over a hold below which its mean is that of a parabola.
const SMALL: f64 = 1e-3;

/// By how much farther a motor moves in hold k than between the positions of the reference, as far as the model tells; of what
/// is neither on a spring nor near rest, and of torques that are not held as they were read (`is_held`), it tells nothing.
///
/// ```text
/// θ̈ = −λ θ̇ + …,   x = λ h,   s = 1/x − 1/(eˣ − 1)
/// h (s θ̇_k + (1 − s) θ̇_{k+1}) − h³/12 (∂θ̈/∂θ θ̇ + ∂θ̈/∂q q̇ + ∂θ̈/∂q̇ q̈) − (θ_{k+1} − θ_k)
/// ```
pub(super) fn slip(motion: &Motion, along: &Along, dof: usize, k: usize, h: f64, is_held: bool) -> f64 {
    let [of_theta, of_thetad, of_q, of_qd] = along.linear[dof][k].rate;
    let decay = -of_thetad * h;
    let (theta, thetad) = (&motion.theta[dof], &motion.thetad[dof]);
    let mean = mean_of_decay(thetad[k], thetad[k + 1], decay);
    let jerk = match along.links.motion[dof].as_ref().map(|link| link[k]) {
        Some([_, qd, qdd]) if is_held && of_theta.abs() * h * h < EVEN => {
            of_theta * mean + of_q * qd + of_qd * qdd
        }
        _ if decay > STIFF => 0.0,
        _ => return 0.0,
    };
    h * mean - h.powi(3) / 12.0 * jerk - (theta[k + 1] - theta[k])
}

/// How unsure the mean of friction over each hold is, by its standard deviation, N·m, if nothing is known of when within the hold
/// it changes.
///
/// σ = |∂τ_m/∂θ̇ (θ̇_{k+1} − θ̇_k)|/√12
pub(super) fn unsure(motion: &Motion, along: &Along, dof: usize) -> Vec<f32> {
    let change = |(linear, ends): (&Linear, &[f64])| linear.rate[1] / linear.motor * (ends[1] - ends[0]);
    let holds = along.linear[dof].iter().zip(motion.thetad[dof].windows(2));
    holds.map(|hold| (change(hold).abs() / 12f64.sqrt()) as f32).collect()
}

// The mean of what goes from one value to another like e^(−x t/h).
fn mean_of_decay(from: f64, to: f64, x: f64) -> f64 {
    let share = if x.abs() < SMALL { 0.5 - x / 12.0 } else { 1.0 / x - 1.0 / x.exp_m1() };
    to + share * (from - to)
}

/// The width of even spread with the variance of what goes from one value to another like e^(−t/T), from `change` and by how
/// much the mean is off the middle of both; within 2.5 % for every T.
///
/// w² = Δ² (1 − |2 off/Δ|³)
pub(super) fn width_of_decay(change: f64, off: f64) -> f64 {
    let early = (2.0 * off / change).abs();
    // Nothing changes, or what changes is over before it counts.
    if early < 1.0 { change.abs() * (1.0 - early.powi(3)).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    // v = e^(−x t):  ∫ v = (1 − e^(−x))/x,  ∫ v² = (1 − e^(−2x))/2x
    #[test]
    fn a_decay_has_its_mean_and_its_variance() {
        for x in [1e-6, 0.1, 1.0, 3.0, 10.0, 60.0] {
            let end = f64::exp(-x);
            let (mean, square) = (-f64::exp_m1(-x) / x, -f64::exp_m1(-2.0 * x) / (2.0 * x));
            assert!((mean_of_decay(1.0, end, x) - mean).abs() < 1e-9, "{x}");
            let std = (square - mean * mean).max(0.0).sqrt();
            let width = width_of_decay(end - 1.0, mean - 0.5 * (1.0 + end));
            let off = (width / 12f64.sqrt() - std).abs();
            assert!(off <= 0.025 * std + 1e-9, "{x}: {off} of {std}");
        }
        assert_eq!(width_of_decay(0.0, 0.0), 0.0);
        assert_eq!(width_of_decay(0.1, 0.06), 0.0);
    }
}
