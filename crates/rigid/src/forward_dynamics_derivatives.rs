//! Analytic derivatives of forward dynamics.

use nalgebra::DMatrix;
use sinew_model::{Model, Scalar};

use crate::{Bodies, Scratch, Workspace, forward_dynamics_with, inverse_dynamics_derivatives_with, ldlt};

/// How the accelerations of a robot change with its state and torques; each matrix nv × nv, row: acceleration,
/// column: what changes.
#[derive(Debug, Clone, PartialEq)]
pub struct ForwardDynamicsDerivatives {
    /// ∂q̈/∂q, along the displacements of [`integrate`](sinew_kinematics::integrate).
    pub by_position: DMatrix<f64>,
    /// ∂q̈/∂q̇.
    pub by_velocity: DMatrix<f64>,
    /// ∂q̈/∂τ = M⁻¹.
    pub by_torque: DMatrix<f64>,
}

/// Derivatives of [`forward_dynamics`](crate::forward_dynamics) by position, velocity and torque.
///
/// ```text
/// δq̈ = M⁻¹ (δτ − ∂τ/∂q δq − ∂τ/∂q̇ δq̇),   the derivatives of inverse dynamics at q̈
/// ```
///
/// `q`: nq, rad (m). `qd`, `tau`: nv. δq is a displacement as [`integrate`](sinew_kinematics::integrate) takes it: of
/// a floating base [turn; shift] in its own axes. Cost O(n³).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A level pendulum that is let go falls at −g/l cos q; at 0.3 rad this changes by g/l sin q:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let d = sinew_rigid::forward_dynamics_derivatives(&pendulum, &[0.3], &[0.0], &[0.0]);
/// approx::assert_relative_eq!(d.by_position[(0, 0)], 9.81 / 0.5 * 0.3_f64.sin(), max_relative = 1e-12);
/// approx::assert_relative_eq!(d.by_torque[(0, 0)], 1.0 / (2.0 * 0.25), max_relative = 1e-12);
/// ```
/// Source: Carpentier, Mansard, *Analytical derivatives of rigid body dynamics algorithms*, Robotics: Science and
/// Systems, 2018.
pub fn forward_dynamics_derivatives(
    model: &Model,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
) -> ForwardDynamicsDerivatives {
    let zeros = || DMatrix::zeros(model.nv, model.nv);
    let (mut by_q, mut by_qd, mut by_tau) = (zeros(), zeros(), zeros());
    forward_dynamics_derivatives_into(
        model,
        &mut Workspace::new(model),
        q,
        qd,
        tau,
        by_q.as_mut_slice(),
        by_qd.as_mut_slice(),
        by_tau.as_mut_slice(),
    );
    ForwardDynamicsDerivatives { by_position: by_q, by_velocity: by_qd, by_torque: by_tau }
}

/// [`forward_dynamics_derivatives`] without allocation, into three times nv × nv numbers by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn forward_dynamics_derivatives_into(
    model: &Model,
    ws: &mut Workspace,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    by_position: &mut [f64],
    by_velocity: &mut [f64],
    by_torque: &mut [f64],
) {
    let (bodies, scratch, _) = ws.split(model);
    forward_dynamics_derivatives_with(&bodies, scratch, q, qd, tau, by_position, by_velocity, by_torque);
}

/// [`forward_dynamics_derivatives_into`] for any kind of number, with the armature.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn forward_dynamics_derivatives_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    tau: &[S],
    by_position: &mut [S],
    by_velocity: &mut [S],
    by_torque: &mut [S],
) {
    let nv = b.model.nv;
    let (mut factor, mut qdd) = (core::mem::take(&mut ws.response.0), core::mem::take(&mut ws.response.2));
    forward_dynamics_with(b, ws, q, qd, tau, &mut qdd);
    inverse_dynamics_derivatives_with(b, ws, q, qd, &qdd, by_position, by_velocity, by_torque);
    factor.copy_from_slice(by_torque);
    ldlt::factor(&mut factor, nv);
    ldlt::invert(by_torque, nv);
    // ∂q̈/∂x = −M⁻¹ ∂τ/∂x
    for column in by_position.chunks_exact_mut(nv).chain(by_velocity.chunks_exact_mut(nv)) {
        ldlt::solve(&factor, nv, column);
        column.iter_mut().for_each(|x| *x = -*x);
    }
    (ws.response.0, ws.response.2) = (factor, qdd);
}
