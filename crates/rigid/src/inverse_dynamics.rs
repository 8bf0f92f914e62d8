//! Inverse dynamics, nonlinear effects and gravity as plain functions.

use nalgebra::DVector;
use sinew_model::{Model, wide_forms};

use crate::{Workspace, rnea};

/// Joint torques that produce the accelerations `qdd` (recursive Newton–Euler).
///
/// ```text
/// τ = M(q) q̈ + C(q, q̇) q̇ + g(q)
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. Returns τ: nv, N·m (N for sliding joints). Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A pendulum of 2 kg held level at 0.5 m needs m·g·l:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let tau = sinew_rigid::inverse_dynamics(&pendulum, &[0.0], &[0.0], &[0.0]);
/// approx::assert_relative_eq!(tau[0], 2.0 * 9.81 * 0.5, max_relative = 1e-12);
/// ```
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 5.1.
pub fn inverse_dynamics(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> DVector<f64> {
    let mut tau = DVector::zeros(model.nv);
    inverse_dynamics_into(model, &mut Workspace::new(model), q, qd, qdd, tau.as_mut_slice());
    tau
}

wide_forms! {
    avx2,
    /// [`inverse_dynamics`] without allocation, into the nv numbers of `tau`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn inverse_dynamics_into(
        model: &Model,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) {
        let (conditions, scratch, _) = ws.open(model);
        rnea::inverse_dynamics(scratch, &conditions, q, qd, qdd, |_| {}, tau);
    }
}

/// Nonlinear effects: the torques of a motion without acceleration.
///
/// ```text
/// h(q, q̇) = C(q, q̇) q̇ + g(q)
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns h: nv, N·m (N). Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// One pendulum has gravity only, however fast it turns:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let h = sinew_rigid::bias(&pendulum, &[0.0], &[7.0]);
/// approx::assert_relative_eq!(h[0], 9.81, max_relative = 1e-12);
/// ```
pub fn bias(model: &Model, q: &[f64], qd: &[f64]) -> DVector<f64> {
    let mut h = DVector::zeros(model.nv);
    bias_into(model, &mut Workspace::new(model), q, qd, h.as_mut_slice());
    h
}

wide_forms! {
    avx2,
    /// [`bias`] without allocation, into the nv numbers of `h`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn bias_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64], h: &mut [f64]) {
        let (conditions, scratch, zeros) = ws.open(model);
        rnea::inverse_dynamics(scratch, &conditions, q, qd, zeros, |_| {}, h);
    }
}

/// Torques that hold the robot against gravity.
///
/// ```text
/// g(q) = ∂U/∂q
/// ```
///
/// `q`: nq, rad (m). Returns g: nv, N·m (N). Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// An upright pendulum needs none:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let g = sinew_rigid::gravity(&pendulum, &[std::f64::consts::FRAC_PI_2]);
/// approx::assert_abs_diff_eq!(g[0], 0.0, epsilon = 1e-12);
/// ```
pub fn gravity(model: &Model, q: &[f64]) -> DVector<f64> {
    let mut g = DVector::zeros(model.nv);
    gravity_into(model, &mut Workspace::new(model), q, g.as_mut_slice());
    g
}

wide_forms! {
    avx2,
    /// [`gravity()`] without allocation, into the nv numbers of `g`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn gravity_into(model: &Model, ws: &mut Workspace, q: &[f64], g: &mut [f64]) {
        let (conditions, scratch, zeros) = ws.open(model);
        rnea::inverse_dynamics(scratch, &conditions, q, zeros, zeros, |_| {}, g);
    }
}
