//! The regressor: torques as a linear map of the inertial parameters.

use nalgebra::DMatrix;
use sinew_model::{Model, Motion, Scalar, Vector3};

use crate::rnea::{rate, scaled, velocity};
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

/// [`regressor`] without allocation, into the nv × 10 n numbers of `Y` by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn regressor_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64], qdd: &[f64], Y: &mut [f64]) {
    let (bodies, scratch, _) = ws.split(model);
    regressor_with(&bodies, scratch, q, qd, qdd, Y);
}

/// [`regressor_into`] for any kind of number; the inertias and the armature of `b` are not looked at.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn regressor_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    Y: &mut [S],
) {
    let (nv, n) = (b.model.nv, b.model.joints.len());
    assert_eq!((q.len(), qd.len(), qdd.len()), (b.model.nq, nv, nv), "q, qd, qdd");
    assert_eq!(Y.len(), nv * PARAMETERS * n, "Y");
    Y.fill(S::ZERO);
    for (i, joint) in b.model.joints.iter().enumerate() {
        let pose = joint.pose(q);
        let (world_from_parent, v_parent, a_parent) = match joint.parent {
            None => (None, Motion::ZERO, Motion::new(Vector3::ZERO, -b.gravity)),
            Some(p) => (Some(ws.pose[p.0]), ws.velocity[p.0], ws.acceleration[p.0]),
        };
        let (v, c) = velocity(joint, &pose, v_parent, qd);
        let a = pose.motion_to_child(a_parent) + rate(joint, qdd) + c;
        ws.pose[i] = world_from_parent.map_or(pose, |parent| parent * pose);
        (ws.velocity[i], ws.acceleration[i]) = (v, a);
        let mut ancestor = Some(i);
        while let Some(j) = ancestor {
            let carrier = &b.model.joints[j];
            for k in 0..carrier.kind.nv() {
                // s = the axis as body i feels it
                let unit = carrier.kind.motion(k, scaled(carrier, S::ONE));
                let s = ws.pose[i].motion_to_child(ws.pose[j].motion_to_parent(unit));
                let row = carrier.first_dof + k;
                for (p, entry) in along_axis(s, v, a).into_iter().enumerate() {
                    Y[row + nv * (PARAMETERS * i + p)] += entry;
                }
            }
            ancestor = carrier.parent.map(|p| p.0);
        }
    }
}

/// The torque along axis `s` of each of a body's ten parameters, all in the body.
///
/// ```text
/// s·f = m s_v·b + h·(b × s_ω − α × s_v + ω × (ω × s_v)) + s_ω·I α + (s_ω × ω)·I ω,   b = a + ω × v
/// ```
#[inline(always)]
fn along_axis<S: Scalar>(s: Motion<S>, v: Motion<S>, a: Motion<S>) -> [S; PARAMETERS] {
    let (w, alpha, omega) = (s.angular, a.angular, v.angular);
    let point = a.linear + omega.cross(v.linear);
    let h = point.cross(w) - alpha.cross(s.linear) + omega.cross(omega.cross(s.linear));
    let z = w.cross(omega);
    [
        s.linear.dot(point),
        h.x,
        h.y,
        h.z,
        w.x * alpha.x + z.x * omega.x,
        w.x * alpha.y + w.y * alpha.x + z.x * omega.y + z.y * omega.x,
        w.y * alpha.y + z.y * omega.y,
        w.x * alpha.z + w.z * alpha.x + z.x * omega.z + z.z * omega.x,
        w.y * alpha.z + w.z * alpha.y + z.y * omega.z + z.z * omega.y,
        w.z * alpha.z + z.z * omega.z,
    ]
}
