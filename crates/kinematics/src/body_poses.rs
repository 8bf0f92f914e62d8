//! Forward kinematics: where every body and every link is.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::{LinkId, Model, Pose, Scalar, wide_forms};

use crate::{Scratch, Workspace};

/// Poses of all moving bodies in the world, in the order of [`Model::joints`].
///
/// ```text
/// world_from_body = world_from_parent · parent_from_body(q)
/// ```
///
/// `q`: nq, rad (m). Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
pub fn body_poses(model: &Model, q: &[f64]) -> Vec<Pose<f64>> {
    let mut poses = vec![Pose::identity(); model.joints.len()];
    body_poses_with(model, q, &mut poses);
    poses
}

/// [`body_poses`] for any kind of number, into `world_from_body`, one pose a joint.
///
/// # Panics
/// If a slice has the wrong length.
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

/// Where a link is in the world.
///
/// ```text
/// world_from_link = Π parent_from_body(q) · body_from_link
/// ```
///
/// `q`: nq, rad (m). Only the joints between the link and the world are looked at.
///
/// # Panics
/// If `q` has the wrong length or there is no such link.
///
/// # Example
/// The last rod of a planar arm starts where the first, one metre long and upright, ends:
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let pose = sinew_kinematics::link_pose(&arm, &[std::f64::consts::FRAC_PI_2, 0.3], arm.last_link());
/// assert_eq!(pose.translation.z, 1.0);
/// ```
pub fn link_pose(model: &Model, q: &[f64], link: LinkId) -> Pose<f64> {
    link_pose_with(model, q, link)
}

/// [`link_pose`] for any kind of number.
///
/// # Panics
/// If `q` has the wrong length or there is no such link.
pub fn link_pose_with<S: Scalar>(model: &Model, q: &[S], link: LinkId) -> Pose<S> {
    assert_eq!(q.len(), model.nq, "q");
    let link = &model.links[link.0];
    let mut pose = Pose::constant(&link.body_from_link);
    let mut body = link.body;
    while let Some(id) = body {
        let joint = &model.joints[id.0];
        pose = joint.pose(q) * pose;
        body = joint.parent;
    }
    pose
}

/// Where all links are in the world, in the order of [`Model::links`].
///
/// `q`: nq, rad (m). Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// The base stays; the second of two one-metre rods starts where the first ends:
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let poses = sinew_kinematics::link_poses(&arm, &[0.0, 0.3]);
/// assert_eq!((poses[0].translation.x, poses[2].translation.x), (0.0, 1.0));
/// ```
pub fn link_poses(model: &Model, q: &[f64]) -> Vec<Pose<f64>> {
    let mut poses = vec![Pose::identity(); model.links.len()];
    link_poses_into(model, &mut Workspace::new(model), q, &mut poses);
    poses
}

wide_forms! {
    avx2,
    /// [`link_poses`] without allocation, into one pose a link.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn link_poses_into(model: &Model, ws: &mut Workspace, q: &[f64], world_from_link: &mut [Pose<f64>]) {
        all_poses(model, ws, q, world_from_link);
    }
}

/// [`link_poses_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
pub fn link_poses_with<S: Scalar>(
    model: &Model,
    ws: &mut Scratch<S>,
    q: &[S],
    world_from_link: &mut [Pose<S>],
) {
    all_poses(model, ws, q, world_from_link);
}

#[inline(always)]
fn all_poses<S: Scalar>(model: &Model, ws: &mut Scratch<S>, q: &[S], world_from_link: &mut [Pose<S>]) {
    assert_eq!(world_from_link.len(), model.links.len(), "world_from_link");
    ws.poses(model, q);
    for (k, pose) in world_from_link.iter_mut().enumerate() {
        *pose = ws.link_in_world(LinkId(k));
    }
}
