//! Gramians and the split of a spectrum, by the matrix sign function.

use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

use crate::LinearError;

// Newton's steps of the sign function; each halves the distance in logarithm, then squares it.
const ROUNDS: usize = 120;
const STILL: f64 = 1e-14;
// ‖A P + P Aᵀ + B Bᵀ‖ by ‖A‖‖P‖ that is taken for right.
const RESIDUAL: f64 = 1e-10;

/// P of A P + P Aᵀ + B Bᵀ = 0 for a stable A.
///
/// ```text
/// A ← ½ (A/γ + γ A⁻¹),   W ← ½ (W/γ + γ A⁻¹ W A⁻ᵀ),   W₀ = B Bᵀ;   P = W/2 where A = −1
/// ```
///
/// # Errors
/// If the solution does not check, as of a system that is not stable.
///
/// Source: Roberts, *Linear model reduction and solution of the algebraic Riccati equation by use of the sign
/// function*, Int. J. Control 32(4), 1980; Byers' scaling by the determinant.
pub(crate) fn lyapunov(A: &Mat<f64>, B: &Mat<f64>) -> Result<Mat<f64>, LinearError> {
    let n = A.nrows();
    let W0 = B * B.transpose();
    let (mut X, mut W) = (A.clone(), W0.clone());
    for _ in 0..ROUNDS {
        let (inverse, scale) = inverse_and_scale(&X);
        let next = half_sum(&X, &inverse, scale);
        let moved = &inverse * &W * inverse.transpose();
        W = Mat::from_fn(n, n, |i, j| 0.5 * (W[(i, j)] / scale + scale * moved[(i, j)]));
        let change = (&next - &X).norm_l2() / next.norm_l2();
        X = next;
        if change < STILL.sqrt() && (scale - 1.0).abs() < STILL.sqrt() {
            break;
        }
    }
    let P = Mat::from_fn(n, n, |i, j| 0.25 * (W[(i, j)] + W[(j, i)]));
    let left = A * &P;
    let rest = Mat::from_fn(n, n, |i, j| left[(i, j)] + left[(j, i)] + W0[(i, j)]);
    let residual = rest.norm_l2() / (A.norm_l2() * P.norm_l2()).max(f64::MIN_POSITIVE);
    if n > 0 && W0.norm_l2() > 0.0 && (residual.is_nan() || residual > RESIDUAL) {
        return Err(LinearError::Gramian { size: n, residual, allowed: RESIDUAL });
    }
    Ok(P)
}

/// sign(A): the matrix with the eigenvectors of A and ±1 for eigenvalues right and left of the imaginary axis; none
/// if some lie on it.
pub(crate) fn sign(A: &Mat<f64>) -> Option<Mat<f64>> {
    let mut X = A.clone();
    for _ in 0..ROUNDS {
        let (inverse, scale) = inverse_and_scale(&X);
        let next = half_sum(&X, &inverse, scale);
        let change = (&next - &X).norm_l2() / next.norm_l2();
        X = next;
        if change.is_nan() {
            return None;
        }
        if change < STILL.sqrt() && (scale - 1.0).abs() < STILL.sqrt() {
            let square = &X * &X;
            let off = Mat::from_fn(A.nrows(), A.nrows(), |i, j| square[(i, j)] - f64::from(i == j));
            return (off.norm_l2() < RESIDUAL * X.norm_l2()).then_some(X);
        }
    }
    None
}

// X⁻¹, and γ = |det X|^(1/n).
fn inverse_and_scale(X: &Mat<f64>) -> (Mat<f64>, f64) {
    let n = X.nrows();
    let lu = X.partial_piv_lu();
    let logarithm: f64 = (0..n).map(|k| lu.U()[(k, k)].abs().ln()).sum();
    let scale = if n == 0 { 1.0 } else { (logarithm / n as f64).exp() };
    // Near the end scaling only rounds.
    let scale = if (scale - 1.0).abs() < 1e-2 { 1.0 } else { scale };
    (lu.inverse(), scale)
}

// ½ (X/γ + γ X⁻¹)
fn half_sum(X: &Mat<f64>, inverse: &Mat<f64>, scale: f64) -> Mat<f64> {
    Mat::from_fn(X.nrows(), X.ncols(), |i, j| 0.5 * (X[(i, j)] / scale + scale * inverse[(i, j)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_order_lag_has_the_gramian_b_squared_by_twice_its_rate() {
        let P = lyapunov(&Mat::from_fn(1, 1, |_, _| -4.0), &Mat::from_fn(1, 1, |_, _| 3.0)).unwrap();
        assert!((P[(0, 0)] - 9.0 / 8.0).abs() < 1e-14);
    }

    // ẍ = −ω² x − 2ζω ẋ + u: P = diag(1/(4ζω³), 1/(4ζω)).
    #[test]
    fn a_weakly_damped_oscillator_has_its_closed_form() {
        let (w, zeta) = (40.0, 1e-4);
        let A = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [-w * w, -2.0 * zeta * w]][i][j]);
        let P = lyapunov(&A, &Mat::from_fn(2, 1, |i, _| i as f64)).unwrap();
        let exact = [1.0 / (4.0 * zeta * w * w * w), 1.0 / (4.0 * zeta * w)];
        for k in 0..2 {
            assert!((P[(k, k)] / exact[k] - 1.0).abs() < 1e-10, "{P:?} {exact:?}");
        }
    }

    #[test]
    fn the_sign_of_a_diagonal_is_its_signs() {
        let A = Mat::from_fn(3, 3, |i, j| if i == j { [-2.0, 5.0, -0.1][i] } else { 0.0 });
        let S = sign(&A).unwrap();
        assert!((0..3).all(|i| (S[(i, i)] - A[(i, i)].signum()).abs() < 1e-14));
    }
}
