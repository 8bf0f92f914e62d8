//! Inverse dynamics: the recursive Newton–Euler algorithm.

use sinew_model::{Force, Inertia, Motion, Pose, Scalar, Segment, SegmentKind, Vector3, wide_forms};

use crate::scratch::Conditions;
use crate::{Bodies, MovingBodies, Scratch};

wide_forms! {
    avx2,
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
    pub fn inverse_dynamics_with<S: Scalar>(
        b: &Bodies<S>,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        tau: &mut [S],
    ) {
        let conditions = ws.take(b);
        inverse_dynamics(ws, &conditions, q, qd, qdd, |_| {}, tau);
    }
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn inverse_dynamics<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    push: impl Fn(&mut MovingBodies<S>),
    tau: &mut [S],
) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), qdd.len(), tau.len()), (nv, nv, nv), "qd, qdd, tau");
    let Scratch { mechanism, at, inertia, body, .. } = ws;
    mechanism.read(q, at);
    let ground = c.ground();
    body[0].acceleration = ground;
    // Along a chain the parent is the body before, and stays in registers.
    let mut last = (Motion::ZERO, ground);
    for (k, (segment, inertia)) in mechanism.segments().iter().zip(&*inertia).enumerate() {
        let pose = mechanism.pose(k, q, at);
        let (v_parent, a_parent) = if S::FITS_REGISTERS && segment.parent == k {
            last
        } else {
            let parent = &body[segment.parent];
            (parent.velocity, parent.acceleration)
        };
        // v = X v_parent + S q̇,   a = X a_parent + S q̈ + v × S q̇
        let (mut v, mut a) = if segment.parent == 0 {
            (Motion::ZERO, Motion::new(Vector3::ZERO, pose.rotation.transpose_mul(ground.linear)))
        } else {
            (pose.motion_to_child(v_parent), pose.motion_to_child(a_parent))
        };
        accelerate(segment, qd, qdd, &mut v, &mut a);
        let own = &mut body[k + 1];
        (own.pose, own.velocity, own.acceleration) = (pose, v, a);
        own.force = body_force(inertia, v, a);
        last = (v, a);
    }
    push(&mut MovingBodies(body));
    for dof in 0..nv {
        tau[dof] = c.armature(dof) * qdd[dof];
    }
    let mut carried = Force::ZERO;
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let mut f = body[k + 1].force;
        if S::FITS_REGISTERS {
            f += carried;
            carried = Force::ZERO;
        }
        add_torque(segment, f, tau);
        if segment.parent > 0 {
            // f_parent = f_parent + Xᵀ f
            let to_parent = body[k + 1].pose.force_to_parent(f);
            if S::FITS_REGISTERS && segment.parent == k {
                carried = to_parent;
            } else {
                body[segment.parent].force += to_parent;
            }
        }
    }
}

/// Adds what the joint does to the motion of its body, given in the body.
///
/// ```text
/// v = v + S q̇,   a = a + S q̈ + v × S q̇
/// ```
#[inline(always)]
fn accelerate<S: Scalar>(segment: &Segment, qd: &[S], qdd: &[S], v: &mut Motion<S>, a: &mut Motion<S>) {
    let dof = segment.first_dof;
    match segment.kind {
        SegmentKind::Turning => {
            let (w, w_rate) = (qd[dof] * segment.ratio, qdd[dof] * segment.ratio);
            v.angular.z += w;
            a.angular.x += v.angular.y * w;
            a.angular.y -= v.angular.x * w;
            a.angular.z += w_rate;
            a.linear.x += v.linear.y * w;
            a.linear.y -= v.linear.x * w;
        }
        SegmentKind::Sliding => {
            let (w, w_rate) = (qd[dof] * segment.ratio, qdd[dof] * segment.ratio);
            v.linear.z += w;
            a.linear.x += v.angular.y * w;
            a.linear.y -= v.angular.x * w;
            a.linear.z += w_rate;
        }
        SegmentKind::Free => {
            let w = segment.rate(qd);
            *v += w;
            *a += segment.rate(qdd) + v.cross_motion(w);
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
    segment: &Segment,
    pose: &Pose<S>,
    v_parent: Motion<S>,
    qd: &[S],
) -> (Motion<S>, Motion<S>) {
    let mut v = pose.motion_to_child(v_parent);
    let o = S::ZERO;
    match segment.kind {
        SegmentKind::Turning => {
            let w = qd[segment.first_dof] * segment.ratio;
            v.angular.z += w;
            let angular = [v.angular.y * w, -(v.angular.x * w), o];
            (v, Motion::new(angular.into(), [v.linear.y * w, -(v.linear.x * w), o].into()))
        }
        SegmentKind::Sliding => {
            let w = qd[segment.first_dof] * segment.ratio;
            v.linear.z += w;
            (v, Motion::new([o; 3].into(), [v.angular.y * w, -(v.angular.x * w), o].into()))
        }
        SegmentKind::Free => {
            let w = segment.rate(qd);
            v += w;
            (v, v.cross_motion(w))
        }
    }
}

/// f = I a + v ×* I v.
#[inline(always)]
pub(crate) fn body_force<S: Scalar>(inertia: &Inertia<S>, v: Motion<S>, a: Motion<S>) -> Force<S> {
    inertia.times(a) + v.cross_force(inertia.times(v))
}

/// τ = τ + Sᵀ f, f in the body.
#[inline(always)]
pub(crate) fn add_torque<S: Scalar>(segment: &Segment, f: Force<S>, tau: &mut [S]) {
    let dof = segment.first_dof;
    match segment.kind {
        SegmentKind::Turning => tau[dof] += f.angular.z * segment.ratio,
        SegmentKind::Sliding => tau[dof] += f.linear.z * segment.ratio,
        SegmentKind::Free => {
            for (t, f) in tau[dof..dof + 6].iter_mut().zip(f.to_array()) {
                *t += f;
            }
        }
    }
}
