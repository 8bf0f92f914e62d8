//! Robots with elastic joints: the reduced (Spong) model for any mixture of rigid and elastic joints.
#![allow(non_snake_case)]

mod joint_elasticity;

pub use joint_elasticity::{JOINT_ELASTICITY, JointElasticity};
