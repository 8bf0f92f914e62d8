//! Fewer points for a line on a page, with every peak kept.

/// The points of a line over time, at most two a pixel column: the smallest and the largest value in it.
///
/// `place` gives the pixel of a time. The order in time is kept.
pub(crate) fn decimate(time: &[f64], values: &[f64], place: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut start = 0;
    while start < time.len() {
        let pixel = place(time[start]).floor();
        let end = start + time[start..].iter().take_while(|t| place(**t).floor() == pixel).count().max(1);
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let low = (start..end).min_by(by_value).unwrap_or(start);
        let high = (start..end).max_by(by_value).unwrap_or(start);
        points.push((place(time[low.min(high)]), values[low.min(high)]));
        if low != high {
            points.push((place(time[low.max(high)]), values[low.max(high)]));
        }
        start = end;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives() {
        let time: Vec<f64> = (0..10_000).map(f64::from).collect();
        let values: Vec<f64> = time.iter().map(|t| if *t == 4321.0 { 9.0 } else { 0.0 }).collect();
        let points = decimate(&time, &values, |t| t / 100.0);
        assert!(points.len() <= 200 && points.iter().any(|p| p.1 == 9.0));
        assert!(points.windows(2).all(|w| w[0].0 <= w[1].0));
    }
}
