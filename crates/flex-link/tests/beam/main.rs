//! Lumped springs against the beams that they stand for.
#![allow(non_snake_case)]

mod frequencies;
mod inertias;
mod robots;
mod statics;
mod table;
