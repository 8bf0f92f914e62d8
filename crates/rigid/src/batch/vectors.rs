//! Inverse and forward dynamics of many configurations.

use nalgebra::DMatrix;
use sinew_model::side_by_side::{count, gather, scatter};
use sinew_model::{Model, side_by_side};

use super::{Lane, Room};
use crate::{BatchWorkspace, Workspace, forward_dynamics_into, hybrid_dynamics, inverse_dynamics_into, rnea};

/// [`inverse_dynamics`](crate::inverse_dynamics) of many configurations.
///
/// ```text
/// τ_k = M(q_k) q̈_k + C(q_k, q̇_k) q̇_k + g(q_k)
/// ```
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `qdd`: count × nv likewise. Returns nv × count.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A pendulum held level and upright:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let q = [0.0, std::f64::consts::FRAC_PI_2];
/// let tau = sinew_rigid::inverse_dynamics_batch(&pendulum, &q, &[0.0; 2], &[0.0; 2]);
/// approx::assert_relative_eq!(tau[(0, 0)], 9.81, max_relative = 1e-12);
/// approx::assert_abs_diff_eq!(tau[(0, 1)], 0.0, epsilon = 1e-12);
/// ```
pub fn inverse_dynamics_batch(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> DMatrix<f64> {
    let mut tau = DMatrix::zeros(model.nv, count(q, model.nq));
    inverse_dynamics_batch_into(model, &mut BatchWorkspace::new(model), q, qd, qdd, tau.as_mut_slice());
    tau
}

/// [`inverse_dynamics_batch`] without allocation, into the count × nv numbers of `tau`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_dynamics_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    let size = model.nv * count(q, model.nq);
    assert_eq!((qd.len(), qdd.len(), tau.len()), (size, size, size), "qd, qdd, tau");
    run_inverse(&mut ws.room, model, q, qd, qdd, tau);
}

/// [`forward_dynamics`](crate::forward_dynamics) of many configurations.
///
/// ```text
/// q̈_k = M(q_k)⁻¹ (τ_k − C(q_k, q̇_k) q̇_k − g(q_k))
/// ```
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `tau`: count × nv likewise. Returns nv × count.
///
/// # Panics
/// If a slice has the wrong length.
pub fn forward_dynamics_batch(model: &Model, q: &[f64], qd: &[f64], tau: &[f64]) -> DMatrix<f64> {
    let mut qdd = DMatrix::zeros(model.nv, count(q, model.nq));
    forward_dynamics_batch_into(model, &mut BatchWorkspace::new(model), q, qd, tau, qdd.as_mut_slice());
    qdd
}

/// [`forward_dynamics_batch`] without allocation, into the count × nv numbers of `qdd`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn forward_dynamics_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) {
    let size = model.nv * count(q, model.nq);
    assert_eq!((qd.len(), tau.len(), qdd.len()), (size, size, size), "qd, tau, qdd");
    run_forward(&mut ws.room, model, q, qd, tau, qdd);
}

side_by_side! {
    fn run_inverse(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]), inverse_in_lanes, inverse_one_by_one
}

#[inline(always)]
fn inverse_in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, qd: qd_lanes, x, matrices: [output, ..], .. } = lane;
    let output = &mut output[..model.nv];
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        gather(qd, first, qd_lanes);
        gather(qdd, first, x);
        rnea::inverse_dynamics(scratch, &conditions, q_lanes, qd_lanes, x, |_| {}, output);
        scatter(output, first, tau);
    }
}

fn inverse_one_by_one(
    ws: &mut Workspace,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    for (k, q) in q.chunks_exact(model.nq.max(1)).enumerate() {
        let own = model.nv * k..model.nv * (k + 1);
        inverse_dynamics_into(model, ws, q, &qd[own.clone()], &qdd[own.clone()], &mut tau[own]);
    }
}

side_by_side! {
    fn run_forward(model: &Model, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]), forward_in_lanes, forward_one_by_one
}

#[inline(always)]
fn forward_in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, qd: qd_lanes, x, matrices: [output, ..], .. } = lane;
    let output = &mut output[..model.nv];
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        gather(qd, first, qd_lanes);
        gather(tau, first, x);
        hybrid_dynamics::forward_dynamics(scratch, &conditions, q_lanes, qd_lanes, x, |_| {}, output);
        scatter(output, first, qdd);
    }
}

fn forward_one_by_one(
    ws: &mut Workspace,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) {
    for (k, q) in q.chunks_exact(model.nq.max(1)).enumerate() {
        let own = model.nv * k..model.nv * (k + 1);
        forward_dynamics_into(model, ws, q, &qd[own.clone()], &tau[own.clone()], &mut qdd[own]);
    }
}
