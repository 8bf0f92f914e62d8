//! Factors and inverse of the mass matrix, for any kind of number, without touching its zeros.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::Scalar;

use crate::support::Support;

/// A symmetric matrix with the zeros of the mass matrix, its factors and its inverse.
#[derive(Debug, Clone, Default)]
pub(crate) struct Grouped<S> {
    // By columns, `reach` apart: of column k the entries whose rows carry k, itself last, and nothing between them. So
    // the columns of those that carry k begin with the same rows as column k.
    factors: Vec<S>,
    reach: usize,
    // Whole columns, `height` apart: n and what fills the last pair of groups.
    inverse: Vec<S>,
    height: usize,
    // Two columns.
    sum: Vec<S>,
    n: usize,
}

impl<S: Scalar> Grouped<S> {
    /// Room for matrices of this support.
    pub(crate) fn new(n: usize, support: &Support) -> Self {
        let height = usize::next_multiple_of(n, 2 * S::GROUP).max(1);
        let most = (0..n).map(|k| support.depth(k) + 1).max().unwrap_or(0);
        let reach = usize::next_multiple_of(most, S::GROUP).max(1);
        Self {
            factors: vec![S::ZERO; n * reach],
            reach,
            inverse: vec![S::ZERO; n * height],
            height,
            sum: vec![S::ZERO; 2 * height],
            n,
        }
    }

    /// The distance between columns, and all columns without their zeros, for a matrix to be written.
    #[inline(always)]
    pub(crate) fn packed(&mut self) -> (usize, &mut [S]) {
        (self.reach, &mut self.factors)
    }

    /// Takes the upper triangle of an n × n matrix by columns.
    #[inline(always)]
    pub(crate) fn load(&mut self, support: &Support, A: &[S]) {
        let columns = A.chunks_exact(self.n.max(1)).zip(self.factors.chunks_exact_mut(self.reach));
        for (k, (from, to)) in columns.enumerate() {
            let mut row = 0;
            for &(start, end) in support.carriers(k) {
                for i in start..end {
                    to[row] = from[i];
                    row += 1;
                }
            }
        }
    }

    /// Column `k` of the inverse.
    #[inline(always)]
    pub(crate) fn inverse_column(&self, k: usize) -> &[S] {
        &self.inverse[self.height * k..][..self.n]
    }

    /// Writes all of the inverse by columns.
    #[inline(always)]
    pub(crate) fn store(&self, A_inverse: &mut [S]) {
        for (k, to) in A_inverse.chunks_exact_mut(self.n.max(1)).enumerate() {
            to.copy_from_slice(self.inverse_column(k));
        }
    }

    /// Factors the matrix in place: L, without its unit diagonal, above the diagonal; 1/D on it. `room`: n numbers.
    ///
    /// ```text
    /// A = Lᵀ D L,   L_kj ≠ 0 only where j carries k
    /// ```
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 6.3.
    #[inline(always)]
    pub(crate) fn factor(&mut self, support: &Support, room: &mut [S]) {
        let (reach, width) = (self.reach, S::GROUP);
        for k in (0..self.n).rev() {
            let (before, own) = self.factors.split_at_mut(reach * k);
            let (own, depth) = (&mut own[..reach], support.depth(k));
            let d_inverse = own[depth].recip();
            let mut row = 0;
            for &(start, end) in support.ancestors(k) {
                for i in start..end {
                    // A_ij = A_ij − a A_kj,   a = A_ki/A_kk,   for j up to i
                    let a = own[row] * d_inverse;
                    // written to the column at the end: what was just written is slow to read in groups
                    room[row] = a;
                    row += 1;
                    let whole = usize::next_multiple_of(row, width);
                    let column = before[reach * i..][..whole].chunks_exact_mut(width);
                    for (x, y) in column.zip(own[..whole].chunks_exact(width)) {
                        S::ungroup(S::group(x) - S::group(y) * a.repeated(), x);
                    }
                }
            }
            own[..depth].copy_from_slice(&room[..depth]);
            own[depth] = d_inverse;
        }
    }

    /// Takes A⁻¹, all of it, from the factors of A; `room`: n numbers.
    ///
    /// ```text
    /// A⁻¹_ik = D⁻¹_ik − Σ_j L_ij A⁻¹_jk   for k ≤ i, row by row
    /// ```
    #[inline(always)]
    pub(crate) fn invert(&mut self, support: &Support, room: &mut [S]) {
        let (height, width) = (self.height, S::GROUP);
        for i in 0..self.n {
            let (ancestors, factors) = (support.ancestors(i), &self.factors[self.reach * i..][..self.reach]);
            let mut row = 0;
            for &(start, end) in ancestors {
                for j in start..end {
                    room[j] = factors[row];
                    row += 1;
                }
            }
            let mut diagonal = factors[row];
            let (before, own) = self.inverse.split_at_mut(height * i);
            let mut row = 0;
            while row < i {
                // a sum waits for its last term: several are on their way
                if i > row + 2 * width {
                    minus_sums::<S, 4, 1>(before, height, row, ancestors, [room], [own]);
                    row += 4 * width;
                } else {
                    minus_sums::<S, 2, 1>(before, height, row, ancestors, [room], [own]);
                    row += 2 * width;
                }
            }
            for &(start, end) in ancestors {
                (start..end).for_each(|j| diagonal -= room[j] * own[j]);
            }
            own[i] = diagonal;
            for k in 0..i {
                before[height * k + i] = own[k];
            }
        }
    }

    /// Solves A x = b in place, once A is factored.
    #[inline(always)]
    pub(crate) fn solve(&self, support: &Support, x: &mut [S]) {
        // Lᵀ y = b
        for i in (0..self.n).rev() {
            let mut factors = self.factors[self.reach * i..].iter();
            for &(start, end) in support.ancestors(i) {
                for (j, L) in (start..end).zip(factors.by_ref()) {
                    let t = *L * x[i];
                    x[j] -= t;
                }
            }
        }
        // L x = D⁻¹ y
        for i in 0..self.n {
            let factors = &self.factors[self.reach * i..];
            let mut sum = x[i] * factors[support.depth(i)];
            let mut factors = factors.iter();
            for &(start, end) in support.ancestors(i) {
                for (j, L) in (start..end).zip(factors.by_ref()) {
                    sum -= *L * x[j];
                }
            }
            x[i] = sum;
        }
    }

    /// −A⁻¹ x for each column x of both matrices, n × n, which have the zeros of the mass matrix; the inverse must have
    /// been taken.
    #[inline(always)]
    pub(crate) fn minus_times(&mut self, support: &Support, X: &mut [S], Y: &mut [S]) {
        let Self { inverse, sum, n, height, .. } = self;
        let (sum_x, sum_y) = sum.split_at_mut(*height);
        let columns = X.chunks_exact_mut((*n).max(1)).zip(Y.chunks_exact_mut((*n).max(1)));
        for (k, (x, y)) in columns.enumerate() {
            // a number of A⁻¹ is read once for both
            let (ranges, mut row) = (support.related(k), 0);
            while row < *n {
                if *n > row + 2 * S::GROUP {
                    minus_sums::<S, 4, 2>(inverse, *height, row, ranges, [x, y], [sum_x, sum_y]);
                    row += 4 * S::GROUP;
                } else {
                    minus_sums::<S, 2, 2>(inverse, *height, row, ranges, [x, y], [sum_x, sum_y]);
                    row += 2 * S::GROUP;
                }
            }
            x.copy_from_slice(&sum_x[..*n]);
            y.copy_from_slice(&sum_y[..*n]);
        }
    }
}

/// −Σ_j a_j x_j, the columns x_j one after the other in `columns`, for `N` groups of rows from `row` on and `K` lists of
/// numbers a_j.
#[inline(always)]
fn minus_sums<S: Scalar, const N: usize, const K: usize>(
    columns: &[S],
    height: usize,
    row: usize,
    ranges: &[(usize, usize)],
    a: [&[S]; K],
    sums: [&mut [S]; K],
) {
    let mut own = [[S::Group::ZERO; N]; K];
    for &(start, end) in ranges {
        for j in start..end {
            // with a check of each: over slices of columns the compiler takes the groups apart
            let rows = &columns[height * j + row..][..N * S::GROUP];
            for l in 0..K {
                let a = a[l][j].repeated();
                for k in 0..N {
                    own[l][k] -= S::group(&rows[k * S::GROUP..][..S::GROUP]) * a;
                }
            }
        }
    }
    for (sums, own) in sums.into_iter().zip(own) {
        let sums = &mut sums[row..][..N * S::GROUP];
        for k in 0..N {
            S::ungroup(own[k], &mut sums[k * S::GROUP..][..S::GROUP]);
        }
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
        let (mut LD, mut x) = (Grouped::new(3, &support()), b);
        LD.load(&support(), &A);
        LD.factor(&support(), &mut [0.0; 3]);
        LD.solve(&support(), &mut x);
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| A[i + 3 * j] * x[j]).sum();
            assert!((row - b[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let (mut grouped, mut inverse) = (Grouped::new(3, &support()), A);
        grouped.load(&support(), &A);
        grouped.factor(&support(), &mut [0.0; 3]);
        grouped.invert(&support(), &mut [0.0; 3]);
        grouped.store(&mut inverse);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let entry: f64 = (0..3).map(|k| A[i + 3 * k] * inverse[k + 3 * j]).sum();
            assert!((entry - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
        }
    }
}
