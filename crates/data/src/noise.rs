//! How large the noise of a signal is, seen from the signal alone.

use crate::quantisation::quantisation_step;
use crate::run::Signal;
use crate::statistics::{median, rms};

/// Standard deviation of the white noise in a signal, from its fourth differences.
///
/// ```text
/// d_k = (x_{k−2} − 4 x_{k−1} + 6 x_k − 4 x_{k+1} + x_{k+2}) / √70        σ = rms of d, clipped at ± 6 median |d|
/// ```
///
/// Smooth motion has no fourth differences, white noise keeps its size: 1² + 4² + 6² + 4² + 1² = 70. Quantised
/// or filtered signals fool it (see [`fourth_difference_lag1`]): it is a lower bound there. Zero for fewer than
/// five samples.
///
/// # Example
/// ```
/// let line: Vec<f64> = (0..100).map(f64::from).collect();
/// assert_eq!(sinew_data::white_noise_std(&line), 0.0);
/// ```
pub fn white_noise_std(values: &[f64]) -> f64 {
    rms(clipped_fourth_differences(values))
}

/// Correlation of neighbouring fourth differences: −0.8 for white noise.
///
/// ```text
/// ρ = Σ d_k d_{k+1} / Σ d_k²        white: −(1·4 + 4·6 + 6·4 + 4·1) / 70 = −56/70
/// ```
///
/// More than 0.15 away from −0.8 the signal was filtered before it was logged, quantised, or has no noise at
/// all. NaN if all differences are zero.
///
/// # Example
/// ```
/// let spike: Vec<f64> = (0..41).map(|k| if k == 20 { 1.0 } else { 0.0 }).collect();
/// // A single spike is clipped away: more than half of the differences are zero.
/// assert!(sinew_data::fourth_difference_lag1(&spike).is_nan());
/// ```
pub fn fourth_difference_lag1(values: &[f64]) -> f64 {
    let d = clipped_fourth_differences(values);
    d.windows(2).map(|d| d[0] * d[1]).sum::<f64>() / d.iter().map(|d| d * d).sum::<f64>()
}

/// True if the fourth differences of a signal with this correlation are those of white noise.
pub(crate) fn is_white(lag1: f64) -> bool {
    (lag1 + 0.8).abs() <= 0.15
}

/// Standard deviation of the instrument's noise: as stated with the signal, else estimated.
///
/// ```text
/// σ² = std² + r²/12                        both stated: noise before rounding, and rounding
/// σ = max(white_noise_std, r / √12)        no std stated; r: the resolution stated, or the step found in the readings
/// ```
///
/// # Example
/// ```
/// use sinew_data::{Quantity, Signal, instrument_noise};
/// let mut signal = Signal::new(Quantity::MotorPosition, "elbow", vec![0.0; 100]);
/// signal.resolution = Some(12f64.sqrt());
/// assert_eq!(instrument_noise(&signal), 1.0);
/// signal.std = Some(0.75);
/// assert_eq!(instrument_noise(&signal), 1.25);
/// ```
pub fn instrument_noise(signal: &Signal) -> f64 {
    if let Some(std) = signal.std {
        return std.hypot(signal.resolution.unwrap_or(0.0) / 12f64.sqrt());
    }
    let resolution = signal.resolution.or_else(|| quantisation_step(&signal.values)).unwrap_or(0.0);
    white_noise_std(&signal.values).max(resolution / 12f64.sqrt())
}

/// Autocovariance of a signal at the lags 0 … `lags`.
///
/// ```text
/// c_l = 1/N Σ_k (x_k − x̄)(x_{k+l} − x̄)
/// ```
///
/// Divided by N, not N − l, so that the Toeplitz matrix of c is positive semidefinite and Yule–Walker equations
/// have a stable solution. Lags beyond the signal are zero. Cost O(N · lags).
///
/// # Example
/// ```
/// assert_eq!(sinew_data::autocovariance(&[1.0, -1.0, 1.0, -1.0], 2), [1.0, -0.75, 0.5]);
/// ```
pub fn autocovariance(values: &[f64], lags: usize) -> Vec<f64> {
    let mean = crate::statistics::mean(values);
    let x: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let n = x.len().max(1) as f64;
    (0..=lags).map(|l| x.iter().zip(x.iter().skip(l)).map(|(a, b)| a * b).sum::<f64>() / n).collect()
}

/// d_k = (x_{k−2} − 4 x_{k−1} + 6 x_k − 4 x_{k+1} + x_{k+2}) / √70
fn fourth_differences(values: &[f64]) -> Vec<f64> {
    let scale = 70f64.sqrt();
    // Written as differences of neighbours, so that a large constant costs no digits.
    values
        .windows(5)
        .map(|x| (((x[4] - x[3]) - (x[1] - x[0])) + 3.0 * ((x[2] - x[3]) + (x[2] - x[1]))) / scale)
        .collect()
}

fn clipped_fourth_differences(values: &[f64]) -> Vec<f64> {
    let mut d = fourth_differences(values);
    let clip = 6.0 * median(d.iter().map(|d| d.abs()).collect());
    d.iter_mut().for_each(|d| *d = d.clamp(-clip, clip));
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;
    use crate::run::Signal;
    use crate::samples::white_noise;
    use approx::assert_relative_eq;

    #[test]
    fn white_noise_is_measured_under_any_smooth_motion() {
        let noise = white_noise(20_000, 1);
        let values: Vec<f64> =
            noise.iter().enumerate().map(|(k, n)| 5.0 * (0.01 * k as f64).sin() + 1e3 + 0.02 * n).collect();
        assert_relative_eq!(white_noise_std(&values), 0.02, max_relative = 0.03);
        assert_relative_eq!(fourth_difference_lag1(&values), -0.8, epsilon = 0.01);
    }

    #[test]
    fn a_few_spikes_do_not_move_the_estimate() {
        let mut values = white_noise(20_000, 2);
        for k in (100..20_000).step_by(500) {
            values[k] += 1000.0;
        }
        assert_relative_eq!(white_noise_std(&values), 1.0, max_relative = 0.1);
    }

    #[test]
    fn fourth_differences_are_zero_for_cubics() {
        let values: Vec<f64> = (0..50).map(|k| f64::from(k).powi(3)).collect();
        assert!(fourth_differences(&values).iter().all(|d| d.abs() < 1e-9));
    }

    #[test]
    fn a_filtered_signal_is_off_the_white_value() {
        let noise = white_noise(5000, 3);
        let filtered: Vec<f64> = noise.windows(3).map(|x| x[0] + 2.0 * x[1] + x[2]).collect();
        assert!((fourth_difference_lag1(&filtered) + 0.8).abs() > 0.15);
        assert!(fourth_difference_lag1(&[1.0; 20]).is_nan());
    }

    #[test]
    fn a_coarse_sensor_has_at_least_the_noise_of_its_steps() {
        let values: Vec<f64> =
            (0..2000).map(|k| ((0.002 * f64::from(k)).sin() * 50.0).round() * 0.02).collect();
        let signal = Signal::new(Quantity::MotorPosition, "elbow", values);
        assert_relative_eq!(instrument_noise(&signal), 0.02 / 12f64.sqrt(), max_relative = 1e-3);
    }

    #[test]
    fn white_noise_has_no_autocovariance() {
        let c = autocovariance(&white_noise(20_000, 4), 5);
        assert_relative_eq!(c[0], 1.0, max_relative = 0.03);
        assert!(c[1..].iter().all(|c| c.abs() < 0.03));
        assert_eq!(autocovariance(&[1.0, 2.0], 3)[2..], [0.0, 0.0]);
    }
}
