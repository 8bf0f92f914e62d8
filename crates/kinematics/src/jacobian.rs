//! The geometric Jacobian of a link.

use nalgebra::Matrix6xX;
use sinew_model::{LinkId, Model, Motion, Pose, Scalar};

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

/// [`jacobian`] without allocation, into the 6 × nv numbers of `J` by columns.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn jacobian_into(model: &Model, ws: &mut Workspace, q: &[f64], link: LinkId, axes: Axes, J: &mut [f64]) {
    jacobian_with(model, ws, q, link, axes, J);
}

/// [`jacobian_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
#[inline(always)]
pub fn jacobian_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    axes: Axes,
    J: &mut [S],
) {
    assert_eq!(J.len(), 6 * model.nv, "J");
    crate::body_poses_with(model, q, &mut ws.world_from_body);
    let world_from_link = link_in_world(model, &ws.world_from_body, link);
    J.fill(S::ZERO);
    let mut body = model.links[link.0].body;
    while let Some(id) = body {
        let joint = &model.joints[id.0];
        for k in 0..joint.kind.nv() {
            let unit = joint.kind.motion(k, S::constant(joint.multiplier()));
            let in_world = ws.world_from_body[id.0].motion_to_parent(unit);
            add_column(J, joint.first_dof + k, axes.tell(&world_from_link, in_world));
        }
        body = joint.parent;
    }
}

/// The pose of a link when those of all bodies are known.
#[inline(always)]
pub(crate) fn link_in_world<S: Scalar>(model: &Model, world_from_body: &[Pose<S>], link: LinkId) -> Pose<S> {
    let link = &model.links[link.0];
    let body_from_link = Pose::constant(&link.body_from_link);
    match link.body {
        None => body_from_link,
        Some(body) => world_from_body[body.0] * body_from_link,
    }
}

/// Adds a motion to column `dof`; joints that mimic each other share one.
#[inline(always)]
pub(crate) fn add_column<S: Scalar>(J: &mut [S], dof: usize, m: Motion<S>) {
    for (entry, x) in J[6 * dof..6 * dof + 6].iter_mut().zip(m.to_array()) {
        *entry += x;
    }
}
