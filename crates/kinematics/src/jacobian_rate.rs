//! The rate of change of a link's Jacobian.

use nalgebra::Matrix6xX;
use sinew_model::{LinkId, Model, Scalar, wide_forms};

use crate::jacobian::add_column;
use crate::{Axes, Scratch, Workspace};

/// The rate of change of [`jacobian`](crate::jacobian) along the motion.
///
/// ```text
/// J̇(q, q̇) = dJ/dt,   classical acceleration = J q̈ + J̇ q̇ in world-aligned axes
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns 6 × nv. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
///
/// # Example
/// A link one metre from its pivot, turning at 2 rad/s, is pulled inward at ω² r = 4 m/s²:
/// ```
/// use sinew_kinematics::{Axes, jacobian_rate};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let rate = jacobian_rate(&arm, &[0.0, 0.0], &[2.0, 0.0], arm.last_link(), Axes::WorldAligned);
/// assert_eq!(rate[(3, 0)] * 2.0, -4.0);
/// ```
pub fn jacobian_rate(model: &Model, q: &[f64], qd: &[f64], link: LinkId, axes: Axes) -> Matrix6xX<f64> {
    let mut rate = Matrix6xX::zeros(model.nv);
    jacobian_rate_into(model, &mut Workspace::new(model), q, qd, link, axes, rate.as_mut_slice());
    rate
}

wide_forms! {
    avx2,
    /// [`jacobian_rate`] without allocation, into the 6 × nv numbers of `rate` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length or there is no such link.
    pub fn jacobian_rate_into(
        model: &Model,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        link: LinkId,
        axes: Axes,
        rate: &mut [f64],
    ) {
        columns(model, ws, q, qd, link, axes, rate);
    }
}

/// [`jacobian_rate_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn jacobian_rate_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    link: LinkId,
    axes: Axes,
    rate: &mut [S],
) {
    columns(model, ws, q, qd, link, axes, rate);
}

#[inline(always)]
fn columns<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    link: LinkId,
    axes: Axes,
    rate: &mut [S],
) {
    assert_eq!(rate.len(), 6 * model.nv, "rate");
    ws.velocities(model, q, qd);
    rate.fill(S::ZERO);
    let world_from_link = ws.link_in_world(link);
    let mut row = ws.row(link);
    let v_link = ws.velocity[row];
    while row > 0 {
        let segment = &ws.mechanism.segments()[row - 1];
        for k in 0..segment.nv() {
            // ṡ = v × s
            let s = segment.axis(k, &ws.world[row]);
            let changing = ws.velocity[row].cross_motion(s);
            let column = axes.tell_rate(&world_from_link, v_link, s, changing);
            add_column(rate, segment.first_dof + k, column);
        }
        row = segment.parent;
    }
}
