//! Robots with elastic joints, in any mixture with rigid ones: the reduced (Spong) and the complete (De Luca, Tomei) model.
//!
//! [`ElasticJoints`] is the model by itself: springs as numbers or as full matrices that couple joints, rotors that turn
//! about their own axes only ([`ElasticJoints::new`]) or with the links that carry them ([`ElasticJoints::complete`]).
//! From it come forward dynamics, their analytic derivatives and the state-space form; the motor torques that make the
//! links follow a motion; rest positions; energy and the audit of passivity. The same spring as a physical effect,
//! which a search may add and fit, is [`JointElasticity`].
//!
//! Plain methods are for people. Forms ending in `_into` are for loops: they take a [`Workspace`] and allocate nothing.
//! Forms ending in `_with` take a [`Scratch`] and any kind of number, so that lanes and dual numbers go through the
//! same lines.
#![allow(non_snake_case)]

mod deflection;
mod derivatives;
mod dynamics;
mod elastic_joints;
mod energy;
mod equilibrium;
mod error;
mod inverse_dynamics;
mod joint_elasticity;
mod passivity;
mod rotors;
mod spin;
mod state_space;
mod workspace;

pub use deflection::Deflection;
pub use derivatives::ForwardDynamicsDerivatives;
pub use elastic_joints::ElasticJoints;
pub use equilibrium::Rest;
pub use error::FlexJointError;
pub use inverse_dynamics::{InverseScratch, MotorMotion};
pub use joint_elasticity::{JOINT_ELASTICITY, JointElasticity};
pub use passivity::{PassivityAudit, Sample};
pub use rotors::SpinInertia;
pub use workspace::{Scratch, Workspace};
