//! Reading a run from a file.

use std::path::{Path, PathBuf};

use crate::column_map::ColumnMap;
use crate::csv_file;
use crate::error::DataError;
use crate::file::{file_name, is_parquet_name, read_bytes, read_text, text};
use crate::layout::{Layout, stem};
use crate::note::{Note, Severity};
use crate::quantity::SignalName;
use crate::run::Run;
use crate::sensor_facts::{SensorFact, SensorFacts};

/// Reads a run from a `.csv`, `.csv.gz` or, with the feature `parquet`, a `.parquet` file.
///
/// Without a columns map the header must use the names `time` and `QUANTITY.PLACE`; columns of the map come
/// before columns of the same name in the file. Fields of a CSV are separated by commas, semicolons or tabs. Columns of
/// Parquet are floating-point or whole numbers of any width; times and time stamps become seconds after the first of their
/// column. If `FILE.run.toml` stands beside `FILE.csv`, noise and resolution of the sensors are taken from it.
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

/// A file as it was read, before any of its samples is refused.
pub(crate) struct Raw {
    pub run: Run,
    pub faults: Vec<Fault>,
    pub layout: Layout,
    /// The headers of its columns.
    pub names: Vec<String>,
}

/// A field that is no number.
pub(crate) struct Fault {
    pub line: u64,
    pub error: DataError,
}

pub(crate) fn read(path: &Path, part: Part, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
    let file = file_name(path);
    let bytes = read_bytes(path)?;
    let raw = match bytes.starts_with(b"PAR1") {
        true => read_parquet(&file, bytes, columns)?,
        false => csv_file::read(&file, &text_of(path, &file, bytes)?, columns)?,
    };
    let Raw { mut run, faults, layout, names } = raw;
    let header_of =
        |name: &SignalName| layout.column_of(name).map_or_else(|| name.to_string(), |c| names[c].clone());
    run.pick(part.recording)?;
    layout.unwrap(&mut run);
    let time_column = &names[layout.time.index];
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

// A text that is called Parquet is read as what it is.
fn text_of(path: &Path, file: &str, bytes: Vec<u8>) -> Result<String, DataError> {
    text(file, bytes).map_err(|error| match is_parquet_name(path) {
        true => DataError::NotParquet { file: file.into() },
        false => error,
    })
}

#[cfg(feature = "parquet")]
use crate::parquet_file::read as read_parquet;

#[cfg(not(feature = "parquet"))]
fn read_parquet(file: &str, _bytes: Vec<u8>, _columns: Option<&ColumnMap>) -> Result<Raw, DataError> {
    Err(DataError::NoParquet { file: file.into() })
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
    let mapped = columns.map_or(&[][..], |map| &map.sensors.list);
    let is_there = |fact: &SensorFact| {
        fact.place.as_ref().is_none_or(|place| run.signal(fact.quantity, place).is_some())
    };
    let note = |fact: &SensorFact, stated_in: String| Note {
        severity: Severity::Warning,
        place: stated_in,
        statement: format!(
            "states noise of {}.{}, which the run does not have",
            fact.quantity,
            fact.place.as_deref().unwrap_or_default()
        ),
        help: "compare its spelling with the header of the run".to_owned(),
    };
    let of_run = own.list.iter().map(|fact| (fact, file_name(&beside)));
    let of_map = mapped.iter().map(|fact| (fact, "the columns map".to_owned()));
    let lost = of_run.chain(of_map).filter(|(fact, _)| !is_there(fact));
    let notes: Vec<Note> = lost.map(|(fact, stated_in)| note(fact, stated_in)).collect();
    run.notes.extend(notes);
    for signal in &mut run.signals {
        own.apply(signal);
        if let Some(map) = columns {
            map.sensors.apply(signal);
        }
    }
    Ok(())
}
