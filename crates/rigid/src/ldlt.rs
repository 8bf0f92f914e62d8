//! Factors and inverse of a symmetric positive definite matrix by columns, for any kind of number.

use sinew_model::Scalar;

/// Factors `A` (n × n) in place: L below the diagonal (unit diagonal not stored), 1/D on it.
///
/// ```text
/// A = L D Lᵀ
/// ```
#[inline(always)]
pub(crate) fn factor<S: Scalar>(A: &mut [S], n: usize) {
    for j in 0..n {
        let inverse = A[j + n * j].recip();
        A[j + n * j] = inverse;
        // A_kl = A_kl − a_k a_l / d   for k ≥ l > j
        for l in j + 1..n {
            let a = A[l + n * j] * inverse;
            for k in l..n {
                let t = A[k + n * j] * a;
                A[k + n * l] -= t;
            }
        }
        for k in j + 1..n {
            A[k + n * j] *= inverse;
        }
    }
}

/// Solves L D Lᵀ x = b in place.
#[inline(always)]
pub(crate) fn solve<S: Scalar>(LD: &[S], n: usize, x: &mut [S]) {
    for j in 0..n {
        for k in j + 1..n {
            let t = LD[k + n * j] * x[j];
            x[k] -= t;
        }
    }
    for j in (0..n).rev() {
        x[j] *= LD[j + n * j];
        for k in j + 1..n {
            let t = LD[k + n * j] * x[k];
            x[j] -= t;
        }
    }
}

/// Inverts the symmetric positive definite `A` (n × n) in place by Gauss–Jordan elimination, which needs no pivoting
/// here.
#[inline(always)]
pub(crate) fn invert<S: Scalar>(A: &mut [S], n: usize) {
    for k in 0..n {
        let d = A[k + n * k].recip();
        // a_ij = a_ij − a_ik a_kj / d   for i, j ≠ k, the upper triangle from the lower
        for j in (0..n).filter(|&j| j != k) {
            let a = A[k.max(j) + n * k.min(j)] * d;
            for i in (j..n).filter(|&i| i != k) {
                let t = A[k.max(i) + n * k.min(i)] * a;
                A[i + n * j] -= t;
            }
        }
        // a_ik = a_ik / d,   a_kk = −1/d
        for i in (0..n).filter(|&i| i != k) {
            A[k.max(i) + n * k.min(i)] *= d;
        }
        A[k + n * k] = -d;
    }
    for j in 0..n {
        for i in j..n {
            let inverse = -A[i + n * j];
            A[i + n * j] = inverse;
            A[j + n * i] = inverse;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_satisfies_its_equations() {
        let A = [4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];
        let b = [1.0, -2.0, 3.0];
        let (mut LD, mut x) = (A, b);
        factor(&mut LD, 3);
        solve(&LD, 3, &mut x);
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| A[i + 3 * j] * x[j]).sum();
            assert!((row - b[i]).abs() < 1e-14);
        }
    }
}
