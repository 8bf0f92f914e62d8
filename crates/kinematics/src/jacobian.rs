//! The geometric Jacobian of a link.

use nalgebra::Matrix6xX;
use sinew_model::{LinkId, Model, Motion, Scalar, wide_forms};

use crate::{Axes, Scratch, Workspace};

/// The geometric Jacobian of a link, rows [angular; linear].
///
/// ```text
/// [ω; v] = J(q) q̇
/// ```
///
/// `q`: nq, rad (m). Returns 6 × nv. Cost O(n).
///
/// # Panics
/// If `q` has the wrong length or there is no such link.
///
/// # Example
/// A link one metre from its level pivot moves upward at 1 m/s per rad/s:
/// ```
/// use sinew_kinematics::{Axes, jacobian};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let J = jacobian(&arm, &[0.0, 0.0], arm.last_link(), Axes::WorldAligned);
/// assert_eq!(J.column(0).as_slice(), [0.0, -1.0, 0.0, 0.0, 0.0, 1.0]);
/// ```
/// Source: Siciliano et al., *Robotics*, 2009, section 3.1.
pub fn jacobian(model: &Model, q: &[f64], link: LinkId, axes: Axes) -> Matrix6xX<f64> {
    let mut J = Matrix6xX::zeros(model.nv);
    jacobian_into(model, &mut Workspace::new(model), q, link, axes, J.as_mut_slice());
    J
}

wide_forms! {
    avx2,
    /// [`jacobian`] without allocation, into the 6 × nv numbers of `J` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length or there is no such link.
    pub fn jacobian_into(model: &Model, ws: &mut Workspace, q: &[f64], link: LinkId, axes: Axes, J: &mut [f64]) {
        columns(model, ws, q, link, axes, J);
    }
}

/// [`jacobian_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn jacobian_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    axes: Axes,
    J: &mut [S],
) {
    columns(model, ws, q, link, axes, J);
}

#[inline(always)]
pub(crate) fn columns<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    axes: Axes,
    J: &mut [S],
) {
    assert_eq!(J.len(), 6 * model.nv, "J");
    ws.poses(model, q);
    let world_from_link = ws.link_in_world(link);
    J.fill(S::ZERO);
    let mut row = ws.row(link);
    while row > 0 {
        let segment = &ws.mechanism.segments()[row - 1];
        for k in 0..segment.nv() {
            let s = segment.axis(k, &ws.world[row]);
            add_column(J, segment.first_dof + k, axes.tell(&world_from_link, s));
        }
        row = segment.parent;
    }
}

/// The axes of all joints in the world, 6 × their number: the columns of which every link's Jacobian is made.
///
/// ```text
/// s_k = X S_k,   J of a link in `World` axes = the columns of the joints that carry it
/// ```
///
/// `q`: nq, rad (m). One column for each axis of each joint in turn, mimic joints included (theirs times their ratio);
/// without mimic joints 6 × nv. Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// The second joint of a level planar arm turns about −y, one metre from the origin:
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let s = sinew_kinematics::joint_axes(&arm, &[0.0, 0.0]);
/// assert_eq!(s.column(1).as_slice(), [0.0, -1.0, 0.0, 0.0, 0.0, -1.0]);
/// ```
pub fn joint_axes(model: &Model, q: &[f64]) -> Matrix6xX<f64> {
    let mut ws = Workspace::new(model);
    let mut axes = Matrix6xX::zeros(ws.mechanism.axes());
    joint_axes_into(model, &mut ws, q, axes.as_mut_slice());
    axes
}

wide_forms! {
    avx2,
    /// [`joint_axes`] without allocation, into the 6 × axes numbers of `axes` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn joint_axes_into(model: &Model, ws: &mut Workspace, q: &[f64], axes: &mut [f64]) {
        all_axes(model, ws, q, axes);
    }
}

/// [`joint_axes_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
pub fn joint_axes_with<S: Scalar>(model: &Model, ws: &mut Scratch<S>, q: &[S], axes: &mut [S]) {
    all_axes(model, ws, q, axes);
}

#[inline(always)]
fn all_axes<S: Scalar>(model: &Model, ws: &mut Scratch<S>, q: &[S], axes: &mut [S]) {
    assert_eq!(axes.len(), 6 * ws.mechanism.axes(), "axes");
    ws.poses(model, q);
    for (segment, pose) in ws.mechanism.segments().iter().zip(&ws.world[1..]) {
        let own = &mut axes[6 * segment.first_axis..];
        for (k, column) in own.chunks_exact_mut(6).take(segment.nv()).enumerate() {
            column.copy_from_slice(&segment.axis(k, pose).to_array());
        }
    }
}

/// Adds a motion to column `dof`; joints that mimic each other share one.
#[inline(always)]
pub(crate) fn add_column<S: Scalar>(J: &mut [S], dof: usize, m: Motion<S>) {
    for (entry, x) in J[6 * dof..6 * dof + 6].iter_mut().zip(m.to_array()) {
        *entry += x;
    }
}
