//! Cartesian compliance: how far a tool gives way to a wrench.

use nalgebra::{DMatrix, Matrix6, Matrix6xX};

/// The compliance that joint compliances give a link.
///
/// ```text
/// δx = J K⁻¹ Jᵀ w
/// ```
///
/// `J`: 6 × n. `K_inverse`: n × n, any symmetric matrix (coupled transmissions, locked joints as zero rows), rad/(N·m).
/// Returns 6 × 6 from [moment; force] to [turn; shift], symmetric.
///
/// # Panics
/// If the sizes do not match.
///
/// # Example
/// One joint of 100 N·m/rad with a tool one metre away gives way by l²/K = 0.01 m/N:
/// ```
/// use nalgebra::{DMatrix, Matrix6xX};
/// let J = Matrix6xX::from_column_slice(&[0.0, -1.0, 0.0, 0.0, 0.0, 1.0]);
/// let C = sinew_kinematics::compliance(&J, &DMatrix::from_element(1, 1, 1.0 / 100.0));
/// assert_eq!(C[(5, 5)], 0.01);
/// ```
/// Source: Salisbury, *Active stiffness control of a manipulator in Cartesian coordinates*, CDC 1980.
pub fn compliance(J: &Matrix6xX<f64>, K_inverse: &DMatrix<f64>) -> Matrix6<f64> {
    assert_eq!(K_inverse.shape(), (J.ncols(), J.ncols()), "K_inverse");
    let C = J * K_inverse * J.transpose();
    // rounding must not make a symmetric matrix unsymmetric
    (C + C.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coupled_springs_need_their_whole_matrix() {
        let J = Matrix6xX::from_fn(2, |i, j| (i + 2 * j) as f64);
        let K_inverse = DMatrix::from_row_slice(2, 2, &[2.0, 0.5, 0.5, 1.0]);
        let C = compliance(&J, &K_inverse);
        let want: f64 = (0..2)
            .flat_map(|a| (0..2).map(move |b| (a, b)))
            .map(|(a, b)| J[(1, a)] * K_inverse[(a, b)] * J[(4, b)])
            .sum();
        assert_eq!(C[(1, 4)], want);
        assert_eq!(C, C.transpose());
    }
}
