//! The position scan: which periods a turn the residual of a joint follows.

use std::sync::Arc;

use crate::least_squares::dot;
use crate::record::{Record, Reduction, Sensors};

// Periods a turn that the scan tries.
const MOST_PERIODS: usize = 140;
// Fewest periods in the range moved.
const FEWEST_PERIODS: f64 = 2.5;
// Peaks taken from one channel, and in all.
const PEAKS: usize = 3;
const MOST: usize = 6;

/// Rows of sin nθ and cos nθ of one joint over all runs, for every n of the scan.
#[derive(Debug, Clone)]
pub(crate) struct Waves {
    pub dof: usize,
    first: usize,
    // For each channel of the joint: its number, its waves.
    channels: Vec<(usize, Arc<Pairs>)>,
}

type Pairs = Vec<[Vec<f64>; 2]>;

impl Waves {
    /// The waves of every joint that moves far enough.
    pub fn of(records: &[Record], sensors: &Sensors) -> Vec<Self> {
        sensors.moving().filter_map(|dof| Self::of_joint(records, sensors, dof)).collect()
    }

    fn of_joint(records: &[Record], sensors: &Sensors, dof: usize) -> Option<Self> {
        let all = || records.iter().flat_map(|r| r.theta[dof].iter().copied());
        let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        if range <= 0.0 {
            return None;
        }
        let first = ((FEWEST_PERIODS * std::f64::consts::TAU / range).ceil() as usize).max(4);
        // By run: sin nθ and cos nθ for every n, one after the other.
        let series = |r: &Record| -> Vec<Vec<f64>> {
            let turn: Vec<(f64, f64)> = r.theta[dof].iter().map(|t| t.sin_cos()).collect();
            let mut wave: Vec<(f64, f64)> =
                r.theta[dof].iter().map(|t| (first as f64 * t).sin_cos()).collect();
            let mut all = Vec::with_capacity(2 * (MOST_PERIODS + 1 - first));
            for _ in first..=MOST_PERIODS {
                all.push(wave.iter().map(|w| w.0).collect());
                all.push(wave.iter().map(|w| w.1).collect());
                // sin (n + 1)θ = sin nθ cos θ + cos nθ sin θ,  cos (n + 1)θ alike
                for ((s, c), (st, ct)) in wave.iter_mut().zip(&turn) {
                    (*s, *c) = (*s * ct + *c * st, *c * ct - *s * st);
                }
            }
            all
        };
        let pairs = |channel: usize| -> Arc<Pairs> {
            let mut pairs: Pairs = vec![Default::default(); MOST_PERIODS + 1 - first];
            for record in records {
                let rows = record.generic_rows(channel, &series(record));
                for (k, rows) in rows.into_iter().enumerate() {
                    pairs[k / 2][k % 2].extend(rows);
                }
            }
            Arc::new(pairs)
        };
        let own = (0..sensors.channels.len()).filter(|&c| sensors.channels[c].dof == dof);
        let differ = records.iter().any(|r| matches!(r.reduction, Reduction::Innovations(_)));
        let mut channels: Vec<(usize, Arc<Pairs>)> = Vec::new();
        for channel in own {
            let shared = channels.first().filter(|_| !differ).map(|(_, pairs)| Arc::clone(pairs));
            channels.push((channel, shared.unwrap_or_else(|| pairs(channel))));
        }
        Some(Self { dof, first, channels })
    }

    /// The best few periods a turn by least squares on the joint's channels; `scaled` holds the rows of each channel.
    pub fn harmonics(&self, scaled: &[Vec<f64>]) -> impl Iterator<Item = f64> {
        let mut best: Vec<usize> = Vec::new();
        for (channel, pairs) in &self.channels {
            let spectrum: Vec<f64> = pairs.iter().map(|pair| explained(pair, &scaled[*channel])).collect();
            let peak = |k: usize| {
                (k == 0 || spectrum[k] >= spectrum[k - 1])
                    && (k + 1 == spectrum.len() || spectrum[k] > spectrum[k + 1])
            };
            let mut peaks: Vec<usize> = (0..spectrum.len()).filter(|&k| peak(k)).collect();
            peaks.sort_by(|&a, &b| spectrum[b].total_cmp(&spectrum[a]));
            best.extend(peaks.into_iter().take(PEAKS));
        }
        let mut kept: Vec<usize> = Vec::new();
        for k in best {
            if kept.iter().all(|&other: &usize| other.abs_diff(k) > 1) && kept.len() < MOST {
                kept.push(k);
            }
        }
        let first = self.first;
        kept.into_iter().map(move |k| (first + k) as f64)
    }
}

// Squared residual that a sine and a cosine explain together.
fn explained([s, c]: &[Vec<f64>; 2], e: &[f64]) -> f64 {
    let (ss, cc, sc, se, ce) = (dot(s, s), dot(c, c), dot(s, c), dot(s, e), dot(c, e));
    let determinant = (ss * cc - sc * sc).max(1e-12);
    (cc * se * se - 2.0 * sc * se * ce + ss * ce * ce) / determinant
}
