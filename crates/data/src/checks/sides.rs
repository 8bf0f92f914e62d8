//! Motor side against link side of a joint that has both sensors: gear, sign, delay.

use super::wording::{about, number, percent};
use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::resample::{Uniform, resample};
use crate::run::{Run, Signal};
use crate::smoother::Smoother;
use crate::statistics::{extremes, mean, median, robust_slope};

/// Slopes within this share of one are right.
const SLOPE: f64 = 0.02;
/// A delay is told from this share of a sample on, and if it explains this share of the deflection.
const SAMPLES: f64 = 0.3;
const EXPLAINED: f64 = 0.5;
const HALF_WIDTH: usize = 8;
/// Correlation from which two sides are those of one joint, and below which they are those of two.
const SAME: f64 = 0.99;
const OTHER: f64 = 0.9;

pub(super) fn check(run: &Run) -> Vec<Note> {
    let both = |joint: &&str| {
        Some((run.signal(Quantity::MotorPosition, joint)?, run.signal(Quantity::JointPosition, joint)?))
    };
    let pairs: Vec<(&Signal, &Signal)> = run.joints().iter().filter_map(both).collect();
    let told = |(k, (theta, q)): (usize, &(&Signal, &Signal))| {
        exchanged(run, k, &pairs).or_else(|| ratio(run, theta, q)).or_else(|| delay(run, theta, q))
    };
    pairs.iter().enumerate().filter_map(told).collect()
}

// A link moves as its motor does but for the deflection: what follows the motor of another joint, and its own not, stands
// in the wrong column.
fn exchanged(run: &Run, k: usize, pairs: &[(&Signal, &Signal)]) -> Option<Note> {
    let (theta, q) = pairs[k];
    if likeness(&theta.values, &q.values) >= OTHER {
        return None;
    }
    let (other, _) = pairs.iter().find(|(motor, _)| likeness(&motor.values, &q.values) >= SAME)?;
    let statement = format!(
        "does not move as {} does, but as {}: columns that stand in each other's place?",
        theta.name(),
        other.name()
    );
    Some(about(run, q, Severity::Error, statement, "exchange the two columns of one side in the columns map"))
}

// Correlation of two signals; zero where one stands still.
fn likeness(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum()
    };
    let size = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    if size > 0.0 { sum(&|a, b| a * b) / size } else { 0.0 }
}

fn stands_still(signal: &Signal) -> bool {
    let (low, high) = extremes(&signal.values);
    low == high
}

fn ratio(run: &Run, theta: &Signal, q: &Signal) -> Option<Note> {
    let centred = |x: &[f64]| {
        let middle = median(x.to_vec());
        x.iter().map(|v| v - middle).collect::<Vec<f64>>()
    };
    // A side that stands still is told for itself.
    if stands_still(theta) || stands_still(q) {
        return None;
    }
    let slope = robust_slope(&centred(&q.values), &centred(&theta.values))?;
    if (slope - 1.0).abs() <= SLOPE {
        return None;
    }
    let (severity, cause, help) = if (slope + 1.0).abs() <= SLOPE {
        (
            Severity::Error,
            "the two sides turn in opposite directions".into(),
            "give one of them the scale -1 in the columns map",
        )
    } else if slope.abs() > 2.0 {
        (
            Severity::Warning,
            format!("the motor position is not reflected to the link side (gear ratio {}?)", number(slope)),
            "give it the scale 1/N in the columns map",
        )
    } else {
        (
            Severity::Warning,
            "the two sides have different scales".into(),
            "give the scale of the wrong one in the columns map",
        )
    };
    let statement = format!("moves {} times as far as {}: {cause}", number(slope), q.name());
    Some(about(run, theta, severity, statement, help))
}

/// q − θ = −d θ̇ + offset: which is what a delay d of the link channel looks like.
fn delay(run: &Run, theta: &Signal, q: &Signal) -> Option<Note> {
    let period = run.period();
    let grid = Uniform::within(&run.time, period);
    if grid.len < 8 * HALF_WIDTH || grid.len > 4 * run.time.len() || stands_still(q) {
        return None;
    }
    let smoother = Smoother::new(HALF_WIDTH, period);
    let theta_on_grid = resample(&run.time, &theta.values, &grid);
    let deflection: Vec<f64> = resample(&run.time, &q.values, &grid)
        .iter()
        .zip(&theta_on_grid)
        .map(|(q, theta)| q - theta)
        .collect();
    let (deflection, rate) = (smoother.value(&deflection), smoother.rate(&theta_on_grid));
    let (mean_d, mean_r) = (mean(&deflection), mean(&rate));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        deflection.iter().zip(&rate).map(|(d, r)| f(d - mean_d, r - mean_r)).sum()
    };
    let (dr, rr, dd) = (sum(&|d, r| d * r), sum(&|_, r| r * r), sum(&|d, _| d * d));
    let (delay, explained) = (-dr / rr, dr * dr / (rr * dd));
    if !(explained > EXPLAINED && delay.abs() > SAMPLES * period) {
        return None;
    }
    let statement = format!(
        "{} {} by {} ms, which explains {} of the difference between the two",
        if delay > 0.0 { "lags behind" } else { "runs ahead of" },
        theta.name(),
        number(1e3 * delay.abs()),
        percent(explained)
    );
    let help =
        "a delay looks like damping of the joint: let it be fitted (time_skew) before elasticity is judged";
    Some(about(run, q, Severity::Warning, statement, help))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(scale: f64, delay: f64) -> Vec<Note> {
        let time: Vec<f64> = (0..1000).map(|k| 0.004 * f64::from(k)).collect();
        let motion = |t: f64| 0.8 * (1.5 * t).sin() + 0.4 * (3.5 * t).sin();
        let signals = vec![
            Signal::new(Quantity::MotorPosition, "elbow", time.iter().map(|t| scale * motion(*t)).collect()),
            Signal::new(
                Quantity::JointPosition,
                "elbow",
                time.iter().map(|t| 0.1 + motion(t - delay)).collect(),
            ),
        ];
        check(&Run::new("log".into(), time, signals).unwrap())
    }

    #[test]
    fn sides_that_agree_up_to_an_offset_are_not_mentioned() {
        assert_eq!(notes(1.0, 0.0), []);
    }

    #[test]
    fn a_motor_position_that_was_not_reflected_is_named() {
        assert!(
            notes(-160.0, 0.0)[0].statement.contains("not reflected to the link side (gear ratio -160?)")
        );
        assert!(notes(-1.0, 0.0)[0].statement.contains("opposite directions"));
        assert!(notes(1.1, 0.0)[0].statement.contains("different scales"));
    }

    #[test]
    fn link_positions_of_two_joints_in_each_others_columns_are_found() {
        let time: Vec<f64> = (0..1000).map(|k| 0.004 * f64::from(k)).collect();
        let of = |w: f64| -> Vec<f64> { time.iter().map(|t| (w * t).sin()).collect() };
        let signals = |elbow: f64, wrist: f64| {
            vec![
                Signal::new(Quantity::MotorPosition, "elbow", of(1.5)),
                Signal::new(Quantity::MotorPosition, "wrist", of(3.5)),
                Signal::new(Quantity::JointPosition, "elbow", of(elbow)),
                Signal::new(Quantity::JointPosition, "wrist", of(wrist)),
            ]
        };
        let told =
            |elbow, wrist| check(&Run::new("log".into(), time.clone(), signals(elbow, wrist)).unwrap());
        assert_eq!(told(1.5, 3.5), []);
        let exchanged = told(3.5, 1.5);
        assert_eq!(exchanged.len(), 2);
        assert!(
            exchanged[0].severity == Severity::Error
                && exchanged[0].statement.contains("but as motor_position.wrist")
        );
    }

    #[test]
    fn a_late_channel_is_told_with_its_delay() {
        let notes = notes(1.0, 0.003);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].statement.starts_with("lags behind motor_position.elbow by 3 ms"), "{}", notes[0]);
    }
}
