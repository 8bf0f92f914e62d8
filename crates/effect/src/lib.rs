//! The trait of a physical effect, its card, and the contract every effect must keep.
//!
//! An author writes a [`Law`]: one struct, one file, generic over the kind of number. Every law is an [`Effect`],
//! the object-safe twin that plants, simulators and fitters hold. So what can be injected into a simulation can be
//! identified from a measurement, and its derivatives are exact, without a line more.

mod at;
mod card;
mod catalogue;
mod coefficients;
pub mod contract;
mod law;

pub use at::{Actuation, At, Deflection, Reading, Relaxation, Sensor};
pub use card::{
    Card, Energy, Family, Parameter, Prior, Requirement, Rival, Role, SWING_FREQUENCY, Screening, Written,
};
pub use catalogue::{Ask, Catalogue, Entry, MakeHinge, PlaceKind};
pub use coefficients::Coefficients;
pub use law::{Act, Call, DIRECTIONS, Derivative, Effect, Kind, LANES, Law, Site, Wide};
