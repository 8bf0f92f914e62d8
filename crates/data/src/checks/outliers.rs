//! Single readings far off their neighbours.

use super::velocity::clock_is_broken;
use super::wording::{number, percent, unit};
use crate::note::{Note, Severity};
use crate::quantisation::quantisation_step;
use crate::quantity::Quantity;
use crate::resample::lagrange;
use crate::run::{Run, Signal};
use crate::statistics::{extremes, median};

/// Deviations from the neighbours beyond this many robust standard deviations are suspicious.
const LIMIT: f64 = 8.0;
/// The standard deviation is taken over the signal, and over this many samples to either side.
const NEIGHBOURHOOD: usize = 50;
/// Share of the largest deviation of a disturbance that its outlier's other deviations have: those of one sample are a sixth.
const STICKS_OUT: f64 = 0.1;
/// Longest outlier, samples; it disturbs four more deviations.
const LONGEST: usize = 3;
/// More outliers than this share make the signal useless.
const USELESS: f64 = 0.05;
// Share from which they are more than a note: a few are no harm, and dry friction makes some where it turns round.
const MANY: f64 = 0.005;
// … and share of a signal's range from which one is.
const PLAIN: f64 = 0.2;

pub(super) fn check(run: &Run) -> Vec<Note> {
    use Quantity::*;
    // Samples of motion with wrong time stamps look like outliers and are none.
    let clock_is_broken = clock_is_broken(run);
    let moves =
        |s: &Signal| matches!(s.quantity, MotorPosition | MotorVelocity | JointPosition | JointVelocity);
    run.signals.iter().filter(|s| !(clock_is_broken && moves(s))).filter_map(|s| tell(run, s)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Option<Note> {
    let outliers = outliers(&run.time, &signal.values);
    let (largest, size) = *outliers.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let share = outliers.len() as f64 / signal.values.len() as f64;
    let (low, high) = extremes(&signal.values);
    let is_plain = size.abs() > PLAIN * (high - low);
    Some(Note {
        severity: match share {
            s if s > USELESS => Severity::Error,
            s if s > MANY || is_plain => Severity::Warning,
            _ => Severity::Note,
        },
        place: run.place_of(largest),
        statement: format!(
            "{}: {} isolated outlier{} ({} of the samples), the largest here, {} {} off its neighbours",
            signal.name(),
            outliers.len(),
            if outliers.len() == 1 { "" } else { "s" },
            percent(share),
            number(size),
            unit(signal.quantity)
        ),
        help: "correct these readings, or use windows of the run without them: FILE@FROM..TO".into(),
    })
}

/// Middle sample and height of every isolated outlier: up to three samples that leave the signal and come back.
fn outliers(time: &[f64], values: &[f64]) -> Vec<(usize, f64)> {
    let d = deviations(time, values);
    let spread = |d: &[f64]| 1.4826 * median(d.iter().map(|d| d.abs()).collect());
    let least = LIMIT * spread(&d).max(quantisation_step(values).unwrap_or(0.0));
    let mut found = Vec::new();
    let mut k = 0;
    while least > 0.0 && k < d.len() {
        if d[k].abs() <= least {
            k += 1;
            continue;
        }
        let around = &d[k.saturating_sub(NEIGHBOURHOOD)..(k + NEIGHBOURHOOD).min(d.len())];
        let limit = least.max(LIMIT * spread(around));
        // The disturbance ends with four quiet deviations in a row.
        let mut end = k + 1;
        while (end..(end + 4).min(d.len())).any(|i| d[i].abs() > limit) {
            end += 1;
        }
        if end - k <= LONGEST + 4 {
            // d[i] is centred at sample i + 2
            if d[k..end].iter().any(|d| d.abs() > limit) {
                found.extend(spike(values, k + 2, end + 1));
            }
        } else {
            let (first, last) = heart(&d[k..end]);
            if last - first < LONGEST + 4 {
                found.extend(spike(values, k + first + 2, k + last + 2));
            }
        }
        k = end;
    }
    found
}

// The first and last of what sticks out of a disturbance: where noise is small, the motion about an outlier disturbs, too.
fn heart(d: &[f64]) -> (usize, usize) {
    let most = d.iter().fold(0.0f64, |m, d| m.max(d.abs()));
    let sticks_out = |d: &f64| d.abs() > STICKS_OUT * most;
    (d.iter().position(sticks_out).unwrap_or(0), d.iter().rposition(sticks_out).unwrap_or(0))
}

/// Sample k + 2 minus the cubic through its four neighbours, on the time stamps; on an even clock this is the fourth
/// difference divided by six.
fn deviations(time: &[f64], values: &[f64]) -> Vec<f64> {
    let pick = |x: &[f64]| [x[0], x[1], x[3], x[4]];
    time.windows(5).zip(values.windows(5)).map(|(t, x)| x[2] - lagrange(&pick(t), &pick(x), t[2])).collect()
}

/// The outlier between two samples, if the motion goes on after it where it would have been without: at a step it
/// does not.
fn spike(values: &[f64], first: usize, last: usize) -> Option<(usize, f64)> {
    let before = values.get(first.checked_sub(4)?..first)?;
    let after = values.get(last + 1..last + 5)?;
    let slope = 0.5 * ((before[3] - before[0]) / 3.0 + (after[3] - after[0]) / 3.0);
    // height over the line from the sample before to the sample after
    let length = (last + 2 - first) as f64;
    let height = |k: usize| values[k] - before[3] - (after[0] - before[3]) * (k + 1 - first) as f64 / length;
    let middle = (first..=last).max_by(|&a, &b| height(a).abs().total_cmp(&height(b).abs()))?;
    let jump = after[0] - before[3] - slope * length;
    let comes_back = height(middle).abs() > 2.0 * jump.abs();
    // Off the lines through the samples before and after: a kink is on one of them.
    let off = |from: f64, slope: f64, samples: usize| (values[middle] - from - slope * samples as f64).abs();
    let off_before = off(before[3], (before[3] - before[0]) / 3.0, middle + 1 - first);
    let off_after = off(after[0], (after[0] - after[3]) / 3.0, last + 1 - middle);
    let is_off = off_before.min(off_after) > 0.5 * height(middle).abs();
    (comes_back && is_off).then_some((middle, height(middle)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::white_noise;

    fn clock() -> Vec<f64> {
        (0..1000).map(|k| 0.001 * f64::from(k)).collect()
    }

    fn signal() -> Vec<f64> {
        let motion = (0..1000).map(|k| 5.0 * (0.02 * f64::from(k)).sin());
        white_noise(1000, 5).iter().zip(motion).map(|(n, x)| x + 0.01 * n).collect()
    }

    #[test]
    fn noise_and_motion_have_no_outliers() {
        assert_eq!(outliers(&clock(), &signal()), []);
    }

    #[test]
    fn isolated_spikes_are_found_at_their_sample() {
        let mut values = signal();
        values[300] += 1.0;
        values[600] -= 2.0;
        values[601] -= 2.0;
        let found = outliers(&clock(), &values);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].0, 300);
        assert!((found[0].1 - 1.0).abs() < 0.1);
        assert!((600..=601).contains(&found[1].0));
    }

    #[test]
    fn uneven_stamps_make_no_outliers() {
        let mut time = clock();
        time.iter_mut().step_by(37).for_each(|t| *t += 0.0004);
        let values: Vec<f64> =
            time.iter().zip(white_noise(1000, 6)).map(|(t, n)| (20.0 * t).sin() + 1e-5 * n).collect();
        assert_eq!(outliers(&time, &values), []);
    }

    #[test]
    fn a_step_is_no_outlier() {
        let mut values = signal();
        values[500..].iter_mut().for_each(|v| *v += 3.0);
        assert_eq!(outliers(&clock(), &values), []);
    }

    // A command of lines without noise.
    #[test]
    fn a_kink_is_no_outlier() {
        let rise = |k: usize| (k as f64 - 500.0).max(0.0) * 0.01;
        assert_eq!(outliers(&clock(), &(0..1000).map(rise).collect::<Vec<_>>()), []);
        let smooth = |k: usize| (0.004 * k as f64).sin() + rise(k);
        assert_eq!(outliers(&clock(), &(0..1000).map(smooth).collect::<Vec<_>>()), []);
    }

    #[test]
    fn outliers_are_told_with_line_number_and_height() {
        let mut values = signal();
        values[300] += 100.0;
        let time = (0..1000).map(|k| 0.001 * f64::from(k)).collect();
        let run = Run::new("log".into(), time, vec![Signal::new(Quantity::MotorTorque, "elbow", values)]);
        let notes = check(&run.unwrap());
        assert_eq!(notes[0].place, "log, sample 301");
        assert!(
            notes[0].statement.starts_with("motor_torque.elbow: 1 isolated outlier (0.1 % of the samples)")
        );
    }
}
