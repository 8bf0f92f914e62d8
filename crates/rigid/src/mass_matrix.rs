//! The mass matrix: the composite-rigid-body algorithm.

use nalgebra::DMatrix;
use sinew_model::{Force, Model, Scalar, Segment, SegmentKind, wide_forms};

use crate::scratch::Conditions;
use crate::{Bodies, Scratch, Workspace};

/// The mass matrix (composite rigid bodies).
///
/// ```text
/// M_ij = S_iᵀ X I_c,j S_j   for i on the way from j to the root;   T = ½ q̇ᵀ M(q) q̇
/// ```
///
/// `q`: nq, rad (m). Returns nv × nv, symmetric, kg·m² (kg·m, kg). Cost O(n · depth).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// A pendulum has m l²:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// assert_eq!(sinew_rigid::mass_matrix(&pendulum, &[0.3])[(0, 0)], 2.0 * 0.25);
/// ```
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 6.2.
pub fn mass_matrix(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let mut M = DMatrix::zeros(model.nv, model.nv);
    mass_matrix_into(model, &mut Workspace::new(model), q, M.as_mut_slice());
    M
}

wide_forms! {
    avx2,
    /// [`mass_matrix`] without allocation, into the nv × nv numbers of `M` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn mass_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], M: &mut [f64]) {
        let (conditions, scratch, _) = ws.open(model);
        composite_bodies(scratch, &conditions, q, M);
    }
}

wide_forms! {
    avx2,
    /// The upper triangle of [`mass_matrix`] without allocation, into the nv × nv numbers of `M` by columns.
    ///
    /// Only entries on and above the diagonal whose joints carry one another are written: the others above it are zero
    /// in every configuration. Who starts with zeros has the whole triangle after each call; with mimic joints, all of M.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// ```
    /// use sinew_rigid::{Workspace, mass_matrix, mass_matrix_upper_into};
    /// let arm = sinew_model::samples::planar_arm(2, 3.0, 0.7);
    /// let mut M = [0.0; 4];
    /// mass_matrix_upper_into(&arm, &mut Workspace::new(&arm), &[0.1, 0.2], &mut M);
    /// assert_eq!((M[1], M[2]), (0.0, mass_matrix(&arm, &[0.1, 0.2])[(0, 1)]));
    /// ```
    pub fn mass_matrix_upper_into(model: &Model, ws: &mut Workspace, q: &[f64], M: &mut [f64]) {
        let (conditions, scratch, _) = ws.open(model);
        assert_eq!(M.len(), model.nv * model.nv, "M");
        upper_triangle(scratch, &conditions, q, M);
    }
}

wide_forms! {
    avx2,
    /// [`mass_matrix_into`] for any kind of number, with the armature on the diagonal.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn mass_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], M: &mut [S]) {
        let conditions = ws.take_composites(b);
        composite_bodies(ws, &conditions, q, M);
    }
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn composite_bodies<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], M: &mut [S]) {
    let nv = ws.mechanism.nv();
    assert_eq!(M.len(), nv * nv, "M");
    M.fill(S::ZERO);
    upper_triangle(ws, c, q, M);
    if !ws.mechanism.has_mimic() {
        ws.support.mirror(M);
    }
}

/// Entries on and above the diagonal that may be other than zero; with mimic joints all of M.
#[inline(always)]
pub(crate) fn upper_triangle<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], M: &mut [S]) {
    let Scratch { mechanism, at, places, .. } = ws;
    let nv = mechanism.nv();
    mechanism.read(q, at);
    places.set_out(mechanism, q, at);
    if mechanism.has_mimic() {
        M.fill(S::ZERO);
        places.add_up();
        places.add_all(nv, M);
    } else {
        places.write_upper(nv, false, M);
    }
    if !c.armature.is_empty() {
        for dof in 0..nv {
            M[dof + nv * dof] += c.armature(dof);
        }
    }
}

/// The same without the zeros between them, columns `stride` apart, where no joint mimics another.
#[inline(always)]
pub(crate) fn packed_triangle<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    stride: usize,
    M: &mut [S],
) {
    let Scratch { mechanism, at, places, support, .. } = ws;
    mechanism.read(q, at);
    places.set_out(mechanism, q, at);
    places.write_upper(stride, true, M);
    if !c.armature.is_empty() {
        for dof in 0..mechanism.nv() {
            M[support.depth(dof) + stride * dof] += c.armature(dof);
        }
    }
}

/// S_k · f of a force in the segment's frame.
#[inline(always)]
pub(crate) fn along<S: Scalar>(segment: &Segment, k: usize, f: Force<S>) -> S {
    match segment.kind {
        SegmentKind::Turning => f.angular.z * segment.ratio,
        SegmentKind::Sliding => f.linear.z * segment.ratio,
        SegmentKind::Free => f.to_array()[k],
    }
}
