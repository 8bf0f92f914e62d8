//! The joint torques of a wrench at a link.

use sinew_kinematics::body_poses_with;
use sinew_model::{Force, LinkId, Pose, Scalar};

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
#[inline(always)]
pub fn tool_wrench_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    link: LinkId,
    wrench: Force<S>,
    tau: &mut [S],
) {
    assert_eq!(tau.len(), b.model.nv, "tau");
    body_poses_with(b.model, q, &mut ws.pose);
    let link = &b.model.links[link.0];
    let mut body = link.body;
    let Some(carrier) = body else { return };
    let world_from_link = ws.pose[carrier.0] * Pose::constant(&link.body_from_link);
    // w at the world's origin: n = n + p × f
    let moment = wrench.angular + world_from_link.translation.cross(wrench.linear);
    let in_world = Force::new(moment, wrench.linear);
    while let Some(id) = body {
        let joint = &b.model.joints[id.0];
        // τ_i = τ_i + S_iᵀ X w
        add_torque(joint, ws.pose[id.0].force_to_child(in_world), tau);
        body = joint.parent;
    }
}
