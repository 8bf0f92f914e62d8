//! L D Lᵀ of a symmetric positive definite matrix by columns, for any kind of number.

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
