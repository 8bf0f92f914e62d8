//! Analytic derivatives of forward dynamics.

use nalgebra::DMatrix;
use sinew_model::{Model, Scalar, wide_forms};

use crate::inverse_dynamics_derivatives::{composites, masses, outward, push, rotors, slopes, torques};
use crate::scratch::Conditions;
use crate::{Bodies, Scratch, Workspace};

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
/// a floating base [turn; shift] in its own axes. Cost O(n² · depth).
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

wide_forms! {
    avx2,
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
        let (conditions, scratch, _) = ws.open(model);
        differentiate(scratch, &conditions, q, qd, tau, by_position, by_velocity, by_torque);
    }
}

/// [`forward_dynamics_derivatives_into`] for any kind of number, with the armature.
///
/// # Panics
/// If a slice has the wrong length.
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
    let conditions = ws.take(b);
    differentiate(ws, &conditions, q, qd, tau, by_position, by_velocity, by_torque);
}

/// The same once the inertias are taken.
#[inline(always)]
fn differentiate<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    tau: &[S],
    by_position: &mut [S],
    by_velocity: &mut [S],
    by_torque: &mut [S],
) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), tau.len()), (nv, nv), "qd, tau");
    let lengths = (by_position.len(), by_velocity.len(), by_torque.len());
    assert_eq!(lengths, (nv * nv, nv * nv, nv * nv), "by_position, by_velocity, by_torque");
    outward(ws, c, q, qd);
    composites(ws);
    rotors(c, nv, by_torque);
    masses(ws, by_torque);
    let mut h = core::mem::take(&mut ws.torque);
    torques(ws, &mut h);
    let Scratch { support, grouped, column, solution: qdd, .. } = &mut *ws;
    grouped.load(support, by_torque);
    grouped.factor(support, column);
    // M q̈ = τ − h
    for ((x, tau), h) in qdd.iter_mut().zip(tau).zip(&h) {
        *x = *tau - *h;
    }
    grouped.solve(support, qdd);
    grouped.invert(support, column);
    grouped.store(by_torque);
    ws.torque = h;
    by_position.fill(S::ZERO);
    by_velocity.fill(S::ZERO);
    let qdd = core::mem::take(&mut ws.solution);
    push(ws, &qdd);
    ws.solution = qdd;
    slopes(ws, by_position, by_velocity);
    // ∂q̈/∂x = −M⁻¹ ∂τ/∂x
    let Scratch { support, grouped, .. } = ws;
    grouped.minus_times(support, by_position, by_velocity);
}
