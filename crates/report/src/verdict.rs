//! The verdict in words.

use sinew_identify::{Accepted, CandidateReport, Diagnosis, ParameterReport, UNSEEN, Verdict};

use crate::quantity;

/// The verdict of a diagnosis in one to three sentences.
pub fn verdict_in_words(diagnosis: &Diagnosis) -> String {
    let judged = judged(diagnosis);
    match diagnosis.findings.iter().find(|f| f.regime == UNSEEN) {
        Some(finding) => format!("{judged} But {}.", finding.statement),
        None => judged,
    }
}

// What the fitted runs say.
fn judged(diagnosis: &Diagnosis) -> String {
    let named = named(diagnosis);
    let said = |one: &'static str, several: &'static str| {
        if diagnosis.accepted.len() > 1 { several } else { one }
    };
    match diagnosis.verdict {
        Verdict::Adequate => {
            "Adequate: with its parameters, offsets and clocks fitted within their tolerances no effect of the catalogue \
                              would improve this model on these data, and nothing predictable is left in its error."
                .to_owned()
        }
        Verdict::Missing => {
            format!("{} With {} nothing predictable is left.", missing(diagnosis), said("it", "them"))
        }
        Verdict::PartlyExplained if diagnosis.accepted.is_empty() => {
            "Explained in part: what the catalogue offers leaves something predictable behind.".to_owned()
        }
        Verdict::PartlyExplained => {
            let improve = said("improves", "improve");
            format!("Explained in part: {named} {improve} the model, but something predictable is left.")
        }
        Verdict::Unexplained if !diagnosis.accepted.is_empty() => {
            let explain = said("explains", "explain");
            format!("Unexplained: {named} {explain} a part of the error, and too much is left for that to be the cause.")
        }
        Verdict::Unexplained => {
            "Unexplained: the error has structure that no effect of the catalogue explains.".to_owned()
        }
        Verdict::Undecidable => "Undecidable: these data cannot tell the candidates apart.".to_owned(),
    }
}

/// An effect at its place in words: `coulomb_friction`, `elbow` → "Coulomb friction at elbow".
///
/// # Example
/// ```
/// assert_eq!(sinew_report::effect_in_words("coulomb_friction", "elbow"), "Coulomb friction at elbow");
/// assert_eq!(sinew_report::effect_in_words("payload", ""), "payload");
/// ```
pub fn effect_in_words(effect: &str, place: &str) -> String {
    let name = effect.replace('_', " ").replace("coulomb", "Coulomb").replace("stribeck", "Stribeck");
    if place.is_empty() || place == "robot" { name } else { format!("{name} at {place}") }
}

// What the model lacks, and what it states wrongly: each in a sentence.
fn missing(diagnosis: &Diagnosis) -> String {
    let is_stated = |a: &&Accepted| candidate(diagnosis, a).is_some_and(|c| c.is_stated);
    let (stated, new): (Vec<&Accepted>, Vec<&Accepted>) = diagnosis.accepted.iter().partition(is_stated);
    let sentence = |what: &str, list: Vec<&Accepted>| {
        let named = named_of(diagnosis, list.iter().copied(), |a| in_words(diagnosis, a));
        (!list.is_empty()).then(|| format!("{what}: {named}."))
    };
    let sentences = [sentence("Missing", new), sentence("Not as stated", stated)];
    sentences.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

// With what it is and what it is stated to be, if it is stated.
fn in_words(diagnosis: &Diagnosis, a: &Accepted) -> String {
    let words = effect_in_words(&a.effect, &a.place);
    let Some(candidate) = candidate(diagnosis, a).filter(|c| c.is_stated) else { return words };
    let pull = |p: &ParameterReport| (p.value - p.start).abs() / p.std.max(f64::MIN_POSITIVE);
    let farthest = candidate.values.iter().max_by(|a, b| pull(a).total_cmp(&pull(b)));
    let change = farthest.map(|p| {
        let key = p.key(&a.place).replace('_', " ");
        format!(" ({key} {}, stated {})", quantity(p.value, &p.unit), quantity(p.start, &p.unit))
    });
    words + &change.unwrap_or_default()
}

fn candidate<'a>(diagnosis: &'a Diagnosis, a: &Accepted) -> Option<&'a CandidateReport> {
    diagnosis.candidates.iter().find(|c| c.effect == a.effect && c.place == a.place)
}

fn named(diagnosis: &Diagnosis) -> String {
    named_of(diagnosis, &diagnosis.accepted, |a| effect_in_words(&a.effect, &a.place))
}

// The sure names first; those that are more likely wrong than right are said to be so.
fn named_of<'a>(
    diagnosis: &Diagnosis,
    list: impl IntoIterator<Item = &'a Accepted>,
    word: impl Fn(&Accepted) -> String,
) -> String {
    let probability = |a: &Accepted| candidate(diagnosis, a).map_or(1.0, |c| c.probability);
    let words = |list: Vec<&Accepted>| {
        let words: Vec<_> = list.into_iter().map(&word).collect();
        match words.as_slice() {
            [] => "an effect of the catalogue".to_owned(),
            [one] => one.clone(),
            [init @ .., last] => format!("{} and {last}", init.join(", ")),
        }
    };
    let (sure, unsure): (Vec<&Accepted>, Vec<&Accepted>) =
        list.into_iter().partition(|a| probability(a) >= 0.5);
    match (sure.is_empty(), unsure.is_empty()) {
        (_, true) => words(sure),
        (true, false) => words(unsure),
        (false, false) => format!("{}, and perhaps {}", words(sure), words(unsure)),
    }
}
