//! Logged velocity against the derivative of the position: unit, sign, gear ratio, truth of the time stamps.

use super::clock::repeats_or_skips_ticks;
use super::jumps::is_wrapped;
use super::wording::{about, number, percent};
use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::resample::{Uniform, resample};
use crate::run::{Run, Signal};
use crate::smoother::Smoother;
use crate::statistics::{rms, robust_slope};

/// Slopes within this share of one are right.
const SLOPE: f64 = 0.05;
/// Misfit that is told, and misfit that already costs effects, as shares of the velocity.
const TOLD: f64 = 0.015;
const STRONG: f64 = 0.03;
/// The way out where it is not known which.
const WRONG_ONE: &str = "give the scale of the wrong one in the columns map";
/// Half width of the smoother: as many samples, and at least as many seconds.
const SAMPLES: usize = 8;
const SECONDS: f64 = 0.016;

pub(super) fn check(run: &Run) -> Vec<Note> {
    // A wrapped angle has no derivative, and is told for itself.
    let whole = pairs(run).into_iter().filter(|[q, _]| !is_wrapped(q));
    let compared = whole.filter_map(|pair| compare(run, pair)).collect::<Vec<_>>();
    let right = |c: &&Compared| (c.slope - 1.0).abs() <= SLOPE;
    let wrong_factor = compared.iter().filter(|c| !right(c)).map(|c| tell_factor(run, c));
    let misfits: Vec<&Compared> = compared.iter().filter(right).filter(|c| c.misfit >= TOLD).collect();
    let told = match misfits.is_empty() || !clock_is_broken(run) {
        true => misfits.iter().map(|c| tell_misfit(run, c)).collect(),
        false => vec![tell_clock(run, &misfits)],
    };
    wrong_factor.chain(told).collect()
}

/// Whether the motion of the fastest joint shows that the log was polled by another clock than the robot's.
pub(super) fn clock_is_broken(run: &Run) -> bool {
    pairs(run).iter().any(|[q, qd]| repeats_or_skips_ticks(&run.time, &q.values, &qd.values))
}

/// A logged velocity and how it fits the derivative of the position.
struct Compared<'a> {
    q: &'a Signal,
    qd: &'a Signal,
    /// Robust slope of the logged velocity on the derivative.
    slope: f64,
    /// Root mean square of what the slope leaves, as a share of the velocity.
    misfit: f64,
}

/// Position and velocity of every joint and side that has both.
pub(crate) fn pairs(run: &Run) -> Vec<[&Signal; 2]> {
    let sides = [
        (Quantity::MotorPosition, Quantity::MotorVelocity),
        (Quantity::JointPosition, Quantity::JointVelocity),
    ];
    let of_joint = |joint: &str| {
        sides.map(|(position, velocity)| Some([run.signal(position, joint)?, run.signal(velocity, joint)?]))
    };
    run.joints().into_iter().flat_map(of_joint).flatten().collect()
}

fn compare<'a>(run: &Run, [q, qd]: [&'a Signal; 2]) -> Option<Compared<'a>> {
    let (logged, derived) = on_one_kernel(run, &q.values, &qd.values)?;
    let slope = robust_slope(&derived, &logged)?;
    let misfit = rms(logged.iter().zip(&derived).map(|(v, d)| v - slope * d)) / rms(logged.iter().copied());
    Some(Compared { q, qd, slope, misfit })
}

fn tell_factor(run: &Run, c: &Compared) -> Note {
    let (severity, cause, help) = cause_of(c.slope);
    let statement = format!("{} times the derivative of {}: {cause}", number(c.slope), c.q.name());
    about(run, c.qd, severity, statement, help)
}

fn tell_misfit(run: &Run, c: &Compared) -> Note {
    let statement = format!(
        "differs from the derivative of {} on the time stamps by {} of its rms",
        c.q.name(),
        percent(c.misfit)
    );
    let severity = if c.misfit < STRONG { Severity::Note } else { Severity::Warning };
    let help = "the time stamps or the velocity are not those of the samples: late, filtered or uneven";
    about(run, c.qd, severity, statement, help)
}

fn tell_clock(run: &Run, misfits: &[&Compared]) -> Note {
    let worst = misfits.iter().map(|c| c.misfit).fold(0.0, f64::max);
    let joints: Vec<&str> = misfits.iter().map(|c| c.q.place.as_str()).collect();
    Note {
        severity: Severity::Warning,
        place: run.name.clone(),
        statement: format!(
            "the clock of this log repeats or skips ticks: between two rows the joints move by whole ticks, which the \
             time stamps do not show; the derivative of the position is up to {} off the logged velocity ({})",
            percent(worst),
            joints.join(", ")
        ),
        help:
            "rebuild the clock from the velocities with --rebuild-clock, or log the controller's time stamps"
                .into(),
    }
}

/// Smoothed velocity, and smoothed derivative of the position, by one kernel. `None` if either stands still.
fn on_one_kernel(run: &Run, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let period = run.period();
    let grid = Uniform::within(&run.time, period);
    let half_width = SAMPLES.max((SECONDS / period).ceil() as usize);
    if grid.len < 4 * half_width || grid.len > 4 * run.time.len() {
        return None;
    }
    let smoother = Smoother::new(half_width, period);
    let logged = smoother.value(&resample(&run.time, qd, &grid));
    let derived = smoother.rate(&resample(&run.time, q, &grid));
    let moves = |x: &[f64]| rms(x.iter().copied()) > 0.0;
    (moves(&logged) && moves(&derived)).then_some((logged, derived))
}

// Nothing rests on a logged velocity, and everything on a position.
fn cause_of(slope: f64) -> (Severity, String, &'static str) {
    let near = |value: f64| (slope.abs() / value - 1.0).abs() < SLOPE;
    let sign = if slope < 0.0 { " and the sign is turned round" } else { "" };
    let to_radians = "give it the scale 0.017453292519943295 in the columns map";
    let (severity, cause, help) = if near(1.0) {
        let cause = "one of the two has the wrong sign".to_owned();
        return (Severity::Warning, cause, "give it the scale -1 in the columns map");
    } else if near(1f64.to_degrees()) {
        (Severity::Warning, "the velocity is in degrees".to_owned(), to_radians)
    } else if near(1f64.to_radians()) {
        (Severity::Error, "the position is in degrees".to_owned(), to_radians)
    } else if near(1e-3) {
        let cause = "the position is in thousandths of a radian or metre".to_owned();
        (Severity::Error, cause, "give it the scale 0.001 in the columns map")
    } else if slope.abs() >= 5.0 {
        let cause = format!("the velocity is on the motor side of a gear of {}", number(slope.abs()));
        (Severity::Warning, cause, WRONG_ONE)
    } else if slope.abs() <= 0.2 {
        let cause = format!("the position is on the motor side of a gear of {}", number(1.0 / slope.abs()));
        (Severity::Warning, cause, WRONG_ONE)
    } else {
        (Severity::Warning, "units differ, or the velocity was filtered".to_owned(), WRONG_ONE)
    };
    (severity, cause + sign, help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(time: Vec<f64>, true_time: &[f64], scale: f64) -> Run {
        let of = |f: fn(f64) -> f64| true_time.iter().map(|&t| f(t)).collect::<Vec<f64>>();
        let velocity = of(|t| 1.2 * (1.5 * t).cos() + 1.4 * (3.5 * t).cos());
        let signals = vec![
            Signal::new(
                Quantity::JointPosition,
                "elbow",
                of(|t| 0.8 * (1.5 * t).sin() + 0.4 * (3.5 * t).sin()),
            ),
            Signal::new(Quantity::JointVelocity, "elbow", velocity.iter().map(|v| scale * v).collect()),
        ];
        Run::new("log".into(), time, signals).unwrap()
    }

    fn statement(scale: f64) -> String {
        let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let notes = check(&run(time.clone(), &time, scale));
        notes.into_iter().map(|n| n.statement).collect()
    }

    #[test]
    fn a_true_velocity_is_not_mentioned() {
        assert_eq!(statement(1.0), "");
        assert_eq!(statement(1.03), "");
    }

    #[test]
    fn a_wrong_factor_is_named() {
        assert!(statement(57.296).starts_with("57.3 times the derivative of joint_position.elbow"));
        assert!(statement(57.296).contains("the velocity is in degrees"));
        assert!(statement(1.0 / 57.296).contains("the position is in degrees"));
        assert!(statement(1e-3).contains("the position is in thousandths"));
        assert!(statement(-57.296).contains("degrees and the sign is turned round"));
        assert!(statement(-1.0).contains("wrong sign"));
        assert!(statement(100.0).contains("motor side of a gear of 100"));
        assert!(statement(-0.01).contains("the position is on the motor side of a gear of 100 and the sign"));
        assert!(statement(0.8).contains("units differ"));
    }

    #[test]
    fn stamps_that_are_not_those_of_the_samples_are_told() {
        let uniform: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let uneven: Vec<f64> = uniform.iter().map(|t| t + 0.008 * (7.0 * t).sin()).collect();
        let notes = check(&run(uniform, &uneven, 1.0));
        assert_eq!(notes.len(), 1);
        assert_eq!(notes[0].severity, Severity::Warning);
        assert!(notes[0].statement.contains("differs from the derivative"), "{}", notes[0]);
    }

    #[test]
    fn a_clock_that_repeats_and_skips_ticks_is_named() {
        // polled every 0.9 ms, new samples every 1 ms, and every 14th poll comes a tick late
        let polled: Vec<f64> = (0..4000).map(|k| 0.0009 * f64::from(k)).collect();
        let mut stamps = polled.clone();
        stamps.iter_mut().enumerate().for_each(|(k, t)| *t += 0.0002 * ((k * k) as f64).sin());
        let delay = |k: usize| if k % 160 < 80 { 0.004 } else { 0.0 };
        let ticks: Vec<f64> =
            polled.iter().enumerate().map(|(k, t)| ((t - delay(k)) / 0.001).floor() * 0.001).collect();
        let notes = check(&run(stamps, &ticks, 1.0));
        assert!(notes[0].statement.contains("the clock of this log repeats or skips ticks"), "{}", notes[0]);
    }
}
