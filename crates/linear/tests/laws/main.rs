//! Laws of linear models, modes, frequency responses, reduced and sampled models, stiffness.
#![allow(non_snake_case)]

mod along;
mod bending;
mod chirp;
mod describing;
mod export;
mod following;
mod lesson;
mod participation;
mod planar_arm;
mod reduction;
mod reference;
mod robots;
mod sampling;
mod stiffness;
mod stiffness_base;
mod stiffness_identify;
mod stiffness_reference;
mod symmetric;
mod transfer;
