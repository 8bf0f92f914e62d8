//! Derivatives of inverse dynamics of many configurations.

use nalgebra::DMatrix;
use sinew_model::side_by_side::{count, gather, scatter};
use sinew_model::{Model, side_by_side};

use super::{Lane, Room};
use crate::inverse_dynamics_derivatives::differentiate;
use crate::{BatchWorkspace, InverseDynamicsDerivatives, Workspace, inverse_dynamics_derivatives_into};

/// [`inverse_dynamics_derivatives`](crate::inverse_dynamics_derivatives) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `qdd`: count × nv likewise. Each matrix of the
/// result is nv² × count: each column is one configuration's by columns.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// The slope −m g l sin q of a pendulum's torque, level and upright:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let q = [0.0, std::f64::consts::FRAC_PI_2];
/// let d = sinew_rigid::inverse_dynamics_derivatives_batch(&pendulum, &q, &[0.0; 2], &[0.0; 2]);
/// approx::assert_abs_diff_eq!(d.by_position[(0, 0)], 0.0, epsilon = 1e-12);
/// approx::assert_relative_eq!(d.by_position[(0, 1)], -9.81, max_relative = 1e-12);
/// ```
pub fn inverse_dynamics_derivatives_batch(
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> InverseDynamicsDerivatives {
    let zeros = || DMatrix::zeros(model.nv * model.nv, count(q, model.nq));
    let (mut by_q, mut by_qd, mut M) = (zeros(), zeros(), zeros());
    inverse_dynamics_derivatives_batch_into(
        model,
        &mut BatchWorkspace::new(model),
        q,
        qd,
        qdd,
        by_q.as_mut_slice(),
        by_qd.as_mut_slice(),
        M.as_mut_slice(),
    );
    InverseDynamicsDerivatives { by_position: by_q, by_velocity: by_qd, by_acceleration: M }
}

/// [`inverse_dynamics_derivatives_batch`] without allocation, into three times count × nv² numbers.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_dynamics_derivatives_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    by_position: &mut [f64],
    by_velocity: &mut [f64],
    by_acceleration: &mut [f64],
) {
    let (n, size) = (model.nv * count(q, model.nq), model.nv * model.nv * count(q, model.nq));
    assert_eq!((qd.len(), qdd.len()), (n, n), "qd, qdd");
    let lengths = (by_position.len(), by_velocity.len(), by_acceleration.len());
    assert_eq!(lengths, (size, size, size), "by_position, by_velocity, by_acceleration");
    run(&mut ws.room, model, q, qd, qdd, by_position, by_velocity, by_acceleration);
}

side_by_side! {
    fn run(
        model: &Model,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
        by_acceleration: &mut [f64],
    ), in_lanes, one_by_one
}

#[inline(always)]
fn in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    by_position: &mut [f64],
    by_velocity: &mut [f64],
    by_acceleration: &mut [f64],
) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, qd: qd_lanes, x, matrices: [by_q, by_qd, M], .. } = lane;
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        gather(qd, first, qd_lanes);
        gather(qdd, first, x);
        differentiate(scratch, &conditions, q_lanes, qd_lanes, x, by_q, by_qd, M);
        scatter(by_q, first, by_position);
        scatter(by_qd, first, by_velocity);
        scatter(M, first, by_acceleration);
    }
}

fn one_by_one(
    ws: &mut Workspace,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    by_position: &mut [f64],
    by_velocity: &mut [f64],
    by_acceleration: &mut [f64],
) {
    for (k, q) in q.chunks_exact(model.nq.max(1)).enumerate() {
        let (nv, size) = (model.nv, model.nv * model.nv);
        let (own, square) = (nv * k..nv * (k + 1), size * k..size * (k + 1));
        let by_position = &mut by_position[square.clone()];
        let (by_velocity, M) = (&mut by_velocity[square.clone()], &mut by_acceleration[square]);
        let (qd, qdd) = (&qd[own.clone()], &qdd[own]);
        inverse_dynamics_derivatives_into(model, ws, q, qd, qdd, by_position, by_velocity, M);
    }
}
