//! Motion that occurs twice: inside a run or in two runs.

use crate::checks::wording::number;
use crate::quantity::Quantity;
use crate::resample::{Uniform, resample};
use crate::run::Run;
use crate::statistics::{extremes, rms, std};

/// Points of the coarse search per run.
const POINTS: f64 = 1000.0;
/// Two positions are the same if they differ by less than this share of the standard deviation of the motion.
const SAME: f64 = 0.03;
/// A repeat lasts at least this long, s, and this share of the shorter run.
const SHORTEST: f64 = 1.0;
const SHARE: f64 = 0.2;
/// Positions whose motion is below this share of the largest one do not count.
const MOVES: f64 = 0.01;
/// How far from the true lag the longest coarse match may lie, coarse steps.
const REACH: usize = 4;
/// What a sample that does not match costs, in samples that do.
const PENALTY: f64 = 4.0;

/// A stretch of motion that occurs twice.
///
/// Whoever fits the one and checks on the other has checked on nothing unseen. The difference of the other signals
/// in the two stretches is the scatter from run to run, the best noise floor there is.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeat {
    /// Number of the run of the first stretch.
    pub first: usize,
    /// Number of the run of the second stretch; the same number for a repeat inside one run.
    pub second: usize,
    /// Begin of the first stretch, s after the first time stamp of its run.
    pub first_from: f64,
    /// Begin of the second stretch, s after the first time stamp of its run.
    pub second_from: f64,
    /// Length of the stretch, s.
    pub duration: f64,
    /// Root mean square difference of the positions in units of their standard deviation.
    pub difference: f64,
}

impl Repeat {
    /// Time from a sample of the first stretch to the same sample of the second, each s after the first time stamp
    /// of its run. Inside one run: the time after which the motion repeats.
    pub fn lag(&self) -> f64 {
        self.second_from - self.first_from
    }

    /// The sentence that says so, without the first run's name: "the motion of 4 s from 0 s occurs again from 6.5 s".
    ///
    /// # Panics
    /// If `runs` is shorter than what [`find_repeats`] was given.
    pub fn statement(&self, runs: &[Run]) -> String {
        let [from, to, length] = [self.first_from, self.second_from, self.duration].map(number);
        let other =
            if self.first == self.second { String::new() } else { format!(" in {}", runs[self.second].name) };
        format!("the motion of {length} s from {from} s occurs again{other} from {to} s")
    }

    /// Second minus first occurrence of a signal, at the samples of the first: divided by √2 its root mean square
    /// is the scatter of one run.
    ///
    /// `None` if the signal is missing in one of the runs. `runs` is what [`find_repeats`] was given.
    ///
    /// # Panics
    /// If `runs` is shorter than it was.
    pub fn scatter(&self, runs: &[Run], quantity: Quantity, place: &str) -> Option<Vec<f64>> {
        let (a, b) = (&runs[self.first], &runs[self.second]);
        let (x, y) = (a.signal(quantity, place)?, b.signal(quantity, place)?);
        let grid = |run: &Run, from: f64| {
            let step = a.period();
            Uniform { start: run.time[0] + from, step, len: (self.duration / step + 5e-7) as usize + 1 }
        };
        let x = resample(&a.time, &x.values, &grid(a, self.first_from));
        let y = resample(&b.time, &y.values, &grid(b, self.second_from));
        Some(y.iter().zip(&x).map(|(y, x)| y - x).collect())
    }
}

/// The longest repeat inside each run, and between each two runs, by their positions.
///
/// All positions that both have must repeat together, by value, within 3 % of the standard deviation of their
/// motion, for at least a second and a fifth of the shorter run. Standing still is no repeat.
///
/// # Example
/// The motion occurs again after 4 s:
/// ```
/// use sinew_data::{Quantity, Run, Signal, find_repeats};
/// let time: Vec<f64> = (0..800).map(|k| 0.01 * f64::from(k)).collect();
/// let motion = |t: f64| (7.0 * t).sin() + t * (4.0 - t);
/// let q = time.iter().map(|t| motion(t % 4.0)).collect();
/// let run = Run::new("log".into(), time, vec![Signal::new(Quantity::JointPosition, "elbow", q)]).unwrap();
/// let repeats = find_repeats(&[run]);
/// assert_eq!(repeats.len(), 1);
/// approx::assert_relative_eq!(repeats[0].lag(), 4.0, max_relative = 1e-3);
/// ```
pub fn find_repeats(runs: &[Run]) -> Vec<Repeat> {
    let pairs = (0..runs.len()).flat_map(|a| (a..runs.len()).map(move |b| (a, b)));
    pairs.filter_map(|(a, b)| Pair::new(runs, a, b)?.longest_repeat()).collect()
}

/// Two runs and the positions that both have, in units of their motion.
struct Pair<'a> {
    runs: [&'a Run; 2],
    numbers: [usize; 2],
    /// Signals of the two runs and the standard deviation of the motion.
    positions: Vec<([&'a [f64]; 2], f64)>,
}

/// A stretch of the coarse grid: shift of the second run against the first, first sample, length.
#[derive(Clone, Copy)]
struct Stretch {
    shift: isize,
    from: usize,
    len: usize,
}

impl<'a> Pair<'a> {
    fn new(runs: &'a [Run], a: usize, b: usize) -> Option<Pair<'a>> {
        let mut positions = Vec::new();
        for x in &runs[a].signals {
            let y = runs[b].signal(x.quantity, &x.place);
            let is_position = matches!(x.quantity, Quantity::MotorPosition | Quantity::JointPosition);
            if let (Some(y), true) = (y, is_position) {
                positions.push(([&x.values[..], &y.values[..]], std(&x.values).max(std(&y.values))));
            }
        }
        let largest = positions.iter().map(|p| p.1).fold(0.0, f64::max);
        positions.retain(|p| p.1 > MOVES * largest);
        let pair = Pair { runs: [&runs[a], &runs[b]], numbers: [a, b], positions };
        (!pair.positions.is_empty()).then_some(pair)
    }

    fn longest_repeat(&self) -> Option<Repeat> {
        let [a, b] = self.runs;
        let step = (a.duration().max(b.duration()) / POINTS).max(a.period()).max(b.period());
        let coarse = [0, 1].map(|side| self.scaled(side, &Uniform::within(&self.runs[side].time, step)));
        let shifts = if self.numbers[0] == self.numbers[1] {
            first_unlike_shift(&coarse[0])?..coarse[0][0].len() as isize
        } else {
            1 - coarse[0][0].len() as isize..coarse[1][0].len() as isize
        };
        let best = shifts.map(|shift| longest_match(&coarse, shift)).max_by_key(|stretch| stretch.len)?;
        let shorter = a.duration().min(b.duration());
        let long_enough = best.len > 2 * REACH && best.len as f64 * step >= SHORTEST.max(SHARE * shorter);
        if !long_enough || !moves(&coarse[0], best) {
            return None;
        }
        let (lag, difference) = self.refine(best, step);
        // Both stretches stay inside their runs.
        let first_from = (best.from as f64 * step).max(-lag);
        let second_from = first_from + lag;
        let longest = (a.duration() - first_from).min(b.duration() - second_from);
        (difference < SAME).then_some(Repeat {
            first: self.numbers[0],
            second: self.numbers[1],
            first_from,
            second_from,
            duration: ((best.len - 1) as f64 * step).min(longest),
            difference,
        })
    }

    /// All positions of one run on a grid, in units of their motion.
    fn scaled(&self, side: usize, grid: &Uniform) -> Vec<Vec<f64>> {
        let on_grid = |values| resample(&self.runs[side].time, values, grid);
        self.positions
            .iter()
            .map(|(values, scale)| on_grid(values[side]).iter().map(|x| x / scale).collect())
            .collect()
    }

    /// The lag near a coarse match at which the positions differ least, and by how much (golden section).
    fn refine(&self, stretch: Stretch, step: f64) -> (f64, f64) {
        // Shorter by REACH at either end, every lag tried stays inside both runs.
        let from = (stretch.from + REACH) as f64 * step;
        let first = Uniform { start: self.runs[0].time[0] + from, step, len: stretch.len - 2 * REACH };
        let x = self.scaled(0, &first);
        let difference = |lag: f64| {
            let second = Uniform { start: self.runs[1].time[0] + from + lag, ..first };
            let y = self.scaled(1, &second);
            rms(x.iter().flatten().zip(y.iter().flatten()).map(|(x, y)| x - y))
        };
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let reach = REACH as f64 * step;
        let middle = stretch.shift as f64 * step;
        let (mut low, mut high) = (middle - reach, middle + reach);
        while high - low > 1e-3 * step {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            if difference(left) < difference(right) { high = right } else { low = left }
        }
        let lag = 0.5 * (low + high);
        (lag, difference(lag))
    }
}

/// The first shift at which a run is unlike itself: mean square difference above a half (two for strangers).
fn first_unlike_shift(x: &[Vec<f64>]) -> Option<isize> {
    let n = x[0].len();
    let unlike = |shift: &usize| {
        let differences = x.iter().flat_map(|x| x.iter().zip(&x[*shift..]).map(|(a, b)| a - b));
        rms(differences).powi(2) > 0.5
    };
    (1..n).find(unlike).map(|shift| shift as isize)
}

/// The stretch of best score at one shift: every matching sample counts one, every other −4 (Kadane).
fn longest_match([x, y]: &[Vec<Vec<f64>>; 2], shift: isize) -> Stretch {
    let (from, to) = ((-shift).max(0), (x[0].len() as isize).min(y[0].len() as isize - shift));
    let mut best = (0.0, Stretch { shift, from: 0, len: 0 });
    let (mut score, mut begin) = (0.0, from);
    for k in from..to {
        let other = (k + shift) as usize;
        let matches = x.iter().zip(y).all(|(x, y)| {
            // Half a coarse step of motion is no difference.
            let moved = (x[(k as usize + 1).min(x.len() - 1)] - x[(k as usize).saturating_sub(1)]).abs();
            (x[k as usize] - y[other]).abs() < SAME + 0.5 * moved
        });
        score += if matches { 1.0 } else { -PENALTY };
        if score <= 0.0 {
            (score, begin) = (0.0, k + 1);
        } else if score > best.0 {
            best = (score, Stretch { shift, from: begin as usize, len: (k + 1 - begin) as usize });
        }
    }
    best.1
}

/// Whether the positions move in a stretch by at least their standard deviation.
fn moves(x: &[Vec<f64>], stretch: Stretch) -> bool {
    x.iter().any(|x| {
        let (low, high) = extremes(&x[stretch.from..stretch.from + stretch.len]);
        high - low > 1.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Signal;
    use crate::samples::white_noise;
    use approx::assert_relative_eq;

    fn run(duration: f64, motion: impl Fn(f64) -> f64, seed: u64) -> Run {
        let n = (duration / 0.004) as usize;
        let time: Vec<f64> = (0..n).map(|k| 17.0 + 0.004 * k as f64).collect();
        let noise = white_noise(n, seed);
        let q = time.iter().zip(&noise).map(|(t, n)| motion(t - 17.0) + 1e-3 * n).collect();
        let torque = time.iter().zip(&noise).map(|(t, n)| motion(t - 17.0) + 0.5 * n).collect();
        let signals = vec![
            Signal::new(Quantity::JointPosition, "elbow", q),
            Signal::new(Quantity::MotorTorque, "elbow", torque),
        ];
        Run::new("log".into(), time, signals).unwrap()
    }

    /// Multi-sine without a common period.
    fn wander(t: f64) -> f64 {
        (1.1 * t).sin() + 0.7 * (2.9 * t + 0.4).sin() + 0.5 * (0.37 * t).cos()
    }

    #[test]
    fn a_motion_without_repeat_has_none() {
        assert_eq!(find_repeats(&[run(30.0, wander, 1)]), []);
        assert_eq!(find_repeats(&[run(30.0, |_| 1.0, 1)]), []);
        assert_eq!(find_repeats(&[run(30.0, |t| t, 1)]), []);
    }

    #[test]
    fn a_command_run_twice_is_found_with_its_lag() {
        let repeats = find_repeats(&[run(25.0, |t| wander(t % 12.48), 2)]);
        assert_eq!(repeats.len(), 1);
        assert_relative_eq!(repeats[0].lag(), 12.48, epsilon = 2e-3);
        assert_relative_eq!(repeats[0].duration, 12.5, epsilon = 0.2);
    }

    #[test]
    fn two_runs_of_one_command_are_found_and_their_scatter_measured() {
        let runs =
            [run(20.0, wander, 3), run(26.0, |t| wander(t - 5.0), 4), run(20.0, |t| -wander(3.0 * t), 5)];
        let repeats = find_repeats(&runs);
        assert_eq!(repeats.len(), 1);
        assert_eq!((repeats[0].first, repeats[0].second), (0, 1));
        assert_relative_eq!(repeats[0].lag(), 5.0, epsilon = 2e-3);
        let scatter = repeats[0].scatter(&runs, Quantity::MotorTorque, "elbow").unwrap();
        assert_relative_eq!(rms(scatter) / 2f64.sqrt(), 0.5, max_relative = 0.05);
        assert_eq!(repeats[0].scatter(&runs, Quantity::Temperature, "elbow"), None);
    }

    #[test]
    fn resting_twice_is_no_repeat() {
        let rests = |t: f64| if (5.0..15.0).contains(&t) { wander(t) - wander(5.0) } else { 0.0 };
        assert_eq!(find_repeats(&[run(30.0, rests, 6)]), []);
    }
}
