//! Robots, motions and hidden effects: the recognition suite, shared by the gate's tests and by the command that
//! prints its table.

mod hidden;
#[cfg(doctest)]
mod readme;
mod robots;
mod suite;

pub use hidden::{Hidden, hidden_effects};
pub use robots::{Arm, one_joint, two_joints};
pub use suite::{Case, Outcome, Outside, confusion, judge, measure, null_case};
