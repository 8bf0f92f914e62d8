//! `sinew diagnose`: which effect is missing.

use clap::Args;
use sinew_effects::CATALOGUE;
use sinew_identify::{CandidateReport, Diagnosis, ParameterReport, Verdict, diagnose};
use sinew_report::{number, quantity, verdict_in_words, with_std};

use crate::console::Console;
use crate::error::CliError;
use crate::inputs::Inputs;
use crate::table::{at_place, item, percent, table};

/// Arguments of `sinew diagnose`.
#[derive(Debug, Args)]
pub(crate) struct Diagnose {
    #[command(flatten)]
    inputs: Inputs,
    /// Say also which candidates were refused, and why
    #[arg(long)]
    explain: bool,
}

impl Diagnose {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (robot, runs) = self.inputs.read(console)?;
        console.say("searching the catalogue …");
        let diagnosis = diagnose(&robot.robot, &CATALOGUE, &runs, &self.inputs.options(console))?;
        console.answer(&diagnosis, || {
            let mut out = text(&diagnosis, self.explain);
            section(&mut out, "fitted", &values(&diagnosis.candidates));
            out
        })
    }
}

/// The verdict in words first, then the evidence.
pub(crate) fn text(diagnosis: &Diagnosis, explain: bool) -> String {
    let mut out = format!("{}\n", verdict_in_words(diagnosis));
    if matches!(diagnosis.verdict, Verdict::Unexplained | Verdict::PartlyExplained) {
        out += "`sinew report` draws what is left along time, position and velocity.\n";
    }
    if !diagnosis.candidates.is_empty() {
        let header = ["joint", "effect", ">probability", ">explains", "rival"];
        out += &format!("\n{}\n", table(&header, diagnosis.candidates.iter().map(candidate)));
    }
    let experiments = experiments(&diagnosis.candidates);
    section(&mut out, "to tell rivals apart", &experiments);
    let findings: Vec<_> = diagnosis.findings.iter().map(|f| f.statement.clone()).collect();
    section(&mut out, "findings", &findings);
    section(&mut out, "would have been seen", &limits(diagnosis));
    if !diagnosis.scope.is_empty() {
        out += &format!("\nscope: {}\n", diagnosis.scope);
    }
    out += &refusals(diagnosis, explain);
    out
}

// The smallest strengths that would have been named, place by place.
fn limits(diagnosis: &Diagnosis) -> Vec<String> {
    let mut places: Vec<&str> = diagnosis.limits.iter().map(|l| l.place.as_str()).collect();
    places.sort_unstable();
    places.dedup();
    let line = |place: &&str| {
        let own = diagnosis.limits.iter().filter(|l| l.place == **place);
        let each: Vec<String> =
            own.map(|l| format!("{} from {}", l.effect, quantity(l.smallest, &l.unit))).collect();
        format!("{place}: {}", each.join(", "))
    };
    let untold = (!places.is_empty()).then(|| UNTOLD.to_owned());
    places.iter().map(line).chain(untold).collect()
}

const UNTOLD: &str =
    "of effects with a threshold, a time or several strengths (gaps, lags, harmonics …) no size is told";

/// Every refused candidate with the gate that refused it, or how many there are.
fn refusals(diagnosis: &Diagnosis, explain: bool) -> String {
    let refused = &diagnosis.refusals;
    let mut out = String::new();
    if explain {
        let line = |r: &sinew_identify::Refusal| format!("step {}: {}: {}", r.step, r.candidate, r.reason);
        section(&mut out, "refused", &refused.iter().map(line).collect::<Vec<_>>());
    } else if !refused.is_empty() {
        let were = if refused.len() == 1 { "candidate was" } else { "candidates were" };
        out += &format!("{} {were} refused; --explain says why\n", refused.len());
    }
    out
}

fn candidate(c: &CandidateReport) -> Vec<String> {
    let rival = c.rivals.first().map_or("–".to_owned(), |r| {
        format!(
            "{} {}",
            at_place(&r.effect, if r.place == c.place { "" } else { &r.place }),
            number(r.probability)
        )
    });
    let place = if c.place.is_empty() { "(robot)" } else { &c.place };
    let explains = c.explains().map_or("–".to_owned(), percent);
    vec![place.to_owned(), c.effect.clone(), number(c.probability), explains, rival]
}

// What was fitted of each candidate; `fit` and `discover` tell it with all other parameters.
fn values(candidates: &[CandidateReport]) -> Vec<String> {
    let each = |c: &CandidateReport| {
        let value =
            |p: &ParameterReport| format!("{} = {}", p.key(&c.place), with_std(p.value, p.std, &p.unit));
        let values: Vec<String> = c.values.iter().map(value).collect();
        (!values.is_empty()).then(|| format!("{}: {}", at_place(&c.effect, &c.place), values.join(", ")))
    };
    candidates.iter().filter_map(each).collect()
}

// One line for each rival that an experiment would separate.
fn experiments(candidates: &[CandidateReport]) -> Vec<String> {
    let of = |c: &CandidateReport| {
        let line = |r: &sinew_identify::RivalReport| {
            let pair = (at_place(&c.effect, &c.place), at_place(&r.effect, &r.place));
            format!("{} or {}: {}", pair.0, pair.1, r.experiment)
        };
        let told = c.rivals.iter().filter(|r| !r.experiment.is_empty());
        told.map(line).collect::<Vec<_>>()
    };
    candidates.iter().flat_map(of).collect()
}

fn section(out: &mut String, title: &str, lines: &[String]) {
    if !lines.is_empty() {
        *out += &format!("\n{title}\n");
        for line in lines {
            *out += &format!("{}\n", item(line));
        }
    }
}
