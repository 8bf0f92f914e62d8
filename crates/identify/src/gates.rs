//! The evidence for a candidate, and the gates it must pass.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::Options;
use crate::colour::rows_of;
use crate::residual::Layout;

/// What speaks for a candidate against the model without it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Evidence {
    /// Fall of the squared whitened residual.
    pub data: f64,
    /// Fall of the priors' misfit.
    pub tension: f64,
    /// The fall by its block-robust spread.
    pub z: f64,
    /// Fall on held-out blocks, strengths fitted without them.
    pub held_out: f64,
    /// The same without the two best blocks.
    pub trimmed: f64,
    /// Largest share explained of a channel, in its standard deviation.
    pub share: f64,
    /// The channel that the candidate explains most of.
    pub channel: usize,
    /// Largest share of a channel's squared error explained.
    pub explained: f64,
    /// Largest share of a channel's unit noise variance explained.
    pub material: f64,
    /// Mean square of the whitened residual with the candidate, at least one.
    pub temper: f64,
    /// Number of new parameters.
    pub parameters: usize,
}

/// Whitened residuals of two models on the same rows, with the raw ones.
pub(crate) struct Pair<'a> {
    pub before: &'a [f64],
    pub after: &'a [f64],
    pub raw_before: &'a [f64],
    pub raw_after: &'a [f64],
}

impl Evidence {
    pub fn of(
        layout: &Layout,
        pair: &Pair,
        tension: f64,
        parameters: usize,
        held_out: &[f64],
        channel_std: &[f64],
    ) -> Self {
        let (data, spread) = fall(layout, pair.before, pair.after);
        let mut sorted = held_out.to_vec();
        sorted.sort_by(f64::total_cmp);
        let cv: f64 = sorted.iter().sum();
        let best: f64 = sorted.iter().rev().take(2).sum();
        let (mut share, mut channel) = (0.0f64, 0);
        let mut material: f64 = 0.0;
        let mut explained: f64 = 0.0;
        let (mut worst, mut touched) = (1.0f64, false);
        for c in 0..layout.channels.len() {
            let (raw, white) = (
                mean_fall(layout, c, pair.raw_before, pair.raw_after),
                mean_fall(layout, c, pair.before, pair.after),
            );
            share = share.max(raw.max(0.0).sqrt() / channel_std[c].max(1e-300));
            material = material.max(white);
            let part = raw / mean_square(layout, c, pair.raw_before).max(1e-300);
            if part > explained {
                (explained, channel) = (part, c);
            }
            if white > 0.01 {
                let remaining = mean_square(layout, c, pair.after);
                worst = if touched { worst.max(remaining) } else { remaining.max(1.0) };
                touched = true;
            }
        }
        Self {
            data,
            tension,
            z: data / (2.0 * spread.sqrt() + 2.0),
            held_out: cv,
            trimmed: cv - best,
            share,
            channel,
            explained: explained.max(0.0),
            material,
            temper: worst.max(1.0),
            parameters,
        }
    }

    /// ln of the chance of such a fall without an effect, times the number of candidates tried.
    pub fn ln_chance(&self, trials: usize) -> f64 {
        let x = (self.data + self.tension) / self.temper;
        if x <= 0.0 {
            return 0.0;
        }
        let k = self.parameters.max(1) as f64;
        let tail = ChiSquared::new(k).map_or(1.0, |d| d.sf(x));
        // Beyond the range of numbers: ln P ≈ −x/2 + (k/2 − 1) ln(x/2)
        let ln_tail = if tail > 1e-290 { tail.ln() } else { -x / 2.0 + (k / 2.0 - 1.0) * (x / 2.0).ln() };
        ln_tail + (trials.max(1) as f64).ln()
    }

    /// True if the prior's relief carries the candidate rather than the residual.
    pub fn by_tension(&self) -> bool {
        self.tension > 12.0 && self.data > -0.5 * self.tension
    }

    /// True if the candidate promises the residual less than the priors.
    pub fn is_relief(&self) -> bool {
        self.by_tension() && self.data < self.tension
    }

    /// True if all that speaks for another candidate, of the residual and of the priors, speaks for this one with no more
    /// parameters.
    pub fn includes(&self, other: &Self) -> bool {
        self.data >= other.data && self.tension >= other.tension && self.parameters <= other.parameters
    }

    /// The gate that refuses the candidate, in words; none if it passes.
    pub fn refused(&self, options: &Options, trials: usize) -> Option<String> {
        let chance = self.ln_chance(trials);
        if chance > 0.01f64.ln() {
            return Some(format!("could be chance (p = {:.2} after {trials} trials)", chance.exp().min(1.0)));
        }
        if self.by_tension() && self.tension / self.temper > 12.0 && self.z < options.least_z {
            return None;
        }
        if self.z < options.least_z {
            return Some(format!("z = {:.1} is below {}", self.z, options.least_z));
        }
        if self.held_out <= 0.0 {
            return Some("blocks left out get worse".to_owned());
        }
        if self.trimmed <= 0.0 {
            return Some("rests on two blocks".to_owned());
        }
        if self.material < 0.03 {
            return Some(format!("explains {:.1} % of the noise variance only", 100.0 * self.material));
        }
        if self.share < options.material_share {
            return Some(format!("explains {:.2} % of the signal only", 100.0 * self.share));
        }
        None
    }
}

/// Fall of the squared residual, and the block-robust variance of half of it.
pub(crate) fn fall(layout: &Layout, before: &[f64], after: &[f64]) -> (f64, f64) {
    let mut square = vec![(0.0, 0.0, 0.0); layout.blocks];
    let mut data = 0.0;
    for k in 0..layout.len {
        let (a, b) = (before[k], after[k]);
        if a == 0.0 && b == 0.0 {
            continue;
        }
        data += a * a - b * b;
        let block = &mut square[layout.block[k]];
        block.0 += b * b;
        block.1 += 1.0;
        block.2 += (a - b) * (a - b);
    }
    let spread = square.iter().map(|(sum, n, change)| change * (sum / f64::max(*n, 1.0)).max(0.3)).sum();
    (data, spread)
}

/// z of one model against another on the same rows.
pub(crate) fn z_between(layout: &Layout, worse: &[f64], better: &[f64]) -> f64 {
    let (data, spread) = fall(layout, worse, better);
    data / (2.0 * spread.sqrt() + 2.0)
}

/// Mean square of the rows of a channel.
pub(crate) fn mean_square(layout: &Layout, c: usize, rows: &[f64]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0f64);
    for k in rows_of(layout, c) {
        sum += rows[k] * rows[k];
        n += 1.0;
    }
    sum / n.max(1.0)
}

fn mean_fall(layout: &Layout, c: usize, before: &[f64], after: &[f64]) -> f64 {
    mean_square(layout, c, before) - mean_square(layout, c, after)
}

/// Whether two candidates change the whitened residual alike: |cos| of their changes is 0.3 and more, which it is not in
/// different joints.
pub(crate) fn overlap(before: &[f64], a: &[f64], b: &[f64]) -> bool {
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0f64);
    for k in 0..before.len() {
        let (x, y) = (before[k] - a[k], before[k] - b[k]);
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    ab.abs() >= OVERLAP * (aa * bb).sqrt().max(1e-300)
}

const OVERLAP: f64 = 0.3;
