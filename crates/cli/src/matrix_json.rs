//! Matrices as JSON: a list of rows.

use nalgebra::{Dim, Matrix, RawStorage};

/// The rows of a matrix.
pub(crate) fn rows<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(m: &Matrix<f64, R, C, S>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_rows() {
        assert_eq!(rows(&nalgebra::Matrix2::new(1.0, 2.0, 3.0, 4.0)), [[1.0, 2.0], [3.0, 4.0]]);
    }
}
