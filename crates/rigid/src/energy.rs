//! Kinetic and potential energy.

use sinew_kinematics::body_poses_with;
use sinew_model::{Motion, Scalar};

use crate::rnea::velocity;
use crate::{Bodies, Scratch};

/// Kinetic energy of all moving bodies and of the armature, for any kind of number.
///
/// ```text
/// T = ½ Σ vᵀ I v + ½ Σ B q̇² = ½ q̇ᵀ M q̇
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns J. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn kinetic_energy_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], qd: &[S]) -> S {
    b.check();
    assert_eq!((q.len(), qd.len()), (b.model.nq, b.model.nv), "q, qd");
    let mut twice = S::ZERO;
    for (i, joint) in b.model.joints.iter().enumerate() {
        let v_parent = joint.parent.map_or(Motion::ZERO, |p| ws.velocity[p.0]);
        let (v, _) = velocity(joint, &joint.pose(q), v_parent, qd);
        twice += b.inertia[i].times(v).dot(v);
        ws.velocity[i] = v;
    }
    for dof in 0..b.model.nv {
        twice += b.armature(dof) * qd[dof] * qd[dof];
    }
    twice * 0.5
}

/// Potential energy of all moving bodies in gravity, 0 at the world's origin, for any kind of number.
///
/// ```text
/// U = −Σ gᵀ (m p + R h)
/// ```
///
/// `q`: nq, rad (m). Returns J. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn potential_energy_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S]) -> S {
    b.check();
    body_poses_with(b.model, q, &mut ws.pose);
    let mut energy = S::ZERO;
    for (pose, inertia) in ws.pose.iter().zip(b.inertia) {
        energy -= b.gravity.dot(pose.translation * inertia.mass + pose.rotation * inertia.first_moment);
    }
    energy
}
