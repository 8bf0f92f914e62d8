//! Frequencies at which a residual swings: where a mode that the model lacks shows.

use realfft::RealFftPlanner;

// Seconds of the pieces whose spectra are averaged, and how many times as long they are padded.
const PIECE: f64 = 8.0;
const PADDED: usize = 4;
// Below this frequency, Hz, a swing is not told from friction and load; so near to the end, in rates of rows, neither.
const SLOWEST: f64 = 2.0;
const FASTEST: f64 = 0.45;
// A peak stands out from the median of its neighbours up to this factor of its frequency by so much power.
const NEIGHBOURS: f64 = 1.6;
const OUTSTANDING: f64 = 5.0;
/// Frequencies that are told.
pub(crate) const MOST: usize = 2;
// The factor by which they differ at least.
const APART: f64 = 1.05;

/// A line of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Swing {
    pub hertz: f64,
    /// Its power by the median of its neighbours'.
    pub outstanding: f64,
}

/// The lines that stand out of the averaged spectrum of these runs of rows, `period` seconds apart.
///
/// P(f) = mean over pieces of |Σ w_k x_k e^{−2πi f k T}|²,  w the window of von Hann. Source: P. D. Welch, *IEEE Trans. Audio and
/// Electroacoustics* 15(2), 1967.
pub(crate) fn swings<'r>(runs: impl Iterator<Item = &'r [f64]>, period: f64) -> Vec<Swing> {
    let runs: Vec<&[f64]> = runs.collect();
    let piece = runs.iter().map(|r| r.len()).max().unwrap_or(0).min((PIECE / period) as usize);
    if piece < 2 {
        return Vec::new();
    }
    let padded = PADDED * piece;
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(padded);
    let (mut input, mut output) = (fft.make_input_vec(), fft.make_output_vec());
    let mut power = vec![0.0; output.len()];
    let weight = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / piece as f64).cos();
    let window: Vec<f64> = (0..piece).map(weight).collect();
    for part in runs.iter().flat_map(|r| r.windows(piece).step_by((piece / 2).max(1))) {
        input.fill(0.0);
        input.iter_mut().zip(window.iter().zip(part)).for_each(|(x, (w, row))| *x = w * row);
        if fft.process(&mut input, &mut output).is_err() {
            return Vec::new();
        }
        power.iter_mut().zip(&output).for_each(|(p, x)| *p += x.norm_sqr());
    }
    let spacing = 1.0 / (padded as f64 * period);
    let bin = |hertz: f64| ((hertz / spacing) as usize).min(power.len() - 1);
    let outstanding = |k: usize| {
        let f = k as f64;
        let mut near =
            power[(f / NEIGHBOURS) as usize..=((f * NEIGHBOURS) as usize).min(power.len() - 1)].to_vec();
        let middle = near.len() / 2;
        let (_, median, _) = near.select_nth_unstable_by(middle, f64::total_cmp);
        power[k] / median.max(f64::MIN_POSITIVE)
    };
    let is_peak = |&k: &usize| power[k] > power[k - 1] && power[k] >= power[k + 1];
    let peaks = (bin(SLOWEST).max(1)..bin(FASTEST / period)).filter(is_peak);
    let swing = |k: usize| Swing { hertz: summit(&power, k) * spacing, outstanding: outstanding(k) };
    told(peaks.map(swing).collect())
}

/// The best few of some lines that differ.
pub(crate) fn told(mut lines: Vec<Swing>) -> Vec<Swing> {
    lines.retain(|line| line.outstanding > OUTSTANDING);
    lines.sort_by(|a, b| b.outstanding.total_cmp(&a.outstanding));
    let mut told: Vec<Swing> = Vec::new();
    for line in lines {
        let differs = |other: &Swing| (line.hertz / other.hertz).ln().abs() > APART.ln();
        if told.len() < MOST && told.iter().all(differs) {
            told.push(line);
        }
    }
    told
}

// The summit of the parabola through three powers, in bins.
fn summit(power: &[f64], k: usize) -> f64 {
    let [a, b, c] = [power[k - 1], power[k], power[k + 1]];
    k as f64 + 0.5 * (a - c) / (a - 2.0 * b + c)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;

    fn noise(seed: u64, len: usize) -> Vec<f64> {
        let mut random = SmallRng::seed_from_u64(seed);
        (0..len).map(|_| random.random::<f64>() - 0.5).collect()
    }

    // A sine of a quarter of the noise's variance, 9.13 Hz, in rows of 16 ms.
    #[test]
    fn a_sine_in_noise_is_told_by_its_frequency() {
        let period = 0.016;
        let run = |seed: u64, len: usize| -> Vec<f64> {
            let sine = |k: usize| 0.2 * (std::f64::consts::TAU * 9.13 * k as f64 * period).sin();
            noise(seed, len).into_iter().enumerate().map(|(k, x)| x + sine(k)).collect()
        };
        let runs = [run(1, 620), run(2, 700)];
        let lines = swings(runs.iter().map(Vec::as_slice), period);
        assert!((lines[0].hertz - 9.13).abs() < 0.03, "{lines:?}");
        assert!(lines[0].outstanding > 20.0, "{lines:?}");
    }

    #[test]
    fn too_few_rows_have_no_lines() {
        assert_eq!(swings([&[1.0][..], &[]].into_iter(), 0.016), []);
    }
}
