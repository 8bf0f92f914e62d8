//! Which column of a file is which signal.

use crate::column_map::{Column, ColumnMap};
use crate::error::DataError;
use crate::note::{Note, Severity};
use crate::quantity::SignalName;
use crate::run::{Mark, Origin, Run, Signal};
use crate::spelling::nearest;

/// The headers of a file, and where it has them.
pub(crate) struct Headers<'a> {
    pub file: &'a str,
    /// `run.csv:1` of a text, the file itself of a table.
    pub place: String,
    pub names: Vec<&'a str>,
}

/// Which columns of a file are time and signals.
pub(crate) struct Layout {
    pub time: Field,
    pub signals: Vec<(SignalName, Field)>,
    notes: Vec<Note>,
}

/// A column, or what a columns map makes of up to three.
pub(crate) struct Field {
    pub index: usize,
    plus: Option<usize>,
    times: Option<usize>,
    scale: f64,
    offset: f64,
    /// How far it goes until it begins anew.
    turn: Option<f64>,
}

impl Layout {
    /// # Errors
    /// If there is no time, no signal, or a column of the map is not there or there twice.
    pub fn new(headers: &Headers, columns: Option<&ColumnMap>) -> Result<Layout, DataError> {
        let names = || headers.names.iter().copied();
        let is_mapped = columns.is_some_and(|map| map.time.is_some());
        if !is_mapped && names().filter(|h| *h == "time").count() > 1 {
            return Err(headers.twice("time"));
        }
        let mut time = names().position(|h| h == "time").map(Field::plain);
        let mut signals = Vec::new();
        if let Some(map) = columns {
            if let Some(column) = &map.time {
                time = Some(Field::mapped(headers, map, "time", column)?);
            }
            for (name, column) in &map.signals {
                signals.push((name.clone(), Field::mapped(headers, map, &name.to_string(), column)?));
            }
        }
        let mut unknown = Vec::new();
        for (field, header) in names().enumerate() {
            match header.parse::<SignalName>() {
                Ok(name) if columns.is_some_and(|map| map.signals.contains_key(&name)) => {}
                Ok(name) if signals.iter().any(|s| s.0 == name) => return Err(headers.twice(header)),
                Ok(name) => signals.push((name, Field::plain(field))),
                Err(error) if header != "time" => unknown.push((header, error)),
                Err(_) => {}
            }
        }
        let found = || headers.found();
        if signals.is_empty() {
            let (place, help) = (headers.place.clone(), headers.naming());
            return Err(DataError::NoKnownColumn { place, found: found(), help });
        }
        let Some(time) = time else {
            return Err(DataError::NoTime { file: headers.file.into(), found: found() });
        };
        let notes = if columns.is_some() { Vec::new() } else { headers.ignored(&unknown) };
        Ok(Layout { time, signals, notes })
    }

    /// The run of these columns, its samples with these numbers in the file.
    pub fn run(
        &self,
        file: &str,
        mark: Mark,
        numbers: Vec<u64>,
        time: Vec<f64>,
        values: Vec<Vec<f64>>,
    ) -> Run {
        let signals = self.signals.iter().zip(values);
        let signals = signals.map(|((name, _), values)| Signal::new(name.quantity, &name.place, values));
        Run {
            name: stem(file).into(),
            time,
            signals: signals.collect(),
            notes: self.notes.clone(),
            left_out: Vec::new(),
            origin: Some(Origin { file: file.into(), mark, numbers }),
        }
    }

    /// Takes whole turns out of the signals that wrap.
    pub fn unwrap(&self, run: &mut Run) {
        for (signal, (_, field)) in run.signals.iter_mut().zip(&self.signals) {
            if let Some(turn) = field.turn {
                unwrap(&mut signal.values, turn);
            }
        }
    }

    /// The column in which a signal was logged.
    pub fn column_of(&self, name: &SignalName) -> Option<usize> {
        self.signals.iter().find(|s| s.0 == *name).map(|s| s.1.index)
    }
}

impl Headers<'_> {
    fn twice(&self, column: &str) -> DataError {
        DataError::DuplicateColumn { place: self.place.clone(), column: column.into() }
    }

    fn found(&self) -> String {
        const SHOWN: usize = 12;
        let mut names: Vec<&str> = self.names.iter().copied().take(SHOWN).collect();
        let more = format!("and {} more", self.names.len().saturating_sub(SHOWN));
        if self.names.len() > SHOWN {
            names.push(&more);
        }
        names.join(", ")
    }

    fn ignored(&self, unknown: &[(&str, DataError)]) -> Vec<Note> {
        let note = |(header, error): &(&str, DataError)| Note {
            severity: Severity::Note,
            place: self.place.clone(),
            statement: format!("column \"{header}\" is not known and was ignored"),
            help: match error {
                DataError::BadName { help, .. } => help.clone(),
                _ => "name it with --columns".into(),
            },
        };
        unknown.iter().map(note).collect()
    }

    // How to name the columns of a log none of which has a name that is known.
    fn naming(&self) -> String {
        let names = || self.names.iter().copied();
        if names().all(|h| h.parse::<f64>().is_ok()) {
            return "the first line holds numbers: write a line of names above it, \
                    time,motor_position.JOINT,motor_torque.JOINT… with the URDF's joints"
                .into();
        }
        if names().any(|h| h.to_lowercase().parse::<SignalName>().is_ok()) {
            return "quantities are written in small letters: time, motor_position.JOINT, motor_torque.JOINT …"
                .into();
        }
        // A header with one of these letters; one after another if none has them.
        let like = |words: &[&str], other: usize| {
            let has = |h: &&str| words.iter().any(|word| h.to_lowercase().contains(word));
            names().skip(1).find(has).or(names().nth(other)).unwrap_or("…").to_owned()
        };
        let time = names().next().unwrap_or("…");
        let (position, torque) =
            (like(&["pos", "q", "angle"], 1), like(&["torque", "tau", "effort", "tq"], 2));
        format!(
            "say which column is what with --columns map.toml, for every JOINT of the URDF, for example\n    \
             time = {{ column = \"{time}\" }}\n    \
             \"motor_position.JOINT\" = {{ column = \"{position}\", scale = 1.0 }}  # to rad\n    \
             \"motor_torque.JOINT\" = {{ column = \"{torque}\", scale = 1.0 }}  # to N·m behind the gear; motor_current: A\n    \
             # joint_position, joint_torque: what sensors behind the gear show"
        )
    }
}

impl Field {
    fn plain(index: usize) -> Field {
        Field { index, plus: None, times: None, scale: 1.0, offset: 0.0, turn: None }
    }

    fn mapped(headers: &Headers, map: &ColumnMap, name: &str, column: &Column) -> Result<Field, DataError> {
        let find = |header: &str| Self::find(headers, map, name, header);
        Ok(Field {
            index: find(&column.header)?,
            plus: column.plus.as_deref().map(find).transpose()?,
            times: column.times.as_deref().map(find).transpose()?,
            scale: column.scale,
            offset: column.offset,
            turn: column.wraps.map(|wraps| wraps * column.scale.abs()),
        })
    }

    // Which column has a header that a map names.
    fn find(headers: &Headers, map: &ColumnMap, name: &str, header: &str) -> Result<usize, DataError> {
        let mut fields = headers.names.iter().enumerate().filter(|(_, h)| **h == header).map(|(i, _)| i);
        match (fields.next(), fields.next()) {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => Err(headers.twice(header)),
            (None, _) => {
                // A column that the map gives to another name is not the one that was meant.
                let free: Vec<&str> = headers.names.iter().copied().filter(|h| !map.uses(h)).collect();
                Err(DataError::MissingColumn {
                    place: headers.place.clone(),
                    column: header.into(),
                    name: name.into(),
                    found: headers.found(),
                    help: match nearest(header, &free) {
                        Some(near) => format!("did you mean \"{near}\"?"),
                        None => "correct the columns map".into(),
                    },
                })
            }
        }
    }

    /// The columns that it is made of.
    #[cfg(feature = "parquet")]
    pub fn columns(&self) -> impl Iterator<Item = usize> {
        [Some(self.index), self.plus, self.times].into_iter().flatten()
    }

    /// True if its columns are in another unit.
    #[cfg(feature = "parquet")]
    pub fn is_scaled(&self) -> bool {
        self.scale != 1.0
    }

    /// The number of this field in SI, made of those of its columns.
    ///
    /// # Errors
    /// Those of `raw`.
    pub fn number(&self, raw: impl Fn(usize) -> Result<f64, DataError>) -> Result<f64, DataError> {
        let or = |column: Option<usize>, without: f64| column.map_or(Ok(without), &raw);
        // value = scale · (column + plus) · times + offset
        Ok(self.scale * (raw(self.index)? + or(self.plus, 0.0)?) * or(self.times, 1.0)? + self.offset)
    }
}

// Steps of more than half a turn are whole ones and what is left of them.
fn unwrap(values: &mut [f64], turn: f64) {
    let (mut turns, mut before) = (0.0, None);
    for value in values.iter_mut().filter(|value| value.is_finite()) {
        let logged = *value;
        turns -= before.map_or(0.0, |before: f64| ((logged - before) / turn).round());
        *value = logged + turns * turn;
        before = Some(logged);
    }
}

/// The name of a file without `.csv`, `.parquet` or `.gz`.
pub(crate) fn stem(file: &str) -> &str {
    let stem = file.strip_suffix(".gz").unwrap_or(file);
    [".csv", ".parquet"].iter().find_map(|end| stem.strip_suffix(end)).unwrap_or(stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_are_taken_out_and_fields_that_are_no_numbers_passed_over() {
        let mut values = vec![170.0, 179.0, f64::NAN, -175.0, 178.0, -170.0, -20.0, 150.0];
        unwrap(&mut values, 360.0);
        assert!(values[2].is_nan());
        values.remove(2);
        assert_eq!(values, [170.0, 179.0, 185.0, 178.0, 190.0, 340.0, 510.0]);
    }
}
