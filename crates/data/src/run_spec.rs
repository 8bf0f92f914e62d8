//! A run as named on a command line: a file, or a window of it.

use std::path::PathBuf;
use std::str::FromStr;

use crate::column_map::ColumnMap;
use crate::error::DataError;
use crate::read_run::{Part, read, sensors_file};
use crate::run::Run;

/// A file, or the part of it between two times: `FILE`, `FILE@FROM..TO`, `FILE@..TO`, `FILE@FROM..`.
///
/// The times are in s after the first time stamp of the file; FROM is inside, TO is not. So one half of a log
/// can be fitted and the other kept to check on. `FILE#N` is the Nth recording of a file whose clock starts anew
/// (`FILE#2@0..4` the first four seconds of its second), counted from 1.
///
/// # Example
/// ```
/// use sinew_data::RunSpec;
/// let spec: RunSpec = "log.csv#2@12.5..".parse().unwrap();
/// assert_eq!(spec.path.to_str(), Some("log.csv"));
/// assert_eq!(spec.recording, Some(2));
/// assert_eq!(spec.window, Some((12.5, f64::INFINITY)));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RunSpec {
    /// The file.
    pub path: PathBuf,
    /// Which recording of a file whose clock starts anew, from 1; `None`: the only one.
    pub recording: Option<usize>,
    /// Begin and end of the window, s.
    pub window: Option<(f64, f64)>,
}

impl RunSpec {
    /// Reads the window of the file. Fields outside of it may be empty or no numbers; every row needs its time stamp.
    ///
    /// # Errors
    /// Those of [`crate::read_run`], [`crate::read_recording`] and [`Run::window`].
    pub fn read(&self, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
        read(&self.path, Part { recording: self.recording, window: self.window }, columns)
    }

    /// The files that reading takes: the log, and beside it the one that may state noise and resolution of its sensors.
    ///
    /// # Example
    /// ```
    /// let spec: sinew_data::RunSpec = "day/log.csv.gz@1..2".parse().unwrap();
    /// assert_eq!(spec.files()[1].to_str(), Some("day/log.run.toml"));
    /// ```
    pub fn files(&self) -> [PathBuf; 2] {
        [self.path.clone(), sensors_file(&self.path)]
    }
}

impl FromStr for RunSpec {
    type Err = DataError;

    fn from_str(text: &str) -> Result<Self, DataError> {
        let bad = |what: String| DataError::BadSpec { text: text.into(), what };
        // An @ in a folder or file name opens no window.
        let split = text.rsplit_once('@').filter(|(_, tail)| !tail.contains(['/', '\\']));
        let split = split.and_then(|(file, tail)| Some((file, tail.split_once("..")?)));
        let (file, window) = match split {
            Some((file, (from, to))) => (file, Some((from, to))),
            None => (text, None),
        };
        let (path, recording) = match file.rsplit_once('#') {
            Some((path, number)) if !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()) => {
                let number = number.parse().ok().filter(|&n: &usize| n > 0);
                (path, Some(number.ok_or_else(|| bad("recordings are counted from 1".into()))?))
            }
            _ => (file, None),
        };
        if path.is_empty() {
            let mark = if recording.is_some() { '#' } else { '@' };
            return Err(bad(format!("no file before the {mark}")));
        }
        let Some((from, to)) = window else {
            return Ok(RunSpec { path: path.into(), recording, window: None });
        };
        let seconds = |word: &str, if_empty: f64| match word.trim() {
            "" => Ok(if_empty),
            word => word
                .parse::<f64>()
                .ok()
                .filter(|s| !s.is_nan())
                .ok_or_else(|| bad(format!("not a time (got \"{word}\")"))),
        };
        let (from, to) = (seconds(from, 0.0)?, seconds(to, f64::INFINITY)?);
        if from >= to {
            return Err(bad(format!("the window ends before it begins (got {from}..{to} s)")));
        }
        Ok(RunSpec { path: path.into(), recording, window: Some((from, to)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(text: &str) -> Option<(f64, f64)> {
        text.parse::<RunSpec>().unwrap().window
    }

    #[test]
    fn one_side_of_a_window_may_be_left_out() {
        assert_eq!(window("a.csv"), None);
        assert_eq!(window("a.csv@1.5..3"), Some((1.5, 3.0)));
        assert_eq!(window("a.csv@..3"), Some((0.0, 3.0)));
        assert_eq!(window("a.csv@3.."), Some((3.0, f64::INFINITY)));
    }

    #[test]
    fn an_at_sign_in_a_path_opens_no_window() {
        assert_eq!("me@home/../a.csv".parse::<RunSpec>().unwrap().path.to_str(), Some("me@home/../a.csv"));
        assert_eq!(window("arm@2.csv"), None);
    }

    #[test]
    fn a_number_sign_picks_a_recording() {
        let of = |text: &str| text.parse::<RunSpec>().unwrap();
        assert_eq!((of("a.csv#3").recording, of("a.csv#3@1..2").window), (Some(3), Some((1.0, 2.0))));
        assert_eq!(of("run#b.csv").path.to_str(), Some("run#b.csv"));
        let message = |text: &str| text.parse::<RunSpec>().unwrap_err().to_string();
        assert!(message("a.csv#0").contains("counted from 1"));
        assert!(message("#1").contains("no file before the #"));
    }

    #[test]
    fn a_wrong_window_says_how_to_write_one() {
        let message = |text: &str| text.parse::<RunSpec>().unwrap_err().to_string();
        assert!(message("a.csv@x..3").starts_with("a.csv@x..3: not a time (got \"x\")\n  help: write FILE"));
        assert!(message("a.csv@3..1").contains("ends before it begins (got 3..1 s)"));
        assert!(message("@1..2").contains("no file"));
    }
}
