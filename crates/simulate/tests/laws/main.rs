//! Laws of simulated runs.

mod bending;
mod controlled;
mod energy;
mod excitation;
mod instruments;
mod lesson;
mod planar_arm;
mod refusals;
mod robots;
mod rotors;
mod stiffness;
mod swings;
mod temperature;
