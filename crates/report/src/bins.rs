//! Conditional quantiles: how a residual spreads along another quantity.

/// One interval of the abscissa: its middle, and three quantiles of the values in it.
pub(crate) struct Bin {
    pub middle: f64,
    pub low: f64,
    pub median: f64,
    pub high: f64,
}

/// Splits `low … high` into `count` bins and gives the 10, 50 and 90 % quantiles of those with at least five values.
pub(crate) fn bins(x: &[f64], y: &[f64], (low, high): (f64, f64), count: usize) -> Vec<Bin> {
    let mut held = vec![Vec::new(); count];
    for (x, y) in x.iter().zip(y) {
        let k = (x - low) / (high - low) * count as f64;
        if k >= 0.0 && k < count as f64 {
            held[k as usize].push(*y);
        }
    }
    let step = (high - low) / count as f64;
    let bin = |(k, mut values): (usize, Vec<f64>)| {
        values.sort_by(f64::total_cmp);
        let [low_value, median, high_value] = [0.1, 0.5, 0.9].map(|p| quantile(&values, p));
        let middle = low + (k as f64 + 0.5) * step;
        (values.len() >= 5).then_some(Bin { middle, low: low_value, median, high: high_value })
    };
    held.into_iter().enumerate().filter_map(bin).collect()
}

/// The value below which the share `p` of sorted values lies; zero if there are none.
pub(crate) fn quantile(sorted: &[f64], p: f64) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n => sorted[((n - 1) as f64 * p).round() as usize],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_at_zero_is_seen_on_both_sides() {
        let x: Vec<f64> = (-500..500).map(|k| f64::from(k) + 0.5).collect();
        let y: Vec<f64> = x.iter().map(|x| x.signum()).collect();
        let all = bins(&x, &y, (-500.0, 500.0), 10);
        assert_eq!(all.len(), 10);
        assert!(all.iter().all(|b| b.median == b.middle.signum()));
    }
}
