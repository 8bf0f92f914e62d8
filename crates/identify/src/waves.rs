//! The position scan: which periods a turn the residual of a joint follows, of its own turn and, behind a gear, of its motor's.

use std::iter::once;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use sinew_model::Robot;

use crate::least_squares::dot;
use crate::record::{Generic, Record, Reduction, Sensors};

// Periods a turn that the scan tries.
const MOST_PERIODS: usize = 140;
// Fewest periods in the range moved.
const FEWEST_PERIODS: f64 = 2.5;
// Waves whose rows are made together.
const TOGETHER: usize = 16;
// Peaks taken from one channel, and in all.
const PEAKS: usize = 3;
const MOST: usize = 6;
// What is nearer counts as one.
const APART: f64 = 1.5;
// Periods in a turn of the motor that are tried besides: its own, those of a wave generator, of poles, phases and slots.
const OF_MOTOR: [f64; 7] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0];

/// Rows of sin nθ and cos nθ of one joint over all runs, for every n of the scan.
#[derive(Debug, Clone)]
pub(crate) struct Waves {
    pub dof: usize,
    // The periods a turn; so many of them follow one another, the others are of the motor.
    periods: Vec<f64>,
    following: usize,
    // For each channel of the joint: its number, its waves.
    channels: Vec<(usize, Arc<Pairs>)>,
}

// In single precision: every joint has up to 144 of them along the whole log.
type Pairs = Vec<[Vec<f32>; 2]>;

impl Waves {
    /// The waves of every joint that moves far enough.
    pub fn of(robot: &Robot, records: &[Record], sensors: &Sensors) -> Vec<Self> {
        let joints: Vec<usize> = sensors.moving().collect();
        let gear = |dof: usize| robot.joints[dof].gear_ratio;
        joints.into_par_iter().filter_map(|dof| Self::of_joint(records, sensors, dof, gear(dof))).collect()
    }

    fn of_joint(records: &[Record], sensors: &Sensors, dof: usize, gear: Option<f64>) -> Option<Self> {
        let all = || records.iter().flat_map(|r| r.theta[dof].iter().copied());
        let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        let (first, following) = periods(range)?;
        let of_joint = (first..first + following).map(|n| n as f64);
        let periods: Vec<f64> = of_joint.chain(of_motor(gear)).collect();
        let count = periods.len();
        let own: Vec<usize> =
            (0..sensors.channels.len()).filter(|&c| sensors.channels[c].dof == dof).collect();
        let differ = records.iter().any(|r| matches!(r.reduction, Reduction::Innovations(_)));
        let differing = if differ { own.len() } else { own.len().min(1) };
        let mut told: Vec<Pairs> = vec![vec![Default::default(); count]; differing];
        for record in records {
            let theta = &record.theta[dof];
            let held = record.held(theta);
            let turn: Vec<(f64, f64)> = held.iter().map(|t| t.sin_cos()).collect();
            let generic: Vec<Generic> =
                own[..differing].iter().map(|&channel| record.generic(channel)).collect();
            // Rows of some n by channel.
            let rows_of = |some: Range<usize>| -> Vec<Vec<Vec<f64>>> {
                let series = if some.start < following {
                    waves(&held, &turn, first + some.start, some.len())
                } else {
                    fast_waves(theta, record.hold(), &periods[some])
                };
                generic.iter().map(|of_channel| of_channel.rows(&series)).collect()
            };
            let begins = (0..following).step_by(TOGETHER).map(|k| k..following.min(k + TOGETHER));
            let portions: Vec<Range<usize>> = begins.chain(once(following..count)).collect();
            let parts: Vec<Vec<Vec<Vec<f64>>>> = portions.par_iter().cloned().map(rows_of).collect();
            for (portion, of_channels) in portions.into_iter().zip(parts) {
                for (pairs, rows) in told.iter_mut().zip(of_channels) {
                    for (k, rows) in rows.into_iter().enumerate() {
                        pairs[portion.start + k / 2][k % 2].extend(rows.into_iter().map(|x| x as f32));
                    }
                }
            }
        }
        let told: Vec<Arc<Pairs>> = told.into_iter().map(Arc::new).collect();
        let last = told.len().checked_sub(1)?;
        let of = |(k, channel): (usize, usize)| (channel, Arc::clone(&told[k.min(last)]));
        let channels = own.into_iter().enumerate().map(of).collect();
        Some(Self { dof, periods, following, channels })
    }

    /// The best few periods a turn by least squares on the joint's channels; `scaled` holds the rows of each channel.
    pub fn harmonics(&self, scaled: &[Vec<f64>]) -> impl Iterator<Item = f64> {
        let mut best: Vec<usize> = Vec::new();
        for (channel, pairs) in &self.channels {
            let spectrum: Vec<f64> = pairs.iter().map(|pair| explained(pair, &scaled[*channel])).collect();
            let follow = &spectrum[..self.following];
            let peak = |k: usize| {
                k >= follow.len()
                    || ((k == 0 || follow[k] >= follow[k - 1])
                        && (k + 1 == follow.len() || follow[k] > follow[k + 1]))
            };
            let mut peaks: Vec<usize> = (0..spectrum.len()).filter(|&k| peak(k)).collect();
            peaks.sort_by(|&a, &b| spectrum[b].total_cmp(&spectrum[a]));
            best.extend(peaks.into_iter().take(PEAKS));
        }
        let mut kept: Vec<f64> = Vec::new();
        for n in best.into_iter().map(|k| self.periods[k]) {
            if kept.iter().all(|other| (other - n).abs() > APART) && kept.len() < MOST {
                kept.push(n);
            }
        }
        kept.into_iter()
    }
}

// sin nθ and cos nθ of so many n from the first one on, one after the other; `turn`: sin θ and cos θ.
fn waves(theta: &[f64], turn: &[(f64, f64)], first: usize, count: usize) -> Vec<Vec<f64>> {
    let mut wave: Vec<(f64, f64)> = theta.iter().map(|t| (first as f64 * t).sin_cos()).collect();
    let mut series: Vec<Vec<f64>> = Vec::with_capacity(2 * count);
    for _ in 0..count {
        series.push(wave.iter().map(|w| w.0).collect());
        series.push(wave.iter().map(|w| w.1).collect());
        // sin (n + 1)θ = sin nθ cos θ + cos nθ sin θ,  cos (n + 1)θ alike
        for ((s, c), (st, ct)) in wave.iter_mut().zip(turn) {
            (*s, *c) = (*s * ct + *c * st, *c * ct - *s * st);
        }
    }
    series
}

// The same of these n, which may turn over within a hold: its mean.
fn fast_waves(theta: &[f64], hold: usize, periods: &[f64]) -> Vec<Vec<f64>> {
    let mean = |n: f64, wave: fn(f64) -> f64| -> Vec<f64> {
        let of_hold = |hold: &[f64]| hold.iter().map(|t| wave(n * t)).sum::<f64>() / hold.len() as f64;
        theta.chunks(hold).map(of_hold).collect()
    };
    periods.iter().flat_map(|&n| [mean(n, f64::sin), mean(n, f64::cos)]).collect()
}

// Periods a turn of the joint of what follows the motor's turns, as far as the scan of the joint's own does not reach.
fn of_motor(gear: Option<f64>) -> impl Iterator<Item = f64> {
    let all = gear.into_iter().flat_map(|gear| OF_MOTOR.map(|of_motor| of_motor * gear.abs()));
    all.filter(|n| n.is_finite() && *n > MOST_PERIODS as f64 + 0.5)
}

// The fewest periods a turn that are tried in a range of positions, rad, and how many are; none in one that is too small.
fn periods(range: f64) -> Option<(usize, usize)> {
    let first = ((FEWEST_PERIODS * std::f64::consts::TAU / range).ceil() as usize).max(4);
    let count = (MOST_PERIODS + 1).checked_sub(first)?;
    (range > 0.0 && count > 0).then_some((first, count))
}

// Squared residual that a sine and a cosine explain together.
fn explained(pair: &[Vec<f32>; 2], e: &[f64]) -> f64 {
    let [s, c] = pair.each_ref().map(|rows| rows.iter().map(|x| f64::from(*x)).collect::<Vec<f64>>());
    let (ss, cc, sc, se, ce) = (dot(&s, &s), dot(&c, &c), dot(&s, &c), dot(&s, e), dot(&c, e));
    let determinant = (ss * cc - sc * sc).max(1e-12);
    (cc * se * se - 2.0 * sc * se * ce + ss * ce * ce) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_behind_a_gear_is_looked_at_by_its_own_turns() {
        assert_eq!(of_motor(Some(-100.0)).collect::<Vec<f64>>(), [200.0, 300.0, 400.0, 600.0, 800.0, 1200.0]);
        assert_eq!(of_motor(None).count(), 0);
        // A whole turn within a hold leaves nothing of a sine.
        let theta: Vec<f64> = (0..8).map(|k| k as f64 * std::f64::consts::TAU / 400.0).collect();
        let waves = fast_waves(&theta, 4, &[100.0, 1.0]);
        assert!(waves[0].iter().chain(&waves[1]).all(|x| x.abs() < 1e-12));
        assert!((waves[3][0] - 1.0).abs() < 1e-3);
    }

    // Two and a half of 140 periods are 0.112 rad.
    #[test]
    fn a_joint_that_hardly_moves_has_no_waves() {
        assert_eq!(periods(7.0), Some((4, 137)));
        assert_eq!(periods(0.1123), Some((140, 1)));
        for range in [0.112, 1e-6, 0.0, f64::NEG_INFINITY] {
            assert_eq!(periods(range), None);
        }
    }
}
