//! How large the torque noise of every joint is.

use std::ops::Range;

use rayon::prelude::*;

use super::Pass;
use super::kalman::Kalman;

impl Pass<'_> {
    /// Torque noise of every joint by maximum likelihood on samples that move, one after the other: each is searched
    /// from above with the others as they are; `before`: what the last pass found.
    pub(super) fn torque_noise(&self, before: Option<&[f64]>) -> Vec<f64> {
        let groups = self.form.groups();
        let found: Vec<Vec<f64>> = groups.into_par_iter().map(|group| self.noise_of(group, before)).collect();
        found.concat()
    }

    fn noise_of(&self, group: Range<usize>, before: Option<&[f64]>) -> Vec<f64> {
        let joints = self.form.joints.len();
        let used = LIKELIHOOD_SAMPLES / self.records.len();
        let runs = || 0..self.records.len();
        let mut noise = vec![0.0; joints];
        for joint in group.clone() {
            let (mut sum, mut count) = (0.0, 0.0f64);
            for run in runs() {
                for k in 0..used.min(self.records[run].len()) {
                    sum += self.input(run, joint, k).torque.powi(2);
                    count += 1.0;
                }
            }
            noise[joint] = (sum / count.max(1.0)).sqrt().max(1e-9);
        }
        let fastest = |run: usize, joint: usize| {
            let speed = &self.records[run].thetad[self.form.joints[joint].dof];
            MOVING * speed.iter().fold(0.0f64, |m, v| m.max(v.abs()))
        };
        let moving: Vec<Vec<f64>> =
            runs().map(|run| (0..joints).map(|joint| fastest(run, joint)).collect()).collect();
        let blocks = |noise: &[f64]| -> Vec<Blocks> {
            let mut blocks = vec![Blocks::default(); joints];
            for run in runs() {
                let record = &self.records[run];
                let step = record.scales.step();
                let settled = self.systems[run].led + (SETTLED / step) as usize;
                let of_block = ((NOISE_BLOCK / step) as usize).max(1);
                blocks.iter_mut().for_each(Blocks::begin);
                let kalman = Kalman { system: &self.systems[run], group: group.clone(), noise };
                let input = |joint, k| self.input(run, joint, k);
                kalman.misfit(settled + used, input, |joint, k, value| {
                    let speed = record.thetad[self.form.joints[joint].dof][k];
                    if k >= settled && speed.abs() > moving[run][joint] && !record.leaves_out(record.time[k])
                    {
                        blocks[joint].add(k / of_block, value);
                    }
                });
            }
            blocks
        };
        let sum = |blocks: &Vec<Blocks>| blocks.iter().map(Blocks::sum).sum::<f64>();
        let misfit = |noise: &[f64]| sum(&blocks(noise));
        // With another noise of one joint.
        let with = |noise: &[f64], joint: usize, x: f64| {
            let mut tried = noise.to_vec();
            tried[joint] = x;
            tried
        };
        // All of them together, then each by itself; a joint whose noise fell far may let that of the others fall.
        let together = |x: f64| -> Vec<f64> { noise.iter().map(|n| x * n).collect() };
        let is_alone = group.len() == 1;
        let (mut noise, sweeps) = match before {
            Some(before) if !is_alone && misfit(before) < misfit(&noise) => (before.to_vec(), 1),
            _ => (together(lowest(HIGHEST, |x| misfit(&together(x)))), if is_alone { 1 } else { SWEEPS }),
        };
        // A little more, as it is, and a little less of one joint.
        let about = |noise: &[f64], joint: usize| -> [Vec<Blocks>; 3] {
            let at = |factor: f64| blocks(&with(noise, joint, factor * noise[joint]));
            let (more, (here, less)) =
                rayon::join(|| at(RATIO), || rayon::join(|| at(1.0), || at(1.0 / RATIO)));
            [more, here, less]
        };
        for _ in 1..sweeps {
            for joint in group.clone() {
                let sums = about(&noise, joint).each_ref().map(sum);
                noise[joint] = lowest_about(noise[joint], sums, |x| misfit(&with(&noise, joint, x)));
            }
        }
        // Where the model is wrong now and then, all samples together make too much of it.
        let mut typical = vec![f64::INFINITY; joints];
        for joint in group.clone() {
            let near = about(&noise, joint);
            let of = |blocks: &Vec<Blocks>| blocks[joint].typical_change(&near[1][joint]);
            let value = |x: f64| of(&blocks(&with(&noise, joint, x)));
            typical[joint] = lowest_about(noise[joint], near.each_ref().map(of), value);
            if !is_alone {
                let value = |x: f64| misfit(&with(&noise, joint, x));
                noise[joint] = lowest_about(noise[joint], near.each_ref().map(sum), value);
            }
        }
        for joint in group.clone() {
            if typical[joint] < CLEARLY_LESS * noise[joint] {
                noise[joint] = typical[joint];
            }
        }
        noise[group].to_vec()
    }
}

// A sum by blocks of time.
#[derive(Debug, Clone, Default)]
struct Blocks {
    // Sum and count of each.
    sums: Vec<(f64, f64)>,
    first: usize,
}

impl Blocks {
    // Another run begins.
    fn begin(&mut self) {
        self.first = self.sums.len();
    }

    fn add(&mut self, block: usize, value: f64) {
        let block = self.first + block;
        if block >= self.sums.len() {
            self.sums.resize(block + 1, (0.0, 0.0));
        }
        self.sums[block].0 += value;
        self.sums[block].1 += 1.0;
    }

    fn sum(&self) -> f64 {
        self.sums.iter().map(|(sum, _)| sum).sum()
    }

    // By how much the sum would be another if all blocks had changed like the median one. Their levels differ by more than
    // their noise does, so that a median of these would be the likelihood of one block.
    fn typical_change(&self, from: &Self) -> f64 {
        let blocks = self.sums.iter().zip(&from.sums).filter(|((_, n), _)| *n > 0.0);
        let mut means: Vec<[f64; 2]> =
            blocks.map(|((sum, n), (before, _))| [(sum - before) / n, *n]).collect();
        means.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let count: f64 = means.iter().map(|[_, n]| n).sum();
        let mut before = 0.0;
        for [mean, n] in means {
            before += n;
            if before >= 0.5 * count {
                return count * mean;
            }
        }
        0.0
    }
}

// Share of the noise of all samples below which that of a typical block is no chance.
const CLEARLY_LESS: f64 = 0.8;
// Seconds of a block in which a noise is looked at.
const NOISE_BLOCK: f64 = 0.25;
// Samples of all runs that may count in the likelihood of a noise.
const LIKELIHOOD_SAMPLES: usize = 6000;
// A sample moves at this share of the top speed. Links whose springs were led are to be as certain again as they ever are:
// what came before expects more than is there, and would be better off with less noise.
const MOVING: f64 = 0.02;
const SETTLED: f64 = 0.2;
// Where the search begins, in units of what the model leaves; its grid; its end as a share of its start; times that the
// joints of one group are searched one by one.
const HIGHEST: f64 = 4.0;
const RATIO: f64 = 1.5;
const LOWEST: f64 = 1e-4;
const SWEEPS: usize = 2;

// The minimum next to `x`, by what is there and a step above and below it; where it is not between them, it is searched for.
fn lowest_about(x: f64, [above, here, below]: [f64; 3], misfit: impl Fn(f64) -> f64 + Sync) -> f64 {
    if here <= above && here <= below {
        vertex(x, [above, here, below])
    } else if below < here {
        lowest(x, misfit)
    } else {
        lowest(HIGHEST * x, misfit)
    }
}

// Where a parabola in ln x is lowest, by its values a step above x, at x and a step below it.
fn vertex(x: f64, [above, here, below]: [f64; 3]) -> f64 {
    let bend = above - 2.0 * here + below;
    let shift = if bend > 0.0 { (0.5 * (above - below) / bend).clamp(-1.0, 1.0) } else { 0.0 };
    x * RATIO.powf(-shift)
}

// The first minimum from `top` downwards, by a parabola in ln x. Two points are looked at side by side.
fn lowest(top: f64, misfit: impl Fn(f64) -> f64 + Sync) -> f64 {
    let (mut x, mut values) = (top, Vec::new());
    while x > LOWEST * top {
        let (here, next) = rayon::join(|| misfit(x), || misfit(x / RATIO));
        for value in [here, next] {
            values.push(value);
            let n = values.len();
            if n >= 3 && values[n - 1] > values[n - 2] {
                return vertex(x * RATIO, [values[n - 3], values[n - 2], values[n - 1]]);
            }
            x /= RATIO;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    // −2 ln L of a block of variance v under a noise x:  ln x² + v/x²,  least at x = √v.
    #[test]
    fn a_block_that_the_model_misses_does_not_set_the_noise() {
        let of = |typical: bool| {
            let blocks = |x: f64| {
                let mut blocks = Blocks::default();
                for (k, variance) in [4.0, 3.8, 900.0, 4.2, 4.1].into_iter().enumerate() {
                    // Sensors of other units have other levels.
                    blocks.add(k, (x * x).ln() + variance / (x * x) + 10.0 * k as f64);
                }
                blocks
            };
            lowest(40.0, |x| if typical { blocks(x).typical_change(&blocks(40.0)) } else { blocks(x).sum() })
        };
        assert!((of(true) / 2.02 - 1.0).abs() < 0.05 && of(false) > 10.0, "{} {}", of(true), of(false));
    }
}
