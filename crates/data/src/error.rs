//! Why a run, a window or a columns map was refused.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::file::ends_in;

/// Everything that can be wrong with measured data and its files.
///
/// Messages read *where*: *what* (*got*, *allowed*), then a `help:` line with the way out.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DataError {
    /// The file does not exist.
    #[error("{}: no such file\n  help: {}", path.display(), help_for_missing(path))]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file exists but cannot be read.
    #[error("{}: cannot be read ({source})\n  help: check that it is a file and that you may read it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written ({source})\n  help: check the folder, its permissions and the space left", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The name ends in `.gz`, the content is not gzip or is cut short.
    #[error(
        "{file}: not a whole gzip file ({what})\n  help: rename it to .csv if it is plain text, else make it again with gzip"
    )]
    NotGzip {
        /// The file.
        file: String,
        /// What is wrong with it.
        what: String,
    },
    /// The name ends in `.parquet`, the content is neither that nor text.
    #[error(
        "{file}: neither a Parquet file nor text\n  help: write it again; a Parquet file begins with PAR1"
    )]
    NotParquet {
        /// The file.
        file: String,
    },
    /// The text is not UTF-8.
    #[error("{file}:{line}: not UTF-8 text\n  help: save the file as CSV in UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// Line of the first wrong byte.
        line: usize,
    },
    /// The file has no byte in it.
    #[error("{file}: the file is empty\n  help: a run needs a header line and at least two samples")]
    Empty {
        /// The file.
        file: String,
    },
    /// There are too few samples to be a run.
    #[error(
        "{place}: too few samples (got {got}, at least 2)\n  help: a run needs a header line and at least two samples"
    )]
    TooShort {
        /// File, or run.
        place: String,
        /// Number of samples.
        got: usize,
    },
    /// The header names nothing that Sinew knows and no columns map was given.
    #[error("{place}: no column has a name that is known here (got {found})\n  help: {help}")]
    NoKnownColumn {
        /// File, and line of its header.
        place: String,
        /// The headers found.
        found: String,
        /// How to name them.
        help: String,
    },
    /// There is no time column.
    #[error(
        "{file}: no time stamps (got {found}); without them velocity and acceleration cannot be computed\n  help: log the time of each sample in a column `time` in s, or name the column: time = {{ column = \"…\" }}"
    )]
    NoTime {
        /// The file.
        file: String,
        /// The headers found.
        found: String,
    },
    /// The columns map names a column that the file does not have.
    #[error(
        "{place}: no column \"{column}\", which the columns map gives to {name} (got {found})\n  help: {help}"
    )]
    MissingColumn {
        /// File, and line of its header.
        place: String,
        /// The column asked for.
        column: String,
        /// The signal it was asked for.
        name: String,
        /// The headers found.
        found: String,
        /// Nearest spelling.
        help: String,
    },
    /// Two columns have the same name.
    #[error("{place}: two columns are called \"{column}\"\n  help: rename one of them")]
    DuplicateColumn {
        /// File, and line of its header.
        place: String,
        /// Their name.
        column: String,
    },
    /// A field is not a number.
    #[error("{place}: column \"{column}\" is not a number (got {got:?})\n  help: {help}")]
    NotNumber {
        /// File and line.
        place: String,
        /// The column.
        column: String,
        /// The text of the field.
        got: String,
        /// The way out.
        help: String,
    },
    /// A value is NaN or infinite.
    #[error("{place}: column \"{column}\" is not finite (got {got}{more})\n  help: {help}")]
    NotFinite {
        /// File and line.
        place: String,
        /// The column.
        column: String,
        /// The value.
        got: f64,
        /// How many more there are; empty if none.
        more: String,
        /// The way out.
        help: String,
    },
    /// A value that would drown everything else.
    #[error(
        "{place}: column \"{column}\": no sensor reads that much (got {got:e}, at most {most:e})\n  help: drop the row, or use a window of the run without it: FILE@FROM..TO"
    )]
    TooLarge {
        /// File and line.
        place: String,
        /// The column.
        column: String,
        /// The value.
        got: f64,
        /// The largest size that is taken.
        most: f64,
    },
    /// A time stamp is earlier than the one before it.
    #[error(
        "{place}: time runs backwards (got {got} s after {previous} s)\n  help: drop the row if its stamp alone is wrong, sort the rows if they were shuffled; a new recording may be cut out: FILE#2 is the second of a file"
    )]
    TimeBackwards {
        /// File and line.
        place: String,
        /// The stamp.
        got: f64,
        /// The stamp before it.
        previous: f64,
    },
    /// The clock starts anew: the file holds several recordings.
    #[error(
        "{place}: time runs backwards (got {got} s after {previous} s): the clock starts anew, {file} holds {recordings} recordings\n  help: name each as a run of its own: {file}#1 … {file}#{recordings}"
    )]
    Recordings {
        /// File and line of the first new start.
        place: String,
        /// The stamp.
        got: f64,
        /// The stamp before it.
        previous: f64,
        /// The file.
        file: String,
        /// Recordings in it.
        recordings: usize,
    },
    /// The file has fewer recordings.
    #[error(
        "{run}: recording {got} does not exist (the file has {recordings}: a new one begins where time runs backwards)\n  help: give a number from 1 to {recordings}"
    )]
    NoRecording {
        /// The run.
        run: String,
        /// The number asked for.
        got: usize,
        /// Recordings in the file.
        recordings: usize,
    },
    /// A time stamp repeats the one before it.
    #[error(
        "{place}: time stamp {got} s is the same as the one before it\n  help: drop the duplicated row, or log the time with more digits"
    )]
    TimeRepeats {
        /// File and line.
        place: String,
        /// The stamp.
        got: f64,
    },
    /// A row has more or fewer fields than the header.
    #[error("{place}: wrong number of fields (got {got}, the header has {expected})\n  help: {help}")]
    FieldCount {
        /// File and line.
        place: String,
        /// Fields in the row.
        got: usize,
        /// Fields in the header.
        expected: usize,
        /// The way out.
        help: String,
    },
    /// A quotation or another part of the CSV cannot be understood.
    #[error("{file}: not a table of comma-separated values\n  help: check the quotation marks")]
    BadCsv {
        /// The file.
        file: String,
        /// What the reader said.
        source: csv::Error,
    },
    /// A column of a Parquet file holds texts, lists or something else than one number a row.
    #[error(
        "{file}: column \"{column}\" does not hold one number a row (its type is {got})\n  help: write it as float, double or whole numbers"
    )]
    NoNumbers {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its type.
        got: String,
    },
    /// A columns map gives a scale to a column whose type has its unit.
    #[error(
        "{file}: column \"{column}\" holds times, which are read in s whatever their unit\n  help: leave `scale` out of its entry in the columns map"
    )]
    ScaledTime {
        /// The file.
        file: String,
        /// The column.
        column: String,
    },
    /// A Parquet file that is broken, cut short, encrypted or packed in a way that is not known here.
    #[cfg(feature = "parquet")]
    #[error(
        "{file}: cannot be read as Parquet ({source})\n  help: write it packed with snappy, gzip, lz4, zstd or not at all; copy it once more if it is not whole"
    )]
    BadParquet {
        /// The file.
        file: String,
        /// What the reader said.
        source: parquet::errors::ParquetError,
    },
    /// A Parquet file, which a build without the feature `parquet` does not read.
    #[error(
        "{file}: Parquet, which this build does not read\n  help: build it with the feature `parquet`, or write the run as CSV"
    )]
    NoParquet {
        /// The file.
        file: String,
    },
    /// A signal has not one value for each time stamp.
    #[error(
        "{run}: {signal} has {got} values, time has {expected}\n  help: give one value for each time stamp"
    )]
    Length {
        /// The run.
        run: String,
        /// The signal.
        signal: String,
        /// Its number of values.
        got: usize,
        /// The number of time stamps.
        expected: usize,
    },
    /// A name of a signal or quantity is wrong.
    #[error("{name}: {what}\n  help: {help}")]
    BadName {
        /// The name as given.
        name: String,
        /// What is wrong with it.
        what: String,
        /// The way out.
        help: String,
    },
    /// A columns map or a `.run.toml` is wrong.
    #[error("{file}:{line}:{column}: {what}\n  help: {help}")]
    BadToml {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1, in characters.
        column: usize,
        /// What is wrong.
        what: String,
        /// The way out.
        help: String,
    },
    /// A window holds fewer than two samples.
    #[error(
        "{run}: window {from}..{to} s holds {got} samples (at least 2; the run lasts {duration} s)\n  help: FROM and TO are seconds after the first time stamp"
    )]
    Window {
        /// The run.
        run: String,
        /// Begin of the window, s.
        from: f64,
        /// End of the window, s.
        to: f64,
        /// Samples inside.
        got: usize,
        /// Duration of the run, s.
        duration: f64,
    },
    /// `FILE#N@FROM..TO` cannot be read.
    #[error(
        "{text}: {what}\n  help: write FILE, FILE@FROM..TO, FILE@FROM.. or FILE@..TO, in seconds after the first time stamp; FILE#N is the Nth recording of a file"
    )]
    BadSpec {
        /// The text as given.
        text: String,
        /// What is wrong with it.
        what: String,
    },
}

fn help_for_missing(path: &Path) -> &'static str {
    match ends_in(path, "toml") {
        true => "check the path",
        false => "check the path; a run is a .csv, .csv.gz or .parquet file",
    }
}
