//! Forward and hybrid dynamics: the articulated-body algorithm.

use sinew_model::{ArticulatedInertia, Force, JointKind, Motion, Scalar, Vector3};

use crate::ldlt;
use crate::rnea::{inverse_dynamics_with, velocity};
use crate::scratch::Pivot;
use crate::{Bodies, Scratch, mass_matrix_with};

/// Accelerations that the torques `tau` produce, for any kind of number (articulated bodies).
///
/// ```text
/// q̈ = M(q)⁻¹ (τ − C(q, q̇) q̇ − g(q))
/// ```
///
/// `q`: nq, rad (m). `qd`, `tau`: nv. `qdd`: nv, overwritten. Cost O(n); with mimic joints M is factored instead.
/// A degree of freedom that moves no inertia gives numbers that are not finite.
///
/// # Panics
/// If a slice has the wrong length.
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 7.1.
#[inline(always)]
pub fn forward_dynamics_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    tau: &[S],
    qdd: &mut [S],
) {
    assert_eq!(tau.len(), b.model.nv, "tau");
    let mut torque = core::mem::take(&mut ws.torque);
    torque.copy_from_slice(tau);
    hybrid(b, ws, q, qd, |_| false, qdd, &mut torque);
    ws.torque = torque;
}

/// Hybrid dynamics, for any kind of number: where `imposed`, q̈ is given and τ computed; elsewhere τ is given and q̈
/// computed, in one sweep.
///
/// ```text
/// M(q) q̈ + C(q, q̇) q̇ + g(q) = τ
/// ```
///
/// `q`: nq, rad (m). `qd`, `imposed`, `qdd`, `tau`: nv. Entries of `qdd` where not imposed and of `tau` where
/// imposed are overwritten. All imposed: inverse dynamics; none: forward dynamics. Cost O(n); with mimic joints M
/// is factored instead.
///
/// # Panics
/// If a slice has the wrong length.
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 9.1.
#[inline(always)]
pub fn hybrid_dynamics_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    imposed: &[bool],
    qdd: &mut [S],
    tau: &mut [S],
) {
    assert_eq!(imposed.len(), b.model.nv, "imposed");
    hybrid(b, ws, q, qd, |dof| imposed[dof], qdd, tau);
}

/// How a hybrid motion answers to the torques of its free joints, for any kind of number.
///
/// ```text
/// R_ij = ∂q̈_i/∂τ_j = (M_ff⁻¹)_ij          i free, j free
/// R_ij = ∂τ_i/∂τ_j = (M_if M_ff⁻¹)_ij     i imposed, j free
/// R_ij = 0                                j imposed
/// ```
///
/// `q`: nq, rad (m). `imposed`: nv. `response`: nv × nv by columns, overwritten. Cost O(n³) in the free degrees of
/// freedom. None imposed: the inverse of the mass matrix.
///
/// # Panics
/// If a slice has the wrong length.
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 9.1.
pub fn hybrid_response_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    imposed: &[bool],
    response: &mut [S],
) {
    let nv = b.model.nv;
    assert_eq!((imposed.len(), response.len()), (nv, nv * nv), "imposed, response");
    let (mut M, mut factor, mut x) = core::mem::take(&mut ws.response);
    mass_matrix_with(b, ws, q, &mut M);
    factor.copy_from_slice(&M);
    identity_where(|dof| imposed[dof], &mut factor, nv);
    ldlt::factor(&mut factor, nv);
    response.fill(S::ZERO);
    for j in (0..nv).filter(|&j| !imposed[j]) {
        x.fill(S::ZERO);
        x[j] = S::ONE;
        ldlt::solve(&factor, nv, &mut x);
        for i in 0..nv {
            let through =
                || (0..nv).filter(|&k| !imposed[k]).fold(S::ZERO, |sum, k| sum + M[i + nv * k] * x[k]);
            response[i + nv * j] = if imposed[i] { through() } else { x[i] };
        }
    }
    ws.response = (M, factor, x);
}

// Rows and columns of imposed degrees of freedom become those of the identity.
#[inline(always)]
fn identity_where<S: Scalar>(imposed: impl Fn(usize) -> bool, M: &mut [S], nv: usize) {
    for (i, j) in (0..nv).flat_map(|j| (0..nv).map(move |i| (i, j))) {
        if imposed(i) || imposed(j) {
            M[i + nv * j] = if i == j { S::ONE } else { S::ZERO };
        }
    }
}

#[inline(always)]
fn hybrid<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    imposed: impl Fn(usize) -> bool + Copy,
    qdd: &mut [S],
    tau: &mut [S],
) {
    b.check();
    let nv = b.model.nv;
    assert_eq!((q.len(), qd.len(), qdd.len(), tau.len()), (b.model.nq, nv, nv, nv), "q, qd, qdd, tau");
    if b.model.has_mimic() {
        by_mass_matrix(b, ws, q, qd, imposed, qdd, tau);
    } else {
        gather(b, ws, q, qd, imposed, qdd, tau);
        accelerate(b, ws, imposed, qdd, tau);
    }
}

/// Outward for velocities, inward for articulated inertias. A floating joint is six axes one after another in one
/// frame, so that one treatment serves every kind of joint.
#[inline(always)]
fn gather<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    imposed: impl Fn(usize) -> bool,
    qdd: &[S],
    tau: &[S],
) {
    for (i, joint) in b.model.joints.iter().enumerate() {
        let pose = joint.pose(q);
        let v_parent = joint.parent.map_or(Motion::ZERO, |p| ws.velocity[p.0]);
        let (v, c) = velocity(joint, &pose, v_parent, qd);
        // I_A = I,   p_A = v ×* I v
        ws.articulated[i] = ArticulatedInertia::rigid(&b.inertia[i]);
        ws.force[i] = v.cross_force(b.inertia[i].times(v));
        (ws.pose[i], ws.velocity[i], ws.acceleration[i]) = (pose, v, c);
    }
    for (i, joint) in b.model.joints.iter().enumerate().rev() {
        let (mut I, mut p) = (ws.articulated[i], ws.force[i]);
        for k in (0..joint.kind.nv()).rev() {
            let dof = joint.first_dof + k;
            // U = I_A s
            let U = column(&I, joint.kind, k);
            let bias = joint.kind.along(k, p);
            if imposed(dof) {
                // p_A = p_A + U q̈
                ws.pivot[dof] = Pivot { U, d_inverse: S::ZERO, u: bias };
                p += U * qdd[dof];
            } else {
                // d = s·U,   u = τ − s·p_A,   I_A = I_A − U Uᵀ/d,   p_A = p_A + U u/d
                let d_inverse = (joint.kind.along(k, U) + b.armature(dof)).recip();
                let u = tau[dof] - bias;
                ws.pivot[dof] = Pivot { U, d_inverse, u };
                I = I.without(U, d_inverse);
                p += U * (u * d_inverse);
            }
        }
        if let Some(parent) = joint.parent {
            // I_parent = I_parent + Xᵀ I_A X,   p_parent = p_parent + Xᵀ (p_A + I_A c)
            p += I.times(ws.acceleration[i]);
            ws.articulated[parent.0] = ws.articulated[parent.0].plus(&I.to_parent(&ws.pose[i]));
            ws.force[parent.0] += ws.pose[i].force_to_parent(p);
        }
    }
}

/// Outward for accelerations; `ws.acceleration` holds the velocity products c before, a after.
#[inline(always)]
fn accelerate<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    imposed: impl Fn(usize) -> bool,
    qdd: &mut [S],
    tau: &mut [S],
) {
    for (i, joint) in b.model.joints.iter().enumerate() {
        let a_parent = match joint.parent {
            None => Motion::new(Vector3::ZERO, -b.gravity),
            Some(p) => ws.acceleration[p.0],
        };
        // a = X a_parent + c
        let mut a = ws.pose[i].motion_to_child(a_parent) + ws.acceleration[i];
        for k in 0..joint.kind.nv() {
            let dof = joint.first_dof + k;
            let Pivot { U, d_inverse, u } = ws.pivot[dof];
            if imposed(dof) {
                // a = a + s q̈,   τ = U·a + s·p_A
                a += joint.kind.motion(k, qdd[dof]);
                tau[dof] = U.dot(a) + u + b.armature(dof) * qdd[dof];
            } else {
                // q̈ = (u − U·a)/d,   a = a + s q̈
                qdd[dof] = (u - U.dot(a)) * d_inverse;
                a += joint.kind.motion(k, qdd[dof]);
            }
        }
        ws.acceleration[i] = a;
    }
}

/// The same through M and h, for trees in which several joints share a degree of freedom.
#[inline(always)]
fn by_mass_matrix<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    imposed: impl Fn(usize) -> bool,
    qdd: &mut [S],
    tau: &mut [S],
) {
    let nv = b.model.nv;
    let (mut M, mut x) = (core::mem::take(&mut ws.matrix), core::mem::take(&mut ws.solution));
    // x = τ_f − (M q̈ + h)_f with q̈_f = 0
    for dof in (0..nv).filter(|&dof| !imposed(dof)) {
        qdd[dof] = S::ZERO;
    }
    inverse_dynamics_with(b, ws, q, qd, qdd, &mut x);
    for dof in 0..nv {
        x[dof] = if imposed(dof) { S::ZERO } else { tau[dof] - x[dof] };
    }
    // M_ff q̈_f = x; imposed rows and columns become those of the identity
    mass_matrix_with(b, ws, q, &mut M);
    identity_where(&imposed, &mut M, nv);
    ldlt::factor(&mut M, nv);
    ldlt::solve(&M, nv, &mut x);
    for dof in (0..nv).filter(|&dof| !imposed(dof)) {
        qdd[dof] = x[dof];
    }
    // τ_i = (M q̈ + h)_i
    inverse_dynamics_with(b, ws, q, qd, qdd, &mut x);
    for dof in (0..nv).filter(|&dof| imposed(dof)) {
        tau[dof] = x[dof];
    }
    (ws.matrix, ws.solution) = (M, x);
}

/// I_A S_k.
#[inline(always)]
fn column<S: Scalar>(I: &ArticulatedInertia<S>, kind: JointKind, k: usize) -> Force<S> {
    match kind {
        JointKind::Revolute { axis } => {
            let axis = Vector3::constant(axis);
            Force::new(I.angular * axis, I.mixed.transpose_mul(axis))
        }
        JointKind::Prismatic { axis } => {
            let axis = Vector3::constant(axis);
            Force::new(I.mixed * axis, I.linear * axis)
        }
        JointKind::Floating => I.times(kind.motion(k, S::ONE)),
    }
}
