//! Factors and inverse of the mass matrix, for any kind of number, without touching its zeros.

use sinew_model::Scalar;

use crate::support::Support;

/// Factors `A` (n × n by columns, symmetric, zeros as in `support`) in place: L, without its unit diagonal, above the
/// diagonal by rows of Lᵀ's columns, 1/D on the diagonal.
///
/// ```text
/// A = Lᵀ D L,   L_kj ≠ 0 only where j carries k
/// ```
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 6.3.
#[inline(always)]
pub(crate) fn factor<S: Scalar>(A: &mut [S], n: usize, support: &Support) {
    for k in (0..n).rev() {
        let (above, own) = A.split_at_mut(n * k);
        let own = &mut own[..=k];
        let d_inverse = own[k].recip();
        own[k] = d_inverse;
        let ranges = support.ancestors(k);
        for (last, &(start, end)) in ranges.iter().enumerate().rev() {
            for i in (start..end).rev() {
                // A_ij = A_ij − a A_kj,   a = A_ki/A_kk,   for j up to i
                let a = own[i] * d_inverse;
                let column = &mut above[n * i..=n * i + i];
                for &(from, to) in &ranges[..last] {
                    subtract(&mut column[from..to], &own[from..to], a);
                }
                subtract(&mut column[start..=i], &own[start..=i], a);
                own[i] = a;
            }
        }
    }
}

/// Turns the factors of A into A⁻¹, all of it, in place; `room`: n numbers.
///
/// ```text
/// A⁻¹_ik = D⁻¹_ik − Σ_j L_ij A⁻¹_jk   for k ≤ i, row by row
/// ```
#[inline(always)]
pub(crate) fn invert<S: Scalar>(A: &mut [S], n: usize, support: &Support, room: &mut [S]) {
    for i in 0..n {
        let (above, own) = A.split_at_mut(n * i);
        let own = &mut own[..=i];
        let d_inverse = own[i];
        let L = &mut room[..i];
        L.copy_from_slice(&own[..i]);
        own[..i].fill(S::ZERO);
        for &(start, end) in support.ancestors(i) {
            for j in start..end {
                subtract(&mut own[..i], &above[n * j..n * j + i], L[j]);
            }
        }
        let mut diagonal = d_inverse;
        for &(start, end) in support.ancestors(i) {
            for j in start..end {
                diagonal -= L[j] * own[j];
            }
        }
        own[i] = diagonal;
        for k in 0..i {
            above[i + n * k] = own[k];
        }
    }
}

/// Solves A x = b in place.
#[inline(always)]
pub(crate) fn solve<S: Scalar>(LD: &[S], n: usize, support: &Support, x: &mut [S]) {
    // Lᵀ y = b
    for i in (0..n).rev() {
        let (before, own) = x.split_at_mut(i);
        for &(start, end) in support.ancestors(i) {
            subtract(&mut before[start..end], &LD[n * i + start..n * i + end], own[0]);
        }
    }
    // L x = D⁻¹ y
    for i in 0..n {
        let mut sum = x[i] * LD[n * i + i];
        for &(start, end) in support.ancestors(i) {
            for j in start..end {
                sum -= LD[n * i + j] * x[j];
            }
        }
        x[i] = sum;
    }
}

/// y = y − a x.
#[inline(always)]
pub(crate) fn subtract<S: Scalar>(y: &mut [S], x: &[S], a: S) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y -= x * a;
    }
}

#[cfg(test)]
mod tests {
    use sinew_model::Mechanism;
    use sinew_model::samples::planar_arm;

    use super::*;

    const A: [f64; 9] = [4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];

    fn support() -> Support {
        Support::new(&Mechanism::new(&planar_arm(3, 1.0, 1.0)))
    }

    #[test]
    fn a_solution_satisfies_its_equations() {
        let b = [1.0, -2.0, 3.0];
        let (mut LD, mut x) = (A, b);
        factor(&mut LD, 3, &support());
        solve(&LD, 3, &support(), &mut x);
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| A[i + 3 * j] * x[j]).sum();
            assert!((row - b[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let mut inverse = A;
        factor(&mut inverse, 3, &support());
        invert(&mut inverse, 3, &support(), &mut [0.0; 3]);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let entry: f64 = (0..3).map(|k| A[i + 3 * k] * inverse[k + 3 * j]).sum();
            assert!((entry - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
        }
    }
}
