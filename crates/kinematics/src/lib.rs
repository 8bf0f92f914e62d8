//! Forward kinematics, geometric Jacobians and Cartesian compliance of robot trees.
#![allow(non_snake_case)]

mod body_poses;

pub use body_poses::body_poses_with;
