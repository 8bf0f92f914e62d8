//! Time scales of the method, chosen by the sample rate of the log.

use sinew_data::{Quantity, Run, instrument_noise};

use crate::Options;

/// Widths and strides, in samples of the log or in steps of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scales {
    /// Median sample period of the log, s.
    pub period: f64,
    /// Half width of the smoothing kernel h, samples.
    pub smooth: usize,
    /// Half width of the wider kernel that shows where the sign of a velocity is uncertain, samples.
    pub wide: usize,
    /// Samples a grid step.
    pub stride: usize,
    /// Half width of the residual kernel φ, grid steps.
    pub kernel: usize,
    /// Grid steps a residual row.
    pub every: usize,
    /// True if the logged torque is held until the next sample.
    pub held: bool,
}

impl Scales {
    /// The scales for runs of one robot: those of the fastest log.
    pub fn of(runs: &[Run], options: &Options) -> Self {
        let period = runs.iter().map(Run::period).fold(f64::INFINITY, f64::min);
        let rate = 1.0 / period;
        // Plateaus of the width scans on measured logs: 250 Hz 32 ms, 100 Hz 110 ms. Fast logs: as narrow as the
        // encoders allow, since a wide kernel rounds the reversals.
        let (smooth, kernel, every) = match rate {
            r if r >= 500.0 => (narrowest(runs, period), 0.024, 0.016),
            r if r >= 200.0 => (0.032, 0.040, 0.024),
            r if r >= 80.0 => (0.110, 0.070, 0.040),
            _ => (5.0 * period, 4.0 * period, 2.0 * period),
        };
        let smooth = options.smoothing.unwrap_or(smooth);
        let samples = |seconds: f64, step: f64| ((seconds / step).round() as usize).max(1);
        let stride = samples(0.002, period);
        let step = period * stride as f64;
        Self {
            period,
            smooth: samples(smooth, period).max(2),
            wide: samples(1.5 * smooth, period).max(4),
            stride,
            kernel: samples(kernel, step).max(2),
            every: samples(every, step),
            held: rate >= 400.0,
        }
    }

    /// Grid step, s.
    pub fn step(&self) -> f64 {
        self.period * self.stride as f64
    }
}

// Half widths tried on fast logs, s.
const WIDTHS: [f64; 5] = [0.006, 0.008, 0.012, 0.016, 0.024];
// Largest noise of the smoothed velocity, as a share of the top speed.
const VELOCITY_NOISE: f64 = 2e-4;

// The narrowest half width that keeps the noise of every joint's velocity small against its speed.
fn narrowest(runs: &[Run], period: f64) -> f64 {
    let quiet = |seconds: f64, run: &Run| {
        let positions = run.signals.iter().filter(|s| s.quantity == Quantity::MotorPosition);
        positions.into_iter().all(|signal| {
            let w = seconds / period;
            // σ ‖ḣ‖
            let noise = instrument_noise(signal) * 1.9 / (w * w.sqrt() * period);
            let slopes = signal.values.windows(2).zip(run.time.windows(2));
            let top = slopes.map(|(x, t)| ((x[1] - x[0]) / (t[1] - t[0])).abs()).fold(0.0, f64::max);
            noise <= VELOCITY_NOISE * top
        })
    };
    let fits = |seconds: &&f64| runs.iter().all(|run| quiet(**seconds, run));
    *WIDTHS.iter().find(fits).unwrap_or(&WIDTHS[WIDTHS.len() - 1])
}
