//! The filter of one joint by itself, over holds of some samples in which a torque on it stays.
//!
//! ```text
//! x̃ ← A x̃ + b δτ,   Σ e/√S = c x̃ + d δτ
//! ```

use rayon::prelude::*;

use sinew_effect::DIRECTIONS;

use super::filter::Filters;
use super::kalman::widest_form;
use super::system::SENSORS;

/// The filter of a joint, hold by hold, and what one of its sensors makes of it.
pub(crate) struct Held {
    holds: Vec<Hold>,
    // Holds of a row.
    in_row: usize,
}

// Factors of the four states and of the torque.
type Terms = [f64; TORQUE + 1];
const TORQUE: usize = 4;
// As many are followed at once.
const _: () = assert!(TORQUE < DIRECTIONS);

struct Hold {
    // A and b, state by state.
    next: [Terms; TORQUE],
    // c and d.
    sum: Terms,
}

impl Held {
    /// Of a sensor of a joint: torques act on the motor for its own encoder, on the link for what is behind the gear.
    /// `hold`: a divisor of the samples of a row.
    pub(super) fn new(filters: &Filters, joint: usize, sensor: usize, hold: usize) -> Self {
        let in_row = filters.every / hold;
        let count = filters.system.len() / filters.every * in_row;
        let share = 1.0 / (filters.every as f64).sqrt();
        // The deviation is one in each of its states in turn, then zero under a torque of one.
        let of_one = |one: usize| std::array::from_fn(|w| f64::from(u8::from(w == one)));
        let states: [[f64; DIRECTIONS]; TORQUE] = std::array::from_fn(of_one);
        let (torque, none) = (of_one(TORQUE), [0.0; DIRECTIONS]);
        let torques = if sensor == 0 { [torque, none] } else { [none, torque] };
        let terms = |of: [f64; DIRECTIONS]| -> Terms { std::array::from_fn(|w| of[w]) };
        let of = |number: usize| {
            let (mut x, mut sums) = (states, [[0.0; DIRECTIONS]; SENSORS]);
            let samples = number * hold..(number + 1) * hold;
            filters.follow_alone(joint, samples, &torques, &mut x, &mut sums);
            Hold { next: x.map(terms), sum: terms(sums[sensor].map(|sum| share * sum)) }
        };
        Self { holds: (0..count).into_par_iter().map(of).collect(), in_row }
    }

    /// Rows that each of several torques gives, told hold by hold.
    pub fn rows(&self, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut out = Vec::with_capacity(series.len());
        for part in series.chunks(DIRECTIONS) {
            let torque = |k: usize| std::array::from_fn(|w| part.get(w).map_or(0.0, |s| s[k]));
            let torques: Vec<[f64; DIRECTIONS]> = (0..self.holds.len()).map(torque).collect();
            let rows = rows(&self.holds, self.in_row, &torques);
            out.extend((0..part.len()).map(|w| rows.iter().map(|row| row[w]).collect()));
        }
        out
    }
}

widest_form! {
    fn rows<const W: usize>(holds: &[Hold], in_row: usize, torques: &[[f64; W]]) -> Vec<[f64; W]> {
        let mut x = [[0.0; W]; 4];
        let mut rows = Vec::with_capacity(holds.len() / in_row);
        for (holds, torques) in holds.chunks_exact(in_row).zip(torques.chunks_exact(in_row)) {
            let mut sum = [0.0; W];
            for (hold, torque) in holds.iter().zip(torques) {
                let before = x;
                add_terms(&mut sum, &hold.sum, &before, torque);
                x = [[0.0; W]; 4];
                x.iter_mut().zip(&hold.next).for_each(|(x, terms)| add_terms(x, terms, &before, torque));
            }
            rows.push(sum);
        }
        rows
    }
}

// sum ← sum + c x̃ + d δτ.  One loop over the sets goes round all of it: separate loops do not end in full registers.
#[inline(always)]
fn add_terms<const W: usize>(sum: &mut [f64; W], terms: &Terms, x: &[[f64; W]; 4], torque: &[f64; W]) {
    for w in 0..W {
        let of_state = terms[0] * x[0][w] + terms[1] * x[1][w] + terms[2] * x[2][w] + terms[3] * x[3][w];
        sum[w] += of_state + terms[TORQUE] * torque[w];
    }
}
