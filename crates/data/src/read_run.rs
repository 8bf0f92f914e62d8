//! Reading a run from CSV.

use std::path::{Path, PathBuf};

use crate::column_map::{Column, ColumnMap};
use crate::error::DataError;
use crate::file::{file_name, read_text};
use crate::note::{Note, Severity};
use crate::quantity::SignalName;
use crate::run::{Origin, Run, Signal};
use crate::sensor_facts::{SensorFact, SensorFacts};
use crate::spelling::nearest;

/// Reads a run from a `.csv` or `.csv.gz` file.
///
/// Without a columns map the header must use the names `time` and `QUANTITY.PLACE`; columns of the map come
/// before columns of the same name in the file. Fields are separated by commas, semicolons or tabs. If
/// `FILE.run.toml` stands beside `FILE.csv`, noise and resolution of the sensors are taken from it.
///
/// # Errors
/// Everything that would have to be guessed or mended is refused with file, line and column: no time stamps,
/// time that does not increase, a field that is not a finite number, a row of another length, and so on.
///
/// # Example
/// ```
/// # let folder = std::env::temp_dir().join(format!("sinew-data-read-run-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder).unwrap();
/// let path = folder.join("log.csv");
/// std::fs::write(&path, "time,joint_position.elbow\n0.0,0.5\n0.01,0.6\n").unwrap();
/// let run = sinew_data::read_run(&path, None).unwrap();
/// assert_eq!(run.name, "log");
/// assert_eq!(run.signals[0].values, [0.5, 0.6]);
/// # std::fs::remove_dir_all(&folder).unwrap();
/// ```
pub fn read_run(path: &Path, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
    read(path, Part::default(), columns)
}

/// Reads one recording of a file in which several stand one below the other: a new one begins where the clock
/// runs backwards. `number` counts from 1; the run is called `log#2`.
///
/// # Errors
/// As for [`read_run`], or if the file has no such recording.
///
/// # Example
/// ```
/// # let folder = std::env::temp_dir().join(format!("sinew-data-read-recording-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder).unwrap();
/// let path = folder.join("log.csv");
/// std::fs::write(&path, "time,joint_position.elbow\n0.0,0.5\n0.01,0.6\n0.0,0.1\n0.01,0.2\n").unwrap();
/// let run = sinew_data::read_recording(&path, 2, None).unwrap();
/// assert_eq!((run.name.as_str(), run.signals[0].values.as_slice()), ("log#2", [0.1, 0.2].as_slice()));
/// assert!(sinew_data::read_run(&path, None).is_err());
/// # std::fs::remove_dir_all(&folder).unwrap();
/// ```
pub fn read_recording(path: &Path, number: usize, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
    read(path, Part { recording: Some(number), window: None }, columns)
}

/// What of a file is wanted: fields outside it may hold anything.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Part {
    /// Which of the recordings that stand one below the other, counted from 1.
    pub recording: Option<usize>,
    /// Begin and end, s after the first time stamp.
    pub window: Option<(f64, f64)>,
}

pub(crate) fn read(path: &Path, part: Part, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
    let file = file_name(path);
    let text = read_text(path)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    if text.trim().is_empty() {
        return Err(DataError::Empty { file });
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter(text))
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(source) => return Err(DataError::BadCsv { file, source }),
    };
    let layout = Layout::new(&file, &headers, columns)?;
    let (mut run, faults) = layout.read(file, text, &headers, &mut reader)?;
    let header_of = |name: &SignalName| {
        let place = layout.signals.iter().find(|s| s.0 == *name);
        place.map_or_else(|| name.to_string(), |s| headers[s.1.index].to_string())
    };
    run.pick(part.recording)?;
    let time_column = &headers[layout.time.index];
    if let Some((from, to)) = part.window {
        run.validate_time(time_column)?;
        run = run.window(from, to)?;
    }
    if let Some(fault) = faults.into_iter().find(|fault| run.has_line(fault.line)) {
        return Err(fault.error);
    }
    run.validate(header_of, time_column)?;
    state_sensors(&mut run, path, columns)?;
    Ok(run)
}

/// The file beside a log that may state noise and resolution of its sensors.
pub(crate) fn sensors_file(path: &Path) -> PathBuf {
    path.with_file_name(format!("{}.run.toml", stem(&file_name(path))))
}

/// Writes noise and resolution into the signals; `FILE.run.toml` wins over the columns map.
fn state_sensors(run: &mut Run, path: &Path, columns: Option<&ColumnMap>) -> Result<(), DataError> {
    let beside = sensors_file(path);
    let own = match beside.is_file() {
        true => SensorFacts::parse(&read_text(&beside)?, &file_name(&beside))?,
        false => SensorFacts::default(),
    };
    let is_there = |fact: &SensorFact| {
        fact.place.as_ref().is_none_or(|place| run.signal(fact.quantity, place).is_some())
    };
    let note = |fact: &SensorFact| Note {
        severity: Severity::Warning,
        place: file_name(&beside),
        statement: format!(
            "states noise of {}.{}, which the run does not have",
            fact.quantity,
            fact.place.as_deref().unwrap_or_default()
        ),
        help: "compare its spelling with the header of the run".to_owned(),
    };
    let notes: Vec<Note> = own.list.iter().filter(|f| !is_there(f)).map(note).collect();
    run.notes.extend(notes);
    for signal in &mut run.signals {
        own.apply(signal);
        if let Some(map) = columns {
            map.sensors.apply(signal);
        }
    }
    Ok(())
}

/// Which field of a row is which signal.
struct Layout {
    time: Field,
    signals: Vec<(SignalName, Field)>,
    notes: Vec<Note>,
}

/// A field that is no number.
struct Fault {
    line: u64,
    error: DataError,
}

/// Counts lines up to a row, over blank lines and both kinds of line end.
struct LineCursor<'a> {
    text: &'a [u8],
    byte: usize,
    line: u64,
}

struct Field {
    index: usize,
    plus: Option<usize>,
    times: Option<usize>,
    scale: f64,
    offset: f64,
}

impl Layout {
    fn new(
        file: &str,
        headers: &csv::StringRecord,
        columns: Option<&ColumnMap>,
    ) -> Result<Layout, DataError> {
        let found = found(headers);
        let mut time = headers.iter().position(|h| h == "time").map(Field::plain);
        let mut signals = Vec::new();
        if let Some(map) = columns {
            if let Some(column) = &map.time {
                time = Some(Field::mapped(file, headers, map, "time", column)?);
            }
            for (name, column) in &map.signals {
                signals.push((name.clone(), Field::mapped(file, headers, map, &name.to_string(), column)?));
            }
        }
        let mut unknown = Vec::new();
        for (field, header) in headers.iter().enumerate() {
            match header.parse::<SignalName>() {
                Ok(name) if columns.is_some_and(|map| map.signals.contains_key(&name)) => {}
                Ok(name) if signals.iter().any(|s| s.0 == name) => {
                    return Err(DataError::DuplicateColumn { file: file.into(), column: header.into() });
                }
                Ok(name) => signals.push((name, Field::plain(field))),
                Err(error) if header != "time" => unknown.push((header, error)),
                Err(_) => {}
            }
        }
        if signals.is_empty() {
            return Err(DataError::NoKnownColumn { file: file.into(), found, help: naming(headers) });
        }
        let Some(time) = time else { return Err(DataError::NoTime { file: file.into(), found }) };
        let notes = if columns.is_some() { Vec::new() } else { ignored(file, &unknown) };
        Ok(Layout { time, signals, notes })
    }

    /// The rows that follow the header; fields of signals that are no numbers are NaN, and told besides.
    fn read(
        &self,
        file: String,
        text: &str,
        headers: &csv::StringRecord,
        reader: &mut csv::Reader<&[u8]>,
    ) -> Result<(Run, Vec<Fault>), DataError> {
        let (mut time, mut lines, mut faults) = (Vec::new(), Vec::new(), Vec::new());
        let mut values = vec![Vec::new(); self.signals.len()];
        let mut row = csv::StringRecord::new();
        let mut cursor = LineCursor { text: text.as_bytes(), byte: 0, line: 1 };
        while match reader.read_record(&mut row) {
            Ok(more) => more,
            Err(source) => return Err(DataError::BadCsv { file, source }),
        } {
            let line = cursor.line_at(row.position().map_or(0, |p| p.byte() as usize));
            let place = || format!("{file}:{line}");
            if row.len() != headers.len() {
                let (got, expected) = (row.len(), headers.len());
                let help = match got {
                    _ if got == 2 * expected => "a decimal comma? Write the decimal point as a full stop",
                    _ => "complete or drop the row; a log that was cut off ends like this",
                };
                return Err(DataError::FieldCount { place: place(), got, expected, help: help.into() });
            }
            time.push(self.time.number(&row, headers, place)?);
            for (values, (_, field)) in values.iter_mut().zip(&self.signals) {
                let value = field.number(&row, headers, place);
                values.push(value.unwrap_or_else(|error| {
                    faults.push(Fault { line, error });
                    f64::NAN
                }));
            }
            lines.push(line);
        }
        let signals = self.signals.iter().zip(values);
        let signals = signals.map(|((name, _), values)| Signal::new(name.quantity, &name.place, values));
        let run = Run {
            name: stem(&file).into(),
            time,
            signals: signals.collect(),
            notes: self.notes.clone(),
            left_out: Vec::new(),
            origin: Some(Origin { file, lines }),
        };
        Ok((run, faults))
    }
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

impl Field {
    fn plain(index: usize) -> Field {
        Field { index, plus: None, times: None, scale: 1.0, offset: 0.0 }
    }

    fn mapped(
        file: &str,
        headers: &csv::StringRecord,
        map: &ColumnMap,
        name: &str,
        column: &Column,
    ) -> Result<Field, DataError> {
        let find = |header: &str| Self::find(file, headers, map, name, header);
        Ok(Field {
            index: find(&column.header)?,
            plus: column.plus.as_deref().map(find).transpose()?,
            times: column.times.as_deref().map(find).transpose()?,
            scale: column.scale,
            offset: column.offset,
        })
    }

    // Which field has a header that a map names.
    fn find(
        file: &str,
        headers: &csv::StringRecord,
        map: &ColumnMap,
        name: &str,
        header: &str,
    ) -> Result<usize, DataError> {
        let mut fields = headers.iter().enumerate().filter(|(_, h)| *h == header).map(|(i, _)| i);
        match (fields.next(), fields.next()) {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => {
                Err(DataError::DuplicateColumn { file: file.into(), column: header.into() })
            }
            (None, _) => Err(DataError::MissingColumn {
                file: file.into(),
                column: header.into(),
                name: name.into(),
                found: found(headers),
                // A column that the map gives to another name is not the one that was meant.
                help: match nearest(header, &headers.iter().filter(|h| !map.uses(h)).collect::<Vec<_>>()) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => "correct the columns map".into(),
                },
            }),
        }
    }

    /// The number of this field in a row, in SI.
    fn number(
        &self,
        row: &csv::StringRecord,
        headers: &csv::StringRecord,
        place: impl Fn() -> String,
    ) -> Result<f64, DataError> {
        let raw = |index: usize| {
            let text = &row[index];
            parse(text).ok_or_else(|| DataError::NotNumber {
                place: place(),
                column: headers[index].into(),
                got: text.into(),
                help: help_for(text),
            })
        };
        let or = |column: Option<usize>, without: f64| column.map_or(Ok(without), raw);
        // value = scale · (column + plus) · times + offset
        Ok(self.scale * (raw(self.index)? + or(self.plus, 0.0)?) * or(self.times, 1.0)? + self.offset)
    }
}

/// The name of a file without `.csv` or `.csv.gz`.
fn stem(file: &str) -> &str {
    let stem = file.strip_suffix(".gz").unwrap_or(file);
    stem.strip_suffix(".csv").unwrap_or(stem)
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

/// How to name the columns of a log none of which has a name that is known.
fn naming(headers: &csv::StringRecord) -> String {
    if headers.iter().all(|h| parse(h).is_some()) {
        return "the first line holds numbers: write a line of names above it, \
                time,motor_position.JOINT,motor_torque.JOINT… with the URDF's joints"
            .into();
    }
    if headers.iter().any(|h| h.to_lowercase().parse::<SignalName>().is_ok()) {
        return "quantities are written in small letters: time, motor_position.JOINT, motor_torque.JOINT …"
            .into();
    }
    // A header with one of these letters; one after another if none has them.
    let like = |words: &[&str], other: usize| {
        let has = |h: &&str| words.iter().any(|word| h.to_lowercase().contains(word));
        headers.iter().skip(1).find(has).or(headers.get(other)).unwrap_or("…").to_owned()
    };
    let time = headers.get(0).unwrap_or("…");
    let (position, torque) = (like(&["pos", "q", "angle"], 1), like(&["torque", "tau", "effort", "tq"], 2));
    format!(
        "say which column is what with --columns map.toml, for every JOINT of the URDF, for example\n    \
         time = {{ column = \"{time}\" }}\n    \
         \"motor_position.JOINT\" = {{ column = \"{position}\", scale = 1.0 }}  # to rad\n    \
         \"motor_torque.JOINT\" = {{ column = \"{torque}\", scale = 1.0 }}  # to N·m behind the gear; motor_current: A\n    \
         # joint_position, joint_torque: what sensors behind the gear show"
    )
}

fn found(headers: &csv::StringRecord) -> String {
    const SHOWN: usize = 12;
    let mut names: Vec<&str> = headers.iter().take(SHOWN).collect();
    let more = format!("and {} more", headers.len().saturating_sub(SHOWN));
    if headers.len() > SHOWN {
        names.push(&more);
    }
    names.join(", ")
}

fn ignored(file: &str, unknown: &[(&str, DataError)]) -> Vec<Note> {
    let note = |(header, error): &(&str, DataError)| Note {
        severity: Severity::Note,
        place: format!("{file}:1"),
        statement: format!("column \"{header}\" is not known and was ignored"),
        help: match error {
            DataError::BadName { help, .. } => help.clone(),
            _ => "name it with --columns".into(),
        },
    };
    unknown.iter().map(note).collect()
}
