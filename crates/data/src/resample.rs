//! From true time stamps to a uniform grid.

/// Equally spaced times `start`, `start + step`, …: `len` of them, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uniform {
    /// First time, s.
    pub start: f64,
    /// Distance of two times, s.
    pub step: f64,
    /// Number of times.
    pub len: usize,
}

impl Uniform {
    /// The grid of a step that lies within the given time stamps and begins at the first.
    ///
    /// ```
    /// let grid = sinew_data::Uniform::within(&[2.0, 2.4, 3.1], 0.5);
    /// assert_eq!((grid.start, grid.len), (2.0, 3));
    /// assert_eq!(grid.times(), [2.0, 2.5, 3.0]);
    /// ```
    ///
    /// # Panics
    /// If there are no time stamps or the step is not positive.
    pub fn within(time: &[f64], step: f64) -> Uniform {
        assert!(!time.is_empty() && step > 0.0, "time: no stamps, or a step of {step} s");
        let start = time[0];
        // Half a millionth of a step forgives the rounding of the last stamp.
        let len = ((time[time.len() - 1] - start) / step + 5e-7).floor() as usize + 1;
        Uniform { start, step, len }
    }

    /// Time number `k`, s.
    pub fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.step
    }

    /// All times, s.
    pub fn times(&self) -> Vec<f64> {
        (0..self.len).map(|k| self.time(k)).collect()
    }
}

/// Values of a signal on a uniform grid, by cubics through the four samples around each time.
///
/// ```text
/// x(t) = Σ_i x_i Π_{m≠i} (t − t_m) / (t_i − t_m)        i, m: the four stamps around t
/// ```
///
/// Exact for cubics on any stamps. The stamps are used as logged, never the number of a sample. Before the first
/// and after the last stamp the outermost cubic goes on, which is meant for the rounding of a grid's end only.
/// Fewer than four samples: the polynomial through all. Cost O(samples + grid).
///
/// # Panics
/// If `time` and `values` differ in length or are empty.
///
/// # Example
/// ```
/// use sinew_data::{Uniform, resample};
/// let time = [0.0, 0.9, 2.1, 3.0, 4.2];
/// let cubes = time.map(|t: f64| t.powi(3));
/// let on_grid = resample(&time, &cubes, &Uniform { start: 0.0, step: 1.0, len: 5 });
/// approx::assert_relative_eq!(on_grid[2], 8.0, max_relative = 1e-13);
/// ```
pub fn resample(time: &[f64], values: &[f64], grid: &Uniform) -> Vec<f64> {
    resample_through(4, time, values, grid)
}

/// [`resample`] by polynomials through many samples around each time, for grids finer than the log: halfway between the samples
/// of a swing of a tenth of their rate cubics through four lose 0.35 %, polynomials through sixteen nothing that counts. Near
/// the ends they go through fewer, as many on either side, since they swing there.
///
/// # Panics
/// If `time` and `values` differ in length or are empty, or `samples` is odd or less than four.
///
/// # Example
/// ```
/// use sinew_data::{Uniform, resample_through};
/// let time: Vec<f64> = (0..40).map(f64::from).collect();
/// let swing: Vec<f64> = time.iter().map(|t| (std::f64::consts::TAU * 0.1 * t).cos()).collect();
/// let halfway = Uniform { start: 19.5, step: 1.0, len: 1 };
/// let lost = |samples| {
///     let exact = (std::f64::consts::TAU * 1.95).cos();
///     (resample_through(samples, &time, &swing, &halfway)[0] / exact - 1.0).abs()
/// };
/// assert!((3.5e-3..3.6e-3).contains(&lost(4)) && lost(16) < 1e-8);
/// ```
pub fn resample_through(samples: usize, time: &[f64], values: &[f64], grid: &Uniform) -> Vec<f64> {
    assert!(samples >= 4 && samples.is_multiple_of(2), "samples: at least four, as many on either side");
    assert_eq!(time.len(), values.len(), "values: one for each time stamp");
    assert!(!time.is_empty(), "time: no stamps");
    let n = time.len();
    let mut after = 0;
    let at = |k: usize| {
        let t = grid.time(k);
        while after < n && time[after] <= t {
            after += 1;
        }
        let side = after.min(n - after).clamp(2, samples / 2);
        let nodes = n.min(2 * side);
        let first = after.saturating_sub(side).min(n - nodes);
        lagrange(&time[first..first + nodes], &values[first..first + nodes], t)
    };
    (0..grid.len).map(at).collect()
}

/// The polynomial through all samples, at t. Written as x_near + Σ w_i (x_i − x_near): constants stay exact.
pub(crate) fn lagrange(time: &[f64], values: &[f64], t: f64) -> f64 {
    let near = values[values.len() / 2];
    let mut sum = 0.0;
    for i in 0..time.len() {
        let mut weight = 1.0;
        for m in (0..time.len()).filter(|&m| m != i) {
            weight *= (t - time[m]) / (time[i] - time[m]);
        }
        sum += weight * (values[i] - near);
    }
    near + sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn ragged(n: usize) -> Vec<f64> {
        (0..n).map(|k| 0.01 * (k as f64 + 0.3 * ((k * k) as f64).sin())).collect()
    }

    #[test]
    fn cubics_are_kept_on_ragged_stamps() {
        let time = ragged(50);
        let cubic = |t: f64| 1.0 - 2.0 * t + 30.0 * t * t - 100.0 * t * t * t;
        let values: Vec<f64> = time.iter().map(|&t| cubic(t)).collect();
        let grid = Uniform::within(&time, 0.003);
        for (k, value) in resample(&time, &values, &grid).iter().enumerate() {
            assert_relative_eq!(*value, cubic(grid.time(k)), max_relative = 1e-10, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_stamp_gives_back_its_own_value() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        let values = [3.0, -1.0, 4.0, 1.0, -5.0];
        assert_eq!(resample(&time, &values, &Uniform { start: 0.0, step: 1.0, len: 5 }), values);
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_step() {
        let error = |n: usize| {
            let time: Vec<f64> = (0..=n).map(|k| k as f64 / n as f64).collect();
            let values: Vec<f64> = time.iter().map(|t| (5.0 * t).sin()).collect();
            let grid = Uniform::within(&time, 0.001);
            let resampled = resample(&time, &values, &grid);
            resampled
                .iter()
                .enumerate()
                .map(|(k, x)| (x - (5.0 * grid.time(k)).sin()).abs())
                .fold(0.0, f64::max)
        };
        assert_relative_eq!(error(40) / error(80), 16.0, max_relative = 0.1);
    }

    #[test]
    fn few_samples_give_the_polynomial_through_all() {
        let grid = Uniform { start: 0.0, step: 0.5, len: 3 };
        assert_eq!(resample(&[0.0, 1.0], &[0.0, 2.0], &grid), [0.0, 1.0, 2.0]);
        assert_eq!(resample(&[0.0], &[7.0], &grid), [7.0, 7.0, 7.0]);
        assert_eq!(resample_through(8, &[0.0, 1.0], &[0.0, 2.0], &grid), [0.0, 1.0, 2.0]);
        assert_eq!(resample_through(8, &[0.0], &[7.0], &grid), [7.0, 7.0, 7.0]);
    }

    // Steps of an encoder at the ends of a log, through which a polynomial of the fifteenth degree would swing by hundreds.
    #[test]
    fn noise_at_the_ends_stays_as_small_as_it_is() {
        let time = ragged(40);
        let noise = |k: usize| ((k as f64 * 12.9898).sin() * 43_758.545).fract();
        let values: Vec<f64> = (0..40).map(noise).collect();
        let through = resample_through(16, &time, &values, &Uniform::within(&time, 0.0025));
        assert!(through.iter().all(|x| x.abs() < 3.0), "{through:?}");
    }

    #[test]
    fn a_swing_of_a_fifth_of_the_rate_comes_back_between_ragged_stamps() {
        let time = ragged(60);
        let swing = |t: f64| (std::f64::consts::TAU * 20.0 * t).cos();
        let values: Vec<f64> = time.iter().map(|&t| swing(t)).collect();
        let grid = Uniform { start: 0.15, step: 0.0025, len: 120 };
        let lost = |samples| {
            let through = resample_through(samples, &time, &values, &grid).into_iter().enumerate();
            through.map(|(k, x)| (x - swing(grid.time(k))).abs()).fold(0.0, f64::max)
        };
        assert!(lost(4) > 0.05 && lost(16) < 1e-3, "{} {}", lost(4), lost(16));
    }
}
