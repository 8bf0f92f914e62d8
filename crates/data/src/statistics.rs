//! Order statistics that outliers do not move.

/// Median; of an even number of values the mean of the middle two. Zero for no values.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let n = values.len();
    if n == 0 {
        return 0.0;
    }
    let (low, middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return *middle;
    }
    let below = low.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (below + *middle)
}

/// Root of the mean square. Zero for no values.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value * value;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Standard deviation about the mean.
pub(crate) fn std(values: &[f64]) -> f64 {
    let mean = mean(values);
    rms(values.iter().map(|v| v - mean))
}

/// Arithmetic mean. Zero for no values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Smallest and largest value.
pub(crate) fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

/// Slope b of y ≈ b x that half of the samples may contradict: the median of y/x, weighted by |x|.
/// `None` if x is zero throughout.
pub(crate) fn robust_slope(x: &[f64], y: &[f64]) -> Option<f64> {
    let mut ratios: Vec<(f64, f64)> =
        x.iter().zip(y).filter(|(x, _)| **x != 0.0).map(|(x, y)| (y / x, x.abs())).collect();
    ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * ratios.iter().map(|r| r.1).sum::<f64>();
    let mut weight = 0.0;
    ratios
        .iter()
        .find(|r| {
            weight += r.1;
            weight >= half
        })
        .map(|r| r.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_is_the_middle_value() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![]), 0.0);
    }

    #[test]
    fn robust_slope_ignores_a_wild_third() {
        let x: Vec<f64> = (0..30).map(|k| f64::from(k) - 15.0).collect();
        let y: Vec<f64> = x.iter().enumerate().map(|(k, x)| if k % 3 == 0 { 1e6 } else { 2.0 * x }).collect();
        assert_eq!(robust_slope(&x, &y), Some(2.0));
        assert_eq!(robust_slope(&[0.0], &[1.0]), None);
    }
}
