//! How large the torque noise of every joint is.

use std::ops::Range;

use rayon::prelude::*;

use super::kalman::Kalman;
use super::pass::Pass;

impl Pass<'_> {
    /// Torque noise of every joint by maximum likelihood on samples that move, of each with the others as they are, from
    /// above; `before`: what the last pass found.
    pub(super) fn torque_noise(&self, before: Option<&[f64]>) -> Vec<f64> {
        let groups = self.groups();
        let found: Vec<Vec<f64>> =
            groups.into_par_iter().map(|group| Likelihood::new(self, group).noise(before)).collect();
        found.concat()
    }
}

// The likelihood of the noise of a group of joints and hinges.
struct Likelihood<'a> {
    pass: &'a Pass<'a>,
    group: Range<usize>,
    // Speeds above which a joint moves, by run.
    moving: Vec<Vec<f64>>,
}

impl<'a> Likelihood<'a> {
    fn new(pass: &'a Pass<'a>, group: Range<usize>) -> Self {
        let fastest = |run: usize, dof: usize| {
            MOVING * pass.records[run].thetad[dof].iter().fold(0.0f64, |m, v| m.max(v.abs()))
        };
        let of_run = |run| pass.form.joints.iter().map(|joint| fastest(run, joint.dof)).collect();
        Self { pass, group, moving: (0..pass.records.len()).map(of_run).collect() }
    }

    // Those of the group that have noise.
    fn joints(&self) -> Range<usize> {
        self.pass.form.joints_of(&self.group)
    }

    // Samples of each run that may count.
    fn used(&self) -> usize {
        LIKELIHOOD_SAMPLES / self.pass.records.len()
    }

    // What the model leaves of the torque of a joint, by its root mean square.
    fn left(&self, joint: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0f64);
        for (run, record) in self.pass.records.iter().enumerate() {
            for k in 0..self.used().min(record.len()) {
                sum += self.pass.input(run, joint, k).torque.powi(2);
                count += 1.0;
            }
        }
        (sum / count.max(1.0)).sqrt().max(1e-9)
    }

    // −2 log likelihood by joint.
    fn blocks(&self, noise: &[f64]) -> Vec<Blocks> {
        let runs = 0..self.pass.records.len();
        let of_runs: Vec<Vec<Blocks>> = runs.into_par_iter().map(|run| self.blocks_of(run, noise)).collect();
        let mut blocks = vec![Blocks::default(); self.pass.form.joints.len()];
        for of_run in of_runs {
            blocks.iter_mut().zip(of_run).for_each(|(all, own)| all.0.extend(own.0));
        }
        blocks
    }

    // The same of one run.
    fn blocks_of(&self, run: usize, noise: &[f64]) -> Vec<Blocks> {
        let pass = self.pass;
        let (record, system) = (&pass.records[run], &pass.systems[run]);
        let step = record.scales.step();
        let settled = system.led + (SETTLED / step) as usize;
        let of_block = ((NOISE_BLOCK / step) as usize).max(1);
        let kalman = Kalman { system, group: self.group.clone(), noise };
        let input = |joint, k| pass.input(run, joint, k);
        let mut blocks = vec![Blocks::default(); pass.form.joints.len()];
        kalman.misfit(settled + self.used(), input, |joint, k, told| {
            let speed = record.thetad[pass.form.joints[joint].dof][k];
            if k >= settled && speed.abs() > self.moving[run][joint] && !record.leaves_out(record.time[k]) {
                blocks[joint].add(k / of_block, told.misfit);
            }
        });
        blocks
    }

    fn misfit(&self, noise: &[f64]) -> f64 {
        sum(&self.blocks(noise))
    }

    // All of them together, then each by itself; a joint whose noise fell far may let that of the others fall.
    fn noise(&self, before: Option<&[f64]>) -> Vec<f64> {
        let mut left = vec![0.0; self.pass.form.joints.len()];
        self.joints().for_each(|joint| left[joint] = self.left(joint));
        let together = |x: f64| -> Vec<f64> { left.iter().map(|n| x * n).collect() };
        let is_alone = self.joints().len() == 1;
        let kept = before.filter(|_| !is_alone).and_then(|before| {
            let (here, of_left) = rayon::join(|| self.blocks(before), || self.misfit(&left));
            (sum(&here) < of_left).then(|| (before.to_vec(), here))
        });
        let (noise, here) = kept.unwrap_or_else(|| {
            let mut noise = together(lowest(HIGHEST, |x| self.misfit(&together(x))));
            for _ in 1..if is_alone { 1 } else { SWEEPS } {
                let found = self.each(&noise, &self.blocks(&noise), |near| near.lowest(sum));
                noise[self.joints()].copy_from_slice(&found);
            }
            let here = self.blocks(&noise);
            (noise, here)
        });
        // Where the model is wrong now and then, all samples together make too much of it.
        self.each(&noise, &here, |near| {
            let all = if is_alone { noise[near.joint] } else { near.lowest(sum) };
            let typical = near.lowest(|b| b[near.joint].typical_change(&near.here[near.joint]));
            if typical < CLEARLY_LESS * all { typical } else { all }
        })
    }

    // What is found of the noise of each joint of the group with those of the others as they are; `here`: the likelihood there.
    fn each(&self, noise: &[f64], here: &[Blocks], found: impl Fn(Near) -> f64 + Sync) -> Vec<f64> {
        let of_joint = |joint: usize| {
            let (more, less) =
                rayon::join(|| self.with(noise, joint, RATIO), || self.with(noise, joint, 1.0 / RATIO));
            found(Near { likelihood: self, noise, joint, more, here, less })
        };
        self.joints().into_par_iter().map(of_joint).collect()
    }

    // With so many times the noise of one joint.
    fn with(&self, noise: &[f64], joint: usize, times: f64) -> Vec<Blocks> {
        let mut tried = noise.to_vec();
        tried[joint] *= times;
        self.blocks(&tried)
    }
}

// A little more noise of one joint, as it is, and a little less.
struct Near<'a> {
    likelihood: &'a Likelihood<'a>,
    noise: &'a [f64],
    joint: usize,
    more: Vec<Blocks>,
    here: &'a [Blocks],
    less: Vec<Blocks>,
}

impl Near<'_> {
    // The noise of the joint at the minimum next to it.
    fn lowest(&self, of: impl Fn(&[Blocks]) -> f64 + Sync) -> f64 {
        let near = [&*self.more, self.here, &*self.less].map(&of);
        self.noise[self.joint]
            * lowest_about(near, |times| of(&self.likelihood.with(self.noise, self.joint, times)))
    }
}

fn sum(blocks: &[Blocks]) -> f64 {
    blocks.iter().map(Blocks::sum).sum()
}

// A sum by blocks of time: sum and count of each.
#[derive(Debug, Clone, Default)]
struct Blocks(Vec<(f64, f64)>);

impl Blocks {
    fn add(&mut self, block: usize, value: f64) {
        if block >= self.0.len() {
            self.0.resize(block + 1, (0.0, 0.0));
        }
        self.0[block].0 += value;
        self.0[block].1 += 1.0;
    }

    fn sum(&self) -> f64 {
        self.0.iter().map(|(sum, _)| sum).sum()
    }

    // By how much the sum would be another if all blocks had changed like the median one. Their levels differ by more than
    // their noise does, so that a median of these would be the likelihood of one block.
    fn typical_change(&self, from: &Self) -> f64 {
        let blocks = self.0.iter().zip(&from.0).filter(|((_, n), _)| *n > 0.0);
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

// The minimum next to one, by what is there and a step above and below it; where it is not between them, it is searched for.
fn lowest_about([above, here, below]: [f64; 3], misfit: impl Fn(f64) -> f64 + Sync) -> f64 {
    if here <= above && here <= below {
        vertex(1.0, [above, here, below])
    } else if below < here {
        lowest(1.0, misfit)
    } else {
        lowest(HIGHEST, misfit)
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
