//! Robot models that never change after loading: links, joints, tree, spatial algebra and the kinds of number.
//!
//! Opens no file. [`ModelBuilder`] puts a [`Model`] together, [`Robot`] adds what a URDF cannot say (springs,
//! rotors, effects) as plain data, and [`Scalar`] is the trait over which every law of the workspace is written
//! once: for `f64`, for [`Lanes`] of configurations, for [`Dual`] numbers and for [`Taylor`] series along a path.
//!
//! Conventions: SI units; spatial vectors are `[angular; linear]`; poses read right to left
//! (`world_from_tool = world_from_link * link_from_tool`); world z points up.
#![cfg_attr(not(feature = "std"), no_std)]
#![allow(non_snake_case)]

extern crate alloc;

mod articulated;
mod bending;
mod builder;
#[cfg(feature = "count")]
mod counted;
mod description;
mod dual;
mod elementary;
mod error;
mod extended;
mod held;
mod hinge;
mod inertia;
mod joint;
mod lanes;
#[doc(hidden)]
pub mod math;
mod matrix3;
mod mechanism;
mod pose;
mod rotor_mount;
pub mod samples;
mod scalar;
#[doc(hidden)]
pub mod side_by_side;
mod spatial;
mod spelling;
mod taylor;
#[cfg(target_arch = "x86_64")]
mod transpose;
mod tree;
mod vector3;
#[doc(hidden)]
pub mod wide;

pub use articulated::ArticulatedInertia;
pub use bending::{BeamSection, Bending};
pub use builder::{JointShape, JointSpec, ModelBuilder};
#[cfg(feature = "count")]
pub use counted::{Counted, Operations};
pub use description::{Coupling, EffectSpec, JointSettings, Place, Robot, Setting, Trust};
pub use dual::Dual;
pub use error::ModelError;
pub use extended::{Extended, Following, VirtualJoint};
pub use hinge::{Carried, Hinge};
pub use inertia::Inertia;
pub use joint::{Joint, JointId, JointKind, Limits, Mimic};
pub use lanes::Lanes;
pub use matrix3::{Matrix3, Symmetric3};
pub use mechanism::{Coordinates, Mechanism, Segment, SegmentKind};
pub use pose::Pose;
pub use rotor_mount::{RotorMount, UnknownRotorAxis};
pub use scalar::Scalar;
pub use spatial::{Force, Motion};
pub use spelling::nearest;
pub use taylor::Taylor;
pub use tree::{Link, LinkId, Model};
pub use vector3::Vector3;
