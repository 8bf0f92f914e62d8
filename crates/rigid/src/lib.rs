//! Rigid-body dynamics of robot trees: RNEA, CRBA, ABA, energy.
//!
//! Plain functions (`mass_matrix`, `inverse_dynamics`) are for people; forms ending in `_into` are for loops: they take
//! a [`Workspace`] and allocate nothing. Both rest on the forms ending in `_with`, written once over
//! [`Scalar`](sinew_model::Scalar): they take [`Bodies`] whose inertias, gravity and armature are numbers of any kind
//! and a [`Scratch`], and so give lanes and exact derivatives too.
//!
//! # Example
//! The torque that holds a robot is the slope of its potential energy, here by a dual number:
//! ```
//! use sinew_model::{Dual, samples};
//! use sinew_rigid::{Bodies, Scratch, gravity, inertias, potential_energy_with};
//! let pendulum = samples::pendulum(2.0, 0.5);
//! let inertia = inertias(&pendulum);
//! let bodies = Bodies::new(&pendulum, &inertia);
//! let q = [Dual::<1>::variable(0.3, 0)];
//! let energy = potential_energy_with(&bodies, &mut Scratch::new(&pendulum), &q);
//! approx::assert_relative_eq!(energy.derivative[0], gravity(&pendulum, &[0.3])[0], max_relative = 1e-12);
//! ```
#![cfg_attr(not(feature = "std"), no_std)]
#![allow(non_snake_case)]

extern crate alloc;

mod base_parameters;
mod batch;
mod bodies;
mod centroidal_momentum;
mod coriolis;
mod energy;
mod energy_regressor;
mod forward_dynamics;
mod forward_dynamics_derivatives;
mod hybrid_dynamics;
mod inverse_dynamics;
mod inverse_dynamics_derivatives;
mod inverse_mass_matrix;
mod ltdl;
mod mass_matrix;
mod moving_bodies;
mod places;
mod regressor;
mod rnea;
mod scratch;
mod support;
mod tool_wrench;
mod workspace;

pub use base_parameters::{BaseParameters, ParameterGroup, base_parameters};
pub use batch::{
    BatchWorkspace, forward_dynamics_batch, forward_dynamics_batch_into, inverse_dynamics_batch,
    inverse_dynamics_batch_into, inverse_dynamics_derivatives_batch, inverse_dynamics_derivatives_batch_into,
    inverse_mass_matrix_batch, inverse_mass_matrix_batch_into, mass_matrix_batch, mass_matrix_batch_into,
    mass_matrix_upper_batch_into, regressor_batch, regressor_batch_into,
};
pub use bodies::{Bodies, inertias};
pub use centroidal_momentum::{
    centroidal_momentum, centroidal_momentum_into, centroidal_momentum_matrix,
    centroidal_momentum_matrix_into, centroidal_momentum_matrix_with, centroidal_momentum_rate,
    centroidal_momentum_rate_into, centroidal_momentum_with,
};
pub use coriolis::{coriolis_matrix, coriolis_matrix_into, coriolis_matrix_with};
pub use energy::{
    kinetic_energy, kinetic_energy_into, kinetic_energy_with, potential_energy, potential_energy_into,
    potential_energy_with,
};
pub use energy_regressor::{
    kinetic_energy_regressor, kinetic_energy_regressor_into, kinetic_energy_regressor_with,
    potential_energy_regressor, potential_energy_regressor_into, potential_energy_regressor_with,
};
pub use forward_dynamics::{forward_dynamics, forward_dynamics_into, forward_dynamics_under_into};
pub use forward_dynamics_derivatives::{
    ForwardDynamicsDerivatives, forward_dynamics_derivatives, forward_dynamics_derivatives_into,
    forward_dynamics_derivatives_with,
};
pub use hybrid_dynamics::{
    forward_dynamics_under_with, forward_dynamics_with, hybrid_dynamics_with, hybrid_response_with,
};
pub use inverse_dynamics::{bias, bias_into, gravity, gravity_into, inverse_dynamics, inverse_dynamics_into};
pub use inverse_dynamics_derivatives::{
    InverseDynamicsDerivatives, inverse_dynamics_derivatives, inverse_dynamics_derivatives_into,
    inverse_dynamics_derivatives_with,
};
pub use inverse_mass_matrix::{inverse_mass_matrix, inverse_mass_matrix_into, inverse_mass_matrix_with};
pub use mass_matrix::{mass_matrix, mass_matrix_into, mass_matrix_upper_into, mass_matrix_with};
pub use moving_bodies::{BodyAccelerations, MovingBodies};
pub use regressor::{PARAMETERS, regressor, regressor_into, regressor_with};
pub use rnea::inverse_dynamics_with;
pub use scratch::Scratch;
pub use tool_wrench::tool_wrench_with;
pub use workspace::Workspace;
