//! Forward kinematics: where every body is.

use sinew_model::{Model, Pose, Scalar};

/// Poses of all moving bodies in the world, for any kind of number.
///
/// ```text
/// world_from_body = world_from_parent · parent_from_body(q)
/// ```
///
/// `q`: nq, rad (m). `world_from_body`: one pose a joint, in the order of [`Model::joints`]. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn body_poses_with<S: Scalar>(model: &Model, q: &[S], world_from_body: &mut [Pose<S>]) {
    assert_eq!(q.len(), model.nq, "q");
    assert_eq!(world_from_body.len(), model.joints.len(), "world_from_body");
    for (i, joint) in model.joints.iter().enumerate() {
        let parent_from_body = joint.pose(q);
        world_from_body[i] = match joint.parent {
            None => parent_from_body,
            Some(parent) => world_from_body[parent.0] * parent_from_body,
        };
    }
}
