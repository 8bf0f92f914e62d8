//! Tables for a terminal: columns and spaces, no lines, readable without colour.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// A table whose columns named with a leading `>` are aligned to the right.
pub(crate) fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header.iter().map(|h| h.trim_start_matches('>')));
    for row in rows {
        table.add_row(row);
    }
    for (column, name) in table.column_iter_mut().zip(header) {
        column.set_padding((0, 3));
        if name.starts_with('>') {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt()
}

/// A share in per cent.
pub(crate) fn percent(share: f64) -> String {
    format!("{} %", sinew_report::number(100.0 * share))
}

/// `effect@place`, or the effect alone for one of the whole robot.
pub(crate) fn at_place(effect: &str, place: &str) -> String {
    if place.is_empty() || place == "robot" { effect.to_owned() } else { format!("{effect}@{place}") }
}

/// A sentence with its further lines indented.
pub(crate) fn item(text: &str) -> String {
    format!("  · {}", text.replace('\n', "\n    "))
}
