//! Prints the statistics of cases in which nothing is hidden: alarms, scores of absent effects, coverage of intervals.
//!
//! ```text
//! cargo run --release -p sinew-tests --example nulls -- ARM SENSORS ENCODER FIRST..END [imposed|innovation]
//! cargo run --release -p sinew-tests --example nulls -- drawn FIRST..END [imposed|innovation]
//! ```

use rayon::prelude::*;

use sinew_identify::{Options, Residual};
use sinew_tests::{Arm, Conditions, NullCase, null_statistics};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if asked(&args).is_none() {
        eprintln!("usage: nulls 1|2|6[-rigid] full|motor|all fine|coarse FIRST..END [imposed|innovation]");
        eprintln!("       nulls drawn FIRST..END [imposed|innovation]");
    }
}

fn asked(args: &[String]) -> Option<()> {
    let drawn = args.first()? == "drawn";
    let seeds = args.get(if drawn { 1 } else { 3 })?;
    let (first, end) = seeds.split_once("..")?;
    let own = if drawn {
        None
    } else {
        let arm = Arm::named(args.first()?)?;
        Some((arm, Conditions::named(args.get(1)?, args.get(2)?)?))
    };
    let residual = args.iter().find_map(|a| match a.as_str() {
        "imposed" => Some(Residual::Imposed),
        "innovation" => Some(Residual::Innovation),
        _ => None,
    });
    let options = Options { residual, ..Options::default() };
    let seeds: Vec<u64> = (first.parse().ok()?..end.parse().ok()?).collect();
    let cases: Vec<NullCase> = seeds
        .par_iter()
        .filter_map(|seed| {
            let told = match &own {
                Some((arm, conditions)) => null_statistics(arm, *conditions, 200_000 + seed, &options),
                None => null_statistics(&Arm::drawn(*seed), Conditions::drawn(*seed), *seed, &options),
            };
            match told {
                Ok(case) => Some(case),
                Err(error) => {
                    eprintln!("seed {seed}: {error}");
                    None
                }
            }
        })
        .collect();
    print(&cases, seeds.len());
    Some(())
}

fn print(cases: &[NullCase], asked: usize) {
    let alarms: Vec<&String> = cases.iter().filter_map(|c| c.alarm.as_ref()).collect();
    println!("alarms {} of {asked}", alarms.len() + asked - cases.len());
    alarms.iter().for_each(|alarm| println!("{alarm}"));
    let mut names: Vec<&String> = cases.iter().flat_map(|c| &c.estimates).map(|e| &e.name).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let own = || cases.iter().flat_map(|c| &c.estimates).filter(|e| e.name == *name);
        let n = own().count() as f64;
        let rms = (own().map(|e| e.z * e.z).sum::<f64>() / n).sqrt();
        let mean = own().map(|e| e.z).sum::<f64>() / n;
        let mut errors: Vec<f64> = own().map(|e| 100.0 * e.error.abs()).collect();
        errors.sort_by(f64::total_cmp);
        let median = errors[errors.len() / 2];
        println!("{name:24} rms z {rms:5.2}, mean z {mean:5.2}, median error {median:.2} %");
    }
    let mut effects: Vec<&String> = cases.iter().flat_map(|c| &c.scores).map(|(name, _)| name).collect();
    effects.sort_unstable();
    effects.dedup();
    for effect in effects {
        let own: Vec<f64> =
            cases.iter().flat_map(|c| &c.scores).filter(|(n, _)| n == effect).map(|(_, z)| *z).collect();
        let n = own.len() as f64;
        let (mean, square) = (own.iter().sum::<f64>() / n, own.iter().map(|z| z * z).sum::<f64>() / n);
        println!("{effect:40} score/k {square:5.2}, mean z {mean:5.2}");
    }
    let scores: Vec<f64> = cases.iter().flat_map(|c| &c.scores).map(|(_, z)| z * z).collect();
    let mean = scores.iter().sum::<f64>() / scores.len().max(1) as f64;
    // χ² of one degree of freedom exceeds 6.635 in one case of a hundred.
    let rare = scores.iter().filter(|s| **s > 6.635).count() as f64 / scores.len().max(1) as f64;
    let inside = cases.iter().flat_map(|c| &c.estimates).filter(|e| e.z.abs() < 1.96).count();
    let all: usize = cases.iter().map(|c| c.estimates.len()).sum();
    println!(
        "{} scores: mean of score/k {mean:.2}, p < 0.01 in {:.1} %; coverage of 95 % intervals {:.1} % of {all}",
        scores.len(),
        100.0 * rare,
        100.0 * inside as f64 / all.max(1) as f64
    );
}
