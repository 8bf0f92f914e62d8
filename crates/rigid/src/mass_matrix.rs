//! The mass matrix: the composite-rigid-body algorithm.

use nalgebra::DMatrix;
use sinew_model::{Force, Inertia, Model, Motion, Scalar, Segment, SegmentKind};

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

/// [`mass_matrix`] without allocation, into the nv × nv numbers of `M` by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn mass_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], M: &mut [f64]) {
    let (conditions, scratch, _) = ws.open(model);
    composite_bodies(scratch, &conditions, q, M);
}

/// [`mass_matrix_into`] for any kind of number, with the armature on the diagonal.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
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
    let Scratch { mechanism, at, inertia, body, composite, .. } = ws;
    mechanism.read(q, at);
    composite[1..].copy_from_slice(inertia);
    for k in 0..mechanism.segments().len() {
        body[k + 1].pose = mechanism.pose(k, q, at);
    }
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let I = composite[k + 1];
        if segment.parent > 0 {
            // I_parent = I_parent + Xᵀ I X
            composite[segment.parent] += body[k + 1].pose.inertia_to_parent(&I);
        }
        for axis in 0..segment.nv() {
            // F = I_c S
            let mut F = momentum(&I, segment, axis);
            let column = segment.first_dof + axis;
            for l in 0..=axis {
                add_symmetric(M, nv, segment.first_dof + l, column, along(segment, l, F));
            }
            let mut row = k + 1;
            loop {
                let carrier = &mechanism.segments()[row - 1];
                if carrier.parent == 0 {
                    break;
                }
                F = body[row].pose.force_to_parent(F);
                row = carrier.parent;
                let ancestor = &mechanism.segments()[row - 1];
                for l in 0..ancestor.nv() {
                    add_symmetric(M, nv, ancestor.first_dof + l, column, along(ancestor, l, F));
                    if ancestor.first_dof + l == column {
                        // two joints of one degree of freedom meet on the diagonal, once from either side
                        M[column + nv * column] += along(ancestor, l, F);
                    }
                }
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

/// S_k · f of a force in the segment's frame.
#[inline(always)]
pub(crate) fn along<S: Scalar>(segment: &Segment, k: usize, f: Force<S>) -> S {
    match segment.kind {
        SegmentKind::Turning => f.angular.z * segment.ratio,
        SegmentKind::Sliding => f.linear.z * segment.ratio,
        SegmentKind::Free => f.to_array()[k],
    }
}

#[inline(always)]
fn add_symmetric<S: Scalar>(M: &mut [S], nv: usize, row: usize, column: usize, x: S) {
    M[row + nv * column] += x;
    if row != column {
        M[column + nv * row] += x;
    }
}
