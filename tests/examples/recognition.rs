//! Prints the recognition tables: effects hidden in turn, and nothing hidden.
//!
//! ```text
//! cargo run --release -p sinew-tests --example recognition -- effects|nothing [KEY=VALUE…]
//!     seeds=FIRST..END   arms=1,2,6   sensors=full,motor   encoders=fine,coarse   sizes=1,0.3   only=EFFECT
//! ```

use rayon::prelude::*;

use sinew_identify::{Options, Verdict};
use sinew_tests::{Arm, Case, Conditions, Outcome, confusion, hidden_effects, judge, null_case};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let part = args.first().map_or("effects", String::as_str);
    match (part, Population::asked(args.get(1..).unwrap_or_default())) {
        ("effects", Some(population)) => effects(&population),
        ("nothing", Some(population)) => nothing(&population),
        _ => eprintln!(
            "usage: recognition effects|nothing [seeds=0..3] [arms=1,2,6] [sensors=full,motor] [encoders=fine,coarse] [sizes=1] [only=EFFECT]"
        ),
    }
}

// What is drawn: every combination of these.
struct Population {
    seeds: std::ops::Range<u64>,
    arms: Vec<Arm>,
    conditions: Vec<(String, Conditions)>,
    sizes: Vec<f64>,
    only: Option<String>,
}

impl Population {
    fn asked(args: &[String]) -> Option<Self> {
        let word = |key: &str| args.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
        let words = |key: &str, default: &'static str| -> Vec<String> {
            word(key).unwrap_or(default).split(',').map(str::to_owned).collect()
        };
        if args.iter().any(|a| !a.contains('=')) {
            return None;
        }
        let (first, end) = word("seeds").unwrap_or("0..3").split_once("..")?;
        let arms =
            words("arms", "1,2").iter().map(|n| Arm::of_joints(n.parse().ok()?)).collect::<Option<_>>()?;
        let mut conditions = Vec::new();
        for sensors in words("sensors", "full") {
            for encoder in words("encoders", "fine") {
                conditions.push((format!("{sensors} {encoder}"), Conditions::named(&sensors, &encoder)?));
            }
        }
        Some(Self {
            seeds: first.parse().ok()?..end.parse().ok()?,
            arms,
            conditions,
            sizes: words("sizes", "1").iter().map(|s| s.parse().ok()).collect::<Option<_>>()?,
            only: word("only").map(str::to_owned),
        })
    }

    // Cases of one arm and one set of sensors.
    fn cases(&self, arm: &Arm, conditions: Conditions) -> Vec<Case> {
        let mut cases = Vec::new();
        for seed in self.seeds.clone() {
            let dof = seed as usize % arm.robot.model.nv;
            for &size in &self.sizes {
                let all = hidden_effects(arm, dof, size).into_iter();
                let seen = all.filter(|h| conditions.link_encoders || !h.needs_link_encoder());
                let wanted = seen.filter(|h| self.only.as_ref().is_none_or(|o| h.effect == o));
                cases.extend(wanted.map(|h| Case::new(arm, Some(&h), conditions, seed)));
            }
        }
        cases
    }
}

// Contribution in units of filtered noise: below it the right answer may be "adequate", and above it in two strata.
const STRATA: [(f64, &str); 4] = [(0.0, "rho < 0.3"), (0.3, "0.3-1"), (1.0, "1-3"), (3.0, "> 3")];

fn stratum(contribution: f64) -> usize {
    STRATA.iter().rposition(|(least, _)| contribution >= *least).unwrap_or(0)
}

fn effects(population: &Population) {
    let mut all = Vec::new();
    let mut strata = [(0, 0, 0); STRATA.len()];
    for arm in &population.arms {
        for (name, conditions) in &population.conditions {
            let cases = population.cases(arm, *conditions);
            let outcomes = run(arm, &cases);
            let right = outcomes.iter().zip(&cases).filter(|(o, c)| c.is_right(o));
            let extra = right.clone().filter(|(o, _)| o.accepted.len() > 1).count();
            println!(
                "{} {name}: right effect at the right joint first {} of {}, {extra} of them with an extra effect",
                arm.robot.model.name,
                right.count(),
                cases.len()
            );
            for (case, outcome) in cases.iter().zip(&outcomes) {
                let row = &mut strata[stratum(outcome.contribution)];
                row.0 += 1;
                row.1 += usize::from(case.is_right(outcome));
                row.2 += usize::from(case.is_right(outcome) && outcome.accepted.len() > 1);
                if !case.is_right(outcome) || outcome.accepted.len() > 1 {
                    println!(
                        "  seed {} {:?} rho {:.2} → {} {:?} rivals {:?}",
                        case.seed,
                        case.hidden,
                        outcome.contribution,
                        outcome.verdict,
                        outcome.accepted,
                        outcome.rivals
                    );
                }
            }
            all.extend(outcomes);
        }
    }
    for ((_, name), (cases, right, extra)) in STRATA.iter().zip(strata) {
        println!("{name:10} {right} of {cases} right, {extra} of them with an extra effect");
    }
    for (hidden, row) in confusion(&all) {
        let named: Vec<String> = row.iter().map(|(name, count)| format!("{name} {count}")).collect();
        println!("{hidden:32} {}", named.join(", "));
    }
}

fn nothing(population: &Population) {
    for arm in &population.arms {
        for (name, conditions) in &population.conditions {
            let seeds = population.seeds.clone().map(|seed| 100_000 + seed);
            let cases: Vec<Case> = seeds.map(|seed| null_case(arm, *conditions, seed)).collect();
            let outcomes = run(arm, &cases);
            let alarms = outcomes.iter().filter(|o| o.verdict != Verdict::Adequate).count();
            println!("{} {name}: nothing hidden, {alarms} alarms in {}", arm.robot.model.name, cases.len());
            for (case, outcome) in cases.iter().zip(&outcomes).filter(|(_, o)| o.verdict != Verdict::Adequate)
            {
                println!("  seed {} → {} {:?}", case.seed, outcome.verdict, outcome.accepted);
            }
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
