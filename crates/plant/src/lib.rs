//! A robot model and its physical effects as one dynamic system.
//!
//! [`Plant`] is the waist of the workspace: it knows no particular effect, and every analysis knows only the plant.
//! [`Dynamics`] evaluates it in any kind of number, forward (motor torque in, accelerations out) or with the motor
//! motion imposed (accelerations in, motor torque out).

mod active;
mod condensed;
mod dynamics;
mod error;
mod forward;
mod imposed;
mod lever_change;
mod plant;
mod rotors;
mod sag;

pub use active::Active;
pub use dynamics::{Dynamics, LinkState};
pub use error::PlantError;
pub use forward::{Rates, State};
pub use imposed::{GivenLinks, ImposedAt, ImposedOut, MotorMotion, Moving};
pub use plant::{ParameterId, Plant};
pub use sinew_model::VirtualJoint;
