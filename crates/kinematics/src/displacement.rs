//! Positions that are not vectors: floating bases.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::{Joint, JointKind, Matrix3, Model, Scalar, Vector3, math};

/// The position reached from `q` by the displacement `d`.
///
/// ```text
/// joints: q + d;   floating bases: T · exp(d), d in the base's own axes
/// ```
///
/// `q`: nq, rad (m), quaternions of length one. `d`: nv, [turn; shift] for a floating base. Returns nq.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// Joints simply add:
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// assert_eq!(sinew_kinematics::integrate(&arm, &[0.5, 1.0], &[0.25, -1.0]), [0.75, 0.0]);
/// ```
/// Source: Solà, Deray, Atchuthan, *A micro Lie theory for state estimation in robotics*, 2018, appendix D.
pub fn integrate(model: &Model, q: &[f64], d: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; model.nq];
    integrate_into(model, q, d, &mut out);
    out
}

/// [`integrate`] without allocation, into the nq numbers of `out`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn integrate_into(model: &Model, q: &[f64], d: &[f64], out: &mut [f64]) {
    assert_eq!((q.len(), d.len(), out.len()), (model.nq, model.nv, model.nq), "q, d, out");
    for joint in free_joints(model) {
        let (i, k) = (joint.first_q, joint.first_dof);
        if joint.kind == JointKind::Floating {
            out[i..i + 7].copy_from_slice(&move_base(seven(&q[i..]), six(&d[k..])));
        } else {
            out[i] = q[i] + d[k];
        }
    }
}

/// The displacement that leads from `from` to `to`: the inverse of [`integrate`].
///
/// ```text
/// joints: to − from;   floating bases: log(T_from⁻¹ T_to)
/// ```
///
/// `from`, `to`: nq. Returns nv. Turns of more than half a revolution of a floating base come back as the shorter
/// way round.
///
/// # Panics
/// If a slice has the wrong length.
pub fn difference(model: &Model, from: &[f64], to: &[f64]) -> Vec<f64> {
    let mut d = vec![0.0; model.nv];
    difference_into(model, from, to, &mut d);
    d
}

/// [`difference`] without allocation, into the nv numbers of `d`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn difference_into(model: &Model, from: &[f64], to: &[f64], d: &mut [f64]) {
    assert_eq!((from.len(), to.len(), d.len()), (model.nq, model.nq, model.nv), "from, to, d");
    for joint in free_joints(model) {
        let (i, k) = (joint.first_q, joint.first_dof);
        if joint.kind == JointKind::Floating {
            d[k..k + 6].copy_from_slice(&base_displacement(seven(&from[i..]), seven(&to[i..])));
        } else {
            d[k] = to[i] - from[i];
        }
    }
}

/// How fast the numbers of a position change at the velocity `qd`.
///
/// ```text
/// joints: q̇;   floating bases: ṗ = R v, quaternion rate = ½ quaternion · ω
/// ```
///
/// `q`: nq. `qd`: nv. Returns nq numbers: what an integrator of q adds up.
///
/// # Panics
/// If a slice has the wrong length.
pub fn position_rate(model: &Model, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut rate = vec![0.0; model.nq];
    position_rate_with(model, q, qd, &mut rate);
    rate
}

/// [`position_rate`] for any kind of number, without allocation, into the nq numbers of `rate`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn position_rate_with<S: Scalar>(model: &Model, q: &[S], qd: &[S], rate: &mut [S]) {
    assert_eq!((q.len(), qd.len(), rate.len()), (model.nq, model.nv, model.nq), "q, qd, rate");
    for joint in free_joints(model) {
        let (i, k) = (joint.first_q, joint.first_dof);
        if joint.kind == JointKind::Floating {
            let (r, d) = (&q[i + 3..i + 7], &qd[k..k + 6]);
            let shift = Matrix3::from_quaternion(r[0], r[1], r[2], r[3]) * Vector3::new(d[3], d[4], d[5]);
            let turn = product([r[0], r[1], r[2], r[3]], [d[0], d[1], d[2], S::ZERO]);
            rate[i..i + 3].copy_from_slice(&shift.to_array());
            rate[i + 3..i + 7].copy_from_slice(&turn.map(|x| x * 0.5));
        } else {
            rate[i] = qd[k];
        }
    }
}

fn free_joints(model: &Model) -> impl Iterator<Item = &Joint> {
    model.joints.iter().filter(|j| j.mimic.is_none())
}

fn seven(x: &[f64]) -> [f64; 7] {
    core::array::from_fn(|i| x[i])
}

fn six(x: &[f64]) -> [f64; 6] {
    core::array::from_fn(|i| x[i])
}

// p' = p + R V(w) v,   quaternion' = quaternion · exp(w/2)
fn move_base([px, py, pz, x, y, z, w]: [f64; 7], d: [f64; 6]) -> [f64; 7] {
    let turn = Vector3::new(d[0], d[1], d[2]);
    let shift = Vector3::new(d[3], d[4], d[5]);
    let angle = turn.norm();
    // V v = v + b w × v + c w × (w × v),   b = (1 − cos α)/α²,   c = (α − sin α)/α³
    let (b, c) = if angle < SMALL {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        let half = math::sin(angle / 2.0);
        (2.0 * half * half / (angle * angle), (angle - math::sin(angle)) / (angle * angle * angle))
    };
    let once = turn.cross(shift);
    let arc = shift + once * b + turn.cross(once) * c;
    let p = Matrix3::from_quaternion(x, y, z, w) * arc;
    let k = if angle < SMALL { 0.5 - angle * angle / 48.0 } else { math::sin(angle / 2.0) / angle };
    let r = product([x, y, z, w], [turn.x * k, turn.y * k, turn.z * k, math::cos(angle / 2.0)]);
    let length = math::sqrt(r.iter().map(|r| r * r).sum::<f64>());
    [px + p.x, py + p.y, pz + p.z, r[0] / length, r[1] / length, r[2] / length, r[3] / length]
}

fn base_displacement(from: [f64; 7], to: [f64; 7]) -> [f64; 6] {
    let inverse = [-from[3], -from[4], -from[5], from[6]];
    let mut r = product(inverse, [to[3], to[4], to[5], to[6]]);
    if r[3] < 0.0 {
        r = r.map(|r| -r);
    }
    // w = 2 atan2(|r|, r_w) r/|r|
    let axis = Vector3::new(r[0], r[1], r[2]);
    let sine = axis.norm();
    let angle = 2.0 * math::atan2(sine, r[3]);
    let ratio = sine / r[3];
    let turn = axis * if sine < SMALL { (2.0 - 2.0 / 3.0 * ratio * ratio) / r[3] } else { angle / sine };
    let p = Vector3::new(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    let p = Matrix3::from_quaternion(from[3], from[4], from[5], from[6]).transpose_mul(p);
    // V⁻¹ p = p − ½ w × p + e w × (w × p),   e = (1 − (α/2) cot(α/2))/α²
    let e = if angle < SMALL {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - angle / 2.0 * r[3] / sine) / (angle * angle)
    };
    let once = turn.cross(p);
    let shift = p - once * 0.5 + turn.cross(once) * e;
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

// Hamilton's product of quaternions x, y, z, w.
#[inline(always)]
fn product<S: Scalar>([ax, ay, az, aw]: [S; 4], [bx, by, bz, bw]: [S; 4]) -> [S; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// Below this angle series are exact to rounding: their next terms are of order α⁴ < 1e-16.
const SMALL: f64 = 1e-4;
