//! Slow changes that passed for torque noise.
//!
//! Torque noise is white: means of it over n samples are √n times smaller. Behind a coarse encoder a filter may take what it does
//! not explain for much noise, under which everything is white, and what depends on more than the motion, as the friction of a
//! joint that grows warm, is foretold by no feature of it.

use sinew_effect::Sensor;

use crate::explore::Explored;
use crate::record::Channel;
use crate::residual::Segment;
use crate::search::Search;

// Seconds over which means are taken, and the fewest of them that tell.
const OVER: f64 = 0.25;
const FEWEST: f64 = 16.0;
// Times the noise of its readings above which a joint's torque noise is much.
const MUCH: f64 = 3.0;
// Times the variance that white noise would leave in them above which means change slowly, and the least share of the squared
// error that they hold.
const SLOW: f64 = 4.0;
const SHARE: f64 = 0.3;

/// True if what is left of the torque of a joint that moves changes slowly and passed for noise.
pub(crate) fn passes_for_noise(search: &Search, explored: &Explored) -> bool {
    let (Some(reference), Some(last)) = (&explored.state.reference, explored.rungs.last()) else {
        return false;
    };
    let told = search.yardstick();
    let layout = told.problem.form.layout();
    let is_slow = |(dof, noise): (usize, &f64)| {
        let torque = Channel { sensor: Sensor::MotorTorque, dof };
        let Some(c) = layout.channels.iter().position(|c| *c == torque) else { return false };
        let read = told.records.iter().map(|record| record.noise[c]).fold(0.0, f64::max);
        let of_run = |segment: &Segment| {
            let scales = &told.records[segment.record].scales;
            let all = segment.first..segment.first + segment.len;
            let rows = all.filter(|&k| layout.keep[k]).map(|k| last.residual[k]).collect();
            Series { apart: scales.step() * scales.every as f64, rows }
        };
        let runs = || layout.of_channel(c).map(of_run).collect::<Vec<Series>>();
        *noise > MUCH * read && change_slowly(&runs(), noise * noise * layout.period)
    };
    search.sensors.moving().zip(&reference.torque_noise).any(is_slow)
}

// The rows of a channel in a run that count, so many seconds apart.
struct Series {
    apart: f64,
    rows: Vec<f64>,
}

// True if means of rows are larger than those of white noise of this density, and hold a good part of the error.
//
//   ⟨m²⟩ > 4 ⟨density/T⟩,   ⟨m²⟩ > 0.3 ⟨r²⟩
fn change_slowly(runs: &[Series], density: f64) -> bool {
    let [mut means, mut white, mut count, mut squares, mut rows] = [0.0f64; 5];
    for run in runs {
        let together = (OVER / run.apart).ceil().max(1.0);
        squares += run.rows.iter().map(|r| r * r).sum::<f64>();
        rows += run.rows.len() as f64;
        for part in run.rows.chunks_exact(together as usize) {
            means += (part.iter().sum::<f64>() / together).powi(2);
            white += density / (together * run.apart);
            count += 1.0;
        }
    }
    count >= FEWEST && means > SLOW * white && means / count > SHARE * squares / rows
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;

    // Rows 0.01 s apart of noise of unit variance, so of a density of 0.01, and a slow wave beside it.
    #[test]
    fn white_noise_does_not_change_slowly() {
        let mut random = SmallRng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let noise: Vec<f64> = (0..4000).map(|_| normal()).collect();
        let run = |wave: f64, count: usize| {
            let rows = (0..count).map(|k| wave * (0.01 * k as f64).sin() + noise[k]).collect();
            [Series { apart: 0.01, rows }]
        };
        assert!(!change_slowly(&run(0.0, 4000), 0.01));
        assert!(change_slowly(&run(1.0, 4000), 0.01));
        // Means of 25 rows of the wave have a variance of 1/2, those of the noise of 1/25; noise of four times the size may leave it.
        assert!(!change_slowly(&run(1.0, 4000), 0.16));
        // A wave that holds little of the error, and too few means to tell.
        assert!(!change_slowly(&run(0.6, 4000), 0.01));
        assert!(!change_slowly(&run(1.0, 300), 0.01));
    }
}
