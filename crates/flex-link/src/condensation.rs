//! Static condensation: coordinates without inertia leave the equations.

use nalgebra::DMatrix;

/// A linear system over the coordinates that were kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Condensed {
    /// Tᵀ M T.
    pub mass: DMatrix<f64>,
    /// Tᵀ K T.
    pub stiffness: DMatrix<f64>,
    /// T: all coordinates from those kept.
    pub all_from_kept: DMatrix<f64>,
}

/// Eliminates all coordinates but `kept` from M ẍ + K x = 0, as if they followed the others at once.
///
/// ```text
/// x_s = −K_ss⁻¹ K_sk x_k,   x = T x_k,   M ← Tᵀ M T,   K ← Tᵀ K T
/// ```
///
/// Exact where the eliminated coordinates have no inertia (M_ss = 0, M_sk = 0). Elsewhere statics stay exact and a
/// frequency ω comes out too high by the order of (ω/ω_s)², ω_s the lowest frequency of the eliminated coordinates with
/// the others held. None if K_ss is singular.
///
/// # Panics
/// If the matrices are not square of one size, or a coordinate does not exist.
///
/// # Example
/// Two springs of 200 N/m in a row, nothing between them: 100 N/m.
/// ```
/// use nalgebra::DMatrix;
/// let K = DMatrix::from_row_slice(2, 2, &[200.0, -200.0, -200.0, 400.0]);
/// let M = DMatrix::from_row_slice(2, 2, &[3.0, 0.0, 0.0, 0.0]);
/// let condensed = sinew_flex_link::condense(&M, &K, &[0]).unwrap();
/// assert_eq!((condensed.stiffness[(0, 0)], condensed.mass[(0, 0)]), (100.0, 3.0));
/// ```
/// Source: Guyan, *Reduction of stiffness and mass matrices*, AIAA Journal 3(2), 1965.
pub fn condense(M: &DMatrix<f64>, K: &DMatrix<f64>, kept: &[usize]) -> Option<Condensed> {
    let n = K.nrows();
    assert_eq!((M.shape(), K.shape()), ((n, n), (n, n)), "M, K");
    let gone: Vec<usize> = (0..n).filter(|k| !kept.contains(k)).collect();
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| K[(rows[i], columns[j])])
    };
    let follow = -block(&gone, &gone).lu().solve(&block(&gone, kept))?;
    let mut T = DMatrix::zeros(n, kept.len());
    kept.iter().enumerate().for_each(|(j, &k)| T[(k, j)] = 1.0);
    for (i, &k) in gone.iter().enumerate() {
        T.set_row(k, &follow.row(i));
    }
    Some(Condensed { mass: T.transpose() * M * &T, stiffness: T.transpose() * K * &T, all_from_kept: T })
}
