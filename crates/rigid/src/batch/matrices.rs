//! The mass matrix of many configurations and its inverse.

use nalgebra::DMatrix;
use sinew_model::side_by_side::{Rows, count, gather, scatter};
use sinew_model::{Model, side_by_side};

use super::{Lane, Room};
use crate::inverse_mass_matrix::invert_grouped;
use crate::mass_matrix::{composite_bodies, upper_triangle};
use crate::{BatchWorkspace, Workspace, inverse_mass_matrix_into, mass_matrix_into, mass_matrix_upper_into};

/// [`mass_matrix`](crate::mass_matrix) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other. Returns nv² × count: each column is one M by columns.
///
/// # Panics
/// If `q` is not a whole number of configurations.
pub fn mass_matrix_batch(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let mut M = DMatrix::zeros(model.nv * model.nv, count(q, model.nq));
    mass_matrix_batch_into(model, &mut BatchWorkspace::new(model), q, M.as_mut_slice());
    M
}

/// [`mass_matrix_batch`] without allocation, into the count × nv² numbers of `M`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn mass_matrix_batch_into(model: &Model, ws: &mut BatchWorkspace, q: &[f64], M: &mut [f64]) {
    assert_size(model, q, M);
    run_triangles(&mut ws.room, model, q, Triangles::Both, M);
}

/// [`mass_matrix_upper_into`] of many configurations: leaves what it does not write as it is, with mimic joints what is
/// below the diagonal too.
///
/// # Panics
/// If a slice has the wrong length.
pub fn mass_matrix_upper_batch_into(model: &Model, ws: &mut BatchWorkspace, q: &[f64], M: &mut [f64]) {
    assert_size(model, q, M);
    run_triangles(&mut ws.room, model, q, Triangles::Upper, M);
}

/// [`inverse_mass_matrix`](crate::inverse_mass_matrix) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other. Returns nv² × count: each column is one M⁻¹ by columns.
///
/// # Panics
/// If `q` is not a whole number of configurations.
pub fn inverse_mass_matrix_batch(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let mut M_inverse = DMatrix::zeros(model.nv * model.nv, count(q, model.nq));
    inverse_mass_matrix_batch_into(model, &mut BatchWorkspace::new(model), q, M_inverse.as_mut_slice());
    M_inverse
}

/// [`inverse_mass_matrix_batch`] without allocation, into the count × nv² numbers of `M_inverse`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_mass_matrix_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    M_inverse: &mut [f64],
) {
    assert_size(model, q, M_inverse);
    run_inverse(&mut ws.room, model, q, M_inverse);
}

fn assert_size(model: &Model, q: &[f64], M: &[f64]) {
    assert_eq!(M.len(), model.nv * model.nv * count(q, model.nq), "M");
}

/// Which triangles of a symmetric matrix are written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Triangles {
    /// The upper one, without its zeros.
    Upper,
    /// Both, zeros too.
    Both,
}

side_by_side! {
    fn run_triangles(model: &Model, q: &[f64], which: Triangles, M: &mut [f64]),
    triangles_in_lanes, triangles_one_by_one
}
side_by_side! {
    fn run_inverse(model: &Model, q: &[f64], M: &mut [f64]), inverse_in_lanes, inverse_one_by_one
}

#[inline(always)]
fn triangles_in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    q: &[f64],
    which: Triangles,
    M: &mut [f64],
) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, matrices: [output, ..], .. } = lane;
    let (nv, size) = (model.nv, output.len());
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        if which == Triangles::Both {
            composite_bodies(scratch, &conditions, q_lanes, output);
            scatter(output, first, M);
            continue;
        }
        upper_triangle(scratch, &conditions, q_lanes, output);
        let mut rows = Rows::new(M, first, size);
        for j in 0..nv {
            for &(start, end) in scratch.support.carriers(j) {
                rows.put(&output[nv * j + start..nv * j + end], nv * j + start);
            }
        }
    }
}

#[inline(always)]
fn inverse_in_lanes<const N: usize>(lane: &mut Lane<N>, model: &Model, q: &[f64], M: &mut [f64]) {
    let conditions = lane.conditions(model);
    let Lane { scratch, q: q_lanes, matrices: [output, ..], .. } = lane;
    let nv = model.nv;
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, q_lanes);
        invert_grouped(scratch, &conditions, q_lanes);
        // short columns are moved in one piece
        if nv < 2 * N {
            scratch.grouped.store(output);
            scatter(output, first, M);
            continue;
        }
        let mut rows = Rows::new(M, first, nv * nv);
        for k in 0..nv {
            rows.put(scratch.grouped.inverse_column(k), nv * k);
        }
    }
}

fn triangles_one_by_one(ws: &mut Workspace, model: &Model, q: &[f64], which: Triangles, M: &mut [f64]) {
    let plain = if which == Triangles::Both { mass_matrix_into } else { mass_matrix_upper_into };
    one_by_one(ws, model, q, M, plain);
}
fn inverse_one_by_one(ws: &mut Workspace, model: &Model, q: &[f64], M: &mut [f64]) {
    one_by_one(ws, model, q, M, inverse_mass_matrix_into);
}

fn one_by_one(
    ws: &mut Workspace,
    model: &Model,
    q: &[f64],
    M: &mut [f64],
    plain: fn(&Model, &mut Workspace, &[f64], &mut [f64]),
) {
    for (q, M) in q.chunks_exact(model.nq.max(1)).zip(M.chunks_exact_mut((model.nv * model.nv).max(1))) {
        plain(model, ws, q, M);
    }
}
