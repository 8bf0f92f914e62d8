//! Robots with elastic joints: the reduced (Spong) model for any mixture of rigid and elastic joints.
//!
//! [`ElasticJoints`] is the model by itself: springs as numbers or as full matrices that couple joints. The same
//! spring as a physical effect, which a search may add and fit, is [`JointElasticity`].
#![allow(non_snake_case)]

mod dynamics;
mod elastic_joints;
mod energy;
mod equilibrium;
mod error;
mod joint_elasticity;
mod workspace;

pub use elastic_joints::ElasticJoints;
pub use error::FlexJointError;
pub use joint_elasticity::{JOINT_ELASTICITY, JointElasticity};
pub use workspace::Workspace;
