//! One kernel that smooths and differentiates a signal on a uniform grid.

use crate::kernel::bump;

/// Smoothing, first and second derivative by one kernel h and its derivatives.
///
/// ```text
/// h(s) ∝ (1 − s²)⁶,  s = j / (w + 1),  j = −w … w
/// value = h ∗ x        rate = ḣ ∗ x        second_rate = ḧ ∗ x
/// ```
///
/// The samples of ḣ and ḧ are corrected by a few parts in 10⁷ (w = 16), so that for every polynomial up to
/// the fifth degree `rate` is the derivative of `value`, and `second_rate` of `rate`, to rounding. Every
/// method returns len − 2w values: the first belongs to sample w. Values, rate and second rate of one signal
/// therefore belong together, and h on every other channel makes it comparable.
///
/// # Example
/// ```
/// let h = sinew_data::Smoother::new(2, 0.1);
/// let x: Vec<f64> = (0..7).map(|k| 3.0 * 0.1 * f64::from(k)).collect();
/// approx::assert_relative_eq!(h.rate(&x)[0], 3.0, max_relative = 1e-14);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Smoother {
    /// h_{−w} … h_w.
    value: Vec<f64>,
    /// ḣ_1 … ḣ_w; it is odd.
    rate: Vec<f64>,
    /// ḧ_1 … ḧ_w; it is even, and ḧ_0 makes the sum zero.
    second: Vec<f64>,
}

impl Smoother {
    /// The smoother of 2w + 1 samples, w = `half_width`, for a grid of the given step, s.
    ///
    /// # Panics
    /// If `half_width` is zero or `step` is not positive.
    pub fn new(half_width: usize, step: f64) -> Smoother {
        assert!(half_width > 0, "half_width: 0 samples cannot be differentiated");
        assert!(step > 0.0, "step: {step} s is not positive");
        let w = half_width as f64;
        let mut value = bump(half_width, 6);
        let sum: f64 = value.iter().sum();
        value.iter_mut().for_each(|h| *h /= sum);
        let s: Vec<f64> = (1..=half_width).map(|j| j as f64 / (w + 1.0)).collect();
        // μ_p = Σ h s^p over all samples
        let moment =
            |p: i32| 2.0 * (1..=half_width).map(|j| value[half_width + j] * s[j - 1].powi(p)).sum::<f64>();
        let (mu2, mu4) = (moment(2), moment(4));
        // ḣ ∝ s (1 − s²)⁵:  Σ ḣ s = 1,  Σ ḣ s³ = 3 μ₂,  Σ ḣ s⁵ = 5 μ₄
        let shape = |s: f64| s * (1.0 - s * s).powi(5);
        let rate = with_moments(&s, shape, &[(1, 1.0), (3, 3.0 * mu2), (5, 5.0 * mu4)]);
        // ḧ ∝ (11 s² − 1)(1 − s²)⁴:  Σ ḧ s² = 2,  Σ ḧ s⁴ = 12 μ₂
        let shape = |s: f64| (11.0 * s * s - 1.0) * (1.0 - s * s).powi(4);
        let second = with_moments(&s, shape, &[(2, 2.0), (4, 12.0 * mu2)]);
        let length = step * (w + 1.0);
        Smoother {
            value,
            rate: rate.iter().map(|d| d / length).collect(),
            second: second.iter().map(|d| d / (length * length)).collect(),
        }
    }

    /// h ∗ x, with unit gain for a constant.
    pub fn value(&self, x: &[f64]) -> Vec<f64> {
        let dot = |part: &[f64]| self.value.iter().zip(part).map(|(h, x)| h * x).sum();
        x.windows(self.value.len()).map(dot).collect()
    }

    /// ḣ ∗ x, unit of x per s, with unit gain for a slope.
    pub fn rate(&self, x: &[f64]) -> Vec<f64> {
        let w = self.half_width();
        // ẋ_k = Σ_j ḣ_j (x_{k+j} − x_{k−j})
        let dot = |part: &[f64]| (1..=w).map(|j| self.rate[j - 1] * (part[w + j] - part[w - j])).sum();
        x.windows(self.value.len()).map(dot).collect()
    }

    /// ḧ ∗ x, unit of x per s², with unit gain for a parabola.
    pub fn second_rate(&self, x: &[f64]) -> Vec<f64> {
        let w = self.half_width();
        // ẍ_k = Σ_j ḧ_j (x_{k+j} − 2 x_k + x_{k−j})
        let dot = |part: &[f64]| {
            (1..=w).map(|j| self.second[j - 1] * ((part[w + j] - part[w]) + (part[w - j] - part[w]))).sum()
        };
        x.windows(self.value.len()).map(dot).collect()
    }

    /// h, 2w + 1 values of unit sum.
    pub fn weights(&self) -> &[f64] {
        &self.value
    }

    /// w, samples.
    pub fn half_width(&self) -> usize {
        self.rate.len()
    }
}

/// The kernel d_j = shape(s_j)·(a + b s_j² + c s_j⁴) whose two-sided moments Σ d_j s_j^p are as wanted.
///
/// Of more conditions than samples the first are met.
fn with_moments(s: &[f64], shape: impl Fn(f64) -> f64, wanted: &[(i32, f64)]) -> Vec<f64> {
    let wanted = &wanted[..wanted.len().min(s.len())];
    let n = wanted.len();
    let mut rows: Vec<Vec<f64>> = wanted
        .iter()
        .map(|&(p, moment)| {
            let entry = |i: usize| 2.0 * s.iter().map(|&s| shape(s) * s.powi(p + 2 * i as i32)).sum::<f64>();
            (0..n).map(entry).chain([moment]).collect()
        })
        .collect();
    solve(&mut rows);
    s.iter().map(|&s| shape(s) * (0..n).map(|i| rows[i][n] * s.powi(2 * i as i32)).sum::<f64>()).collect()
}

/// Gauss–Jordan elimination of [A | b] with row exchange; the solution stands in the last column.
fn solve(rows: &mut [Vec<f64>]) {
    let n = rows.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()));
        rows.swap(column, pivot.unwrap_or(column));
        let pivot = rows[column].clone();
        rows[column].iter_mut().for_each(|entry| *entry /= pivot[column]);
        let pivot = rows[column].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let factor = row[column];
            row.iter_mut().zip(&pivot).for_each(|(entry, p)| *entry -= factor * p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const STEP: f64 = 0.002;

    fn sampled(n: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..n).map(|k| f(k as f64 * STEP)).collect()
    }

    #[test]
    fn constants_keep_their_value_and_have_no_rate() {
        for w in 1..40 {
            let h = Smoother::new(w, STEP);
            let x = vec![7.0; 2 * w + 3];
            assert_eq!(h.value(&x).len(), 3);
            assert_relative_eq!(h.value(&x)[1], 7.0, max_relative = 1e-14);
            assert_eq!((h.rate(&x)[1], h.second_rate(&x)[1]), (0.0, 0.0));
        }
    }

    #[test]
    fn slope_and_curvature_have_unit_gain_at_every_width() {
        for w in 1..40 {
            let h = Smoother::new(w, STEP);
            let n = 2 * w + 1;
            assert_relative_eq!(h.rate(&sampled(n, |t| 3.0 * t))[0], 3.0, max_relative = 1e-12);
            assert_relative_eq!(h.second_rate(&sampled(n, |t| 3.0 * t * t))[0], 6.0, max_relative = 1e-11);
        }
    }

    #[test]
    fn rate_is_the_derivative_of_value_for_polynomials() {
        for w in [3, 8, 16, 30] {
            let h = Smoother::new(w, STEP);
            let n = 2 * w + 41;
            for degree in 1..=5 {
                let d = f64::from(degree);
                // t in units of a second, shifted so that no term vanishes
                let x = sampled(n, |t| (t - 0.3).powi(degree));
                let slope = sampled(n, |t| d * (t - 0.3).powi(degree - 1));
                let bend = sampled(n, |t| d * (d - 1.0) * (t - 0.3).powi(degree - 2));
                for (rate, exact) in h.rate(&x).iter().zip(h.value(&slope)) {
                    assert_relative_eq!(*rate, exact, max_relative = 1e-10, epsilon = 1e-12);
                }
                for (second, exact) in h.second_rate(&x).iter().zip(h.value(&bend)) {
                    assert_relative_eq!(*second, exact, max_relative = 1e-7, epsilon = 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_sine_keeps_its_phase_and_loses_what_the_kernel_says() {
        let (w, omega) = (16, 40.0);
        let h = Smoother::new(w, STEP);
        let x = sampled(400, |t| (omega * t).sin());
        // gain = Γ(7.5) (2/a)^6.5 J_6.5(a) = 1 − a²/30 + a⁴/2040 − …,  a = ω (w + 1) step
        let a = omega * 17.0 * STEP;
        let gain =
            1.0 - a.powi(2) / 30.0 + a.powi(4) / 2040.0 - a.powi(6) / 232_560.0 + a.powi(8) / 39_070_080.0;
        let (value, rate, second) = (h.value(&x), h.rate(&x), h.second_rate(&x));
        for k in 0..value.len() {
            let t = (k + w) as f64 * STEP;
            assert_relative_eq!(value[k], gain * (omega * t).sin(), epsilon = 1e-6);
            assert_relative_eq!(rate[k], gain * omega * (omega * t).cos(), epsilon = 1e-6 * omega);
            assert_relative_eq!(
                second[k],
                -gain * omega * omega * (omega * t).sin(),
                epsilon = 1e-5 * omega * omega
            );
        }
    }

    #[test]
    fn the_kernel_is_the_published_bump() {
        let h = Smoother::new(16, STEP);
        assert_eq!(h.half_width(), 16);
        assert_relative_eq!(h.weights().iter().sum::<f64>(), 1.0, max_relative = 1e-14);
        assert_relative_eq!(
            h.weights()[20] / h.weights()[16],
            (1.0 - 16.0 / 289.0f64).powi(6),
            max_relative = 1e-14
        );
    }
}
