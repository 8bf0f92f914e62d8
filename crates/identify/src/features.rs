//! The generic predictor's inputs: random features of the motion, without any physics.
//!
//! Source: Rahimi & Recht, *Random features for large-scale kernel machines*, NIPS 2007.

use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use sinew_effect::DIRECTIONS;

use crate::record::{Channel, Record};
use crate::residual::Layout;

// Widths of the stop operators that give the features a memory, rad.
const STOPS: [f64; 3] = [0.004, 0.03, 0.2];
// Inverse length scales of the features, in standard deviations of their inputs.
const SCALES: [f64; 4] = [0.7, 1.5, 3.0, 6.0];

/// `count` random features, one column each over all rows: cos(ωᵀx + b) of one to three standardised inputs of the
/// row's joint, every second one times tanh(θ̇/0.02).
pub(crate) fn random_features(records: &[Record], layout: &Layout, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![0.0; layout.len]; count];
    for (c, channel) in layout.channels.iter().enumerate() {
        let inputs: Vec<Vec<Vec<f64>>> = records.iter().map(|r| inputs(r, channel)).collect();
        let standard = standardisation(&inputs);
        let mut random = SmallRng::seed_from_u64(seed.wrapping_add(channel.dof as u64 * 977));
        let drawn: Vec<Feature> = (0..count).map(|f| Feature::draw(&mut random, f, standard.len())).collect();
        for segment in layout.of_channel(c) {
            let (record, x) = (&records[segment.record], &inputs[segment.record]);
            let x: Vec<Vec<f64>> = x.iter().map(|series| record.held(series)).collect();
            let speed = record.held(&record.thetad[channel.dof]);
            let generic = record.generic(c);
            let jobs = columns.par_chunks_mut(DIRECTIONS).zip(drawn.par_chunks(DIRECTIONS));
            jobs.for_each(|(columns, drawn)| {
                let series: Vec<Vec<f64>> = drawn.iter().map(|f| f.along(&x, &standard, &speed)).collect();
                for (column, rows) in columns.iter_mut().zip(generic.rows(&series)) {
                    column[segment.first..segment.first + segment.len].copy_from_slice(&rows);
                }
            });
        }
    }
    columns
}

// cos(ωᵀx + b), or that times tanh(θ̇/0.02).
struct Feature {
    picked: Vec<(usize, f64)>,
    phase: f64,
    signed: bool,
}

impl Feature {
    fn draw(random: &mut SmallRng, number: usize, inputs: usize) -> Self {
        let terms = random.random_range(1..=3usize);
        let scale = SCALES[random.random_range(0..SCALES.len())];
        let picked = (0..terms)
            .map(|_| (random.random_range(0..inputs), scale * (2.0 * random.random::<f64>() - 1.0)))
            .collect();
        let phase = random.random::<f64>() * std::f64::consts::TAU;
        Self { picked, phase, signed: number % 2 == 1 }
    }

    // Hold by hold.
    fn along(&self, x: &[Vec<f64>], standard: &[(f64, f64)], speed: &[f64]) -> Vec<f64> {
        let at = |(k, speed): (usize, &f64)| {
            let argument: f64 =
                self.picked.iter().map(|&(i, w)| w * (x[i][k] - standard[i].0) / standard[i].1).sum();
            (argument + self.phase).cos() * if self.signed { (speed / 0.02).tanh() } else { 1.0 }
        };
        speed.iter().enumerate().map(at).collect()
    }
}

/// The inputs of a channel's features along a run.
fn inputs(record: &Record, channel: &Channel) -> Vec<Vec<f64>> {
    let dof = channel.dof;
    let (theta, thetad) = (&record.theta[dof], &record.thetad[dof]);
    let lag = ((0.06 / record.scales.step()).round() as usize).max(1);
    let mut all = vec![
        theta.clone(),
        thetad.clone(),
        thetad.iter().map(|v| (v / 0.03).tanh()).collect(),
        record.thetadd[dof].clone(),
        (0..theta.len()).map(|k| thetad[k.saturating_sub(lag)]).collect(),
        thetad.iter().map(|v| (v.abs() + 1e-3).ln()).collect(),
    ];
    all.extend(STOPS.iter().map(|&width| stop(theta, width)));
    let neighbours = [dof.checked_sub(1), Some(dof + 1).filter(|d| *d < record.theta.len())];
    for other in neighbours.into_iter().flatten() {
        all.push(record.theta[other].clone());
        all.push(record.thetad[other].clone());
    }
    all
}

// z ← clamp(z + Δθ, ± width): friction's memory
fn stop(theta: &[f64], width: f64) -> Vec<f64> {
    let mut z: f64 = 0.0;
    let mut last = theta[0];
    theta
        .iter()
        .map(|&x| {
            z = (z + x - last).clamp(-width, width);
            last = x;
            z
        })
        .collect()
}

// Mean and standard deviation of each input over all runs.
fn standardisation(inputs: &[Vec<Vec<f64>>]) -> Vec<(f64, f64)> {
    (0..inputs[0].len())
        .map(|i| {
            let n: f64 = inputs.iter().map(|run| run[i].len() as f64).sum();
            let mean = inputs.iter().flat_map(|run| &run[i]).sum::<f64>() / n;
            let square = inputs.iter().flat_map(|run| &run[i]).map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            (mean, square.sqrt().max(1e-12))
        })
        .collect()
}
