//! Prints what a diagnosis costs by the length of the log: one run of Fourier motion at 1 kHz, an effect hidden in it or
//! nothing.
//!
//! ```text
//! cargo run --release -p sinew-tests --example cost -- 1|2|6[-rigid] EFFECT|nothing SECONDS...
//! ```

use std::time::Instant;

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, diagnose};
use sinew_tests::{Arm, Case, Conditions, Outside, hidden_effects, measure_for};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arm = args.first().and_then(|a| Arm::named(a));
    let lengths: Option<Vec<f64>> = args.iter().skip(2).map(|a| a.parse().ok()).collect();
    let (Some(arm), Some(effect), Some(lengths)) = (arm, args.get(1), lengths) else {
        return eprintln!("usage: cost 1|2|6[-rigid] EFFECT|nothing SECONDS...");
    };
    println!(
        "| log, s | verdict | by the clock, s | processor, s | most memory, MB |\n|---|---|---|---|---|"
    );
    for seconds in lengths {
        if let Err(error) = timed(&arm, effect, seconds) {
            return eprintln!("{seconds} s: {error}");
        }
    }
}

fn timed(arm: &Arm, effect: &str, seconds: f64) -> Result<(), Outside> {
    let all = hidden_effects(arm, 0, 1.0);
    let hidden: Vec<_> = all.iter().filter(|h| h.effect == effect).collect();
    if hidden.is_empty() && effect != "nothing" {
        return Err(format!("{effect}: not in the suite").into());
    }
    let case = Case::new(arm, &hidden, Conditions::FULL, SEED);
    let runs = measure_for(arm, &case, seconds)?;
    let (start, before) = (Instant::now(), processor_seconds());
    let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default())?;
    let (clock, processor) = (start.elapsed().as_secs_f64(), processor_seconds() - before);
    let first = diagnosis.accepted.first().map_or(String::new(), |a| format!(": {}@{}", a.effect, a.place));
    println!(
        "| {seconds} | {}{first} | {clock:.1} | {processor:.1} | {:.0} |",
        diagnosis.verdict,
        most_memory()
    );
    Ok(())
}

// Any seed serves; this one is no case of the suite's figures.
const SEED: u64 = 900;

// Ticks of a second in what the kernel tells of a process.
const TICKS: f64 = 100.0;

// Time of all threads so far; NaN where the system does not tell.
fn processor_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = told.rsplit(')').next().unwrap_or_default();
    let ticks = |field: usize| after_name.split_whitespace().nth(field)?.parse::<f64>().ok();
    ticks(11).zip(ticks(12)).map_or(f64::NAN, |(user, system)| (user + system) / TICKS)
}

// The most memory that the process has held so far, MB; NaN where the system does not tell.
fn most_memory() -> f64 {
    let told = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = told.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kb| kb / 1e3)
}
