//! The joint torques of a wrench at a link.

use sinew_model::{Force, LinkId, Scalar, Vector3};

use crate::rnea::add_torque;
use crate::{Bodies, Scratch};

/// Adds to `tau` what a wrench on a link does at the joints, for any kind of number.
///
/// ```text
/// τ = τ + Jᵀ w
/// ```
///
/// `q`: nq, rad (m). `wrench`: of the surroundings on the robot, at the link's origin in world axes, [N·m; N].
/// `tau`: nv. A link fixed to the world adds nothing. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length or there is no such link.
pub fn tool_wrench_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    wrench: Force<S>,
    tau: &mut [S],
) {
    assert_eq!(tau.len(), b.model.nv, "tau");
    ws.mechanism.check(b.model);
    ws.poses_about_roots(q);
    let Scratch { mechanism, world, .. } = ws;
    let link = &b.model.links[link.0];
    let Some(carrier) = link.body else { return };
    let mut row = carrier.0 + 1;
    // w about the origin of the world's axes: n = n + p × f
    let in_segment = mechanism.segments()[carrier.0].vector_from_link(link.body_from_link.translation);
    let place = world[row].transform_point(Vector3::constant(in_segment));
    let in_world = Force::new(wrench.angular + place.cross(wrench.linear), wrench.linear);
    while row > 0 {
        // τ_i = τ_i + S_iᵀ X w
        let segment = &mechanism.segments()[row - 1];
        add_torque(segment, world[row].force_to_child(in_world), tau);
        row = segment.parent;
    }
}
