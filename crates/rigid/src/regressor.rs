//! The regressor: torques as a linear map of the inertial parameters.

use nalgebra::DMatrix;
use sinew_model::{Matrix3, Model, Motion, Pose, Scalar, Vector3, wide_forms};

use crate::scratch::Conditions;
use crate::{Bodies, Scratch, Workspace};

/// Inertial parameters of one body.
pub const PARAMETERS: usize = 10;

/// The joint-torque regressor: inverse dynamics as a linear map of the inertial parameters.
///
/// ```text
/// τ = Y(q, q̇, q̈) π,   π = [m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz] of each body in turn
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. Returns nv × 10 n; moments about the body's origin. Cost O(n · depth).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A level pendulum held still feels g times its first moment along the rod:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let Y = sinew_rigid::regressor(&pendulum, &[0.0], &[0.0], &[0.0]);
/// approx::assert_relative_eq!(Y[(0, 1)], 9.81, max_relative = 1e-12);
/// ```
/// Source: Atkeson, An, Hollerbach, *Estimation of inertial parameters of manipulator loads and links*,
/// Int. J. Robotics Research 5(3), 1986.
pub fn regressor(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> DMatrix<f64> {
    let mut Y = DMatrix::zeros(model.nv, PARAMETERS * model.joints.len());
    regressor_into(model, &mut Workspace::new(model), q, qd, qdd, Y.as_mut_slice());
    Y
}

wide_forms! {
    avx2,
    /// [`regressor`] without allocation, into the nv × 10 n numbers of `Y` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn regressor_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64], qdd: &[f64], Y: &mut [f64]) {
        let (conditions, scratch, _) = ws.open(model);
        rows(scratch, &conditions, q, qd, qdd, Y);
    }
}

wide_forms! {
    avx2,
    /// [`regressor_into`] for any kind of number; the inertias and the armature of `b` are not looked at.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn regressor_with<S: Scalar>(
        b: &Bodies<S>,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        Y: &mut [S],
    ) {
        ws.mechanism.check(b.model);
        let conditions = Conditions { gravity: b.gravity, armature: &[] };
        rows(ws, &conditions, q, qd, qdd, Y);
    }
}

#[inline(always)]
fn rows<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], qd: &[S], qdd: &[S], Y: &mut [S]) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), qdd.len()), (nv, nv), "qd, qdd");
    assert_eq!(Y.len(), nv * PARAMETERS * ws.inertia.len(), "Y");
    start(ws, c, q);
    for (k, block) in Y.chunks_exact_mut((nv * PARAMETERS).max(1)).enumerate() {
        block.fill(S::ZERO);
        body_rows(ws, k, qd, qdd, block);
    }
}

/// Poses of all bodies, and how the world moves.
#[inline(always)]
pub(crate) fn start<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S]) {
    ws.poses_about_roots(q);
    ws.body[0].acceleration = c.ground();
}

/// Adds the columns of segment `k`, nv × 10; segments are taken in turn.
#[inline(always)]
pub(crate) fn body_rows<S: Scalar>(ws: &mut Scratch<S>, k: usize, qd: &[S], qdd: &[S], block: &mut [S]) {
    let Scratch { mechanism, world, body, axis, .. } = ws;
    let (segments, nv) = (mechanism.segments(), mechanism.nv());
    let segment = &segments[k];
    // v = v_parent + Σ s q̇,   a = a_parent + Σ s q̈ + v × Σ s q̇, in the world's axes
    let (mut moved, mut pushed) = (Motion::ZERO, Motion::ZERO);
    for (l, axis) in axis[segment.first_axis..][..segment.nv()].iter_mut().enumerate() {
        axis.s = segment.axis(l, &world[k + 1]);
        moved += axis.s * qd[segment.first_dof + l];
        pushed += axis.s * qdd[segment.first_dof + l];
    }
    let v = body[segment.parent].velocity + moved;
    let a = body[segment.parent].acceleration + pushed + v.cross_motion(moved);
    (body[k + 1].velocity, body[k + 1].acceleration) = (v, a);
    // the parameters are told in the link's frame
    let pose = Pose::new(segment.link_axes(&world[k + 1].rotation), world[k + 1].translation);
    let torques = Torques::new(pose.motion_to_child(v), pose.motion_to_child(a));
    let mut row = k + 1;
    while row > 0 {
        let carrier = &segments[row - 1];
        for (l, axis) in axis[carrier.first_axis..][..carrier.nv()].iter().enumerate() {
            let along = torques.along(pose.motion_to_child(axis.s));
            let entries = &mut block[carrier.first_dof + l..];
            for p in 0..PARAMETERS {
                entries[nv * p] += along[p];
            }
        }
        row = carrier.parent;
    }
}

/// The torque along any axis of each of a body's ten parameters, all in the body.
///
/// ```text
/// s·f = m s_v·b + h·(b × s_ω + K s_v) + s_ω·I α + (s_ω × ω)·I ω,   b = a + ω × v,   K = [ω]× [ω]× − [α]×
/// ```
struct Torques<S> {
    point: Vector3<S>,
    K: Matrix3<S>,
    // of Ixx, Ixy, Iyy, Ixz, Iyz, Izz
    turning: [Vector3<S>; 6],
}

impl<S: Scalar> Torques<S> {
    #[inline(always)]
    fn new(v: Motion<S>, a: Motion<S>) -> Self {
        let (w, d) = (v.angular, a.angular);
        let K = Matrix3::skew(w).crossed_by(w) - Matrix3::skew(d);
        // (s × ω)_x = s_y ω_z − s_z ω_y and so on
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
        let turning = [
            Vector3::new(d.x, xz, -xy),
            Vector3::new(d.y - xz, d.x + yz, xx - yy),
            Vector3::new(-yz, d.y, xy),
            Vector3::new(d.z + xy, zz - xx, d.x - yz),
            Vector3::new(yy - zz, d.z - xy, d.y + xz),
            Vector3::new(yz, -xz, d.z),
        ];
        Self { point: a.linear + w.cross(v.linear), K, turning }
    }

    #[inline(always)]
    fn along(&self, s: Motion<S>) -> [S; PARAMETERS] {
        let h = self.point.cross(s.angular) + self.K * s.linear;
        let w = s.angular;
        let [xx, xy, yy, xz, yz, zz] = self.turning;
        let turning = [xx.dot(w), xy.dot(w), yy.dot(w), xz.dot(w), yz.dot(w), zz.dot(w)];
        let [xx, xy, yy, xz, yz, zz] = turning;
        [s.linear.dot(self.point), h.x, h.y, h.z, xx, xy, yy, xz, yz, zz]
    }
}
