//! Laws of simulated runs.

mod controlled;
mod energy;
mod excitation;
mod instruments;
mod lesson;
mod planar_arm;
mod refusals;
mod robots;
mod stiffness;
