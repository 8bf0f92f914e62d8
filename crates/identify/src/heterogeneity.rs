//! Do the runs agree on a parameter? A physical constant is the same in every run, a stand-in is not.
//!
//! ```text
//! z_i = J A⁻¹ e_i / (A⁻¹)_ii        column i, free of what the other parameters imitate
//! δ_r = z_rᵀ r_r / z_rᵀ z_r,  var δ_r = φ / z_rᵀ z_r        what run r alone would change
//! Q = Σ w (δ_r − δ̄)²,  w = 1/var;   τ² = (Q − R + 1) / (Σw − Σw²/Σw)
//! s = (A⁻¹)_ii z_iᵀ z_i             share of the data, not of the priors, in what is known of it
//! ```
//!
//! What tolerances of other parameters tell of one does not differ from run to run: of τ the share s counts.
//!
//! Source: DerSimonian & Laird, *Meta-analysis in clinical trials*, Controlled Clinical Trials 7, 1986; Peters,
//! Bühlmann, Meinshausen, *Causal inference by using invariant prediction*, JRSS-B 78, 2016.

use faer::Mat;

use crate::least_squares::{Normal, matrix};
use crate::residual::Layout;

/// By unknown: s τ, the standard deviation of its value from run to run beyond noise; zero of a single run.
pub(crate) fn run_to_run(
    layout: &Layout,
    columns: &[Vec<f64>],
    residual: &[f64],
    normal: &Normal,
    widening: f64,
) -> Vec<f64> {
    let count = columns.len();
    let runs = runs_of(layout);
    if runs < 2 || count == 0 {
        return vec![0.0; count];
    }
    let j = matrix(layout.len, columns);
    let inverse = normal.solve_many(&Mat::<f64>::identity(count, count));
    let z = &j * &inverse;
    let of = |i: usize| {
        let variance = inverse[(i, i)].max(1e-300);
        let share = (0..z.nrows()).map(|row| z[(row, i)].powi(2)).sum::<f64>() / variance;
        share * spread(&estimates(layout, runs, |row| z[(row, i)] / variance, residual, widening))
    };
    (0..count).map(of).collect()
}

/// True if runs contradict each other about the sign of a strength of this value; `column`: its whitened derivative,
/// free of what the other parameters imitate.
pub(crate) fn signs_differ(
    layout: &Layout,
    column: &Mat<f64>,
    residual: &[f64],
    value: f64,
    temper: f64,
) -> bool {
    let runs = runs_of(layout);
    if runs < 2 {
        return false;
    }
    let sure = |(delta, var): &(f64, f64)| {
        let strength = value + delta;
        (strength.abs() > SURE * var.sqrt()).then_some(strength > 0.0)
    };
    let signs: Vec<bool> = estimates(layout, runs, |row| column[(row, 0)], residual, temper.sqrt())
        .iter()
        .filter_map(sure)
        .collect();
    signs.contains(&true) && signs.contains(&false)
}

// Standard deviations beyond which a sign is sure.
const SURE: f64 = 3.0;

fn runs_of(layout: &Layout) -> usize {
    layout.segments.iter().map(|s| s.record + 1).max().unwrap_or(0)
}

// δ and its variance, of the runs that say anything; z: the derivative at each row.
fn estimates(
    layout: &Layout,
    runs: usize,
    z: impl Fn(usize) -> f64,
    residual: &[f64],
    widening: f64,
) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); runs];
    for segment in &layout.segments {
        let (top, square) = &mut sums[segment.record];
        for row in segment.first..segment.first + segment.len {
            *top += z(row) * residual[row];
            *square += z(row) * z(row);
        }
    }
    let seen = sums.iter().filter(|(_, square)| *square > 0.0);
    seen.map(|(top, square)| (top / square, widening * widening / square)).collect()
}

fn spread(estimates: &[(f64, f64)]) -> f64 {
    let weights: Vec<f64> = estimates.iter().map(|(_, var)| 1.0 / var).collect();
    let total: f64 = weights.iter().sum();
    let mean = estimates.iter().zip(&weights).map(|((d, _), w)| w * d).sum::<f64>() / total;
    let q: f64 = estimates.iter().zip(&weights).map(|((d, _), w)| w * (d - mean).powi(2)).sum();
    let freedom = estimates.len() as f64 - 1.0;
    let scale = total - weights.iter().map(|w| w * w).sum::<f64>() / total;
    if scale > 0.0 { ((q - freedom) / scale).max(0.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residual::Segment;

    // y = x in two runs that differ by 2, and a prior on x that says as much as both: half of their spread counts.
    #[test]
    fn what_a_prior_tells_does_not_differ_between_runs() {
        let rows = 50;
        let segment = |record: usize| Segment { record, channel: 0, first: record * rows, len: rows };
        let layout = Layout {
            channels: Vec::new(),
            segments: vec![segment(0), segment(1)],
            len: 2 * rows,
            keep: vec![true; 2 * rows],
            reversal: vec![0.0; 2 * rows],
            block: vec![0; 2 * rows],
            fold: vec![0; 2 * rows],
            blocks: 1,
            folds: 1,
            period: 1e-3,
        };
        let residual: Vec<f64> = (0..2 * rows).map(|k| if k < rows { 1.0 } else { -1.0 }).collect();
        let columns = [vec![1.0; 2 * rows]];
        let of = |prior: f64| {
            let normal = Normal::new(&Mat::from_fn(1, 1, |_, _| 2.0 * rows as f64 + prior)).unwrap();
            run_to_run(&layout, &columns, &residual, &normal, 1e-3)[0]
        };
        assert!((of(0.0) - 2f64.sqrt()).abs() < 1e-3 && (of(2.0 * rows as f64) - 0.5f64.sqrt()).abs() < 1e-3);
    }

    #[test]
    fn runs_that_agree_have_no_spread_and_runs_that_do_not_have_theirs() {
        assert_eq!(spread(&[(1.0, 0.01), (1.05, 0.01)]), 0.0);
        // Two estimates ±1 about their mean, noise negligible: τ² = Σ d² = 2 for two runs.
        let tau = spread(&[(1.0, 1e-6), (-1.0, 1e-6)]);
        assert!((tau - 2f64.sqrt()).abs() < 1e-3, "{tau}");
    }
}
