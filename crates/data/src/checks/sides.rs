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

pub(super) fn check(run: &Run) -> Vec<Note> {
    let both = |joint: &&str| {
        Some((run.signal(Quantity::MotorPosition, joint)?, run.signal(Quantity::JointPosition, joint)?))
    };
    run.joints()
        .iter()
        .filter_map(both)
        .filter_map(|(theta, q)| ratio(run, theta, q).or_else(|| delay(run, theta, q)))
        .collect()
}

fn ratio(run: &Run, theta: &Signal, q: &Signal) -> Option<Note> {
    let centred = |x: &[f64]| {
        let middle = median(x.to_vec());
        x.iter().map(|v| v - middle).collect::<Vec<f64>>()
    };
    let slope = robust_slope(&centred(&q.values), &centred(&theta.values))?;
    if (slope - 1.0).abs() <= SLOPE {
        return None;
    }
    let (cause, help) = if (slope + 1.0).abs() <= SLOPE {
        (
            "the two sides turn in opposite directions".into(),
            "give one of them the scale -1 in the columns map",
        )
    } else if slope.abs() > 2.0 {
        (
            format!("the motor position is not reflected to the link side (gear ratio {}?)", number(slope)),
            "give it the scale 1/N in the columns map",
        )
    } else {
        ("the two sides have different scales".into(), "give the scale of the wrong one in the columns map")
    };
    let statement = format!("moves {} times as far as {}: {cause}", number(slope), q.name());
    Some(about(run, theta, Severity::Warning, statement, help))
}

/// q − θ = −d θ̇ + offset: which is what a delay d of the link channel looks like.
fn delay(run: &Run, theta: &Signal, q: &Signal) -> Option<Note> {
    let period = run.period();
    let grid = Uniform::within(&run.time, period);
    if grid.len < 8 * HALF_WIDTH
        || grid.len > 4 * run.time.len()
        || extremes(&q.values).0 == extremes(&q.values).1
    {
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
    fn a_late_channel_is_told_with_its_delay() {
        let notes = notes(1.0, 0.003);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].statement.starts_with("lags behind motor_position.elbow by 3 ms"), "{}", notes[0]);
    }
}
