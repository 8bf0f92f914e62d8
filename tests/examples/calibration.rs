//! Fits the probabilities of names to how often they are right: cases of a mixed population are diagnosed, and a logistic
//! map of what every name rests on is fitted to whether it is among what was hidden.
//!
//! ```text
//! cargo run --release -p sinew-tests --example calibration -- collect FILE FIRST..END     # adds a line for each name
//! cargo run --release -p sinew-tests --example calibration -- collect FILE FIRST..END friction   # of one kind of case only
//! cargo run --release -p sinew-tests --example calibration -- fit FILE                    # weights, and how well they hold
//! cargo run --release -p sinew-tests --example calibration -- told FILE                   # how well what was told holds
//! ```

use std::io::Write;
use std::ops::Range;
use std::sync::Mutex;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use sinew_identify::{FEATURES, Options};
use sinew_tests::{judge, mixed_case};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    match words[..] {
        ["collect", file, seeds] => collect(file, range(seeds)?, None),
        ["collect", file, seeds, kind] => collect(file, range(seeds)?, Some(kind)),
        ["fit", file] => fit(&read(file)?),
        ["told", file] => {
            let statements = read(file)?;
            let told: Vec<(f64, bool)> = statements.iter().map(|s| (s.told, s.right)).collect();
            println!("{}", reliability(&told));
            Ok(())
        }
        _ => Err("usage: calibration collect FILE FIRST..END [KIND] | fit FILE | told FILE".into()),
    }
}

fn range(text: &str) -> Result<Range<u64>, Failure> {
    let (first, end) = text.split_once("..").ok_or("seeds are FIRST..END")?;
    Ok(first.parse()?..end.parse()?)
}

/// A name that a diagnosis gave.
struct Statement {
    seed: u64,
    told: f64,
    right: bool,
    /// The most that it may be.
    share: f64,
    features: [f64; FEATURES],
}

// Lines: seed, kind of case, name, probability told, right or not, the most that it may be, features.
fn collect(file: &str, seeds: Range<u64>, only: Option<&str>) -> Result<(), Failure> {
    let out = Mutex::new(std::fs::OpenOptions::new().create(true).append(true).open(file)?);
    seeds.into_par_iter().for_each(|seed| {
        let (arm, case, kind) = mixed_case(seed);
        if only.is_some_and(|only| only != kind) {
            return;
        }
        let lines = match judge(&arm, &case, &Options::default()) {
            Err(error) => {
                eprintln!("seed {seed} {:?}: {error}", case.hidden);
                return;
            }
            Ok((outcome, diagnosis)) => {
                eprintln!("{seed} {kind} {:?} → {} {:?}", case.hidden, outcome.verdict, outcome.accepted);
                let of = |c: &sinew_identify::CandidateReport| {
                    let right = case.hidden.contains(&(c.effect.clone(), c.place.clone()));
                    let grounds = c.grounds?;
                    let features = grounds.features().map(|f| format!("{f:.5}")).join(" ");
                    let (name, right) = (format!("{}@{}", c.effect, c.place), u8::from(right));
                    let share = grounds.share();
                    Some(format!("{seed} {kind} {name} {:.4} {right} {share:.5} {features}\n", c.probability))
                };
                diagnosis.candidates.iter().filter_map(of).collect::<String>()
            }
        };
        let mut out = out.lock().expect("no writer panics");
        out.write_all(lines.as_bytes()).expect("the file was opened");
    });
    Ok(())
}

fn read(file: &str) -> Result<Vec<Statement>, Failure> {
    let of = |line: &str| -> Option<Statement> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [seed, _, _, told, right, share, features @ ..] = &words[..] else { return None };
        let features: Vec<f64> = features.iter().map(|f| f.parse().ok()).collect::<Option<_>>()?;
        Some(Statement {
            seed: seed.parse().ok()?,
            told: told.parse().ok()?,
            right: *right == "1",
            share: share.parse().ok()?,
            features: features.try_into().ok()?,
        })
    };
    let text = std::fs::read_to_string(file)?;
    let read: Option<Vec<Statement>> = text.lines().map(of).collect();
    Ok(read.ok_or("a line is not what `collect` writes")?)
}

// Weights on all statements; how they hold on seeds that the weights judged with have not seen.
fn fit(statements: &[Statement]) -> Result<(), Failure> {
    let all: Vec<&Statement> = statements.iter().collect();
    println!("weights {:.2?}", weights(&all).ok_or("no fit")?);
    let mut unseen = Vec::new();
    for fold in 0..FOLDS {
        let inside = |s: &&Statement| s.seed % FOLDS == fold;
        let (judged, fitted): (Vec<&Statement>, Vec<&Statement>) = all.iter().partition(|s| inside(s));
        let w = weights(&fitted).ok_or("no fit")?;
        unseen.extend(judged.iter().map(|s| (probability(&w, s), s.right)));
    }
    println!("each seed judged by weights of the others:\n{}", reliability(&unseen));
    Ok(())
}

const FOLDS: u64 = 5;
// What the weights are taken for before anything is seen, those of a prototype on another population, and the standard
// deviation of each: so few names may move them only where they speak clearly.
const BEFORE: [f64; FEATURES] = [-6.1, 1.8, 2.2, 1.1, 0.93, -1.2];
const WIDTH: f64 = 1.0;
const FIRST_WIDTH: f64 = 5.0;
const ROUNDS: usize = 200;

// P = share/(1 + e^(−w·f))
fn probability(weights: &[f64; FEATURES], s: &Statement) -> f64 {
    let logit: f64 = weights.iter().zip(&s.features).map(|(w, f)| w * f).sum();
    (s.share / (1.0 + (-logit).exp())).clamp(0.02, 0.96)
}

// Fisher's scoring on the penalised log likelihood: dP/dη = P (1 − P/share), score Σ (y − P)/(P (1 − P)) dP/dη f.
fn weights(statements: &[&Statement]) -> Option<[f64; FEATURES]> {
    let mut w = DVector::from_row_slice(&BEFORE);
    let weight = |k: usize| (if k == 0 { FIRST_WIDTH } else { WIDTH }).powi(-2);
    for _ in 0..ROUNDS {
        let mut g = DVector::from_fn(FEATURES, |k, _| weight(k) * (BEFORE[k] - w[k]));
        let mut h = DMatrix::from_fn(FEATURES, FEATURES, |i, j| if i == j { weight(i) } else { 0.0 });
        for s in statements {
            let x = DVector::from_row_slice(&s.features);
            let sigma = 1.0 / (1.0 + (-w.dot(&x)).exp());
            let p = (s.share * sigma).clamp(1e-9, 1.0 - 1e-9);
            let slope = s.share * sigma * (1.0 - sigma);
            let variance = (p * (1.0 - p)).max(1e-12);
            let y = f64::from(u8::from(s.right));
            g += &x * (slope * (y - p) / variance);
            h += &x * x.transpose() * (slope * slope / variance);
        }
        let step: DVector<f64> = h.cholesky()?.solve(&g);
        let length = step.amax();
        w += step * (0.5 / length.max(0.5));
        if length < 1e-8 {
            break;
        }
    }
    w.as_slice().try_into().ok()
}

// Ten classes of equal size: mean probability and share that is right; the mean distance of the two; Brier's score.
fn reliability(statements: &[(f64, bool)]) -> String {
    let mut sorted = statements.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (n, right) = (sorted.len() as f64, |s: &[(f64, bool)]| s.iter().filter(|x| x.1).count() as f64);
    let mut text = String::from("| names | probability | right |\n|---|---|---|\n");
    let mut error = 0.0;
    for class in sorted.chunks(sorted.len().div_ceil(CLASSES).max(1)) {
        let count = class.len() as f64;
        let (told, is) = (class.iter().map(|x| x.0).sum::<f64>() / count, right(class) / count);
        error += count / n * (told - is).abs();
        text += &format!("| {count} | {told:.2} | {is:.2} |\n");
    }
    let brier: f64 = sorted.iter().map(|(p, y)| (p - f64::from(u8::from(*y))).powi(2)).sum::<f64>() / n;
    let sure: Vec<(f64, bool)> = sorted.iter().copied().filter(|x| x.0 >= SURE).collect();
    text += &format!(
        "\n{n} names, {:.0} right; expected calibration error {error:.3}, Brier {brier:.3}; ",
        right(&sorted)
    );
    text += &format!("of {} with {SURE} and more {:.0} right", sure.len(), right(&sure));
    text
}

const CLASSES: usize = 10;
const SURE: f64 = 0.8;
