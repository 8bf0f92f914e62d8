//! Forward kinematics, geometric Jacobians and Cartesian compliance of robot trees.
//!
//! Plain functions (`jacobian`, `link_pose`) are for people, forms ending in `_into` for loops: they take a
//! [`Workspace`] and allocate nothing. Both rest on the forms ending in `_with`, written once over
//! [`Scalar`](sinew_model::Scalar) and therefore also for lanes and dual numbers.
//!
//! # Example
//! The tool of a two-metre planar arm stands still in x while both joints of the stretched arm turn:
//! ```
//! use sinew_kinematics::{Axes, jacobian};
//! let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
//! let J = jacobian(&arm, &[0.0, 0.0], arm.last_link(), Axes::WorldAligned);
//! assert_eq!(J[(3, 0)], 0.0);
//! assert_eq!((J[(5, 0)], J[(5, 1)]), (1.0, 0.0));
//! ```
#![cfg_attr(not(feature = "std"), no_std)]
#![allow(non_snake_case)]

extern crate alloc;

mod axes;
mod batch;
mod body_poses;
mod centre_of_mass;
mod compliance;
mod compliance_batch;
mod displacement;
mod hessian;
mod jacobian;
mod jacobian_rate;
mod link_motion;
mod scratch;

pub use axes::Axes;
pub use batch::{BatchWorkspace, jacobian_batch, jacobian_batch_into};
pub use body_poses::{
    body_poses, body_poses_with, link_pose, link_pose_with, link_poses, link_poses_into, link_poses_with,
};
pub use centre_of_mass::{
    centre_of_mass, centre_of_mass_jacobian, centre_of_mass_jacobian_with, centre_of_mass_with,
};
pub use compliance::compliance;
pub use compliance_batch::{ComplianceWorkspace, compliance_batch, compliance_batch_into};
pub use displacement::{
    difference, difference_into, integrate, integrate_into, position_rate, position_rate_with,
};
pub use hessian::{hessian, hessian_into, hessian_with};
pub use jacobian::{jacobian, jacobian_into, jacobian_with, joint_axes, joint_axes_into, joint_axes_with};
pub use jacobian_rate::{jacobian_rate, jacobian_rate_into, jacobian_rate_with};
pub use link_motion::{
    classical_acceleration, classical_acceleration_with, link_acceleration, link_acceleration_with,
    link_velocity, link_velocity_with,
};
pub use scratch::{Scratch, Workspace};
