//! Signals that stand at their own extreme.

use super::wording::{about, number, percent, unit};
use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::run::{Run, Signal};
use crate::statistics::extremes;

/// Share of the samples at one extreme that is suspicious.
const SHARE: f64 = 0.005;
/// Shortest stay at the extreme that is no chance, samples.
const STAY: usize = 3;

pub(super) fn check(run: &Run) -> Vec<Note> {
    use Quantity::*;
    let can_saturate = |s: &&Signal| {
        matches!(
            s.quantity,
            MotorTorque | MotorCurrent | JointTorque | ToolForce | ToolMoment | LinkAcceleration
        )
    };
    run.signals.iter().filter(can_saturate).flat_map(|signal| tell(run, signal)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Vec<Note> {
    let (low, high) = extremes(&signal.values);
    let at = |extreme: f64| {
        let stays = signal.values.chunk_by(|a, b| (*a == extreme) == (*b == extreme));
        let samples: usize = stays.filter(|s| s[0] == extreme && s.len() >= STAY).map(<[f64]>::len).sum();
        samples as f64 / signal.values.len() as f64
    };
    let note = |extreme: f64| {
        let share = at(extreme);
        // Zero is rest, not a limit.
        (low < high && extreme != 0.0 && share > SHARE).then(|| {
            let statement = format!(
                "{} of the samples stand at the extreme of {} {}: saturated",
                percent(share),
                number(extreme),
                unit(signal.quantity)
            );
            about(
                run,
                signal,
                Severity::Warning,
                statement,
                "the true value is larger; use windows without it",
            )
        })
    };
    [low, high].into_iter().filter_map(note).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(quantity: Quantity, limit: f64) -> Vec<Note> {
        let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let values = time.iter().map(|t| (3.0 * t.sin()).clamp(-limit, 5.0)).collect();
        check(&Run::new("log".into(), time, vec![Signal::new(quantity, "elbow", values)]).unwrap())
    }

    #[test]
    fn a_clipped_torque_is_told_with_its_limit() {
        let notes = notes(Quantity::MotorTorque, 2.9);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].statement.contains("at the extreme of -2.9 N·m (N): saturated"), "{}", notes[0]);
    }

    #[test]
    fn a_free_torque_and_a_joint_at_its_stop_are_not_mentioned() {
        assert_eq!(notes(Quantity::MotorTorque, 4.0), []);
        assert_eq!(notes(Quantity::JointPosition, 2.0), []);
    }
}
