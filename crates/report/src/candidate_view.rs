//! Bars: how probable each candidate is, and its rivals under it.

use sinew_identify::CandidateReport;

use crate::number::number;
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

const LEFT: f64 = 270.0;
const RIGHT: f64 = 740.0;
const MOST: usize = 5;

/// The first candidates with up to three rivals each.
pub(crate) fn candidate_view(candidates: &[CandidateReport]) -> String {
    let shown = &candidates[..candidates.len().min(MOST)];
    let rows: usize = shown.iter().map(|c| 1 + c.rivals.len().min(3)).sum();
    let height = 26.0 * rows as f64 + 56.0;
    let text = "Bars from zero to one: the probability of each candidate; thin bars below it are its rivals.";
    let mut svg = Svg::new(920.0, height, "candidates and rivals", text);
    let x = Scale::linear(0.0, 1.0, LEFT, RIGHT);
    let bottom = height - 46.0;
    for (value, label) in x.ticks(5) {
        svg.line("grid", (x.at(value), 4.0), (x.at(value), bottom));
        svg.text("tick", Anchor::Middle, (x.at(value), bottom + 16.0), &label);
    }
    let mut y = 20.0;
    for candidate in shown {
        let name = at_place(&candidate.effect, &candidate.place);
        svg.text("label", Anchor::End, (LEFT - 10.0, y + 4.0), &name);
        svg.rect("bar after", (LEFT, y - 8.0), (x.at(candidate.probability) - LEFT, 16.0));
        let explains = |share: f64| format!(", explains {} %", number(100.0 * share));
        let explains = candidate.explains().map(explains).unwrap_or_default();
        let note = format!("{}{explains}", number(candidate.probability));
        svg.text("tick", Anchor::Start, (x.at(candidate.probability) + 8.0, y + 4.0), &note);
        y += 26.0;
        for rival in candidate.rivals.iter().take(3) {
            let name = format!("rival: {}", at_place(&rival.effect, &rival.place));
            svg.text("tick", Anchor::End, (LEFT - 10.0, y + 3.0), &name);
            svg.rect("bar rival", (LEFT, y - 4.0), ((x.at(rival.probability) - LEFT).max(1.0), 8.0));
            svg.text(
                "tick",
                Anchor::Start,
                (x.at(rival.probability) + 8.0, y + 4.0),
                &number(rival.probability),
            );
            y += 26.0;
        }
    }
    svg.text("name", Anchor::Middle, ((LEFT + RIGHT) / 2.0, bottom + 34.0), "probability");
    svg.finish()
}

fn at_place(effect: &str, place: &str) -> String {
    if place.is_empty() { effect.to_owned() } else { format!("{effect}@{place}") }
}
