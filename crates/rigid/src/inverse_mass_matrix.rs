//! The inverse of the mass matrix.

use nalgebra::DMatrix;
use sinew_model::{Model, Scalar, wide_forms};

use crate::mass_matrix::{packed_triangle, upper_triangle};
use crate::scratch::Conditions;
use crate::{Bodies, Scratch, Workspace};

/// The inverse of the mass matrix: the accelerations of unit torques.
///
/// ```text
/// q̈ = M(q)⁻¹ τ   at rest without gravity
/// ```
///
/// `q`: nq, rad (m). Returns nv × nv, symmetric. Cost O(n² · depth).
///
/// M is factored without touching the zeros of branches that do not carry each other.
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// For one pendulum it is 1/(m l²):
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// assert_eq!(sinew_rigid::inverse_mass_matrix(&pendulum, &[0.3])[(0, 0)], 1.0 / (2.0 * 0.25));
/// ```
pub fn inverse_mass_matrix(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let mut M_inverse = DMatrix::zeros(model.nv, model.nv);
    inverse_mass_matrix_into(model, &mut Workspace::new(model), q, M_inverse.as_mut_slice());
    M_inverse
}

wide_forms! {
    avx2,
    /// [`inverse_mass_matrix`] without allocation, into the nv × nv numbers of `M_inverse` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn inverse_mass_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], M_inverse: &mut [f64]) {
        let (conditions, scratch, _) = ws.open(model);
        invert(scratch, &conditions, q, M_inverse);
    }
}

/// [`inverse_mass_matrix_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_mass_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], M_inverse: &mut [S]) {
    let conditions = ws.take_composites(b);
    invert(ws, &conditions, q, M_inverse);
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn invert<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], M_inverse: &mut [S]) {
    assert_eq!(M_inverse.len(), ws.mechanism.nv() * ws.mechanism.nv(), "M_inverse");
    invert_grouped(ws, c, q);
    ws.grouped.store(M_inverse);
}

/// The same, left in the workspace.
#[inline(always)]
pub(crate) fn invert_grouped<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S]) {
    if ws.mechanism.has_mimic() {
        let mut M = core::mem::take(&mut ws.matrix);
        upper_triangle(ws, c, q, &mut M);
        ws.grouped.load(&ws.support, &M);
        ws.matrix = M;
    } else {
        let mut grouped = core::mem::take(&mut ws.grouped);
        let (stride, M) = grouped.packed();
        packed_triangle(ws, c, q, stride, M);
        ws.grouped = grouped;
    }
    ws.grouped.factor(&ws.support, &mut ws.column);
    ws.grouped.invert(&ws.support, &mut ws.column);
}
