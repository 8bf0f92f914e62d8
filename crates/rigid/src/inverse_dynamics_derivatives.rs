//! Analytic derivatives of inverse dynamics.

use nalgebra::DMatrix;
use sinew_kinematics::body_poses_with;
use sinew_model::{Model, Motion, Scalar, Vector3};

use crate::coriolis::Transport;
use crate::rnea::{body_force, rate, scaled};
use crate::{Bodies, Scratch, Workspace};

/// How the torques of a motion change with it; each matrix nv × nv, row: torque, column: what changes.
#[derive(Debug, Clone, PartialEq)]
pub struct InverseDynamicsDerivatives {
    /// ∂τ/∂q, along the displacements of [`integrate`](sinew_kinematics::integrate).
    pub by_position: DMatrix<f64>,
    /// ∂τ/∂q̇.
    pub by_velocity: DMatrix<f64>,
    /// ∂τ/∂q̈ = M.
    pub by_acceleration: DMatrix<f64>,
}

/// Derivatives of [`inverse_dynamics`](crate::inverse_dynamics) by position, velocity and acceleration.
///
/// ```text
/// δτ = ∂τ/∂q δq + ∂τ/∂q̇ δq̇ + M δq̈
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. δq is a displacement as [`integrate`](sinew_kinematics::integrate) takes it: of
/// a floating base [turn; shift] in its own axes. Cost O(n · depth).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// The torque m g l cos q that holds a pendulum falls by m g l sin q:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let d = sinew_rigid::inverse_dynamics_derivatives(&pendulum, &[0.3], &[0.0], &[0.0]);
/// approx::assert_relative_eq!(d.by_position[(0, 0)], -2.0 * 9.81 * 0.5 * 0.3_f64.sin(), max_relative = 1e-12);
/// approx::assert_relative_eq!(d.by_acceleration[(0, 0)], 2.0 * 0.25, max_relative = 1e-12);
/// ```
/// Source: Singh, Russell, Wensing, *Efficient analytical derivatives of rigid-body dynamics using spatial vector
/// algebra*, IEEE Robotics and Automation Letters 7(2), 2022.
pub fn inverse_dynamics_derivatives(
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> InverseDynamicsDerivatives {
    let zeros = || DMatrix::zeros(model.nv, model.nv);
    let (mut by_q, mut by_qd, mut M) = (zeros(), zeros(), zeros());
    inverse_dynamics_derivatives_into(
        model,
        &mut Workspace::new(model),
        q,
        qd,
        qdd,
        by_q.as_mut_slice(),
        by_qd.as_mut_slice(),
        M.as_mut_slice(),
    );
    InverseDynamicsDerivatives { by_position: by_q, by_velocity: by_qd, by_acceleration: M }
}

/// [`inverse_dynamics_derivatives`] without allocation, into three times nv × nv numbers by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_dynamics_derivatives_into(
    model: &Model,
    ws: &mut Workspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    by_position: &mut [f64],
    by_velocity: &mut [f64],
    by_acceleration: &mut [f64],
) {
    let (bodies, scratch, _) = ws.split(model);
    inverse_dynamics_derivatives_with(
        &bodies,
        scratch,
        q,
        qd,
        qdd,
        by_position,
        by_velocity,
        by_acceleration,
    );
}

/// [`inverse_dynamics_derivatives_into`] for any kind of number, with the armature on the diagonal of M.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn inverse_dynamics_derivatives_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    by_position: &mut [S],
    by_velocity: &mut [S],
    by_acceleration: &mut [S],
) {
    b.check();
    let nv = b.model.nv;
    assert_eq!((qd.len(), qdd.len()), (nv, nv), "qd, qdd");
    let lengths = (by_position.len(), by_velocity.len(), by_acceleration.len());
    assert_eq!(lengths, (nv * nv, nv * nv, nv * nv), "by_position, by_velocity, by_acceleration");
    for matrix in [&mut *by_position, &mut *by_velocity, &mut *by_acceleration] {
        matrix.fill(S::ZERO);
    }
    for dof in 0..nv {
        by_acceleration[dof + nv * dof] = b.armature(dof);
    }
    outward(b, ws, q, qd, qdd);
    // Inward: a body's columns once its subtree has been added up.
    let mut end = ws.axis.len();
    for (j, joint) in b.model.joints.iter().enumerate().rev() {
        let (I, B, f) = (ws.composite[j], ws.transport[j], ws.force[j]);
        if let Some(p) = joint.parent {
            ws.composite[p.0] += I;
            ws.transport[p.0] = ws.transport[p.0].plus(&B);
            ws.force[p.0] += f;
        }
        let own = end - joint.kind.nv()..end;
        end = own.start;
        for (k, axis) in own.clone().enumerate() {
            let column = joint.first_dof + k;
            let Axis { s, psi, psi_rate, s_rate } = ws.axis[axis];
            // F₁ = I (ψ̇ + ṡ) + 2 B s,   F₂ = I ψ̈ + 2 B ψ̇,   F₃ = I s,   F₄ = 2 Bᵀ s
            let F1 = I.times(s_rate) + twice(B.times(s));
            let F2 = I.times(psi_rate) + twice(B.times(psi));
            let (F3, F4) = (I.times(s), twice(B.transpose_times(s)));
            for (l, other) in own.clone().enumerate() {
                let (row, r) = (joint.first_dof + l, ws.axis[other].s);
                by_position[row + nv * column] += F2.dot(r);
                by_velocity[row + nv * column] += F1.dot(r);
                by_acceleration[row + nv * column] += F3.dot(r);
            }
            // an ancestor's axis stays where it is when this joint turns the force of its subtree
            let F2 = F2 + s.cross_force(f);
            let mut ancestor = joint.parent;
            while let Some(id) = ancestor {
                let carrier = &b.model.joints[id.0];
                for l in 0..carrier.kind.nv() {
                    let row = carrier.first_dof + l;
                    let r = &ws.axis[ws.first_axis[id.0] + l];
                    // ∂τ_i/∂q_j = s_i·F₂,   ∂τ_i/∂q̇_j = s_i·F₁,   M_ij = s_i·F₃
                    by_position[row + nv * column] += F2.dot(r.s);
                    by_velocity[row + nv * column] += F1.dot(r.s);
                    let m = F3.dot(r.s);
                    by_acceleration[row + nv * column] += m;
                    by_acceleration[column + nv * row] += m;
                    // ∂τ_j/∂q_i = ψ̈_i·F₃ + ψ̇_i·F₄,   ∂τ_j/∂q̇_i = (ψ̇_i + ṡ_i)·F₃ + s_i·F₄
                    by_position[column + nv * row] += F3.dot(r.psi_rate) + F4.dot(r.psi);
                    by_velocity[column + nv * row] += F3.dot(r.s_rate) + F4.dot(r.s);
                }
                ancestor = carrier.parent;
            }
        }
    }
}

/// One axis of a joint about the world's origin, and how it changes along the motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis<S> {
    /// s.
    s: Motion<S>,
    /// ψ̇ = v_parent × s.
    psi: Motion<S>,
    /// ψ̈ = a_parent × s + v_parent × ψ̇.
    psi_rate: Motion<S>,
    /// ψ̇ + ṡ, ṡ = v × s.
    s_rate: Motion<S>,
}

impl<S: Scalar> Axis<S> {
    pub(crate) const ZERO: Self =
        Self { s: Motion::ZERO, psi: Motion::ZERO, psi_rate: Motion::ZERO, s_rate: Motion::ZERO };
}

/// Poses, axes, inertias and forces of all bodies about the world's origin, where composites only add.
#[inline(always)]
fn outward<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], qd: &[S], qdd: &[S]) {
    body_poses_with(b.model, q, &mut ws.pose);
    let ground = Motion::new(Vector3::ZERO, -b.gravity);
    for (i, joint) in b.model.joints.iter().enumerate() {
        let pose = ws.pose[i];
        let (v_parent, a_parent) =
            joint.parent.map_or((Motion::ZERO, ground), |p| (ws.velocity[p.0], ws.acceleration[p.0]));
        // v = v_parent + S q̇,   a = a_parent + S q̈ + v × S q̇
        let moved = pose.motion_to_parent(rate(joint, qd));
        let v = v_parent + moved;
        let a = a_parent + pose.motion_to_parent(rate(joint, qdd)) + v.cross_motion(moved);
        let I = pose.inertia_to_parent(&b.inertia[i]);
        for k in 0..joint.kind.nv() {
            let s = pose.motion_to_parent(joint.kind.motion(k, scaled(joint, S::ONE)));
            let psi = v_parent.cross_motion(s);
            let psi_rate = a_parent.cross_motion(s) + v_parent.cross_motion(psi);
            let s_rate = psi + v.cross_motion(s);
            ws.axis[ws.first_axis[i] + k] = Axis { s, psi, psi_rate, s_rate };
        }
        (ws.velocity[i], ws.acceleration[i]) = (v, a);
        (ws.composite[i], ws.transport[i], ws.force[i]) = (I, Transport::new(&I, v), body_force(&I, v, a));
    }
}

#[inline(always)]
fn twice<S: Scalar>(f: sinew_model::Force<S>) -> sinew_model::Force<S> {
    f + f
}
