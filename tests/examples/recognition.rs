//! Prints the recognition table: every effect hidden in turn, and nothing hidden.
//!
//! ```text
//! cargo run --release -p sinew-tests --example recognition -- [effects [FIRST_SEED [SEEDS]] | nothing [FIRST_SEED [CASES]]]
//! ```

use rayon::prelude::*;

use sinew_identify::{Options, Verdict};
use sinew_tests::{Arm, Case, Outcome, confusion, hidden_effects, judge, null_case, one_joint, two_joints};

// Contribution, in units of filtered noise, from which the residual itself shows an effect.
const SEEN: f64 = 0.1;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| args.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let what = args.first().map_or("all", String::as_str);
    let only = args.get(3);
    if what != "nothing" {
        effects(number(1, 0), number(2, 3), only);
    }
    if what != "effects" {
        nothing(number(1, 0), number(2, 60));
    }
}

fn effects(first: u64, seeds: u64, only: Option<&String>) {
    let mut all = Vec::new();
    for arm in [one_joint(), two_joints()] {
        let mut cases = Vec::new();
        for seed in first..first + seeds {
            let dof = seed as usize % arm.robot.model.nv;
            for hidden in hidden_effects(&arm, dof) {
                if only.is_none_or(|o| hidden.effect == o || arm.robot.model.name == *o) {
                    cases.push(Case::new(&arm, Some(&hidden), seed));
                }
            }
        }
        let outcomes = run(&arm, &cases);
        let right = outcomes.iter().zip(&cases).filter(|(o, c)| c.is_right(o)).count();
        let extra =
            outcomes.iter().zip(&cases).filter(|(o, c)| c.is_right(o) && o.accepted.len() > 1).count();
        println!(
            "{}: right effect at the right joint first {right} of {}, {extra} of them with an extra effect",
            arm.robot.model.name,
            cases.len()
        );
        let right = cases.iter().zip(&outcomes).filter(|(c, o)| c.is_right(o));
        let (seen, stated): (Vec<_>, Vec<_>) = right.partition(|(_, o)| o.contribution >= SEEN);
        let least = seen.iter().min_by(|a, b| a.1.contribution.total_cmp(&b.1.contribution));
        if let Some((case, outcome)) = least {
            println!(
                "  smallest contribution of {} seen in the residual: rho {:.1} of {:?}, seed {}; {} only against their tolerance",
                seen.len(),
                outcome.contribution,
                case.hidden,
                case.seed,
                stated.len()
            );
        }
        for (case, outcome) in cases.iter().zip(&outcomes) {
            if !case.is_right(outcome) || outcome.accepted.len() > 1 {
                println!(
                    "  seed {} {:?} → {} {:?} rivals {:?}",
                    case.seed, case.hidden, outcome.verdict, outcome.accepted, outcome.rivals
                );
            }
        }
        all.extend(outcomes);
    }
    for (hidden, row) in confusion(&all) {
        let named: Vec<String> = row.iter().map(|(name, count)| format!("{name} {count}")).collect();
        println!("{hidden:32} {}", named.join(", "));
    }
}

fn nothing(first: u64, count: u64) {
    for (arm, share) in [(one_joint(), count - count / 2), (two_joints(), count / 2)] {
        let cases: Vec<Case> = (first..first + share).map(|seed| null_case(&arm, 100_000 + seed)).collect();
        let outcomes = run(&arm, &cases);
        let alarms = outcomes.iter().filter(|o| o.verdict != Verdict::Adequate).count();
        println!("{}: nothing hidden, {alarms} alarms in {share}", arm.robot.model.name);
        for (case, outcome) in cases.iter().zip(&outcomes).filter(|(_, o)| o.verdict != Verdict::Adequate) {
            println!("  seed {} → {} {:?}", case.seed, outcome.verdict, outcome.accepted);
        }
    }
}

fn run(arm: &Arm, cases: &[Case]) -> Vec<Outcome> {
    let options = Options::default();
    cases
        .par_iter()
        .map(|case| match judge(arm, case, &options) {
            Ok((outcome, _)) => outcome,
            // A case that fails is a miss.
            Err(error) => {
                eprintln!("seed {} {:?}: {error}", case.seed, case.hidden);
                Outcome {
                    hidden: case.hidden.clone(),
                    verdict: Verdict::Undecidable,
                    first: None,
                    contribution: 0.0,
                    accepted: Vec::new(),
                    rivals: Vec::new(),
                }
            }
        })
        .collect()
}
