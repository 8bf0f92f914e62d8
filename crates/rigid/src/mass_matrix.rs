//! The mass matrix: the composite-rigid-body algorithm.

use nalgebra::DMatrix;
use sinew_model::{Model, Scalar};

use crate::rnea::scaled;
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
    let (bodies, scratch, _) = ws.split(model);
    mass_matrix_with(&bodies, scratch, q, M);
}

/// [`mass_matrix_into`] for any kind of number, with the armature on the diagonal.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn mass_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], M: &mut [S]) {
    b.check();
    let nv = b.model.nv;
    assert_eq!((q.len(), M.len()), (b.model.nq, nv * nv), "q, M");
    M.fill(S::ZERO);
    for dof in 0..nv {
        M[dof + nv * dof] = b.armature(dof);
    }
    for (i, joint) in b.model.joints.iter().enumerate() {
        ws.pose[i] = joint.pose(q);
    }
    ws.composite.copy_from_slice(b.inertia);
    for (j, joint) in b.model.joints.iter().enumerate().rev() {
        let I = ws.composite[j];
        if let Some(p) = joint.parent {
            // I_parent = I_parent + Xᵀ I X
            ws.composite[p.0] += ws.pose[j].inertia_to_parent(&I);
        }
        for k in 0..joint.kind.nv() {
            let column = joint.first_dof + k;
            // F = I_c S
            let mut F = I.times(joint.kind.motion(k, scaled(joint, S::ONE)));
            for l in 0..=k {
                let row = joint.first_dof + l;
                let entry = scaled(joint, joint.kind.along(l, F));
                M[row + nv * column] += entry;
                if l < k {
                    M[column + nv * row] += entry;
                }
            }
            let mut child = j;
            while let Some(p) = b.model.joints[child].parent {
                F = ws.pose[child].force_to_parent(F);
                child = p.0;
                let ancestor = &b.model.joints[child];
                for l in 0..ancestor.kind.nv() {
                    let row = ancestor.first_dof + l;
                    let entry = scaled(ancestor, ancestor.kind.along(l, F));
                    M[row + nv * column] += entry;
                    M[column + nv * row] += entry;
                }
            }
        }
    }
}
