//! The graded verdict: three numbers for each channel and one word.

use crate::colour::rows_of;
use crate::diagnosis::ChannelReport;
use crate::least_squares::{Normal, cross, dot, matrix};
use crate::remainder::{Left, predictable};
use crate::report::Verdict;
use crate::search::{Search, State, Told};

// Share of the remaining variance that may be predictable in a complete model, and in one that is half explained.
const COMPLETE: f64 = 0.1;
const HALF: f64 = 0.3;
/// Distance to the reachable floor of an adequate model.
pub(crate) const NEAR_FLOOR: f64 = 2.0;
// What the past foretells of the rows of an adequate model, in the variance of their noise.
const FORETOLD: f64 = 0.5;
// Error, as a share of its signal, below which a channel holds nothing: a log without noise shows the steps of the
// integration and the rounding of the file.
const EXACT: f64 = 2e-4;

/// The three numbers of every channel for a fitted model; `told`: its state.
pub(crate) fn channels(search: &Search, state: &State, told: &Told) -> Vec<ChannelReport> {
    let layout = search.problem.form.layout();
    let model = &search.problem.robot.model;
    let residual = &state.fitted.at.residual;
    let scaled = search_scaled(search, state);
    let records = state.reference.as_ref().map_or(search.records, |reference| reference.records());
    let remainder = predictable(records, layout, &scaled, search.problem.options.seed + 17);
    let unseen = unseen_errors(search, state, told);
    layout
        .channels
        .iter()
        .enumerate()
        .map(|(c, channel)| ChannelReport {
            signal: channel.signal().to_owned(),
            joint: model.dof_name(channel.dof).to_owned(),
            unseen_error: unseen[c],
            predictable_remainder: remainder[c],
            distance_to_floor: rms(rows_of(layout, c).map(|k| residual[k]))
                / state.whitener.channels[c].floor,
        })
        .collect()
}

/// The word for a model with `accepted` effects that leaves this.
pub(crate) fn word(channels: &[ChannelReport], left: &[Left], accepted: usize) -> Verdict {
    // What is no number is as bad as can be.
    let told = |x: f64| if x.is_nan() { f64::INFINITY } else { x };
    let inexact = || channels.iter().zip(left).filter(|(c, _)| told(c.unseen_error) > EXACT);
    let worst_of =
        |of: fn(&ChannelReport, &Left) -> f64| inexact().map(|(c, l)| told(of(c, l))).fold(0.0, f64::max);
    // Where an error is no larger than noise alone would leave, its past may foretell it: rows are smoothed noise.
    let foretold = worst_of(|c, l| if c.distance_to_floor < 1.0 { 0.0 } else { l.foretold });
    let worst = worst_of(|c, _| c.predictable_remainder);
    let far = worst_of(|c, _| c.distance_to_floor);
    match accepted {
        0 if worst < COMPLETE && far < NEAR_FLOOR && foretold < FORETOLD => Verdict::Adequate,
        0 => Verdict::Unexplained,
        _ if worst < HALF && far.is_finite() => Verdict::Missing,
        _ => Verdict::PartlyExplained,
    }
}

// The residual with each row divided by its own standard deviation: reversals do not dominate.
fn search_scaled(search: &Search, state: &State) -> Vec<f64> {
    let layout = search.problem.form.layout();
    let mut scaled = state.fitted.at.residual.clone();
    for segment in &layout.segments {
        let kappa = state.whitener.channels[segment.channel].kappa;
        for k in segment.first..segment.first + segment.len {
            scaled[k] /= (1.0 + kappa * layout.reversal[k].powi(2)).sqrt();
        }
    }
    scaled
}

// Error of every channel on folds left out, as a share of its standard deviation, in the rows in which errors are told:
// every fold's residual with the parameters fitted on the other folds, to first order.
fn unseen_errors(search: &Search, state: &State, told: &Told) -> Vec<f64> {
    let yardstick = search.yardstick();
    let layout = yardstick.problem.form.layout();
    let told = told.at(state);
    let mut unseen = told.residual.clone();
    for (fold, step) in steps_without(search, state).iter().enumerate() {
        for k in (0..layout.len).filter(|&k| layout.fold[k] == fold) {
            unseen[k] -= told.columns.iter().zip(step).map(|(c, d)| c[k] * d).sum::<f64>();
        }
    }
    let of = |c: usize| rms(rows_of(layout, c).map(|k| unseen[k])) / yardstick.channel_std[c];
    (0..layout.channels.len()).map(of).collect()
}

// By fold: the step of the unknowns when the fold is left out; empty where it cannot be taken.
fn steps_without(search: &Search, state: &State) -> Vec<Vec<f64>> {
    let layout = search.problem.form.layout();
    let (fitted, whitener) = (&state.fitted, &state.whitener);
    let white = whitener.apply_all(layout, &fitted.at.columns);
    if white.is_empty() {
        return vec![Vec::new(); layout.folds];
    }
    let j = matrix(layout.len, &white);
    let mut a = cross(&j, &j);
    let mut g: Vec<f64> = white.iter().map(|c| dot(c, &fitted.white)).collect();
    for (k, u) in fitted.model.unknowns.iter().enumerate() {
        a[(k, k)] += u.weight();
        if let Some((mean, _)) = u.prior {
            g[k] += u.weight() * (mean - fitted.model.p[u.position]);
        }
    }
    let without = |fold: usize| {
        let rows: Vec<usize> = (0..layout.len).filter(|&k| layout.fold[k] == fold).collect();
        let part: Vec<Vec<f64>> = white.iter().map(|c| rows.iter().map(|&k| c[k]).collect()).collect();
        let part = matrix(rows.len(), &part);
        let r: Vec<f64> = rows.iter().map(|&k| fitted.white[k]).collect();
        let right: Vec<f64> = (0..white.len())
            .map(|i| g[i] - (0..rows.len()).map(|k| part[(k, i)] * r[k]).sum::<f64>())
            .collect();
        Normal::new(&(&a - cross(&part, &part))).map_or(Vec::new(), |normal| normal.solve(&right))
    };
    (0..layout.folds).map(without).collect()
}

pub(crate) fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0f64);
    for x in values {
        sum += x * x;
        n += 1.0;
    }
    (sum / n.max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_or_a_remainder_that_is_no_number_is_neither_adequate_nor_complete() {
        let channel = |unseen_error: f64, distance_to_floor: f64| ChannelReport {
            signal: "motor_torque".to_owned(),
            joint: "elbow".to_owned(),
            unseen_error,
            predictable_remainder: 0.0,
            distance_to_floor,
        };
        let noise = Left { square: 1.0, quiet: 1.0, foretold: 0.0 };
        let word_of =
            |other: ChannelReport, accepted| word(&[channel(0.1, 1.0), other], &[noise; 2], accepted);
        assert_eq!(word_of(channel(0.1, 1.0), 0), Verdict::Adequate);
        assert_eq!(word_of(channel(0.1, 1.0), 1), Verdict::Missing);
        assert_eq!(word_of(channel(0.1, f64::NAN), 0), Verdict::Unexplained);
        assert_eq!(word_of(channel(0.1, f64::NAN), 1), Verdict::PartlyExplained);
        let remainder = |x| ChannelReport { predictable_remainder: x, ..channel(f64::NAN, 1.0) };
        assert_eq!(word_of(remainder(f64::NAN), 0), Verdict::Unexplained);
        assert_eq!(word_of(remainder(f64::NAN), 1), Verdict::PartlyExplained);
    }

    #[test]
    fn what_the_past_foretells_is_not_adequate() {
        let channel = ChannelReport {
            signal: "motor_torque".to_owned(),
            joint: "joint_1".to_owned(),
            unseen_error: 0.02,
            predictable_remainder: 0.0,
            distance_to_floor: 1.6,
        };
        let left = |foretold| [Left { square: 2.6, quiet: 1.0, foretold }];
        let of = |foretold, accepted| word(std::slice::from_ref(&channel), &left(foretold), accepted);
        let exact = ChannelReport { unseen_error: 1e-5, ..channel.clone() };
        assert_eq!(word(&[exact], &left(2.3), 0), Verdict::Adequate);
        assert_eq!(of(0.1, 0), Verdict::Adequate);
        assert_eq!(of(2.3, 0), Verdict::Unexplained);
        assert_eq!(of(2.3, 1), Verdict::Missing);
    }
}
