//! Factors and inverse of the mass matrix, for any kind of number, without touching its zeros.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::Scalar;

use crate::support::Support;

/// A symmetric matrix with the zeros of the mass matrix, by columns of whole groups.
#[derive(Debug, Clone, Default)]
pub(crate) struct Grouped<S> {
    entries: Vec<S>,
    // Two columns.
    sum: Vec<S>,
    n: usize,
    // Numbers of a column: n and what fills the last pair of groups.
    height: usize,
}

impl<S: Scalar> Grouped<S> {
    /// Room for n × n numbers.
    pub(crate) fn new(n: usize) -> Self {
        let height = usize::next_multiple_of(n, 2 * S::GROUP).max(1);
        Self { entries: vec![S::ZERO; n * height], sum: vec![S::ZERO; 2 * height], n, height }
    }

    /// The distance between columns, and all columns; only what is on and above the diagonal counts.
    #[inline(always)]
    pub(crate) fn columns(&mut self) -> (usize, &mut [S]) {
        (self.height, &mut self.entries)
    }

    /// Takes an n × n matrix by columns.
    #[inline(always)]
    pub(crate) fn load(&mut self, A: &[S]) {
        let columns = A.chunks_exact(self.n.max(1)).zip(self.entries.chunks_exact_mut(self.height));
        for (from, to) in columns {
            to[..self.n].copy_from_slice(from);
        }
    }

    /// Writes all of the matrix by columns.
    #[inline(always)]
    pub(crate) fn store(&self, A: &mut [S]) {
        let columns = A.chunks_exact_mut(self.n.max(1)).zip(self.entries.chunks_exact(self.height));
        for (to, from) in columns {
            to.copy_from_slice(&from[..self.n]);
        }
    }

    #[inline(always)]
    fn get(&self, i: usize, j: usize) -> S {
        self.entries[self.height * j + i]
    }

    #[inline(always)]
    fn set(&mut self, i: usize, j: usize, x: S) {
        self.entries[self.height * j + i] = x;
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
        let (height, width) = (self.height, S::GROUP);
        for k in (0..self.n).rev() {
            let (before, own) = self.entries.split_at_mut(height * k);
            let own = &mut own[..height];
            let d_inverse = own[k].recip();
            for &(start, end) in support.ancestors(k) {
                for i in start..end {
                    // A_ij = A_ij − a A_kj,   a = A_ki/A_kk,   for j up to i
                    let a = own[i] * d_inverse;
                    // written to the column at the end: what was just written is slow to read in groups
                    room[i] = a;
                    let whole = usize::next_multiple_of(i + 1, width);
                    let column = before[height * i..height * i + whole].chunks_exact_mut(width);
                    for (x, y) in column.zip(own[..whole].chunks_exact(width)) {
                        S::ungroup(S::group(x) - S::group(y) * a.repeated(), x);
                    }
                }
            }
            for &(start, end) in support.ancestors(k) {
                own[start..end].copy_from_slice(&room[start..end]);
            }
            own[k] = d_inverse;
        }
    }

    /// Turns the factors of A into A⁻¹, all of it, in place; `room`: n numbers.
    ///
    /// ```text
    /// A⁻¹_ik = D⁻¹_ik − Σ_j L_ij A⁻¹_jk   for k ≤ i, row by row
    /// ```
    #[inline(always)]
    pub(crate) fn invert(&mut self, support: &Support, room: &mut [S]) {
        let (height, width) = (self.height, S::GROUP);
        for i in 0..self.n {
            let d_inverse = self.get(i, i);
            let ancestors = support.ancestors(i);
            for &(start, end) in ancestors {
                (start..end).for_each(|j| room[j] = self.get(j, i));
            }
            let (before, own) = self.entries.split_at_mut(height * i);
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
            let mut diagonal = d_inverse;
            for &(start, end) in ancestors {
                (start..end).for_each(|j| diagonal -= room[j] * self.get(j, i));
            }
            self.set(i, i, diagonal);
            for k in 0..i {
                let x = self.get(k, i);
                self.set(i, k, x);
            }
        }
    }

    /// Solves A x = b in place, once A is factored.
    #[inline(always)]
    pub(crate) fn solve(&self, support: &Support, x: &mut [S]) {
        // Lᵀ y = b
        for i in (0..self.n).rev() {
            for &(start, end) in support.ancestors(i) {
                for j in start..end {
                    let t = self.get(j, i) * x[i];
                    x[j] -= t;
                }
            }
        }
        // L x = D⁻¹ y
        for i in 0..self.n {
            let mut sum = x[i] * self.get(i, i);
            for &(start, end) in support.ancestors(i) {
                (start..end).for_each(|j| sum -= self.get(j, i) * x[j]);
            }
            x[i] = sum;
        }
    }

    /// −A x for each column x of both matrices, n × n, which have the zeros of the mass matrix; all numbers of A must
    /// stand.
    #[inline(always)]
    pub(crate) fn minus_times(&mut self, support: &Support, X: &mut [S], Y: &mut [S]) {
        let Self { entries, sum, n, height } = self;
        let (sum_x, sum_y) = sum.split_at_mut(*height);
        let columns = X.chunks_exact_mut((*n).max(1)).zip(Y.chunks_exact_mut((*n).max(1)));
        for (k, (x, y)) in columns.enumerate() {
            // a number of A is read once for both
            for row in (0..*n).step_by(2 * S::GROUP) {
                let ranges = support.related(k);
                minus_sums::<S, 2, 2>(entries, *height, row, ranges, [x, y], [sum_x, sum_y]);
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
        let (mut LD, mut x) = (Grouped::new(3), b);
        LD.load(&A);
        LD.factor(&support(), &mut [0.0; 3]);
        LD.solve(&support(), &mut x);
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| A[i + 3 * j] * x[j]).sum();
            assert!((row - b[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let (mut grouped, mut inverse) = (Grouped::new(3), A);
        grouped.load(&A);
        grouped.factor(&support(), &mut [0.0; 3]);
        grouped.invert(&support(), &mut [0.0; 3]);
        grouped.store(&mut inverse);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let entry: f64 = (0..3).map(|k| A[i + 3 * k] * inverse[k + 3 * j]).sum();
            assert!((entry - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
        }
    }
}
