//! Factors and inverse of the mass matrix, for any kind of number, without touching its zeros.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::Scalar;

use crate::support::Support;

/// A symmetric matrix with the zeros of the mass matrix, by columns of whole groups.
#[derive(Debug, Clone)]
pub(crate) struct Grouped<S> {
    entries: Vec<S>,
    // One column.
    sum: Vec<S>,
    n: usize,
    // Numbers of a column: n and what fills the last pair of groups.
    height: usize,
}

impl<S: Scalar> Grouped<S> {
    /// Room for n × n numbers.
    pub(crate) fn new(n: usize) -> Self {
        let height = usize::next_multiple_of(n, 2 * S::GROUP).max(1);
        Self { entries: vec![S::ZERO; n * height], sum: vec![S::ZERO; height], n, height }
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
            for row in (0..i).step_by(2 * width) {
                let [low, high] = minus_sum(before, height, row, ancestors, room);
                S::ungroup(low, &mut own[row..row + width]);
                S::ungroup(high, &mut own[row + width..row + 2 * width]);
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

    /// −A x for each column x of `X`, n × n, which has the zeros of the mass matrix; all numbers of A must stand.
    #[inline(always)]
    pub(crate) fn minus_times(&mut self, support: &Support, X: &mut [S]) {
        let Self { entries, sum, n, height } = self;
        for (k, x) in X.chunks_exact_mut((*n).max(1)).enumerate() {
            for (pair, sum) in sum.chunks_exact_mut(2 * S::GROUP).enumerate() {
                let [low, high] = minus_sum(entries, *height, 2 * S::GROUP * pair, support.related(k), x);
                S::ungroup(low, &mut sum[..S::GROUP]);
                S::ungroup(high, &mut sum[S::GROUP..]);
            }
            x.copy_from_slice(&sum[..*n]);
        }
    }
}

/// −Σ_j a_j x_j, the columns x_j one after the other in `columns`, for two groups of rows from `row` on.
#[inline(always)]
fn minus_sum<S: Scalar>(
    entries: &[S],
    height: usize,
    row: usize,
    ranges: &[(usize, usize)],
    a: &[S],
) -> [S::Group; 2] {
    let (mut low, mut high) = (S::Group::ZERO, S::Group::ZERO);
    for &(start, end) in ranges {
        let columns = entries[height * start..height * end].chunks_exact(height);
        for (column, a) in columns.zip(&a[start..end]) {
            let rows = &column[row..row + 2 * S::GROUP];
            low -= S::group(&rows[..S::GROUP]) * a.repeated();
            high -= S::group(&rows[S::GROUP..]) * a.repeated();
        }
    }
    [low, high]
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
