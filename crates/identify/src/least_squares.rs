//! Dense symmetric problems: Cholesky with scaling, and ridge regression with its degrees of freedom.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// A symmetric positive definite system, scaled to unit diagonal before it is factored.
pub(crate) struct Normal {
    factor: faer::linalg::solvers::Llt<f64>,
    scale: Vec<f64>,
}

// Added to the unit diagonal: parameters that the data do not separate share their change.
const RIDGE: f64 = 1e-9;

impl Normal {
    /// Factors the matrix given by its columns; `None` if it is not positive definite.
    pub fn new(matrix: &Mat<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / matrix[(i, i)].max(1e-300).sqrt()).collect();
        let scaled = Mat::from_fn(n, n, |i, j| {
            matrix[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 }
        });
        let factor = scaled.llt(Side::Lower).ok()?;
        Some(Self { factor, scale })
    }

    /// A⁻¹ b.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.scale.len();
        let rhs = Mat::from_fn(n, 1, |i, _| b[i] * self.scale[i]);
        let x = self.factor.solve(&rhs);
        (0..n).map(|i| x[(i, 0)] * self.scale[i]).collect()
    }

    /// A⁻¹ B.
    pub fn solve_many(&self, b: &Mat<f64>) -> Mat<f64> {
        let rhs = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] * self.scale[i]);
        let x = self.factor.solve(&rhs);
        Mat::from_fn(b.nrows(), b.ncols(), |i, j| x[(i, j)] * self.scale[i])
    }

    /// The diagonal of A⁻¹.
    pub fn variances(&self) -> Vec<f64> {
        let n = self.scale.len();
        let inverse = self.factor.solve(&Mat::<f64>::identity(n, n));
        (0..n).map(|i| inverse[(i, i)] * self.scale[i] * self.scale[i]).collect()
    }
}

/// Columns of so many rows side by side as a matrix; there may be none.
pub(crate) fn matrix(rows: usize, columns: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(rows, columns.len(), |i, j| columns[j][i])
}

/// One column as a matrix.
pub(crate) fn column(x: &[f64]) -> Mat<f64> {
    Mat::from_fn(x.len(), 1, |i, _| x[i])
}

/// Xᵀ Y, products of columns.
pub(crate) fn cross(x: &Mat<f64>, y: &Mat<f64>) -> Mat<f64> {
    x.transpose() * y
}

/// a · b.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// ‖a − b‖²
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum()
}

/// a ← a + s b, inlined into its callers, so that each compiles it for its own instructions.
#[inline(always)]
pub(crate) fn add<const N: usize>(a: &mut [f64; N], s: f64, b: &[f64; N]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += s * b;
    }
}

/// Ridge regression of `y` on unit-norm columns.
pub(crate) struct Ridge {
    gram: Mat<f64>,
    right: Vec<f64>,
    // Of XᵀX, so that the freedom of every ridge is cheap.
    values: Vec<f64>,
}

impl Ridge {
    /// From XᵀX and Xᵀ y.
    pub fn new(gram: Mat<f64>, right: Vec<f64>) -> Option<Self> {
        let values = gram.self_adjoint_eigenvalues(Side::Lower).ok()?;
        Some(Self { gram, right, values: values.into_iter().map(|d| d.max(0.0)).collect() })
    }

    /// tr H(λ) = Σ d/(d + λ): the degrees of freedom that the fit uses.
    pub fn freedom(&self, ridge: f64) -> f64 {
        self.values.iter().map(|d| d / (d + ridge)).sum()
    }

    /// The coefficients (XᵀX + λ)⁻¹ Xᵀ y; none of a ridge too small for the numbers to tell from zero.
    pub fn coefficients(mut self, ridge: f64) -> Option<Vec<f64>> {
        let n = self.right.len();
        (0..n).for_each(|i| self.gram[(i, i)] += ridge);
        let right = column(&self.right);
        let b = self.gram.llt(Side::Lower).ok()?.solve(&right);
        Some((0..n).map(|i| b[(i, 0)]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_badly_scaled_system_is_solved() {
        let a = Mat::from_fn(2, 2, |i, j| [[4e16, 1.0], [1.0, 1e-4]][i][j]);
        let x = Normal::new(&a).unwrap().solve(&[4e16 * 2.0 + 3.0, 2.0 + 1e-4 * 3.0]);
        // The ridge of 1e-9 on the first costs 2e-9 · 1/1e-4 in the second.
        assert!((x[0] - 2.0).abs() < 1e-8 && (x[1] - 3.0).abs() < 1e-4);
    }

    #[test]
    fn a_ridge_of_zero_is_least_squares() {
        let gram = Mat::from_fn(2, 2, |i, j| [[2.0, 1.0], [1.0, 3.0]][i][j]);
        let ridge = Ridge::new(gram, vec![3.0, 4.0]).unwrap();
        assert!((ridge.freedom(0.0) - 2.0).abs() < 1e-12);
        let x = ridge.coefficients(0.0).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
    }
}
