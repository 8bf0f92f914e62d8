//! Time per call: the least and the median of many short samples.

use std::time::{Duration, Instant};

/// One sample is about this long, so that most escape the scheduler.
const SAMPLE: Duration = Duration::from_micros(300);
const FEWEST_SAMPLES: usize = 7;
const MOST_SAMPLES: usize = 200_000;
/// Time of one measurement where the environment states none, ms.
const BUDGET_MS: f64 = 60.0;

/// Calls `f` on the states 0 … `states` − 1 in turn until the budget is spent. Prints the least and the median time of
/// a call, divided by `per_call`.
pub fn time(
    robot: &str,
    algorithm: &str,
    library: &str,
    states: usize,
    per_call: usize,
    mut f: impl FnMut(usize),
) {
    if std::env::var("ONLY").is_ok_and(|only| !algorithm.contains(&only)) {
        return;
    }
    let budget = std::env::var("BUDGET_MS").ok().and_then(|ms| ms.parse().ok()).unwrap_or(BUDGET_MS);
    let budget = Duration::from_secs_f64(budget / 1e3);
    let mut sweep = |first: usize, run: usize| {
        let start = Instant::now();
        (first..first + run).for_each(&mut f);
        start.elapsed()
    };
    let once = (0..3).map(|_| sweep(0, states)).min().unwrap_or_default() / states as u32;
    let fitting = SAMPLE.as_nanos() / once.as_nanos().max(1);
    let run = (fitting as usize).clamp(4.min(states), states);
    let (mut samples, mut spent, mut first) = (Vec::new(), Duration::ZERO, 0);
    while (spent < budget && samples.len() < MOST_SAMPLES) || samples.len() < FEWEST_SAMPLES {
        if first + run > states {
            first = 0;
        }
        let time = sweep(first, run);
        first += run;
        spent += time;
        samples.push(time.as_nanos() as f64 / (run * per_call) as f64);
    }
    samples.sort_by(f64::total_cmp);
    println!("{robot},{algorithm},{library},{:.1},{:.1}", samples[0], samples[samples.len() / 2]);
}
