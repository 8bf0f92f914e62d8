//! The rows of a CSV text.

use crate::column_map::ColumnMap;
use crate::error::DataError;
use crate::layout::{Headers, Layout};
use crate::read_run::{Fault, Raw};
use crate::run::Mark;

/// Reads the columns of a CSV text that have known names or are named by a map. Fields of signals that are no numbers are NaN,
/// and told besides.
///
/// # Errors
/// If it is no table, its header names no run, a row has another length or no time stamp.
pub(crate) fn read(file: &str, text: &str, columns: Option<&ColumnMap>) -> Result<Raw, DataError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(DataError::Empty { file: file.into() });
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter(text))
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let bad = |source| DataError::BadCsv { file: file.into(), source };
    let names = reader.headers().map_err(bad)?.clone();
    let headers = Headers { file, place: format!("{file}:1"), names: names.iter().collect() };
    let layout = Layout::new(&headers, columns)?;
    let (mut time, mut lines, mut faults) = (Vec::new(), Vec::new(), Vec::new());
    let mut values = vec![Vec::new(); layout.signals.len()];
    let mut row = csv::StringRecord::new();
    let mut cursor = LineCursor { text: text.as_bytes(), byte: 0, line: 1 };
    while reader.read_record(&mut row).map_err(bad)? {
        let line = cursor.line_at(row.position().map_or(0, |p| p.byte() as usize));
        let place = || format!("{file}:{line}");
        if row.len() != names.len() {
            let (got, expected) = (row.len(), names.len());
            let help = match got {
                _ if got == 2 * expected => "a decimal comma? Write the decimal point as a full stop",
                _ => "complete or drop the row; a log that was cut off ends like this",
            };
            return Err(DataError::FieldCount { place: place(), got, expected, help: help.into() });
        }
        let raw = |index: usize| {
            let text = &row[index];
            parse(text).ok_or_else(|| DataError::NotNumber {
                place: place(),
                column: names[index].into(),
                got: text.into(),
                help: help_for(text),
            })
        };
        time.push(layout.time.number(raw)?);
        for (values, (_, field)) in values.iter_mut().zip(&layout.signals) {
            values.push(field.number(raw).unwrap_or_else(|error| {
                faults.push(Fault { line, error });
                f64::NAN
            }));
        }
        lines.push(line);
    }
    let run = layout.run(file, Mark::Line, lines, time, values);
    let names = names.iter().map(str::to_owned).collect();
    Ok(Raw { run, faults, layout, names })
}

/// Counts lines up to a row, over blank lines and both kinds of line end.
struct LineCursor<'a> {
    text: &'a [u8],
    byte: usize,
    line: u64,
}

impl LineCursor<'_> {
    /// Line of the row that the reader began to look for at `byte`.
    fn line_at(&mut self, byte: usize) -> u64 {
        let blank = self.text[byte..].iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
        let row = byte + blank;
        self.line += self.text[self.byte..row].iter().filter(|&&b| b == b'\n').count() as u64;
        self.byte = row;
        self.line
    }
}

/// The separator that occurs most often in the header.
fn delimiter(text: &str) -> u8 {
    let header = text.lines().next().unwrap_or_default();
    // Of equally frequent ones the last wins: the comma.
    *[b'\t', b';', b','].iter().max_by_key(|&&d| header.bytes().filter(|&b| b == d).count()).unwrap_or(&b',')
}

fn parse(text: &str) -> Option<f64> {
    text.parse().ok()
}

fn help_for(text: &str) -> String {
    if text.is_empty() {
        return "the field is empty: drop the row, or use a window of the run without it: FILE@FROM..TO"
            .into();
    }
    match parse(&text.replace(',', ".")) {
        Some(number) => format!("write the decimal point as a full stop: {number}"),
        None => {
            "drop the row, correct the field, or use a window of the run without it: FILE@FROM..TO".into()
        }
    }
}
