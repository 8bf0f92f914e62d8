//! The kernel that every residual passes through, and decimation.

/// The compact-support kernel φ of the residuals.
///
/// ```text
/// φ_j = c (1 − s²)⁴,  s = j / (w + 1),  j = −w … w,  Σ φ_j = 1
/// ```
///
/// # Example
/// White noise of standard deviation σ leaves it with σ·‖φ‖₂:
/// ```
/// let kernel = sinew_data::Kernel::new(1);
/// // (1 − ¼)⁴ = 81/256, so φ ∝ [81, 256, 81]
/// approx::assert_relative_eq!(kernel.weights()[1], 256.0 / 418.0, max_relative = 1e-15);
/// assert_eq!(kernel.decimate(&[5.0; 9], 3), [5.0, 5.0, 5.0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    weights: Vec<f64>,
}

impl Kernel {
    /// The kernel of 2w + 1 samples, w = `half_width`.
    pub fn new(half_width: usize) -> Kernel {
        let weights = bump(half_width, 4);
        let sum: f64 = weights.iter().sum();
        Kernel { weights: weights.iter().map(|w| w / sum).collect() }
    }

    /// φ ∗ x at the samples w, w + `every`, w + 2·`every` … that have all their neighbours.
    ///
    /// Returns ⌈(len − 2w) / every⌉ values, none if `x` is shorter than the kernel.
    ///
    /// # Panics
    /// If `every` is zero.
    pub fn decimate(&self, x: &[f64], every: usize) -> Vec<f64> {
        assert!(every > 0, "every: 0 is no decimation");
        let dot = |part: &[f64]| self.weights.iter().zip(part).map(|(w, x)| w * x).sum();
        x.windows(self.weights.len()).step_by(every).map(dot).collect()
    }

    /// φ, 2w + 1 values.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// w.
    pub fn half_width(&self) -> usize {
        self.weights.len() / 2
    }

    /// ‖φ‖₂ = √(Σ φ²): what is left of the standard deviation of white noise.
    pub fn norm(&self) -> f64 {
        self.weights.iter().map(|w| w * w).sum::<f64>().sqrt()
    }
}

/// (1 − s²)^power at s = j / (w + 1), j = −w … w.
pub(crate) fn bump(half_width: usize, power: i32) -> Vec<f64> {
    let w = half_width as f64;
    (0..=2 * half_width).map(|j| (1.0 - ((j as f64 - w) / (w + 1.0)).powi(2)).powi(power)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_kernel_is_symmetric_positive_and_of_unit_sum() {
        let kernel = Kernel::new(24);
        let weights = kernel.weights();
        assert_relative_eq!(weights.iter().sum::<f64>(), 1.0, max_relative = 1e-14);
        assert!((0..49).all(|j| weights[j] > 0.0 && weights[j] == weights[48 - j]));
        assert_eq!(kernel.half_width(), 24);
    }

    #[test]
    fn the_norm_is_that_of_the_continuous_kernel() {
        // ∫(1−s²)⁸ ds / (∫(1−s²)⁴ ds)² = (2·16!!/17!!) / (2·8!!/9!!)² for steps of 1 / (w + 1)
        let double_factorials: f64 =
            (1..=8).map(|k| 2.0 * f64::from(k) / (2.0 * f64::from(k) + 1.0)).product();
        let four: f64 = (1..=4).map(|k| 2.0 * f64::from(k) / (2.0 * f64::from(k) + 1.0)).product();
        let exact = (2.0 * double_factorials / (2.0 * four).powi(2) / 25.0).sqrt();
        assert_relative_eq!(Kernel::new(24).norm(), exact, max_relative = 1e-6);
    }

    #[test]
    fn decimation_starts_at_the_first_whole_kernel_and_keeps_straight_lines() {
        let line: Vec<f64> = (0..101).map(f64::from).collect();
        let thin = Kernel::new(10).decimate(&line, 7);
        assert_eq!(thin.len(), 81_usize.div_ceil(7));
        for (k, value) in thin.iter().enumerate() {
            assert_relative_eq!(*value, (10 + 7 * k) as f64, max_relative = 1e-13);
        }
        assert!(Kernel::new(60).decimate(&line, 1).is_empty());
    }
}
