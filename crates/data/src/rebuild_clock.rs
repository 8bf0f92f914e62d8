//! A log that was polled by another clock than the robot's: the true clock from positions and velocities.

use crate::checks::pairs;
use crate::run::{Run, Signal};
use crate::statistics::median;
use crate::{Note, Severity};

/// The run with its clock rebuilt from how far the joints moved between rows, and a note of what was changed; none
/// without logged velocities, or if the joints never move enough to tell.
///
/// The controller of the robot ticks evenly; a log that is polled repeats some ticks and skips others, under stamps of
/// the poll. Between two rows the joints have moved for a whole number n of ticks T:
///
/// ```text
/// Δt = Σ w v̄ Δq / Σ w v̄²,   n = round(Δt / T),   v̄: mean logged velocity of both rows, w = 1/σ_q²
/// ```
///
/// Rows with n = 0 repeat a tick and are left out. Where the joints hardly move the stamps decide.
///
/// # Example
/// ```
/// use sinew_data::{Quantity, Run, Signal, rebuild_clock};
/// // q = sin 2t at ticks of 1 ms, of which the log repeats the fifth and skips the ninth.
/// let ticks: Vec<f64> = (0..400).filter(|k| *k != 9).flat_map(|k| vec![k; if k == 5 { 2 } else { 1 }]).map(f64::from).collect();
/// let q = ticks.iter().map(|k| (2e-3 * k).sin()).collect();
/// let qd = ticks.iter().map(|k| 2.0 * (2e-3 * k).cos()).collect();
/// let stamps = (0..ticks.len()).map(|k| 1e-3 * k as f64).collect();
/// let signals = vec![
///     Signal::new(Quantity::JointPosition, "elbow", q),
///     Signal::new(Quantity::JointVelocity, "elbow", qd),
/// ];
/// let run = Run::new("log".into(), stamps, signals)?;
/// let (rebuilt, _) = rebuild_clock(&run).expect("the joint moves");
/// assert_eq!(rebuilt.time.len(), 399);
/// assert!((rebuilt.time[8] - 0.008).abs() < 1e-7 && (rebuilt.time[9] - 0.010).abs() < 1e-7);
/// # Ok::<(), sinew_data::DataError>(())
/// ```
pub fn rebuild_clock(run: &Run) -> Option<(Run, Note)> {
    let pairs = weighed(run);
    let steps: Vec<Option<f64>> = (1..run.time.len()).map(|k| motion_time(&pairs, k, run.period())).collect();
    let tick = tick(&steps, run.period())?;
    let mut time = vec![run.time[0]];
    let mut kept = vec![0];
    let (mut repeated, mut skipped) = (0, 0);
    for (k, step) in steps.iter().enumerate() {
        let stamps = run.time[k + 1] - run.time[k];
        let same = run.signals.iter().all(|s| s.values[k] == s.values[k + 1]);
        let ticks = match step {
            _ if same => 0.0,
            Some(dt) => (dt / tick).round().max(0.0),
            None => (stamps / tick).round().max(1.0),
        };
        if ticks == 0.0 {
            repeated += 1;
            continue;
        }
        skipped += usize::from(ticks > 1.0);
        time.push(time[time.len() - 1] + ticks * tick);
        kept.push(k + 1);
    }
    let rows = run.time.len();
    let drift = time[time.len() - 1] - run.time[kept[kept.len() - 1]];
    let statement = format!(
        "clock rebuilt from the logged velocities: ticks of {:.4} ms, {repeated} of {rows} rows repeat a tick and are left \
         out, {skipped} steps skip some; at the end {:.1} ms from the stamps",
        1e3 * tick,
        1e3 * drift
    );
    let note = Note {
        severity: Severity::Note,
        place: run.name.clone(),
        statement,
        help: "log the time stamps of the controller, not those of the reader".into(),
    };
    let mut rebuilt = run.clone();
    rebuilt.keep(&kept);
    rebuilt.time = time;
    Some((rebuilt, note))
}

// Position and velocity of a joint with the weight 1/σ² of a step of the position.
struct Pair<'a> {
    q: &'a [f64],
    qd: &'a [f64],
    weight: f64,
}

impl Pair<'_> {
    fn speed(&self, k: usize) -> f64 {
        0.5 * (self.qd[k - 1] + self.qd[k])
    }
    fn step(&self, k: usize) -> f64 {
        self.q[k] - self.q[k - 1]
    }
}

// Every joint's pair, weighed by the noise of a step: what whole sample periods leave of it, whichever their number.
fn weighed(run: &Run) -> Vec<Pair<'_>> {
    pairs(run).into_iter().map(|signals| weighed_pair(run, signals)).collect()
}

fn weighed_pair<'a>(run: &Run, [q, qd]: [&'a Signal; 2]) -> Pair<'a> {
    let period = run.period();
    let mut pair = Pair { q: &q.values, qd: &qd.values, weight: 1.0 };
    let left = |k: usize| {
        let (speed, step) = (pair.speed(k), pair.step(k));
        let ticks = if speed == 0.0 { 1.0 } else { (step / (speed * period)).round().clamp(0.0, 3.0) };
        (step - ticks * speed * period).abs()
    };
    let noise = (1.4826 * median((1..run.time.len()).map(left).collect())).max(1e-12);
    pair.weight = 1.0 / (noise * noise);
    pair
}

// Standard deviations of the time that must fit into half a sample period.
const SURE: f64 = 3.0;

// Time that the joints have moved for before row k; none if they move too little to tell.
fn motion_time(pairs: &[Pair], k: usize, period: f64) -> Option<f64> {
    let (mut top, mut bottom) = (0.0, 0.0);
    for pair in pairs {
        let speed = pair.speed(k);
        top += pair.weight * speed * pair.step(k);
        bottom += pair.weight * speed * speed;
    }
    let uncertain = 1.0 / bottom.sqrt();
    (bottom > 0.0 && SURE * uncertain < 0.5 * period).then(|| top / bottom)
}

// Fewest steps from which a tick can be told.
const FEWEST: usize = 50;

// The time of which the steps are whole multiples, near the sample period.
fn tick(steps: &[Option<f64>], period: f64) -> Option<f64> {
    let near = |t: f64| steps.iter().flatten().copied().filter(move |dt| (dt / t - 1.0).abs() < 0.3);
    let mut single: Vec<f64> = near(period).collect();
    if single.len() < FEWEST {
        return None;
    }
    single.sort_by(f64::total_cmp);
    Some(single[single.len() / 2])
}
