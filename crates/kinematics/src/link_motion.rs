//! Velocity and acceleration of a link.

use sinew_model::{LinkId, Model, Motion, Pose, Scalar, Vector3};

use crate::{Axes, Scratch, Workspace};

/// The velocity of a link, [rad/s; m/s].
///
/// ```text
/// [ω; v] = J(q) q̇
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
///
/// # Example
/// One metre from a pivot that turns at 2 rad/s a link moves at 2 m/s:
/// ```
/// use sinew_kinematics::{Axes, link_velocity};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let v = link_velocity(&arm, &[0.0, 0.0], &[2.0, 0.0], arm.last_link(), Axes::WorldAligned);
/// assert_eq!(v.linear.z, 2.0);
/// ```
pub fn link_velocity(model: &Model, q: &[f64], qd: &[f64], link: LinkId, axes: Axes) -> Motion<f64> {
    link_velocity_with(model, &mut Workspace::new(model), q, qd, link, axes)
}

/// [`link_velocity`] for any kind of number, without allocation.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn link_velocity_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    link: LinkId,
    axes: Axes,
) -> Motion<S> {
    ws.velocities(model, q, qd);
    axes.tell(&ws.link_in_world(link), ws.velocity[ws.row(link)])
}

/// The spatial acceleration of a link, [rad/s²; m/s²], without gravity.
///
/// ```text
/// a = d/dt of the spatial velocity; in `Local` and `World` axes a = J q̈ + J̇ q̇
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. The acceleration of the link's origin is the [`classical_acceleration`].
/// Cost O(n).
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn link_acceleration(
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    link: LinkId,
    axes: Axes,
) -> Motion<f64> {
    link_acceleration_with(model, &mut Workspace::new(model), q, qd, qdd, link, axes)
}

/// [`link_acceleration`] for any kind of number, without allocation.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn link_acceleration_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    link: LinkId,
    axes: Axes,
) -> Motion<S> {
    let (pose, _, a) = motion_in_world(model, ws, q, qd, qdd, link);
    axes.tell(&pose, a)
}

/// The acceleration of a link's origin as an accelerometer without gravity feels it, and the link's angular
/// acceleration, [rad/s²; m/s²].
///
/// ```text
/// [ω̇; p̈] = spatial acceleration + [0; ω × v];   in `WorldAligned` axes J q̈ + J̇ q̇
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
///
/// # Example
/// One metre from a pivot that turns at 2 rad/s the origin is pulled inward at ω² r = 4 m/s²:
/// ```
/// use sinew_kinematics::{Axes, classical_acceleration};
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let tip = arm.last_link();
/// let a = classical_acceleration(&arm, &[0.0, 0.0], &[2.0, 0.0], &[0.0, 0.0], tip, Axes::WorldAligned);
/// assert_eq!(a.linear.x, -4.0);
/// ```
pub fn classical_acceleration(
    model: &Model,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    link: LinkId,
    axes: Axes,
) -> Motion<f64> {
    classical_acceleration_with(model, &mut Workspace::new(model), q, qd, qdd, link, axes)
}

/// [`classical_acceleration`] for any kind of number, without allocation.
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn classical_acceleration_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    link: LinkId,
    axes: Axes,
) -> Motion<S> {
    let (pose, v, a) = motion_in_world(model, ws, q, qd, qdd, link);
    let (v, a) = (axes.tell(&pose, v), axes.tell(&pose, a));
    // p̈ = a + ω × v
    a + Motion::new(Vector3::ZERO, v.angular.cross(v.linear))
}

#[inline(always)]
fn motion_in_world<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
    link: LinkId,
) -> (Pose<S>, Motion<S>, Motion<S>) {
    ws.accelerations(model, q, qd, qdd);
    let row = ws.row(link);
    (ws.link_in_world(link), ws.velocity[row], ws.acceleration[row])
}
