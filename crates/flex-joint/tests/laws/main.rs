//! Laws of elastic joints, and figures of independent libraries. One program: dynamics in each kind of number take long to
//! compile.
#![allow(non_snake_case)]

mod complete;
mod golden;
mod inverse_dynamics;
mod passivity;
mod reference;
mod trees;
