//! Simulation of plants: stiff integration, controllers, sensor noise, energy audit.
//!
//! [`simulate`] drives a plant and logs what its sensors would show. A [`Drive`] decides the torques: a table
//! ([`Torques`]) or a [`Controller`] that follows a [`Trajectory`] made of [`Excitation`]s. Torques are held from
//! sample to sample as real drives hold them; the motion between is integrated to a [`Tolerance`]. Same seed, same
//! bytes.

mod channels;
mod controller;
mod counted;
mod drive;
mod energy_audit;
mod equations;
mod error;
mod excitation;
mod explicit;
mod holds;
mod noise;
mod random;
mod simulate;
mod solver;
mod start;
mod stiff;
mod trajectory;

pub use controller::Controller;
pub use drive::{Drive, Measured, Torques};
pub use energy_audit::EnergyAudit;
pub use error::SimulateError;
pub(crate) use error::StepFailure;
pub use excitation::{Excitation, Limits};
pub use noise::{Noise, SensorNoise};
pub use random::Stream;
pub use simulate::{Options, SIGNALS, Simulated, simulate};
pub use solver::{Method, Solver, System, Tolerance, Work, integrate};
pub use start::Start;
pub use trajectory::{Motion, Point, Trajectory};
