//! Constant and dead signals.

use super::wording::{about, number, unit};
use crate::noise::white_noise_std;
use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::run::{Run, Signal};
use crate::statistics::extremes;

/// A signal that stands still this long while its joint moves is dead, s.
const LONGEST: f64 = 0.5;
/// Motion that counts, as a share of the range of the position that moves.
const MOTION: f64 = 0.02;

/// Range of a torque that changes, in standard deviations of its noise.
const NOISES: f64 = 20.0;

pub(super) fn check(run: &Run) -> Vec<Note> {
    run.signals.iter().filter_map(|signal| constant(run, signal).or_else(|| dead(run, signal))).collect()
}

fn constant(run: &Run, signal: &Signal) -> Option<Note> {
    let (low, high) = extremes(&signal.values);
    if low < high {
        return None;
    }
    let moves = motion(run, signal, 0, run.time.len()).or_else(|| load(run, signal));
    let (severity, joint) = match moves {
        Some((other, range)) => {
            let unit = unit(other.quantity);
            (Severity::Warning, format!(", although {} changes by {} {unit}", other.name(), number(range)))
        }
        None => (Severity::Note, String::new()),
    };
    let statement = format!("constant at {} {} in the whole run{joint}", number(low), unit(signal.quantity));
    Some(about(run, signal, severity, statement, "leave the column out if the sensor was not connected"))
}

fn dead(run: &Run, signal: &Signal) -> Option<Note> {
    let (first, end) = still(run, signal).into_iter().find(|&(a, b)| motion(run, signal, a, b).is_some())?;
    let (other, range) = motion(run, signal, first, end)?;
    Some(Note {
        severity: Severity::Warning,
        place: run.place_of(first),
        statement: format!(
            "{} stands still at {} {} for {} s from here on, while {} moves by {} {}",
            signal.name(),
            number(signal.values[first]),
            unit(signal.quantity),
            number(run.time[end - 1] - run.time[first]),
            other.name(),
            number(range),
            unit(other.quantity),
        ),
        help: "a dead sensor or a held command; if dead, use a window without it: FILE@FROM..TO".into(),
    })
}

/// Stretches of identical values that last too long.
fn still(run: &Run, signal: &Signal) -> Vec<(usize, usize)> {
    let mut stretches = Vec::new();
    let mut first = 0;
    for k in 1..=signal.values.len() {
        if k == signal.values.len() || signal.values[k] != signal.values[first] {
            if run.time[k - 1] - run.time[first] >= LONGEST {
                stretches.push((first, k));
            }
            first = k;
        }
    }
    stretches
}

/// The torque of the joint of a position, and its range, if that is more than its noise: an encoder that shows nothing of
/// it, to the last digit, may be dead.
fn load<'a>(run: &'a Run, signal: &Signal) -> Option<(&'a Signal, f64)> {
    use Quantity::{JointPosition, JointTorque, MotorCurrent, MotorPosition, MotorTorque};
    let range = |s: &Signal| extremes(&s.values).1 - extremes(&s.values).0;
    let is_load = |s: &&Signal| matches!(s.quantity, MotorTorque | JointTorque | MotorCurrent);
    let loads = run.signals.iter().filter(is_load).filter(|s| s.place == signal.place);
    let is_position = matches!(signal.quantity, MotorPosition | JointPosition);
    let changing = loads.filter(|s| is_position && range(s) > NOISES * white_noise_std(&s.values));
    changing.map(|s| (s, range(s))).next()
}

/// Another position of the same joint that moves between two samples, and by how much.
fn motion<'a>(run: &'a Run, signal: &Signal, first: usize, end: usize) -> Option<(&'a Signal, f64)> {
    let range = |values: &[f64]| extremes(values).1 - extremes(values).0;
    run.signals
        .iter()
        .filter(|s| matches!(s.quantity, Quantity::MotorPosition | Quantity::JointPosition))
        .filter(|s| signal.quantity.is_of_joint() && s.place == signal.place && s.quantity != signal.quantity)
        .map(|s| (s, range(&s.values[first..end])))
        .find(|(s, moved)| *moved > 0.0 && *moved >= MOTION * range(&s.values))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(torque: impl Fn(usize) -> f64, position: impl Fn(usize) -> f64) -> Run {
        let n = 300;
        let signals = vec![
            Signal::new(Quantity::MotorTorque, "elbow", (0..n).map(torque).collect()),
            Signal::new(Quantity::MotorPosition, "elbow", (0..n).map(position).collect()),
        ];
        Run::new("log".into(), (0..n).map(|k| 0.01 * k as f64).collect(), signals).unwrap()
    }

    #[test]
    fn a_constant_column_is_told() {
        let notes = check(&run(|_| 2.5, |k| (0.05 * k as f64).sin()));
        assert_eq!(notes.len(), 1);
        assert_eq!(
            notes[0].statement,
            "constant at 2.5 N·m (N) in the whole run, although motor_position.elbow changes by 2 rad (m)"
        );
        // An encoder that shows nothing of a load.
        let notes = check(&run(|k| (0.05 * k as f64).sin(), |_| 1.0));
        assert!(notes[0].statement.contains("motor_torque.elbow") && notes[0].severity == Severity::Warning);
        let notes = check(&run(|_| 0.0, |_| 1.0));
        assert!(notes.len() == 2 && notes.iter().all(|n| n.severity == Severity::Note));
    }

    #[test]
    fn a_sensor_that_dies_while_the_joint_moves_is_told_with_its_place() {
        let notes = check(&run(|k| k.min(150) as f64, |k| (0.05 * k as f64).sin()));
        assert_eq!(notes.len(), 1);
        assert_eq!(notes[0].place, "log, sample 151");
        assert!(notes[0].statement.contains("motor_torque.elbow stands still at 150 N·m (N) for 1.49 s"));
    }

    #[test]
    fn a_joint_at_rest_has_no_dead_sensor() {
        assert_eq!(check(&run(|k| k.min(150) as f64, |k| k.min(150) as f64)), []);
    }
}
