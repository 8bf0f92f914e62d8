//! Forward dynamics as a plain function.

use nalgebra::DVector;
use sinew_model::{Model, wide_forms};

use crate::{BodyAccelerations, MovingBodies, Workspace, hybrid_dynamics};

/// Accelerations that the torques `tau` produce (articulated bodies).
///
/// ```text
/// q̈ = M(q)⁻¹ (τ − C(q, q̇) q̇ − g(q))
/// ```
///
/// `q`: nq, rad (m). `qd`, `tau`: nv. Returns q̈: nv, rad/s² (m/s²). Cost O(n); with mimic joints M is factored
/// instead. A degree of freedom that moves no inertia gives numbers that are not finite.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A level pendulum of 0.5 m that is let go falls at g/l:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let qdd = sinew_rigid::forward_dynamics(&pendulum, &[0.0], &[0.0], &[0.0]);
/// approx::assert_relative_eq!(qdd[0], -9.81 / 0.5, max_relative = 1e-12);
/// ```
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 7.1.
pub fn forward_dynamics(model: &Model, q: &[f64], qd: &[f64], tau: &[f64]) -> DVector<f64> {
    let mut qdd = DVector::zeros(model.nv);
    forward_dynamics_into(model, &mut Workspace::new(model), q, qd, tau, qdd.as_mut_slice());
    qdd
}

wide_forms! {
    avx2,
    /// [`forward_dynamics`] without allocation, into the nv numbers of `qdd`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn forward_dynamics_into(
        model: &Model,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) {
        forward_dynamics_under_into(model, ws, q, qd, tau, |_| {}, qdd);
    }
}

/// [`forward_dynamics_into`] under forces on the bodies: see [`crate::forward_dynamics_under_with`]. Compiled into its
/// caller, for the instructions that the caller is compiled for.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn forward_dynamics_under_into<'w>(
    model: &Model,
    ws: &'w mut Workspace,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    push: impl Fn(&mut MovingBodies<f64>),
    qdd: &mut [f64],
) -> BodyAccelerations<'w, f64> {
    let (conditions, scratch, _) = ws.open(model);
    hybrid_dynamics::forward_dynamics(scratch, &conditions, q, qd, tau, push, qdd)
}
