//! How the Jacobian of a link changes with the position.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::Matrix6xX;
use sinew_model::{LinkId, Model, Motion, Scalar, wide_forms};

use crate::jacobian::add_column;
use crate::{Axes, Scratch, Workspace};

/// The derivatives of [`jacobian`](crate::jacobian) by each degree of freedom, nv matrices 6 × nv.
///
/// ```text
/// H_k = ∂J/∂q_k,   J̇ = Σ H_k q̇_k,   geometric stiffness of a wrench w: K_jk = Σ_i H_k,ij w_i
/// ```
///
/// `q`: nq, rad (m). Derivatives are along the displacements of [`integrate`](crate::integrate): of a floating base
/// [turn; shift] in its own axes. Cost O(depth²).
///
/// # Panics
/// If `q` has the wrong length or there is no such link.
///
/// # Example
/// A link one metre from its level pivot moves upward; turned further it moves inward too:
/// ```
/// use sinew_kinematics::{Axes, hessian};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let H = hessian(&arm, &[0.0, 0.0], arm.last_link(), Axes::WorldAligned);
/// assert_eq!(H[0].column(0).as_slice(), [0.0, 0.0, 0.0, -1.0, 0.0, 0.0]);
/// ```
/// Source: Bruyninckx, De Schutter, *Symbolic differentiation of the velocity mapping for a serial kinematic chain*,
/// Mechanism and Machine Theory 31(2), 1996.
pub fn hessian(model: &Model, q: &[f64], link: LinkId, axes: Axes) -> Vec<Matrix6xX<f64>> {
    let size = 6 * model.nv;
    let mut H = vec![0.0; size * model.nv];
    hessian_into(model, &mut Workspace::new(model), q, link, axes, &mut H);
    H.chunks_exact(size.max(1)).map(Matrix6xX::from_column_slice).collect()
}

wide_forms! {
    avx2,
    /// [`hessian`] without allocation, into nv times 6 × nv numbers, each matrix by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length or there is no such link.
    pub fn hessian_into(model: &Model, ws: &mut Workspace, q: &[f64], link: LinkId, axes: Axes, H: &mut [f64]) {
        columns(model, ws, q, link, axes, H);
    }
}

/// [`hessian_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn hessian_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    axes: Axes,
    H: &mut [S],
) {
    columns(model, ws, q, link, axes, H);
}

#[inline(always)]
fn columns<S: Scalar>(model: &Model, ws: &mut Scratch<S>, q: &[S], link: LinkId, axes: Axes, H: &mut [S]) {
    let size = 6 * model.nv;
    assert_eq!(H.len(), size * model.nv, "H");
    ws.poses(model, q);
    H.fill(S::ZERO);
    let world_from_link = ws.link_in_world(link);
    let mut mover = ws.row(link);
    while mover > 0 {
        let moving = &ws.mechanism.segments()[mover - 1];
        for k in 0..moving.nv() {
            let s = moving.axis(k, &ws.world[mover]);
            let own = &mut H[size * (moving.first_dof + k)..][..size];
            let mut row = ws.row(link);
            while row > 0 {
                let segment = &ws.mechanism.segments()[row - 1];
                for l in 0..segment.nv() {
                    // ∂s_j/∂q_k = s_k × s_j where k carries j: joints stand parents first
                    let column = segment.axis(l, &ws.world[row]);
                    let turned = if row >= mover { s.cross_motion(column) } else { Motion::ZERO };
                    let change = axes.tell_rate(&world_from_link, s, column, turned);
                    add_column(own, segment.first_dof + l, change);
                }
                row = segment.parent;
            }
        }
        mover = moving.parent;
    }
}
