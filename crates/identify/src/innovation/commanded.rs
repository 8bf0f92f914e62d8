//! The acceleration that the logged torques give the motors, beside that of their motion.
//!
//! Torque noise that acts moves a motor: in what was measured of its acceleration is what the logged torque lacks, and an
//! inertia that is fitted to both comes out too small, a dead time too likely. The motion that the logged torques would make
//! without the noise knows nothing of it. Where the noise is the log's own, it is the other way round.
//!
//! ```text
//! logged u = c + n,   acting M θ̈ + f = c + w,   e = u − (M θ̈ + f) = n − w
//! ⟨(θ̈ + s G e) e⟩ = 0   for   s = 1 − ⟨Δ²u e⟩/⟨e²⟩,   Δ²u_r = u_r − 2u_{r−1} + u_{r−2}
//! ```
//!
//! with the command c, the noise of the log n, that which acts w, the acceleration G e by which the joints answer a torque, and means
//! u and e of rows. What the rows before do not foretell of u is noise of the log, or what a controller has made of w within the row.

use std::ops::Range;

use rayon::prelude::*;

use super::pass::Pass;
use crate::verdict::rms;

// Share of the top speed from which a joint moves: near rest e is of friction.
const MOVING: f64 = 0.05;
// Typical deviations of a normal variable beyond which e is no noise.
const FAR: f64 = 6.0;
// Time in which an answer is forgotten, s: what a controller makes of it later is in the log.
const FORGOTTEN: f64 = 0.1;
// Least share that acts, and least part of the square of the accelerating torque in a row, that are worth it.
const LEAST: f64 = 0.05;
const MATTERS: f64 = 0.005;

impl Pass<'_> {
    /// By how much the logged torques accelerate the motors more than they were accelerated, by run, joint and hold. Of what
    /// a model leaves the part that is noise: what else it leaves is no torque of which it knows the answer.
    pub(super) fn commanded(&self, noise: &[f64]) -> Vec<Vec<Vec<f64>>> {
        let own = self.form.own_noise(noise);
        let share = |joint: usize| self.acting(joint) * (own[joint] / noise[joint]).powi(2);
        let shares: Vec<f64> = (0..noise.len()).map(share).collect();
        (0..self.records.len()).into_par_iter().map(|run| self.answers(run, &shares)).collect()
    }

    /// True if torque noise acts in some joint and is not small in its rows.
    pub(super) fn noise_matters(&self, noise: &[f64]) -> bool {
        let own = self.form.own_noise(noise);
        let matters = |joint: usize| {
            own[joint].powi(2) > MATTERS * self.accelerating(joint) && self.acting(joint) > LEAST
        };
        (0..noise.len()).any(matters)
    }

    // The square of the torque that accelerates a joint, summed over a row.
    fn accelerating(&self, joint: usize) -> f64 {
        let dof = self.form.joints[joint].dof;
        let of_run = |run: usize| {
            let (record, system) = (&self.records[run], &self.systems[run]);
            let (every, h) = (record.scales.every, record.scales.period);
            // Near rest friction leaves less of it.
            let kick = (0..system.len()).map(|k| system.kick(joint, joint, k)).fold(0.0, f64::max);
            let mean = rms(record.rows(&record.thetadd[dof]).into_iter());
            every as f64 * (mean * h / kick).powi(2)
        };
        (0..self.records.len()).map(of_run).fold(0.0, f64::max)
    }

    // G s e: accelerations of the motors in answer to these shares of e, by joint and hold.
    fn answers(&self, run: usize, shares: &[f64]) -> Vec<Vec<f64>> {
        let (system, h) = (&self.systems[run], self.records[run].scales.period);
        let kept = (-h / FORGOTTEN).exp();
        let mut x = vec![[[0.0]; 4]; shares.len()];
        let (mut next, mut torques) = (x.clone(), vec![[[0.0]; 2]; shares.len()]);
        let mut answers = vec![Vec::with_capacity(system.len()); shares.len()];
        for k in 0..system.len() {
            for (joint, [motor, _]) in torques.iter_mut().enumerate() {
                *motor = [shares[joint] * self.input(run, joint, k).torque];
            }
            system.advance(0..shares.len(), k, |joint| &torques[joint], &x, &mut next);
            for (answer, (next, x)) in answers.iter_mut().zip(next.iter().zip(&x)) {
                answer.push((next[1][0] - x[1][0]) / h);
            }
            x.iter_mut().zip(&next).for_each(|(x, next)| *x = next.map(|[x]| [kept * x]));
        }
        answers
    }

    // s of a joint.
    fn acting(&self, joint: usize) -> f64 {
        let pairs: Vec<[f64; 2]> =
            (0..self.records.len()).flat_map(|run| self.foretold(run, joint)).collect();
        let mut sizes: Vec<f64> = pairs.iter().map(|[_, e]| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let Some(typical) = sizes.get(sizes.len() / 2) else { return 0.0 };
        let near = pairs.iter().filter(|[_, e]| e.abs() < FAR * typical);
        let (both, own) = near.fold((0.0, 0.0), |(both, own), [u, e]| (both + u * e, own + e * e));
        if own > 0.0 { (1.0 - both / own).clamp(0.0, 1.0) } else { 0.0 }
    }

    // Δ²u and e of every row, where a joint moves.
    fn foretold(&self, run: usize, joint: usize) -> Vec<[f64; 2]> {
        let record = &self.records[run];
        let channels = self.form.joints[joint];
        let every = record.scales.every;
        let (torque, speed) = (&self.form.runs[run].torque[channels.torque], &record.thetad[channels.dof]);
        let slow = MOVING * speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        // None where it does not move.
        let means = |holds: Range<usize>| {
            let mean = |of: &dyn Fn(usize) -> f64| holds.clone().map(of).sum::<f64>() / every as f64;
            let moves = speed[holds.clone()].iter().all(|v| v.abs() > slow);
            moves.then(|| [mean(&|k| torque[k]), mean(&|k| self.input(run, joint, k).torque)])
        };
        let rows = self.systems[run].len() / every;
        let means: Vec<Option<[f64; 2]>> =
            (0..rows).map(|row| means(row * every..(row + 1) * every)).collect();
        let of = |rows: &[Option<[f64; 2]>]| {
            let ([first, _], [before, _], [u, e]) = (rows[0]?, rows[1]?, rows[2]?);
            Some([u - 2.0 * before + first, e])
        };
        means.windows(3).filter_map(of).collect()
    }
}
