//! Poles: the eigenvalues of a linear model, checked.

use faer::{Mat, c64};

use crate::LinearError;

/// The poles of A, rad/s, slowest first, and a right eigenvector of each.
#[derive(Debug, Clone)]
pub(crate) struct Poles {
    pub values: Vec<c64>,
    pub vectors: Mat<c64>,
}

// Largest residual ‖A v − λ v‖/‖A‖ that is taken for right; rounding leaves 1e-15.
const RESIDUAL: f64 = 1e-11;

/// The poles of a linear model ẋ = A x, rad/s, in the order of their size.
///
/// ```text
/// A v = λ v
/// ```
///
/// # Errors
/// If the eigenvalues do not solve their own equation, which is checked.
///
/// # Panics
/// If `A` is not square.
pub fn poles(A: &Mat<f64>) -> Result<Vec<c64>, LinearError> {
    Ok(Poles::of(A)?.values)
}

impl Poles {
    pub fn of(A: &Mat<f64>) -> Result<Self, LinearError> {
        let n = A.nrows();
        assert_eq!(n, A.ncols(), "A: square");
        let scale = balance(A);
        // faer's real eigenvectors are wrong where complex pairs repeat, as they do in robots with two equal arms;
        // its complex ones are right.
        let balanced = Mat::from_fn(n, n, |i, j| c64::new(A[(i, j)] * scale[j] / scale[i], 0.0));
        let unsolved = || LinearError::Eigenvalues { size: n, residual: f64::NAN, allowed: RESIDUAL };
        let eigen = balanced.eigen().map_err(|_| unsolved())?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let size = balanced.norm_l2();
        for k in 0..n {
            let v = vectors.col(k);
            let residual = (&balanced * v - v * faer::Scale(values[k])).norm_l2() / (size * v.norm_l2());
            if residual.is_nan() || residual > RESIDUAL {
                return Err(LinearError::Eigenvalues { size: n, residual, allowed: RESIDUAL });
            }
        }
        let mut order: Vec<usize> = (0..n).collect();
        let key = |k: usize| (values[k].norm(), values[k].im);
        order.sort_by(|&a, &b| {
            let ((size_a, im_a), (size_b, im_b)) = (key(a), key(b));
            size_a.total_cmp(&size_b).then(im_a.total_cmp(&im_b))
        });
        Ok(Self {
            values: order.iter().map(|&k| values[k]).collect(),
            vectors: Mat::from_fn(n, n, |i, j| vectors[(i, order[j])] * scale[i]),
        })
    }
}

// Powers of two that make rows and columns of like size, so that rounding is relative to the poles, not to their
// squares (Parlett and Reinsch, 1969).
pub(crate) fn balance(A: &Mat<f64>) -> Vec<f64> {
    const ROUNDS: usize = 20;
    let n = A.nrows();
    let mut scale = vec![1.0f64; n];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for i in 0..n {
            let others = || (0..n).filter(move |&j| j != i);
            let row: f64 = others().map(|j| (A[(i, j)] * scale[j] / scale[i]).abs()).sum();
            let column: f64 = others().map(|j| (A[(j, i)] * scale[i] / scale[j]).abs()).sum();
            if row > 0.0 && column > 0.0 {
                let factor = (0.5 * (row / column).log2()).round().exp2();
                changed |= factor != 1.0;
                scale[i] *= factor;
            }
        }
        if !changed {
            break;
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_state_has_one_pole() {
        assert_eq!(poles(&Mat::from_fn(1, 1, |_, _| -3.0)).unwrap(), [c64::new(-3.0, 0.0)]);
        assert!(poles(&Mat::<f64>::zeros(0, 0)).unwrap().is_empty());
    }

    #[test]
    fn fourteen_equal_oscillators_have_fourteen_equal_pairs() {
        // ẍ = −ω² x − 2ζω ẋ: the case that faer's real eigenvectors get wrong.
        let (w, zeta, n) = (40.0, 0.02, 14);
        let A = Mat::from_fn(2 * n, 2 * n, |i, j| match (i, j) {
            (i, j) if j == i + n => 1.0,
            (i, j) if i == j + n => -w * w,
            (i, j) if i == j && i >= n => -2.0 * zeta * w,
            _ => 0.0,
        });
        let exact = c64::new(-zeta * w, w * f64::sqrt(1.0 - zeta * zeta));
        for pole in poles(&A).unwrap() {
            let pole = if pole.im < 0.0 { pole.conj() } else { pole };
            assert!((pole - exact).norm() < 1e-12 * w, "{pole}");
        }
    }
}
