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
/// Gravity swings links of 10 m at √(g/l), rad/s: where nothing is faster, rounding is measured by this.
pub(crate) const ORDINARY: f64 = 1.0;
/// |λ| below this share of the fastest, where a motion meets no stiffness, is rounding: a double zero moves by its root.
pub(crate) const ZERO_POLE: f64 = 1e-6;
// A single zero, and the real part of a pair, move by the rounding itself.
const ZERO_ALONE: f64 = 1e-12;

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
            let missing = (&balanced * v - v * faer::Scale(values[k])).norm_l2();
            // A = 0 has the pole 0, and no size to measure by.
            let residual = if missing == 0.0 { 0.0 } else { missing / (size * v.norm_l2()) };
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

/// `roots` of a system whose poles are no faster than `fastest` (at least [`ORDINARY`]), those that rounding has moved from zero put
/// back there.
///
/// A free motion is a double zero, and rounding ε makes of it ±√ε or ±i√ε. A real root without such a partner is slow,
/// not free. A pair that nothing damps is put on the imaginary axis.
pub(crate) fn settled(roots: &[c64], fastest: f64) -> Vec<c64> {
    let is_small = |s: &c64| s.norm() < ZERO_POLE * fastest;
    let is_other_half = |s: &c64, other: &c64| is_small(other) && (s + other).norm() < 0.1 * s.norm();
    let is_zero = |s: &c64| {
        let split = || s.im != 0.0 || roots.iter().any(|other| is_other_half(s, other));
        is_small(s) && (s.norm() <= ZERO_ALONE * fastest || split())
    };
    let put_back = |s: &c64| match s {
        s if is_zero(s) => c64::new(0.0, 0.0),
        s if s.im != 0.0 && s.re.abs() <= ZERO_ALONE * fastest => c64::new(0.0, s.im),
        s => *s,
    };
    roots.iter().map(put_back).collect()
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
        assert_eq!(poles(&Mat::<f64>::zeros(1, 1)).unwrap(), [c64::new(0.0, 0.0)]);
    }

    #[test]
    fn what_rounding_splits_is_put_back_to_zero_and_what_is_slow_is_left() {
        let zero = c64::new(0.0, 0.0);
        let real = |x: f64| c64::new(x, 0.0);
        let pair = [c64::new(1e-9, 4.8e-8), c64::new(1e-9, -4.8e-8)];
        assert_eq!(settled(&pair, ORDINARY), [zero, zero]);
        assert_eq!(settled(&[real(-3e-8), real(3.1e-8), real(-4e-39)], ORDINARY), [zero; 3]);
        let slow = [real(-3e-8), c64::new(-1e-3, 1e-2)];
        assert_eq!(settled(&slow, ORDINARY), slow);
        assert_eq!(settled(&pair, 1e-3), pair);
        let undamped = [c64::new(2e-15, 4.0), c64::new(2e-15, -4.0)];
        assert_eq!(settled(&undamped, 4.0), [c64::new(0.0, 4.0), c64::new(0.0, -4.0)]);
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
