//! Analytic derivatives of inverse dynamics.

use nalgebra::DMatrix;
use sinew_model::{Model, Motion, Scalar, wide_forms};

use crate::coriolis::Transport;
use crate::rnea::body_force;
use crate::scratch::Conditions;
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

wide_forms! {
    avx2,
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
        let (conditions, scratch, _) = ws.open(model);
        differentiate(scratch, &conditions, q, qd, qdd, by_position, by_velocity, by_acceleration);
    }
}

/// [`inverse_dynamics_derivatives_into`] for any kind of number, with the armature on the diagonal of M.
///
/// # Panics
/// If a slice has the wrong length.
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
    let conditions = ws.take(b);
    differentiate(ws, &conditions, q, qd, qdd, by_position, by_velocity, by_acceleration);
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn differentiate<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    by_position: &mut [S],
    by_velocity: &mut [S],
    by_acceleration: &mut [S],
) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), qdd.len()), (nv, nv), "qd, qdd");
    let lengths = (by_position.len(), by_velocity.len(), by_acceleration.len());
    assert_eq!(lengths, (nv * nv, nv * nv, nv * nv), "by_position, by_velocity, by_acceleration");
    by_position.fill(S::ZERO);
    by_velocity.fill(S::ZERO);
    rotors(c, nv, by_acceleration);
    outward(ws, c, q, qd);
    push(ws, qdd);
    composites(ws);
    masses(ws, by_acceleration);
    slopes(ws, by_position, by_velocity);
}

/// One axis of a joint about the world's origin, and how it changes along the motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis<S> {
    /// s.
    pub(crate) s: Motion<S>,
    /// ψ̇ = v_parent × s.
    pub(crate) psi: Motion<S>,
    /// ψ̈ = a_parent × s + v_parent × ψ̇.
    pub(crate) psi_rate: Motion<S>,
    /// ψ̇ + ṡ, ṡ = v × s.
    pub(crate) s_rate: Motion<S>,
}

impl<S: Scalar> Axis<S> {
    pub(crate) const ZERO: Self =
        Self { s: Motion::ZERO, psi: Motion::ZERO, psi_rate: Motion::ZERO, s_rate: Motion::ZERO };
}

/// M = B, the rotors alone.
#[inline(always)]
pub(crate) fn rotors<S: Scalar>(c: &Conditions<S>, nv: usize, M: &mut [S]) {
    M.fill(S::ZERO);
    for dof in 0..nv {
        M[dof + nv * dof] = c.armature(dof);
    }
}

/// Poses, axes, inertias and forces of all bodies in the world's axes, where composites only add; no joint accelerates.
#[inline(always)]
pub(crate) fn outward<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], qd: &[S]) {
    ws.poses_about_roots(q);
    let Scratch { mechanism, inertia, world, body, placed, transport, axis, .. } = ws;
    body[0].acceleration = c.ground();
    for (k, (segment, inertia)) in mechanism.segments().iter().zip(&*inertia).enumerate() {
        let pose = &world[k + 1];
        let (v_parent, a_parent) = (body[segment.parent].velocity, body[segment.parent].acceleration);
        // v = v_parent + Σ s q̇,   a = a_parent + v × Σ s q̇
        let mut moved = Motion::ZERO;
        let own = &mut axis[segment.first_axis..][..segment.nv()];
        for (l, axis) in own.iter_mut().enumerate() {
            axis.s = segment.axis(l, pose);
            moved += axis.s * qd[segment.first_dof + l];
        }
        let v = v_parent + moved;
        let a = a_parent + v.cross_motion(moved);
        for axis in own {
            axis.psi = v_parent.cross_motion(axis.s);
            axis.psi_rate = a_parent.cross_motion(axis.s) + v_parent.cross_motion(axis.psi);
            axis.s_rate = axis.psi + v.cross_motion(axis.s);
        }
        let I = pose.inertia_to_parent(inertia);
        (body[k + 1].velocity, body[k + 1].acceleration) = (v, a);
        body[k + 1].force = body_force(&I, v, a);
        (placed[k + 1], transport[k + 1]) = (I, Transport::new(&I, v));
    }
}

/// What the accelerations of the joints add to the forces of the bodies.
#[inline(always)]
pub(crate) fn push<S: Scalar>(ws: &mut Scratch<S>, qdd: &[S]) {
    let Scratch { mechanism, body, placed, axis, .. } = ws;
    body[0].acceleration = Motion::ZERO;
    for (k, segment) in mechanism.segments().iter().enumerate() {
        // δa = δa_parent + Σ s q̈,   δf = I δa,   δψ̈ = δa_parent × s
        let a_parent = body[segment.parent].acceleration;
        let mut a = a_parent;
        for (l, axis) in axis[segment.first_axis..][..segment.nv()].iter_mut().enumerate() {
            a += axis.s * qdd[segment.first_dof + l];
            axis.psi_rate += a_parent.cross_motion(axis.s);
        }
        body[k + 1].acceleration = a;
        body[k + 1].force += placed[k + 1].times(a);
    }
}

/// Inertias and transports of whole subtrees.
#[inline(always)]
pub(crate) fn composites<S: Scalar>(ws: &mut Scratch<S>) {
    let Scratch { mechanism, placed, composite, transport, .. } = ws;
    composite.copy_from_slice(placed);
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let (I, B) = (composite[k + 1], transport[k + 1]);
        composite[segment.parent] += I;
        transport[segment.parent] = transport[segment.parent].plus(&B);
    }
}

/// Adds M.
///
/// ```text
/// M_ij = s_i·I s_j
/// ```
#[inline(always)]
pub(crate) fn masses<S: Scalar>(ws: &Scratch<S>, M: &mut [S]) {
    let Scratch { mechanism, composite, axis, .. } = ws;
    let (segments, nv) = (mechanism.segments(), mechanism.nv());
    for (j, segment) in segments.iter().enumerate() {
        let own = &axis[segment.first_axis..][..segment.nv()];
        for (k, column) in (segment.first_dof..).take(segment.nv()).enumerate() {
            let F = composite[j + 1].times(own[k].s);
            for (l, r) in own.iter().enumerate() {
                M[segment.first_dof + l + nv * column] += F.dot(r.s);
            }
            let mut ancestor = segment.parent;
            while ancestor > 0 {
                let carrier = &segments[ancestor - 1];
                for (l, r) in axis[carrier.first_axis..][..carrier.nv()].iter().enumerate() {
                    let (row, m) = (carrier.first_dof + l, F.dot(r.s));
                    M[row + nv * column] += m;
                    M[column + nv * row] += m;
                }
                ancestor = carrier.parent;
            }
        }
    }
}

/// The torques of the forces of all bodies; the forces become those of whole subtrees.
///
/// ```text
/// τ_i = s_i·f
/// ```
#[inline(always)]
pub(crate) fn torques<S: Scalar>(ws: &mut Scratch<S>, tau: &mut [S]) {
    let Scratch { mechanism, body, subtree_force, axis, .. } = ws;
    tau.fill(S::ZERO);
    for (total, body) in subtree_force.iter_mut().zip(&*body) {
        *total = body.force;
    }
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let f = subtree_force[k + 1];
        for (l, axis) in axis[segment.first_axis..][..segment.nv()].iter().enumerate() {
            tau[segment.first_dof + l] += f.dot(axis.s);
        }
        subtree_force[segment.parent] += f;
    }
}

/// Adds ∂τ/∂q and ∂τ/∂q̇; the forces of the bodies become those of whole subtrees.
#[inline(always)]
pub(crate) fn slopes<S: Scalar>(ws: &mut Scratch<S>, by_position: &mut [S], by_velocity: &mut [S]) {
    let Scratch { mechanism, body, composite, transport, axis, .. } = ws;
    let (segments, nv) = (mechanism.segments(), mechanism.nv());
    for (j, segment) in segments.iter().enumerate().rev() {
        let (I, B, f) = (composite[j + 1], transport[j + 1], body[j + 1].force);
        body[segment.parent].force += f;
        for k in 0..segment.nv() {
            let column = segment.first_dof + k;
            let Axis { s, psi, psi_rate, s_rate } = axis[segment.first_axis + k];
            // F₁ = I (ψ̇ + ṡ) + 2 B s,   F₂ = I ψ̈ + 2 B ψ̇,   F₃ = I s,   F₄ = 2 Bᵀ s
            let F1 = I.times(s_rate) + twice(B.times(s));
            let F2 = I.times(psi_rate) + twice(B.times(psi));
            let (F3, F4) = (I.times(s), twice(B.transpose_times(s)));
            for l in 0..segment.nv() {
                let (row, r) = (segment.first_dof + l, axis[segment.first_axis + l].s);
                by_position[row + nv * column] += F2.dot(r);
                by_velocity[row + nv * column] += F1.dot(r);
            }
            // an ancestor's axis stays where it is when this joint turns the force of its subtree
            let F2 = F2 + s.cross_force(f);
            let mut ancestor = segment.parent;
            while ancestor > 0 {
                let carrier = &segments[ancestor - 1];
                for (l, r) in axis[carrier.first_axis..][..carrier.nv()].iter().enumerate() {
                    let row = carrier.first_dof + l;
                    // ∂τ_i/∂q_j = s_i·F₂,   ∂τ_i/∂q̇_j = s_i·F₁
                    by_position[row + nv * column] += F2.dot(r.s);
                    by_velocity[row + nv * column] += F1.dot(r.s);
                    // ∂τ_j/∂q_i = ψ̈_i·F₃ + ψ̇_i·F₄,   ∂τ_j/∂q̇_i = (ψ̇_i + ṡ_i)·F₃ + s_i·F₄
                    by_position[column + nv * row] += F3.dot(r.psi_rate) + F4.dot(r.psi.angular);
                    by_velocity[column + nv * row] += F3.dot(r.s_rate) + F4.dot(r.s.angular);
                }
                ancestor = carrier.parent;
            }
        }
    }
}

#[inline(always)]
fn twice<T: core::ops::Add<Output = T> + Copy>(x: T) -> T {
    x + x
}
