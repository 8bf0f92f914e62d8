//! What is left: can anything at all still be predicted?

use faer::Mat;
use rayon::prelude::*;

use crate::colour::rows_of;
use crate::features::random_features;
use crate::gates::mean_square;
use crate::least_squares::{Normal, column, cross, dot};
use crate::record::Record;
use crate::residual::Layout;

// Features of the generic predictor; fewer on short runs.
const FEATURES: usize = 120;
// Ridges tried, in units of the squared length of a feature.
const RIDGES: [f64; 5] = [0.02, 0.1, 0.5, 2.0, 10.0];

/// What is left of a channel, in whitened rows: noise alone leaves independent rows of unit variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    /// Mean square.
    pub square: f64,
    /// The same of quiet seconds, at most one: a quarter of all leave less.
    pub quiet: f64,
    /// The part of it that the row before foretells, ρ₁² of it.
    pub foretold: f64,
}

/// For each channel, what is left of it.
pub(crate) fn left_of_channels(layout: &Layout, white: &[f64]) -> Vec<Left> {
    let of = |c: usize| {
        let square = mean_square(layout, c, white);
        let (mut product, mut pairs) = (0.0, 0.0f64);
        for segment in layout.of_channel(c) {
            for k in segment.first + 1..segment.first + segment.len {
                if layout.keep[k - 1] && layout.keep[k] {
                    product += white[k - 1] * white[k];
                    pairs += 1.0;
                }
            }
        }
        let quiet = quiet(layout, c, white).unwrap_or(square).min(1.0);
        let correlation = product / pairs.max(1.0) / square.max(1e-300);
        Left { square, quiet, foretold: square * correlation * correlation }
    };
    (0..layout.channels.len()).map(of).collect()
}

// Rows from which a second counts.
const FEWEST_ROWS: f64 = 20.0;

// The lower quartile of the mean squares of a channel's seconds.
fn quiet(layout: &Layout, c: usize, white: &[f64]) -> Option<f64> {
    let squares = squares_of_seconds(layout, rows_of(layout, c), white, FEWEST_ROWS);
    squares.get(squares.len() / 4).copied()
}

/// Mean squares of these rows second by second, smallest first, of the seconds with at least so many of them.
pub(crate) fn squares_of_seconds(
    layout: &Layout,
    rows: impl Iterator<Item = usize>,
    white: &[f64],
    fewest: f64,
) -> Vec<f64> {
    let mut seconds = vec![(0.0, 0.0); layout.blocks];
    for k in rows {
        let (sum, count) = &mut seconds[layout.block[k]];
        *sum += white[k] * white[k];
        *count += 1.0;
    }
    let counted = seconds.into_iter().filter(|(_, count)| *count >= fewest);
    let mut squares: Vec<f64> = counted.map(|(sum, count)| sum / count).collect();
    squares.sort_by(f64::total_cmp);
    squares
}

/// For each channel, the share of the residual's variance that a generic predictor foretells on folds it has not
/// seen; the best of several ridges, zero if nothing. `records`: of the motion about which the rows were formed, since
/// what filters them is theirs, and torque noise that acts is in the accelerations of any motion that was not freed of it.
pub(crate) fn predictable(records: &[Record], layout: &Layout, rows: &[f64], seed: u64) -> Vec<f64> {
    let features = random_features(records, layout, FEATURES, seed);
    (0..layout.channels.len()).into_par_iter().map(|c| channel(layout, c, rows, &features)).collect()
}

fn channel(layout: &Layout, c: usize, rows: &[f64], features: &[Vec<f64>]) -> f64 {
    let kept: Vec<usize> = rows_of(layout, c).collect();
    let count = FEATURES.min(kept.len() / 8);
    let total: f64 = kept.iter().map(|&k| rows[k] * rows[k]).sum();
    if count < 4 || total <= 0.0 {
        return 0.0;
    }
    // Through a filter a feature has the length that its joint gives it: all are taken in units of their own.
    let length = |f: &Vec<f64>| (kept.iter().map(|&k| f[k] * f[k]).sum::<f64>() / kept.len() as f64).sqrt();
    let features: Vec<(&[f64], f64)> =
        features[..count].iter().map(|f| (f.as_slice(), length(f).max(1e-300))).collect();
    let chunks: Vec<&[usize]> = kept.chunk_by(|&a, &b| layout.fold[a] == layout.fold[b]).collect();
    let folds: Vec<Fold> = chunks.into_par_iter().map(|kept| Fold::of(&features, rows, kept)).collect();
    let sum = |of: fn(&Fold) -> &Mat<f64>, columns: usize| {
        folds.iter().fold(Mat::<f64>::zeros(count + 1, columns), |sum, fold| sum + of(fold))
    };
    let (gram, right) = (sum(|f| &f.gram, count + 1), sum(|f| &f.right, 1));
    let left = |ridge: f64| unseen_square(&folds, &gram, &right, ridge * kept.len() as f64);
    let best = RIDGES.par_iter().map(|&r| left(r)).reduce(|| f64::INFINITY, f64::min);
    (1.0 - best / total).max(0.0)
}

// The rows of a fold, with XᵀX and Xᵀy of them.
struct Fold {
    x: Mat<f64>,
    y: Vec<f64>,
    gram: Mat<f64>,
    right: Mat<f64>,
}

impl Fold {
    // `kept`: its rows of features, each in units of its length, a one beside them, and of the residual.
    fn of(features: &[(&[f64], f64)], rows: &[f64], kept: &[usize]) -> Self {
        let feature = |i: usize, j: usize| features.get(j).map_or(1.0, |(f, length)| f[kept[i]] / length);
        let x = Mat::from_fn(kept.len(), features.len() + 1, feature);
        let y: Vec<f64> = kept.iter().map(|&k| rows[k]).collect();
        let (gram, right) = (cross(&x, &x), cross(&x, &column(&y)));
        Self { x, y, gram, right }
    }
}

// Squared errors on every fold of ridge regressions that have not seen it; `gram`, `right`: XᵀX and Xᵀy of all.
fn unseen_square(folds: &[Fold], gram: &Mat<f64>, right: &Mat<f64>, ridge: f64) -> f64 {
    let of = |fold: &Fold| -> f64 {
        let mut seen = gram - &fold.gram;
        (0..gram.ncols()).for_each(|i| seen[(i, i)] += ridge);
        let Some(normal) = Normal::new(&seen) else { return dot(&fold.y, &fold.y) };
        let told = &fold.x * normal.solve_many(&(right - &fold.right));
        fold.y.iter().enumerate().map(|(k, y)| (y - told[(k, 0)]).powi(2)).sum()
    };
    folds.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::record::Channel;
    use crate::residual::Segment;
    use sinew_effect::Sensor;

    fn one_channel(len: usize) -> Layout {
        Layout {
            channels: vec![Channel { sensor: Sensor::MotorTorque, dof: 0 }],
            segments: vec![Segment { record: 0, channel: 0, first: 0, len }],
            len,
            keep: vec![true; len],
            reversal: vec![0.0; len],
            block: vec![0; len],
            fold: vec![0; len],
            blocks: 1,
            folds: 1,
            period: 1e-3,
        }
    }

    // y = sin t + e, of unit variance each:  half of it, whatever unit the features have.
    #[test]
    fn what_a_feature_explains_does_not_depend_on_its_unit() {
        let mut random = SmallRng::seed_from_u64(5);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let wave: Vec<f64> = (0..4000).map(|k| 2f64.sqrt() * (0.05 * f64::from(k)).sin()).collect();
        let rows: Vec<f64> = wave.iter().map(|w| w + normal()).collect();
        let mut layout = one_channel(rows.len());
        (layout.fold, layout.folds) = ((0..rows.len()).map(|k| k / 1000).collect(), 4);
        for unit in [1e-3, 1.0, 1e3] {
            let mut features: Vec<Vec<f64>> =
                (0..3).map(|_| rows.iter().map(|_| unit * normal()).collect()).collect();
            features.push(wave.iter().map(|w| unit * w).collect());
            let foretold =
                channel(&layout, 0, &rows, &[features, vec![vec![0.0; rows.len()]; FEATURES]].concat());
            assert!((foretold - 0.5).abs() < 0.05, "{unit}: {foretold}");
        }
    }

    // x_k = a x_{k−1} + e_k:  ⟨x²⟩ = 1/(1 − a²), of which the past foretells a².
    #[test]
    fn the_past_foretells_what_is_coloured() {
        let mut random = SmallRng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let noise: Vec<f64> = (0..20_000).map(|_| normal()).collect();
        for a in [0.0, 0.8] {
            let mut x = 0.0;
            let rows: Vec<f64> = noise
                .iter()
                .map(|e| {
                    x = a * x + e;
                    x
                })
                .collect();
            let [left] = left_of_channels(&one_channel(rows.len()), &rows)[..] else { panic!("one channel") };
            let square = 1.0 / (1.0 - a * a);
            assert!((left.square / square - 1.0).abs() < 0.05, "{left:?}");
            assert!((left.foretold - a * a * square).abs() < 0.1 * square, "{left:?}");
        }
    }
}
