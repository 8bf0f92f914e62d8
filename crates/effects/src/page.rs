//! The page of one effect, as plain text for a terminal.

use sinew_effect::Card;

use crate::wording;

// Columns of the left margin of a paragraph, and of a line.
const MARGIN: usize = 12;
const WIDTH: usize = 100;

/// Everything that the catalogue says of one effect, as plain text.
///
/// # Example
/// ```
/// let card = sinew_effects::CATALOGUE.find("backlash").unwrap().card;
/// let page = sinew_effects::page(card);
/// assert!(page.starts_with("backlash\n") && page.contains("half_width"));
/// ```
pub fn page(card: &Card) -> String {
    let mut out = format!("{}\n  {}.\n\n", card.name, card.title);
    let needs: Vec<_> = card.requires.iter().map(wording::requirement).collect();
    for (label, text) in [
        ("law", card.law),
        ("symptom", card.symptom),
        ("energy", wording::energy(card.energy)),
        ("class", wording::family(card.family)),
        ("acts on", &wording::place(card)),
        ("needs", &needs.join("; ")),
    ] {
        if !text.is_empty() {
            paragraph(&mut out, label, text);
        }
    }
    if !card.parameters.is_empty() {
        out += "\nparameters\n";
        let header = ["key", "symbol", "unit", "role", "range", "known to"].map(str::to_owned);
        let row = |p: &sinew_effect::Parameter| {
            let (symbol, role) = (wording::symbol(p).to_owned(), wording::role(p).to_owned());
            [p.label(), symbol, p.written_unit(), role, wording::range(p), wording::prior(p)]
        };
        table(&mut out, core::iter::once(header).chain(card.parameters.iter().map(row)).collect());
    }
    for key in card.parameters.iter().filter(|p| p.component == Some(0)).map(|p| p.key) {
        let alike = card.parameters.iter().filter(|p| p.key == key);
        let zeros = alike.map(|_| "0").collect::<Vec<_>>().join(", ");
        out += &format!("  in a file: {key} = [{zeros}], in the order above\n");
    }
    if !card.rivals.is_empty() {
        out += "\nlooks like\n";
        for rival in card.rivals {
            let note = if rival.structural { " (no motion separates the two)" } else { "" };
            out += &format!("  {}{note}\n", rival.name);
            paragraph(&mut out, "", &format!("to tell: {}", rival.experiment_with(|_| false)));
        }
    }
    out += "\nsources\n";
    for source in card.sources {
        out += &format!("  {source}\n");
    }
    out
}

/// A labelled text, broken at spaces.
fn paragraph(out: &mut String, label: &str, text: &str) {
    let mut line = format!("  {label:<w$}", w = MARGIN - 2);
    for word in text.split(' ') {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            *out += line.trim_end();
            out.push('\n');
            line = " ".repeat(MARGIN);
        }
        line += word;
        line.push(' ');
    }
    *out += line.trim_end();
    out.push('\n');
}

/// Rows in columns of equal width.
fn table<const N: usize>(out: &mut String, rows: Vec<[String; N]>) {
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    for row in &rows {
        let cells = (0..N).map(|k| format!("{:<w$}", row[k], w = width(k)));
        *out += &format!("  {}", cells.collect::<Vec<_>>().join("  "));
        out.truncate(out.trim_end().len());
        out.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CATALOGUE;

    #[test]
    fn a_page_says_everything_that_its_card_says() {
        for entry in CATALOGUE.entries {
            let text = page(entry.card).split_whitespace().collect::<Vec<_>>().join(" ");
            let squeezed = |s: &str| s.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(text.contains(&squeezed(entry.card.law)), "{}: law", entry.card.name);
            assert!(text.contains(&squeezed(entry.card.symptom)), "{}: symptom", entry.card.name);
            for rival in entry.card.rivals {
                assert!(text.contains(rival.name) && text.contains(rival.experiment));
            }
        }
    }

    #[test]
    fn no_line_of_a_page_is_wider_than_a_terminal() {
        for entry in CATALOGUE.entries {
            for line in page(entry.card).lines() {
                assert!(line.chars().count() <= 120, "{line}");
            }
        }
    }
}
