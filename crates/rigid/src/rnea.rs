//! Inverse dynamics: the recursive Newton–Euler algorithm.

use sinew_model::{Force, Inertia, Joint, JointKind, Motion, Pose, Scalar, Vector3};

use crate::{Bodies, Scratch};

/// Joint torques that produce the accelerations `qdd`, for any kind of number (recursive Newton–Euler).
///
/// ```text
/// τ = M(q) q̈ + C(q, q̇) q̇ + g(q)
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. `tau`: nv, N·m (N), overwritten. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 5.1.
#[inline(always)]
pub fn inverse_dynamics_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    tau: &mut [S],
) {
    b.check();
    let nv = b.model.nv;
    assert_eq!((q.len(), qd.len(), qdd.len(), tau.len()), (b.model.nq, nv, nv, nv), "q, qd, qdd, tau");
    for (i, joint) in b.model.joints.iter().enumerate() {
        let pose = joint.pose(q);
        let (v_parent, a_parent) = match joint.parent {
            None => (Motion::ZERO, Motion::new(Vector3::ZERO, -b.gravity)),
            Some(p) => (ws.velocity[p.0], ws.acceleration[p.0]),
        };
        let (v, c) = velocity(joint, &pose, v_parent, qd);
        // a = X a_parent + S q̈ + v × S q̇
        let a = pose.motion_to_child(a_parent) + rate(joint, qdd) + c;
        ws.force[i] = body_force(&b.inertia[i], v, a);
        (ws.pose[i], ws.velocity[i], ws.acceleration[i]) = (pose, v, a);
    }
    for dof in 0..nv {
        tau[dof] = b.armature(dof) * qdd[dof];
    }
    for (i, joint) in b.model.joints.iter().enumerate().rev() {
        let f = ws.force[i];
        add_torque(joint, f, tau);
        if let Some(p) = joint.parent {
            // f_parent = f_parent + Xᵀ f
            ws.force[p.0] += ws.pose[i].force_to_parent(f);
        }
    }
}

/// The velocity of a joint's body and the velocity product of its acceleration, both in the body.
///
/// ```text
/// v = X v_parent + S q̇,   c = v × S q̇
/// ```
#[inline(always)]
pub(crate) fn velocity<S: Scalar>(
    joint: &Joint,
    pose: &Pose<S>,
    v_parent: Motion<S>,
    qd: &[S],
) -> (Motion<S>, Motion<S>) {
    let mut v = pose.motion_to_child(v_parent);
    match joint.kind {
        JointKind::Revolute { axis } => {
            let w = Vector3::on_axis(axis, joint_rate(joint, qd));
            v.angular += w;
            (v, Motion::new(v.angular.cross(w), v.linear.cross(w)))
        }
        JointKind::Prismatic { axis } => {
            let w = Vector3::on_axis(axis, joint_rate(joint, qd));
            v.linear += w;
            (v, Motion::new(Vector3::ZERO, v.angular.cross(w)))
        }
        JointKind::Floating => {
            let w = rate(joint, qd);
            v += w;
            (v, v.cross_motion(w))
        }
    }
}

/// S q̇: the motion of a joint's body against its parent, in the body.
#[inline(always)]
pub(crate) fn rate<S: Scalar>(joint: &Joint, qd: &[S]) -> Motion<S> {
    match joint.kind {
        JointKind::Floating => {
            let w = &qd[joint.first_dof..joint.first_dof + 6];
            Motion::new([w[0], w[1], w[2]].into(), [w[3], w[4], w[5]].into())
        }
        kind => kind.motion(0, joint_rate(joint, qd)),
    }
}

/// f = I a + v ×* I v.
#[inline(always)]
pub(crate) fn body_force<S: Scalar>(inertia: &Inertia<S>, v: Motion<S>, a: Motion<S>) -> Force<S> {
    inertia.times(a) + v.cross_force(inertia.times(v))
}

/// τ = τ + Sᵀ f.
#[inline(always)]
pub(crate) fn add_torque<S: Scalar>(joint: &Joint, f: Force<S>, tau: &mut [S]) {
    let dof = joint.first_dof;
    match joint.kind {
        JointKind::Floating => {
            for (t, f) in tau[dof..dof + 6].iter_mut().zip(f.to_array()) {
                *t += f;
            }
        }
        kind => tau[dof] += scaled(joint, kind.along(0, f)),
    }
}

/// A torque or a rate of a joint with one axis as its degree of freedom sees it: times the mimic's ratio.
#[inline(always)]
pub(crate) fn scaled<S: Scalar>(joint: &Joint, x: S) -> S {
    match joint.mimic {
        None => x,
        Some(mimic) => x * mimic.multiplier,
    }
}

#[inline(always)]
fn joint_rate<S: Scalar>(joint: &Joint, qd: &[S]) -> S {
    scaled(joint, qd[joint.first_dof])
}
