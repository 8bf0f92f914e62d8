//! Robots, motions and hidden effects: the recognition suite, shared by the gate's tests and by the command that
//! prints its table.

mod described;
mod drawn;
mod foreign;
mod hidden;
mod mixed;
mod nulls;
#[cfg(doctest)]
mod readme;
mod robots;
mod suite;

pub use described::described_case;
pub use drawn::drawn_case;
pub use foreign::{Edit, Foreign, PUSHED, Way, foreign_catalogue, foreign_causes, push};
pub use hidden::{Hidden, How, are_twins, hidden_effects, turns_of_motor};
pub use mixed::mixed_case;
pub use nulls::{Estimate, NullCase, null_statistics};
pub use robots::{Arm, one_joint, six_joints, two_joints};
pub use suite::{
    Case, Conditions, Data, Outcome, Outside, Sensors, TorqueNoise, confusion, judge, measure, measure_for,
    null_case,
};
