//! Rigid-body dynamics of robot trees: RNEA, CRBA, ABA, energy.
//!
//! Every algorithm is written once, over [`Scalar`](sinew_model::Scalar): the forms ending in `_with` take
//! [`Bodies`] of any kind of number and a [`Scratch`].
#![allow(non_snake_case)]

mod bodies;
mod energy;
mod hybrid_dynamics;
mod ldlt;
mod mass_matrix;
mod rnea;
mod scratch;
mod tool_wrench;

pub use bodies::{Bodies, inertias};
pub use energy::{kinetic_energy_with, potential_energy_with};
pub use hybrid_dynamics::{forward_dynamics_with, hybrid_dynamics_with};
pub use mass_matrix::mass_matrix_with;
pub use rnea::inverse_dynamics_with;
pub use scratch::Scratch;
pub use tool_wrench::tool_wrench_with;
