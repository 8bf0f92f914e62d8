//! Linearisation, modes and poles of a plant.
//!
//! [`linearize`] gives A, B, C, D about a rest position, by exact derivatives; [`modes`] the natural frequencies,
//! mode shapes and what damping makes of them; [`poles`] the eigenvalues alone. Every eigenvalue is checked
//! against its own equation.
#![allow(non_snake_case)]

mod equilibrium;
mod error;
mod modes;
mod poles;
mod seeds;
mod state_space;

pub use equilibrium::Equilibrium;
pub use error::LinearError;
pub use modes::{Mode, modes};
pub use poles::poles;
pub use state_space::{StateSpace, linearize};
