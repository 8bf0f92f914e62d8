//! Positions that jump: nothing that has mass does.

use std::f64::consts::TAU;

use super::wording::{number, unit};
use crate::noise::instrument_noise;
use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::run::{Run, Signal};

/// A step is a jump if it is so many times as large as each of its neighbours, this many on either side.
const ABRUPT: f64 = 10.0;
const NEIGHBOURS: usize = 3;
/// … and so many standard deviations of the noise.
const BEYOND_NOISE: f64 = 40.0;
/// A jump stays for so many samples: what comes back sooner is an outlier.
const STAYS: usize = 4;
/// How near to whole turns a jump is one of an angle that was wrapped, rad.
const TURN: f64 = 0.2;

pub(super) fn check(run: &Run) -> Vec<Note> {
    let positions = |s: &&Signal| matches!(s.quantity, Quantity::MotorPosition | Quantity::JointPosition);
    run.signals.iter().filter(positions).filter_map(|s| tell(run, s)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Option<Note> {
    let jumps: Vec<(usize, f64)> = jumps(signal).into_iter().filter(|(k, _)| !run.is_gap(*k)).collect();
    let (first, size) = *jumps.first()?;
    let more = match jumps.len() {
        1 => String::new(),
        n => format!("; {n} jumps in the run"),
    };
    let (severity, help) = if is_turn(size) {
        (
            Severity::Error,
            "an angle that was wrapped: give it wraps = 6.283185307179586 in the columns map, or a whole turn in the unit of its column",
        )
    } else {
        (Severity::Warning, "nothing that has mass jumps: use a window of the run without it, FILE@FROM..TO")
    };
    Some(Note {
        severity,
        place: run.place_of(first),
        statement: format!(
            "{}: jumps by {} {} from the sample before{more}",
            signal.name(),
            number(size),
            unit(signal.quantity)
        ),
        help: help.into(),
    })
}

/// True if an angle jumps by whole turns.
pub(super) fn is_wrapped(signal: &Signal) -> bool {
    jumps(signal).into_iter().any(|(_, size)| is_turn(size))
}

fn is_turn(size: f64) -> bool {
    let turns = (size / TAU).round();
    turns != 0.0 && (size - turns * TAU).abs() < TURN
}

/// The sample after every jump, and by how much.
fn jumps(signal: &Signal) -> Vec<(usize, f64)> {
    let x = &signal.values;
    let least = BEYOND_NOISE * instrument_noise(signal);
    let step = |k: usize| x[k] - x[k - 1];
    let is_jump = |k: usize| {
        let size = step(k).abs();
        let mut near = (k - NEIGHBOURS..k).chain(k + 1..=k + NEIGHBOURS);
        let stays = || (1..=STAYS).all(|n| (x[k + n - 1] - x[k - 1]).abs() > 0.5 * size);
        size > least && near.all(|n| size > ABRUPT * step(n).abs()) && stays()
    };
    let inner = NEIGHBOURS + 1..x.len().saturating_sub(NEIGHBOURS.max(STAYS));
    inner.filter(|&k| is_jump(k)).map(|k| (k, step(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::white_noise;

    fn told(values: Vec<f64>) -> Vec<Note> {
        let time = (0..values.len()).map(|k| 0.002 * k as f64).collect();
        let signal = Signal::new(Quantity::MotorPosition, "elbow", values);
        check(&Run::new("log".into(), time, vec![signal]).unwrap())
    }

    fn motion() -> Vec<f64> {
        let noise = white_noise(3000, 5);
        let noisy = noise.iter().enumerate().map(|(k, n)| 0.5 * (0.004 * k as f64).sin() + 1e-5 * n);
        noisy.collect()
    }

    #[test]
    fn a_motion_that_starts_and_stops_does_not_jump() {
        let stopped = motion().into_iter().enumerate().map(|(k, x)| if k < 1000 { 0.0 } else { x });
        let coarse: Vec<f64> = motion().iter().map(|x| (x / 1e-3).round() * 1e-3).collect();
        assert_eq!(told(motion()), []);
        assert_eq!(told(coarse), []);
        assert_eq!(told(stopped.map(|x| x.max(-0.3)).skip(1000).collect()), []);
    }

    #[test]
    fn a_few_samples_elsewhere_are_told_with_their_line_and_a_turn_as_one() {
        let mut values = motion();
        values[700..706].iter_mut().for_each(|x| *x += 0.87);
        let notes = told(values);
        assert_eq!(notes[0].place, "log, sample 701");
        assert!(notes[0].statement.contains("jumps by 0.868 rad"), "{}", notes[0].statement);
        assert!(notes[0].statement.ends_with("2 jumps in the run"));
        let mut values = motion();
        values[700..].iter_mut().for_each(|x| *x -= TAU);
        let turned = told(values).remove(0);
        assert!(turned.severity == Severity::Error && turned.help.contains("wrapped"), "{turned}");
    }
}
