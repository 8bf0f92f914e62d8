//! Laws of simulated runs.

mod controlled;
mod energy;
mod excitation;
mod instruments;
mod lesson;
mod refusals;
mod robots;
mod stiffness;
