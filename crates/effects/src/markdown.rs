//! The catalogue as a Markdown page: `docs/effects.md` is printed from it.

use sinew_effect::Card;

use crate::{CATALOGUE, wording};

/// The whole catalogue as one Markdown page.
pub fn markdown() -> String {
    let mut out = String::from(
        "# The catalogue of physical effects\n\n\
         Printed from the cards of the effects; `SINEW_BLESS=1 cargo test -p sinew-effects` prints it anew.\n\n\
         A *strength* is zero where the effect is absent; a *shape* has no meaning at zero strength; what is \
         *stated* is taken\nfrom the file and not fitted, or only with its std beside it. Units are those of a turning joint, on the link side; \
         for sliding joints read N and m.\n\n| effect | what it is | energy |\n|---|---|---|\n",
    );
    for card in CATALOGUE.entries.iter().map(|e| e.card) {
        let link = format!("[`{0}`](#{0})", card.name);
        out += &format!("| {link} | {} | {} |\n", cell(card.title), wording::energy(card.energy));
    }
    for entry in CATALOGUE.entries {
        section(&mut out, entry.card);
    }
    out
}

fn section(out: &mut String, card: &Card) {
    *out += &format!("\n## {}\n\n{}.\n\n```text\n{}\n```\n\n", card.name, card.title, card.law);
    *out += &format!("- Looks like: {}\n", card.symptom);
    *out += &format!("- Energy: {}\n", wording::energy(card.energy));
    *out += &format!("- Acts on {}\n", wording::place(card));
    let needs: Vec<_> = card.requires.iter().map(wording::requirement).collect();
    if !needs.is_empty() {
        *out += &format!("- Needs {}\n", needs.join("; "));
    }
    if !card.parameters.is_empty() {
        *out += "\n| key | symbol | unit | role | range | known to |\n|---|---|---|---|---|---|\n";
        for p in card.parameters {
            let (role, range, prior) = (wording::role(p), wording::range(p), wording::prior(p));
            let symbol = cell(wording::symbol(p));
            *out += &format!(
                "| `{}` | {symbol} | {} | {role} | {range} | {prior} |\n",
                p.label(),
                p.written_unit()
            );
        }
    }
    if !card.rivals.is_empty() {
        *out += "\n| rival | what separates the two |\n|---|---|\n";
        for rival in card.rivals {
            let note = if rival.structural { "no motion, only priors; " } else { "" };
            *out += &format!("| `{}` | {note}{} |\n", rival.name, cell(&rival.experiment_with(|_| false)));
        }
    }
    *out += "\nSources: ";
    *out += &card.sources.join(". ");
    *out += ".\n";
}

// A bar would end the cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
