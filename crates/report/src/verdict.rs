//! The verdict in words.

use sinew_identify::{Accepted, CandidateReport, Diagnosis, Verdict};

/// The verdict of a diagnosis in one or two sentences.
pub fn verdict_in_words(diagnosis: &Diagnosis) -> String {
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
            format!("Missing: {named}. With {} nothing predictable is left.", said("it", "them"))
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

// What was accepted, the sure names first; those that are more likely wrong than right are said to be so.
fn named(diagnosis: &Diagnosis) -> String {
    let probability = |a: &Accepted| {
        let is_it = |c: &&CandidateReport| c.effect == a.effect && c.place == a.place;
        diagnosis.candidates.iter().find(is_it).map_or(1.0, |c| c.probability)
    };
    let words = |list: Vec<&Accepted>| {
        let words: Vec<_> = list.into_iter().map(|a| effect_in_words(&a.effect, &a.place)).collect();
        match words.as_slice() {
            [] => "an effect of the catalogue".to_owned(),
            [one] => one.clone(),
            [init @ .., last] => format!("{} and {last}", init.join(", ")),
        }
    };
    let (sure, unsure): (Vec<&Accepted>, Vec<&Accepted>) =
        diagnosis.accepted.iter().partition(|a| probability(a) >= 0.5);
    match (sure.is_empty(), unsure.is_empty()) {
        (_, true) => words(sure),
        (true, false) => words(unsure),
        (false, false) => format!("{}, and perhaps {}", words(sure), words(unsure)),
    }
}
