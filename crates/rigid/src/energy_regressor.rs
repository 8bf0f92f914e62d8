//! Energies as linear maps of the inertial parameters.

use nalgebra::DVector;
use sinew_model::{Model, Motion, Pose, Scalar, wide_forms};

use crate::{Bodies, PARAMETERS, Scratch, Workspace};

/// The kinetic energy as a linear map of the inertial parameters.
///
/// ```text
/// T = y(q, q̇)ᵀ π,   π as for the regressor
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns 10 n numbers. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A rod at 3 rad/s has half its inertia yy about the pivot times 9:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// assert_eq!(sinew_rigid::kinetic_energy_regressor(&pendulum, &[0.7], &[3.0])[6], 4.5);
/// ```
/// Source: Gautier, Khalil, *On the identification of the inertial parameters of robots*, CDC 1988.
pub fn kinetic_energy_regressor(model: &Model, q: &[f64], qd: &[f64]) -> DVector<f64> {
    let mut y = DVector::zeros(PARAMETERS * model.joints.len());
    kinetic_energy_regressor_into(model, &mut Workspace::new(model), q, qd, y.as_mut_slice());
    y
}

wide_forms! {
    avx2,
    /// [`kinetic_energy_regressor`] without allocation, into the 10 n numbers of `y`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn kinetic_energy_regressor_into(
        model: &Model,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        y: &mut [f64],
    ) {
        let (_, scratch, _) = ws.open(model);
        kinetic(scratch, q, qd, y);
    }
}

/// [`kinetic_energy_regressor_into`] for any kind of number; the inertias and the armature of `b` are not looked at.
///
/// # Panics
/// If a slice has the wrong length.
pub fn kinetic_energy_regressor_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    y: &mut [S],
) {
    ws.mechanism.check(b.model);
    kinetic(ws, q, qd, y);
}

/// The potential energy as a linear map of the inertial parameters.
///
/// ```text
/// U = y(q)ᵀ π,   0 at the world's origin
/// ```
///
/// `q`: nq, rad (m). Returns 10 n numbers. Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// An upright rod's first moment along itself is lifted by g:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let y = sinew_rigid::potential_energy_regressor(&pendulum, &[std::f64::consts::FRAC_PI_2]);
/// approx::assert_relative_eq!(y[1], 9.81, max_relative = 1e-12);
/// ```
pub fn potential_energy_regressor(model: &Model, q: &[f64]) -> DVector<f64> {
    let mut y = DVector::zeros(PARAMETERS * model.joints.len());
    potential_energy_regressor_into(model, &mut Workspace::new(model), q, y.as_mut_slice());
    y
}

wide_forms! {
    avx2,
    /// [`potential_energy_regressor`] without allocation, into the 10 n numbers of `y`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn potential_energy_regressor_into(model: &Model, ws: &mut Workspace, q: &[f64], y: &mut [f64]) {
        let (conditions, scratch, _) = ws.open(model);
        potential(scratch, conditions.gravity, q, y);
    }
}

/// [`potential_energy_regressor_into`] for any kind of number; only the gravity of `b` is looked at.
///
/// # Panics
/// If a slice has the wrong length.
pub fn potential_energy_regressor_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], y: &mut [S]) {
    ws.mechanism.check(b.model);
    potential(ws, b.gravity, q, y);
}

#[inline(always)]
fn kinetic<S: Scalar>(ws: &mut Scratch<S>, q: &[S], qd: &[S], y: &mut [S]) {
    assert_eq!(qd.len(), ws.mechanism.nv(), "qd");
    assert_eq!(y.len(), PARAMETERS * ws.inertia.len(), "y");
    ws.poses_about_roots(q);
    let Scratch { mechanism, world, body, .. } = ws;
    let each = mechanism.segments().iter().enumerate().zip(y.chunks_exact_mut(PARAMETERS));
    for ((k, segment), own) in each {
        let moved: Motion<S> = world[k + 1].motion_to_parent(segment.rate(qd));
        let v = body[segment.parent].velocity + moved;
        body[k + 1].velocity = v;
        let pose = Pose::new(segment.link_axes(&world[k + 1].rotation), world[k + 1].translation);
        let Motion { angular: w, linear } = pose.motion_to_child(v);
        // T = ½ m v·v + h·(v × ω) + ½ ω·I ω
        let h = linear.cross(w);
        own.copy_from_slice(&[
            linear.dot(linear) * 0.5,
            h.x,
            h.y,
            h.z,
            w.x * w.x * 0.5,
            w.x * w.y,
            w.y * w.y * 0.5,
            w.x * w.z,
            w.y * w.z,
            w.z * w.z * 0.5,
        ]);
    }
}

#[inline(always)]
fn potential<S: Scalar>(ws: &mut Scratch<S>, gravity: sinew_model::Vector3<S>, q: &[S], y: &mut [S]) {
    assert_eq!(y.len(), PARAMETERS * ws.inertia.len(), "y");
    let Scratch { mechanism, at, world, .. } = ws;
    mechanism.world_poses(q, at, world);
    y.fill(S::ZERO);
    for ((segment, pose), own) in
        mechanism.segments().iter().zip(&world[1..]).zip(y.chunks_exact_mut(PARAMETERS))
    {
        // U = −g·(m p + R h)
        let down = segment.link_axes(&pose.rotation).transpose_mul(gravity);
        own[..4].copy_from_slice(&[-gravity.dot(pose.translation), -down.x, -down.y, -down.z]);
    }
}
