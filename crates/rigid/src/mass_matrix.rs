//! The mass matrix: the composite-rigid-body algorithm.

use nalgebra::DMatrix;
use sinew_model::{Force, Inertia, Model, Motion, Scalar, Segment, SegmentKind, wide_forms};

use crate::scratch::Conditions;
use crate::slots::{self, move_to_parent};
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

/// [`mass_matrix_into`] for any kind of number, with the armature on the diagonal.
///
/// # Panics
/// If a slice has the wrong length.
pub fn mass_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], M: &mut [S]) {
    let conditions = ws.take(b);
    composite_bodies(ws, &conditions, q, M);
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn composite_bodies<S: Scalar>(ws: &mut Scratch<S>, c: &Conditions<S>, q: &[S], M: &mut [S]) {
    let nv = ws.mechanism.nv();
    assert_eq!(M.len(), nv * nv, "M");
    M.fill(S::ZERO);
    for dof in 0..nv {
        M[dof + nv * dof] = c.armature(dof);
    }
    let Scratch { mechanism, at, inertia, body, composite, slots, forces, .. } = ws;
    mechanism.read(q, at);
    composite[1..].copy_from_slice(inertia);
    for k in 0..mechanism.segments().len() {
        body[k + 1].pose = mechanism.pose(k, q, at);
    }
    let mut carried = Inertia::default();
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let pose = &body[k + 1].pose;
        let mut I = composite[k + 1];
        if S::FITS_REGISTERS {
            I += carried;
            carried = Inertia::default();
        }
        // F = I_c S of the own axes; those of the subtree have been moved here
        for axis in 0..segment.nv() {
            slots::put(forces, slots.place(segment.first_axis + axis), momentum(&I, segment, axis));
        }
        for axis in 0..segment.nv() {
            // M_ij = S_i·F_j
            let row = segment.first_dof + axis;
            let feels = S::GROUP * component_along(segment, axis);
            let columns = slots.subtree(k, axis);
            M[row + nv * row] += forces[columns[0].0 + feels] * segment.ratio;
            for &(place, column) in &columns[1..] {
                let entry = forces[place + feels] * segment.ratio;
                M[row + nv * column] += entry;
                M[column + nv * row] += entry;
            }
        }
        if segment.parent > 0 {
            move_to_parent(forces, slots.groups(k), pose);
            // I_parent = I_parent + Xᵀ I X
            let to_parent = pose.inertia_to_parent(&I);
            if S::FITS_REGISTERS && segment.parent == k {
                carried = to_parent;
            } else {
                composite[segment.parent] += to_parent;
            }
        }
    }
}

/// I S_k of a composite body in its own frame.
#[inline(always)]
fn momentum<S: Scalar>(I: &Inertia<S>, segment: &Segment, k: usize) -> Force<S> {
    let (J, h, o) = (&I.second_moment, I.first_moment, S::ZERO);
    match segment.kind {
        SegmentKind::Turning => {
            let F = Force::new([J.xz, J.yz, J.zz].into(), [-h.y, h.x, o].into());
            F * S::constant(segment.ratio)
        }
        SegmentKind::Sliding => {
            let F = Force::new([h.y, -h.x, o].into(), [o, o, I.mass].into());
            F * S::constant(segment.ratio)
        }
        SegmentKind::Free => {
            let mut unit = [o; 6];
            unit[k] = S::ONE;
            let [a, b, c, d, e, f] = unit;
            I.times(Motion::new([a, b, c].into(), [d, e, f].into()))
        }
    }
}

/// The component of a force in the segment's frame that axis `k` feels, before its ratio.
#[inline(always)]
fn component_along(segment: &Segment, k: usize) -> usize {
    match segment.kind {
        SegmentKind::Turning => 2,
        SegmentKind::Sliding => 5,
        SegmentKind::Free => k,
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
