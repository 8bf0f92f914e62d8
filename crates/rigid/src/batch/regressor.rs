//! The regressor of many configurations.

use nalgebra::DMatrix;
use sinew_model::side_by_side::{Rows, count, gather};
use sinew_model::{Lanes, Model, Scalar, side_by_side};

use super::{Lane, Room};
use crate::regressor::{body_rows, start};
use crate::{BatchWorkspace, PARAMETERS, Workspace, regressor_into};

/// [`regressor`](crate::regressor) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `qdd`: count × nv likewise. Returns
/// (nv · 10 n) × count: each column is one Y by columns.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A pendulum held level and upright feels g times one first moment and the other:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let q = [0.0, std::f64::consts::FRAC_PI_2];
/// let Y = sinew_rigid::regressor_batch(&pendulum, &q, &[0.0; 2], &[0.0; 2]);
/// approx::assert_relative_eq!(Y[(1, 0)], 9.81, max_relative = 1e-12);
/// approx::assert_relative_eq!(Y[(3, 1)], -9.81, max_relative = 1e-12);
/// ```
pub fn regressor_batch(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> DMatrix<f64> {
    let mut Y = DMatrix::zeros(size(model), count(q, model.nq));
    regressor_batch_into(model, &mut BatchWorkspace::new(model), q, qd, qdd, Y.as_mut_slice());
    Y
}

/// [`regressor_batch`] without allocation, into the count × nv × 10 n numbers of `Y`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn regressor_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    Y: &mut [f64],
) {
    let count = count(q, model.nq);
    assert_eq!((qd.len(), qdd.len()), (model.nv * count, model.nv * count), "qd, qdd");
    assert_eq!(Y.len(), size(model) * count, "Y");
    run(&mut ws.room, model, q, qd, qdd, Y);
}

fn size(model: &Model) -> usize {
    model.nv * PARAMETERS * model.joints.len()
}

side_by_side! {
    fn run(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64], Y: &mut [f64]), in_lanes, one_by_one
}

#[inline(always)]
fn in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    Y: &mut [f64],
) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, qd: qd_lanes, x, block, .. } = lane;
    let size = size(model);
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        gather(qd, first, qd_lanes);
        gather(qdd, first, x);
        start(scratch, &conditions, q_lanes);
        let mut rows = Rows::new(Y, first, size);
        for k in 0..model.joints.len() {
            block.fill(Lanes::ZERO);
            body_rows(scratch, k, qd_lanes, x, block);
            rows.put(block, k * block.len());
        }
    }
}

fn one_by_one(ws: &mut Workspace, model: &Model, q: &[f64], qd: &[f64], qdd: &[f64], Y: &mut [f64]) {
    let size = size(model);
    for (k, q) in q.chunks_exact(model.nq.max(1)).enumerate() {
        let own = model.nv * k..model.nv * (k + 1);
        regressor_into(model, ws, q, &qd[own.clone()], &qdd[own], &mut Y[size * k..size * (k + 1)]);
    }
}
