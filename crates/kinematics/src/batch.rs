//! Jacobians of many configurations at once, in vector registers.

use alloc::vec::Vec;

use nalgebra::DMatrix;
use sinew_model::side_by_side::{count, gather, scatter, zeros};
use sinew_model::{Lanes, LinkId, Model, side_by_side};

use crate::jacobian::columns;
use crate::{Axes, Scratch, Workspace, jacobian_into};

/// Scratch space of the batch forms; nothing is allocated after `new`.
///
/// Belongs to the model it was made of.
#[derive(Debug, Clone)]
pub struct BatchWorkspace {
    room: Room,
}

type Room = sinew_model::side_by_side::Room<Lane<8>, Lane<4>, Workspace>;

#[derive(Debug, Clone)]
struct Lane<const N: usize> {
    scratch: Scratch<Lanes<N>>,
    q: Vec<Lanes<N>>,
    J: Vec<Lanes<N>>,
}

impl BatchWorkspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        Self { room: Room::new(|| Lane::new(model), || Lane::new(model), || Workspace::new(model)) }
    }
}

impl<const N: usize> Lane<N> {
    fn new(model: &Model) -> Self {
        Self { scratch: Scratch::new(model), q: zeros(model.nq), J: zeros(6 * model.nv) }
    }
}

/// [`jacobian`](crate::jacobian) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other. Returns 6 nv × count: each column is one J by columns.
///
/// # Panics
/// If `q` is not a whole number of configurations or there is no such link.
///
/// # Example
/// A link one metre from its pivot moves upward where the arm is level and inward where it is upright:
/// ```
/// use sinew_kinematics::{Axes, jacobian_batch};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let q = [0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0];
/// let J = jacobian_batch(&arm, &q, arm.last_link(), Axes::WorldAligned);
/// assert_eq!((J[(5, 0)], J[(3, 1)]), (1.0, -1.0));
/// ```
pub fn jacobian_batch(model: &Model, q: &[f64], link: LinkId, axes: Axes) -> DMatrix<f64> {
    let mut J = DMatrix::zeros(6 * model.nv, count(q, model.nq));
    jacobian_batch_into(model, &mut BatchWorkspace::new(model), q, link, axes, J.as_mut_slice());
    J
}

/// [`jacobian_batch`] without allocation, into the count × 6 nv numbers of `J`.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn jacobian_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    link: LinkId,
    axes: Axes,
    J: &mut [f64],
) {
    assert_eq!(J.len(), 6 * model.nv * count(q, model.nq), "J");
    run(&mut ws.room, model, q, link, axes, J);
}

side_by_side! {
    fn run(model: &Model, q: &[f64], link: LinkId, axes: Axes, J: &mut [f64]), in_lanes, one_by_one
}

#[inline(always)]
fn in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    link: LinkId,
    axes: Axes,
    J: &mut [f64],
) {
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, &mut lane.q);
        columns(model, &mut lane.scratch, &lane.q, link, axes, &mut lane.J);
        scatter(&lane.J, first, J);
    }
}

fn one_by_one(ws: &mut Workspace, model: &Model, q: &[f64], link: LinkId, axes: Axes, J: &mut [f64]) {
    for (q, J) in q.chunks_exact(model.nq.max(1)).zip(J.chunks_exact_mut((6 * model.nv).max(1))) {
        jacobian_into(model, ws, q, link, axes, J);
    }
}
