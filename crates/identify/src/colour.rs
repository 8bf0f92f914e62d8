//! The noise of the residual rows: how large, how coloured, and the filter that makes it white.
//!
//! The colour is computed, not fitted: white noise of a sensor through the kernels h and φ, and noise of the imposed
//! position through kernels and model. Only the scale is taken from data, from what a saturated regression leaves.

use rayon::prelude::*;

use sinew_data::{Smoother, autocovariance};
use sinew_plant::Plant;

use crate::least_squares::{Ridge, column, cross, matrix};
use crate::record::{Record, is_within};
use crate::residual::{Layout, ResidualForm};
use crate::verdict::rms;

/// Noise of one channel.
#[derive(Debug, Clone)]
pub(crate) struct ChannelNoise {
    /// Standard deviation of a row away from reversals.
    pub scale: f64,
    /// How much reversals add: σ = scale √(1 + κ W²).
    pub kappa: f64,
    /// Autoregression of the rows.
    pub ar: Vec<f64>,
    /// Standard deviation of the innovation of rows in units of `scale`.
    pub innovation: f64,
    /// The reachable floor of the root mean square: the largest of resolution, instrument, saturated remainder and what
    /// differs between two times of one motion.
    pub floor: f64,
}

/// The filter that turns rows into white noise of unit variance.
#[derive(Debug, Clone)]
pub(crate) struct Whitener {
    pub channels: Vec<ChannelNoise>,
}

// Order of the autoregression; the kernels reach over five rows.
const ORDER: usize = 6;
// Realisations of the position noise.
const SHAKES: u64 = 3;
// Share of white noise added to the computed colour: no colour is known better.
const WHITE_SHARE: f64 = 0.02;
// κ of channels other than motor torque.
const POSITION_KAPPA: f64 = 60.0;
// Times what is left of a channel beyond which its noise was read wrong; a fit leaves a little less than the noise.
const CLEARLY_MORE: f64 = 1.3;
// Largest share of the rows' freedom that the saturated regression may use.
const MOST_FREEDOM: f64 = 0.4;

impl Whitener {
    /// Whitened rows; rows that do not count and the first of each segment become zero.
    pub fn apply(&self, layout: &Layout, rows: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; rows.len()];
        for segment in &layout.segments {
            let noise = &self.channels[segment.channel];
            let order = noise.ar.len();
            let scaled: Vec<f64> = (segment.first..segment.first + segment.len)
                .map(|k| {
                    let sigma = noise.scale * (1.0 + noise.kappa * layout.reversal[k].powi(2)).sqrt();
                    if layout.keep[k] { rows[k] / sigma } else { 0.0 }
                })
                .collect();
            for k in order..segment.len {
                if layout.keep[segment.first + k] {
                    // e_k − Σ a_i e_{k−i}
                    let predicted: f64 = (1..=order).map(|i| noise.ar[i - 1] * scaled[k - i]).sum();
                    out[segment.first + k] = (scaled[k] - predicted) / noise.innovation;
                }
            }
        }
        out
    }

    /// The reachable floor of every channel.
    pub fn floors(&self) -> Vec<f64> {
        self.channels.iter().map(|c| c.floor).collect()
    }

    /// Whitened columns.
    pub fn apply_all<C: AsRef<[f64]>>(&self, layout: &Layout, columns: &[C]) -> Vec<Vec<f64>> {
        columns.iter().map(|c| self.apply(layout, c.as_ref())).collect()
    }

    /// The noise of every channel of a model whose rows, columns and generic predictors are given.
    pub fn estimate(
        form: &dyn ResidualForm,
        records: &[Record],
        plant: &Plant,
        p: &[f64],
        residual: &[f64],
        columns: &[&[f64]],
        seed: u64,
    ) -> Self {
        let layout = form.layout();
        if form.is_white() {
            let of = |c| white_noise(layout, c, &saturated(layout, c, residual, columns));
            return Self { channels: (0..layout.channels.len()).into_par_iter().map(of).collect() };
        }
        let seeds: Vec<u64> = (0..SHAKES).map(|s| seed.wrapping_mul(31).wrapping_add(s * 7919)).collect();
        let shakes = form.position_noise(plant, p, &seeds);
        let channels = (0..layout.channels.len())
            .into_par_iter()
            .map(|c| {
                let left = saturated(layout, c, residual, columns);
                let rms_error = rms(rows_of(layout, c).map(|k| residual[k]));
                let read = instrument_floor(records, c);
                // A drive's torque that jitters looks like noise from sample to sample, and the model explains it.
                let instrument = if read > CLEARLY_MORE * rms_error { rms_error } else { read };
                let encoder = mean_covariance(layout, c, &shakes);
                let mut noise = channel_noise(layout, c, &left, instrument, &encoder, &records[0]);
                noise.floor = noise.floor.max(repeat_scatter(layout, records, c, residual));
                noise
            })
            .collect();
        Self { channels }
    }
}

// Noise of rows that a filter has made white, of unit variance or more.
fn white_noise(layout: &Layout, c: usize, left: &[f64]) -> ChannelNoise {
    let rows: Vec<usize> = rows_of(layout, c).collect();
    let scale = robust_std(left).max(1.0);
    let torque = layout.channels[c].signal() == "motor_torque";
    let kappa = if torque { reversal_kappa(layout, &rows, left, scale) } else { 0.0 };
    ChannelNoise {
        scale,
        kappa,
        ar: Vec::new(),
        innovation: 1.0,
        floor: rms(left.iter().copied()).max(scale),
    }
}

fn channel_noise(
    layout: &Layout,
    c: usize,
    left: &[f64],
    instrument: f64,
    encoder: &[f64],
    record: &Record,
) -> ChannelNoise {
    let rows: Vec<usize> = rows_of(layout, c).collect();
    let quiet: Vec<f64> =
        rows.iter().zip(left).filter(|(k, _)| layout.reversal[**k] < 0.02).map(|(_, e)| *e).collect();
    let sample = if quiet.len() > rows.len() / 4 { &quiet } else { left };
    let scale = robust_std(sample).max(instrument).max(encoder[0].sqrt()).max(1e-12);
    let torque = layout.channels[c].signal() == "motor_torque";
    let kappa = if torque { reversal_kappa(layout, &rows, left, scale) } else { POSITION_KAPPA };
    // c(τ) = σ_w² ρ_g(τ) + c_encoder(τ), of variance scale²
    let white = white_covariance(record);
    let share = (scale * scale - encoder[0]).max(0.05 * scale * scale) / white[0];
    let mut covariance: Vec<f64> = (0..=ORDER).map(|m| share * white[m] + encoder[m]).collect();
    covariance[0] *= 1.0 + WHITE_SHARE;
    let (ar, innovation) = autoregression(&covariance);
    // Reversals, where no law is sure, belong to what noise leaves.
    let mut noise =
        ChannelNoise { scale, kappa, ar, innovation, floor: rms(left.iter().copied()).max(scale) };
    // The whitened remainder of the saturated regression has unit scale.
    let mut full = vec![0.0; layout.len];
    for (k, e) in rows.iter().zip(left) {
        full[*k] = *e;
    }
    let mut channels = vec![noise.clone(); layout.channels.len()];
    channels[c] = noise.clone();
    let whitened = Whitener { channels }.apply(layout, &full);
    let values: Vec<f64> = rows.iter().map(|&k| whitened[k]).filter(|x| *x != 0.0).collect();
    let unit = robust_std(&values);
    if unit > 0.0 {
        noise.innovation *= unit.max(0.5);
    }
    noise
}

pub(crate) fn rows_of(layout: &Layout, channel: usize) -> impl Iterator<Item = usize> {
    layout.of_channel(channel).flat_map(|s| s.first..s.first + s.len).filter(|&k| layout.keep[k])
}

// κ = max(0, Σ(e²/s² − 1) W² / Σ W⁴) over reversals
fn reversal_kappa(layout: &Layout, rows: &[usize], left: &[f64], scale: f64) -> f64 {
    let (mut top, mut bottom) = (0.0, 0.0);
    for (&k, e) in rows.iter().zip(left) {
        let w = layout.reversal[k];
        if w > 0.03 {
            top += ((e / scale).powi(2) - 1.0) * w * w;
            bottom += w.powi(4);
        }
    }
    if bottom > 0.0 { (top / bottom).max(0.0) } else { 0.0 }
}

/// What is left of a channel when everything that could be meant is fitted at once, corrected for its freedom.
fn saturated(layout: &Layout, c: usize, residual: &[f64], columns: &[&[f64]]) -> Vec<f64> {
    let rows: Vec<usize> = rows_of(layout, c).collect();
    let y: Vec<f64> = rows.iter().map(|&k| residual[k]).collect();
    let mut x: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let mut v: Vec<f64> = rows.iter().map(|&k| column[k]).collect();
        let norm = v.iter().map(|a| a * a).sum::<f64>().sqrt();
        if norm > 0.0 && norm.is_finite() {
            v.iter_mut().for_each(|a| *a /= norm);
            x.push(v);
        }
    }
    if x.is_empty() || rows.len() < 10 {
        return y;
    }
    let x = matrix(y.len(), &x);
    let right = cross(&x, &column(&y));
    let right: Vec<f64> = (0..x.ncols()).map(|i| right[(i, 0)]).collect();
    let Some(ridge) = Ridge::new(cross(&x, &x), right) else { return y };
    let n = rows.len() as f64;
    let mut lambda = 1e-8;
    while ridge.freedom(lambda) > MOST_FREEDOM * n && lambda < 1e3 {
        lambda *= 3.0;
    }
    let correction = (n / (n - ridge.freedom(lambda)).max(0.1 * n)).sqrt();
    let Some(b) = ridge.coefficients(lambda) else { return y };
    (0..rows.len())
        .map(|k| {
            let fitted: f64 = (0..b.len()).map(|j| x[(k, j)] * b[j]).sum();
            (y[k] - fitted) * correction
        })
        .collect()
}

// Raw sensor noise through h and φ; averaged over runs.
fn instrument_floor(records: &[Record], c: usize) -> f64 {
    let sum: f64 = records.iter().map(|r| (r.noise[c]).powi(2) * white_covariance(r)[0]).sum();
    (sum / records.len() as f64).sqrt()
}

// Scatter of a channel between two times of the same motion, whose model error is the same; zero where none occurs twice.
//
// σ = √(mean (r₂ − r₁)²/2)
fn repeat_scatter(layout: &Layout, records: &[Record], c: usize, residual: &[f64]) -> f64 {
    let segment = |record: usize| layout.of_channel(c).find(|s| s.record == record);
    let pairs = records.iter().enumerate().flat_map(|(r, record)| {
        let twice =
            record.repeats.iter().filter_map(move |again| Some((again, segment(r)?, segment(again.record)?)));
        twice.flat_map(move |(again, one, other)| {
            let rows = (0..one.len).filter(|&k| is_within(record.stamp(k), again.window));
            rows.filter_map(|k| {
                let later = records[again.record].row_at(record.stamp(k) + again.lag)?;
                (later < other.len).then_some([one.first + k, other.first + later])
            })
        })
    });
    let counted = pairs.filter(|rows| rows.iter().all(|&k| layout.keep[k]));
    let squares: Vec<f64> = counted.map(|[one, other]| (residual[other] - residual[one]).powi(2)).collect();
    if squares.len() < FEWEST_PAIRS {
        return 0.0;
    }
    (0.5 * squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

// Pairs of rows from which a scatter is taken.
const FEWEST_PAIRS: usize = 40;

// Autocovariance, at row lags, of unit white noise in parts of a sample period through h and φ.
fn white_covariance(record: &Record) -> Vec<f64> {
    let s = &record.scales;
    let h = Smoother::new(s.smooth, s.part());
    let phi = record.kernel();
    let mut g = vec![0.0; h.weights().len() + (phi.weights().len() - 1) * s.stride];
    for (i, f) in phi.weights().iter().enumerate() {
        for (j, w) in h.weights().iter().enumerate() {
            g[i * s.stride + j] += f * w;
        }
    }
    let lag = s.every * s.stride;
    (0..=ORDER).map(|m| g.iter().zip(g.iter().skip(m * lag)).map(|(a, b)| a * b).sum()).collect()
}

fn mean_covariance(layout: &Layout, c: usize, shakes: &[Vec<f64>]) -> Vec<f64> {
    let mut mean = vec![0.0; ORDER + 1];
    let mut count = 0.0;
    for shake in shakes {
        for segment in layout.of_channel(c) {
            let rows = &shake[segment.first..segment.first + segment.len];
            for (sum, value) in mean.iter_mut().zip(autocovariance(rows, ORDER)) {
                *sum += value * segment.len as f64;
            }
            count += segment.len as f64;
        }
    }
    mean.iter_mut().for_each(|x| *x /= f64::max(count, 1.0));
    mean
}

/// Yule–Walker by Levinson's recursion: coefficients, and innovation by standard deviation.
fn autoregression(covariance: &[f64]) -> (Vec<f64>, f64) {
    let mut a: Vec<f64> = Vec::new();
    let mut error = covariance[0];
    for m in 1..covariance.len() {
        let predicted: f64 = a.iter().enumerate().map(|(i, ai)| ai * covariance[m - 1 - i]).sum();
        let k = (covariance[m] - predicted) / error;
        let mirrored: Vec<f64> = a.iter().rev().copied().collect();
        for (ai, mi) in a.iter_mut().zip(mirrored) {
            *ai -= k * mi;
        }
        a.push(k);
        error *= 1.0 - k * k;
    }
    (a, (error / covariance[0]).max(1e-6).sqrt())
}

/// 1.4826 median |x|: the standard deviation of normal numbers whose outliers do not count.
pub(crate) fn robust_std(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    sizes.sort_by(f64::total_cmp);
    1.4826 * sizes[sizes.len() / 2]
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Run, Signal};
    use sinew_model::{Robot, samples};

    use super::*;
    use crate::Options;
    use crate::comparison::Prepared;

    // 1 in the first half, −1 in the second, and what both have besides.
    #[test]
    fn what_differs_between_two_times_of_a_motion_is_its_scatter() {
        let robot = Robot::rigid(samples::planar_arm(1, 2.0, 0.5));
        let time: Vec<f64> = (0..3200).map(|k| 5.0 + 2.5e-3 * f64::from(k)).collect();
        let motion = |t: f64| (7.0 * t).sin() + t * (4.0 - t);
        let q: Vec<f64> = time.iter().map(|t| motion((t - 5.0) % 4.0)).collect();
        let signal = |quantity| Signal::new(quantity, "joint_1", q.clone());
        let signals = vec![signal(Quantity::MotorPosition), signal(Quantity::MotorTorque)];
        let run = Run::new("twice".to_owned(), time, signals).unwrap();
        let prepared = Prepared::new(&robot, &[run], &Options::default()).unwrap();
        let form = prepared.form(&robot);
        let (layout, records) = (form.layout(), &prepared.records);
        let stamp = |k: usize| records[0].stamp(k) - 9.0;
        let rows: Vec<f64> =
            (0..layout.len).map(|k| motion((stamp(k) + 4.0) % 4.0) - stamp(k).signum()).collect();
        let scatter = repeat_scatter(layout, records, 0, &rows);
        assert!((scatter - 2f64.sqrt()).abs() < 0.05, "{scatter}");
        let alone = Record { repeats: Vec::new(), ..records[0].clone() };
        assert_eq!(repeat_scatter(layout, &[alone], 0, &rows), 0.0);
    }

    #[test]
    fn an_autoregression_of_first_order_is_found() {
        // c(τ) = 0.6^τ
        let covariance: Vec<f64> = (0..5).map(|m| 0.6f64.powi(m)).collect();
        let (a, innovation) = autoregression(&covariance);
        assert!((a[0] - 0.6).abs() < 1e-12 && a[1..].iter().all(|x| x.abs() < 1e-12));
        assert!((innovation - (1.0 - 0.36f64).sqrt()).abs() < 1e-12);
    }
}
