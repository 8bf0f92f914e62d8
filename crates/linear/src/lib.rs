//! Plants as linear systems: linearisation, modes, poles and zeros, frequency response, lower orders, sampling, export.
//!
//! [`linearize`] gives A, B, C, D about a rest position, by exact derivatives, and [`Linearizer`] about any state;
//! [`modes`] the natural frequencies, mode shapes and what damping makes of them; [`Transfer`] how one signal answers
//! to another, its resonances and antiresonances; [`balanced_truncation`] and [`modal_truncation`] models of lower
//! order; [`discretize`] what a computer sees between samples. Effects that are not linear over the motion of interest
//! are named and described by their first harmonic ([`Nonlinear`]). Every eigenvalue is checked against its own
//! equation.
//!
//! [`cartesian_stiffness`] says how far a link gives way to a wrench while the motors hold, [`equilibrium_under_load`] where
//! a load of any size takes it, [`directions`] what a compliance means,
//! [`stiffness_along`] and [`compliance_map`] do the same for many configurations on all cores,
//! [`identify_stiffness`] which joint springs a set of load tests shows.
#![allow(non_snake_case)]

mod along;
mod describing;
mod discretize;
mod drives;
mod equilibrium;
mod error;
mod export;
mod layout;
mod linearizer;
mod lyapunov;
mod modal_truncation;
mod modes;
mod participation;
mod poles;
mod reduce;
mod seeds;
mod state_space;
mod stiffness;
mod transfer;
mod zeros;

pub use along::{Along, Moment, linearize_along};
pub use describing::{Amplitude, Described, Gain, Nonlinear, Port};
pub use discretize::discretize;
pub use equilibrium::Equilibrium;
pub use error::LinearError;
pub use layout::Coordinate;
pub use linearizer::{Linearizer, Matrices};
pub use modal_truncation::modal_truncation;
pub use modes::{Mode, Modes, modes, modes_with};
pub use participation::Share;
pub use poles::poles;
pub use reduce::{Reduced, balanced_truncation};
pub use state_space::{Options, StateSpace, linearize, linearize_with};
pub use stiffness::{
    CartesianStiffness, Critical, Directions, Evidence, FittedStiffness, LoadTest, Loaded, LossOfStability,
    PrincipalAxis, RANK, StiffnessFit, StiffnessPoint, UnderLoad, Wrench, cartesian_stiffness,
    compliance_map, configuration_grid, directions, equilibrium_under_load, identify_stiffness, on_springs,
    stiffness_along, stiffness_of,
};
pub use transfer::{Bode, Peak, Transfer};
