//! The step between two readings of a sensor.

use std::collections::BTreeMap;

/// The step of a quantised signal, if its increments are whole multiples of one.
///
/// ```text
/// |x_{k+1} − x_k| = m r,   m = 0, 1, 2, …
/// ```
///
/// r starts at the smallest increment and is refined on ever larger ones. `None` if less than 98 % of the
/// increments up to 64 r fit, or if they do not show at least two different multiples (a ramp is not quantised).
///
/// # Example
/// ```
/// let values: Vec<f64> = (0..500).map(|k| (0.02 * f64::from(k)).sin()).collect();
/// assert_eq!(sinew_data::quantisation_step(&values), None);
/// let coarse: Vec<f64> = values.iter().map(|x| (x / 0.005).round() * 0.005).collect();
/// approx::assert_relative_eq!(sinew_data::quantisation_step(&coarse).unwrap(), 0.005, max_relative = 1e-9);
/// ```
pub fn quantisation_step(values: &[f64]) -> Option<f64> {
    /// Distance from a whole multiple, in steps, that the rounding of the log may cause.
    const TOLERANCE: f64 = 0.1;
    const LARGEST_MULTIPLE: f64 = 64.0;
    const SHARE: f64 = 0.98;
    const FEWEST: usize = 20;

    let mut increments: Vec<f64> = values.windows(2).map(|x| (x[1] - x[0]).abs()).collect();
    increments.sort_unstable_by(f64::total_cmp);
    let zeros = increments.partition_point(|&d| d == 0.0);
    let moving = &increments[zeros..];
    let mut step = *moving.first()?;
    let mut reach = 1.5;
    while reach < 2.0 * LARGEST_MULTIPLE {
        // r = Σ m d / Σ m²
        let near = &moving[..moving.partition_point(|&d| d < reach * step)];
        let (mut md, mut mm) = (0.0, 0.0);
        for d in near {
            let m = (d / step).round();
            md += m * d;
            mm += m * m;
        }
        step = md / mm;
        reach *= 2.0;
    }
    let near = &moving[..moving.partition_point(|&d| d < (LARGEST_MULTIPLE + 0.5) * step)];
    let mut multiples: BTreeMap<u64, usize> = BTreeMap::new();
    for m in near.iter().map(|d| d / step).filter(|m| (m - m.round()).abs() < TOLERANCE) {
        *multiples.entry(m.round() as u64).or_default() += 1;
    }
    let fit: usize = multiples.values().sum();
    let share_of_one = |count: &usize| *count * 100 >= near.len() + zeros;
    let teeth = multiples.values().filter(|&c| share_of_one(c)).count()
        + usize::from(zeros > 0 && share_of_one(&zeros));
    (fit >= FEWEST && fit as f64 >= SHARE * near.len() as f64 && teeth >= 2).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::white_noise;
    use approx::assert_relative_eq;

    #[test]
    fn an_encoder_step_is_found_although_the_log_rounds() {
        let step = std::f64::consts::TAU / 131_072.0;
        let values: Vec<f64> = (0..4000)
            .map(|k| ((0.001 * f64::from(k)).sin() / step).round() * step)
            .map(|x| (x * 1e6).round() * 1e-6)
            .collect();
        assert_relative_eq!(quantisation_step(&values).unwrap(), step, max_relative = 1e-3);
    }

    #[test]
    fn a_noisy_coarse_signal_shows_its_step() {
        let values: Vec<f64> = white_noise(1000, 7).iter().map(|x| (x / 0.3).round() * 0.3).collect();
        assert_relative_eq!(quantisation_step(&values).unwrap(), 0.3, max_relative = 1e-9);
    }

    #[test]
    fn continuous_signals_and_ramps_have_no_step() {
        assert_eq!(quantisation_step(&white_noise(5000, 8)), None);
        let ramp: Vec<f64> = (0..500).map(|k| 0.001 * f64::from(k)).collect();
        assert_eq!(quantisation_step(&ramp), None);
        assert_eq!(quantisation_step(&[1.0; 100]), None);
        assert_eq!(quantisation_step(&[]), None);
    }
}
