//! Do the runs agree on a parameter? A physical constant is the same in every run, a stand-in is not.
//!
//! ```text
//! z_i = J A⁻¹ e_i / (A⁻¹)_ii        column i, free of what the other parameters imitate
//! δ_r = z_rᵀ r_r / z_rᵀ z_r,  var δ_r = φ / z_rᵀ z_r        what run r alone would change
//! Q = Σ w (δ_r − δ̄)²,  w = 1/var;   τ² = (Q − R + 1) / (Σw − Σw²/Σw)
//! ```
//!
//! Source: DerSimonian & Laird, *Meta-analysis in clinical trials*, Controlled Clinical Trials 7, 1986; Peters,
//! Bühlmann, Meinshausen, *Causal inference by using invariant prediction*, JRSS-B 78, 2016.

use faer::Mat;

use crate::least_squares::matrix;
use crate::problem::Equations;
use crate::residual::Layout;

/// By unknown: τ, the standard deviation of its value from run to run beyond noise; zero of a single run.
pub(crate) fn run_to_run(layout: &Layout, equations: &Equations, widening: f64) -> Vec<f64> {
    let count = equations.columns.len();
    let runs = runs_of(layout);
    if runs < 2 || count == 0 {
        return vec![0.0; count];
    }
    let j = matrix(&equations.columns);
    let inverse = equations.normal.solve_many(&Mat::<f64>::identity(count, count));
    let z = &j * &inverse;
    let of = |i: usize| {
        let scale = inverse[(i, i)].max(1e-300);
        spread(&estimates(layout, runs, |row| z[(row, i)] / scale, &equations.residual, widening))
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

    #[test]
    fn runs_that_agree_have_no_spread_and_runs_that_do_not_have_theirs() {
        assert_eq!(spread(&[(1.0, 0.01), (1.05, 0.01)]), 0.0);
        // Two estimates ±1 about their mean, noise negligible: τ² = Σ d² = 2 for two runs.
        let tau = spread(&[(1.0, 1e-6), (-1.0, 1e-6)]);
        assert!((tau - 2f64.sqrt()).abs() < 1e-3, "{tau}");
    }
}
