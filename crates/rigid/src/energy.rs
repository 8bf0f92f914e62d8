//! Kinetic and potential energy.

use sinew_model::{Model, Scalar, wide_forms};

use crate::rnea::velocity;
use crate::scratch::Conditions;
use crate::{Bodies, Scratch, Workspace};

/// Kinetic energy of all moving bodies.
///
/// ```text
/// T = ½ Σ vᵀ I v = ½ q̇ᵀ M(q) q̇
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns J. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A pendulum at 3 rad/s has ½ m l² ω²:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// assert_eq!(sinew_rigid::kinetic_energy(&pendulum, &[0.7], &[3.0]), 0.5 * 2.0 * 0.25 * 9.0);
/// ```
pub fn kinetic_energy(model: &Model, q: &[f64], qd: &[f64]) -> f64 {
    kinetic_energy_into(model, &mut Workspace::new(model), q, qd)
}

wide_forms! {
    avx2,
    /// [`kinetic_energy`] without allocation.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn kinetic_energy_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64]) -> f64 {
        let (conditions, scratch, _) = ws.open(model);
        kinetic(scratch, &conditions, q, qd)
    }
}

/// Potential energy of all moving bodies in gravity, 0 at the world's origin.
///
/// ```text
/// U = −Σ gᵀ (m p + R h)
/// ```
///
/// `q`: nq, rad (m). Returns J. Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// An upright pendulum has m g l:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let energy = sinew_rigid::potential_energy(&pendulum, &[std::f64::consts::FRAC_PI_2]);
/// approx::assert_relative_eq!(energy, 2.0 * 9.81 * 0.5, max_relative = 1e-12);
/// ```
pub fn potential_energy(model: &Model, q: &[f64]) -> f64 {
    potential_energy_into(model, &mut Workspace::new(model), q)
}

wide_forms! {
    avx2,
    /// [`potential_energy`] without allocation.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn potential_energy_into(model: &Model, ws: &mut Workspace, q: &[f64]) -> f64 {
        let (conditions, scratch, _) = ws.open(model);
        potential(scratch, &conditions, q)
    }
}

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
pub fn kinetic_energy_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], qd: &[S]) -> S {
    let conditions = ws.take(b);
    kinetic(ws, &conditions, q, qd)
}

#[inline(always)]
fn kinetic<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], qd: &[S]) -> S {
    let nv = ws.mechanism.nv();
    assert_eq!(qd.len(), nv, "qd");
    let Scratch { mechanism, at, inertia, body, .. } = ws;
    mechanism.read(q, at);
    let mut twice = S::ZERO;
    for (k, (segment, inertia)) in mechanism.segments().iter().zip(&*inertia).enumerate() {
        let pose = mechanism.pose(k, q, at);
        let v_parent = body[segment.parent].velocity;
        let (v, _) = velocity(segment, &pose, v_parent, qd);
        twice += inertia.times(v).dot(v);
        body[k + 1].velocity = v;
    }
    for dof in 0..nv {
        twice += c.armature(dof) * qd[dof] * qd[dof];
    }
    twice * 0.5
}

/// [`potential_energy_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
pub fn potential_energy_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S]) -> S {
    let conditions = ws.take(b);
    potential(ws, &conditions, q)
}

#[inline(always)]
fn potential<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S]) -> S {
    let Scratch { mechanism, at, inertia, world, .. } = ws;
    mechanism.world_poses(q, at, world);
    let mut energy = S::ZERO;
    for (pose, inertia) in world[1..].iter().zip(&*inertia) {
        energy -= c.gravity.dot(pose.translation * inertia.mass + pose.rotation * inertia.first_moment);
    }
    energy
}
