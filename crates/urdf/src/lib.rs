//! Reads URDF and the Sinew sidecar into a robot, and writes the sidecar back.
//!
//! [`read_robot`] takes either file: `arm.urdf`, what everybody has, or `arm.sinew.toml`, which says what a URDF
//! cannot (stiffness, rotors, bending, effects). Every error names file, line and column, what stands there, what
//! may stand there, and a way out. What is only suspicious becomes a [`Note`]. [`Sidecar`] changes the text and keeps
//! its author's comments and order.

mod assembly;
mod atomic_file;
mod bending;
mod coupling;
mod definite;
mod edit;
mod effects;
mod error;
mod grammar;
mod note;
mod pivots;
mod plausibility;
mod robot_file;
mod rotation;
mod sidecar;
mod source;
mod urdf;
mod urdf_writer;
mod vocabulary;
mod xml;
mod xml_reader;

pub use error::{Location, UrdfError};
pub use note::{Note, Severity};
pub use robot_file::{RobotFile, parse_robot, read_robot};
pub use sidecar::Sidecar;
pub use urdf::{UrdfModel, parse_urdf, read_urdf};
pub use urdf_writer::write_urdf;
pub use vocabulary::{KindWords, PlaceKind, Vocabulary};
