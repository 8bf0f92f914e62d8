//! Checks of a run that need no robot model.

mod clock;
mod constancy;
mod filtered;
mod jumps;
mod outliers;
mod saturation;
mod sides;
mod stated;
mod steps;
mod time;
mod velocity;
pub(crate) mod wording;

pub(crate) use velocity::pairs;

use crate::note::Note;
use crate::run::Run;

// Samples of which more than their clock can be judged.
const FEWEST: usize = 50;

/// What is suspicious about a run, seen from its own signals.
///
/// In this order, since each check trusts the ones before: time stamps (jitter, gaps, unit), constant and dead
/// signals, stated noise, logged velocity against the derivative of the position (unit, sign, gear ratio, clock), motor side
/// against link side (gear, sign, delay), outliers, jumps, quantisation, saturation, filtering before logging. What the
/// reader had to tell is in [`Run::notes`] and not repeated.
///
/// # Example
/// ```
/// use sinew_data::{Quantity, Run, Signal, check_run};
/// let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
/// let position: Vec<f64> = time.iter().map(|t| (2.0 * t).sin()).collect();
/// let degrees: Vec<f64> = time.iter().map(|t| (2.0 * (2.0 * t).cos()).to_degrees()).collect();
/// let q = Signal::new(Quantity::JointPosition, "elbow", position);
/// let qd = Signal::new(Quantity::JointVelocity, "elbow", degrees);
/// let notes = check_run(&Run::new("log".into(), time, vec![q, qd]).unwrap());
/// assert!(notes.iter().any(|note| note.statement.contains("57.3 times") && note.statement.contains("degrees")));
/// ```
pub fn check_run(run: &Run) -> Vec<Note> {
    let checks: [fn(&Run) -> Vec<Note>; 10] = [
        time::check,
        constancy::check,
        stated::check,
        velocity::check,
        sides::check,
        outliers::check,
        jumps::check,
        steps::check,
        saturation::check,
        filtered::check,
    ];
    let few = if run.time.len() < FEWEST { 1 } else { checks.len() };
    checks[..few].iter().flat_map(|check| check(run)).collect()
}
