//! Whether a small symmetric matrix is positive.

/// True if A + shift · 1 is positive definite (Cholesky). `a`: n × n by rows.
pub(crate) fn is_positive(a: &[f64], n: usize, shift: f64) -> bool {
    let mut l = a.to_vec();
    for j in 0..n {
        // d = A_jj + shift − Σ L_jk²
        let d = l[j * n + j] + shift - (0..j).map(|k| l[j * n + k] * l[j * n + k]).sum::<f64>();
        if !(d > 0.0 && d.is_finite()) {
            return false;
        }
        l[j * n + j] = d.sqrt();
        for i in j + 1..n {
            // L_ij = (A_ij − Σ L_ik L_jk) / L_jj
            let s = l[i * n + j] - (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum::<f64>();
            l[i * n + j] = s / l[j * n + j];
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_positive_if_its_eigenvalues_are() {
        assert!(is_positive(&[2.0, 1.0, 1.0, 2.0], 2, 0.0));
        assert!(!is_positive(&[1.0, 2.0, 2.0, 1.0], 2, 0.0));
        assert!(!is_positive(&[1.0, 1.0, 1.0, 1.0], 2, 0.0));
        assert!(is_positive(&[1.0, 1.0, 1.0, 1.0], 2, 1e-12));
        assert!(!is_positive(&[f64::NAN], 1, 0.0));
    }
}
