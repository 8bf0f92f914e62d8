//! A run as named on a command line: a file, or a window of it.

use std::path::PathBuf;
use std::str::FromStr;

use crate::column_map::ColumnMap;
use crate::error::DataError;
use crate::read_run::read_run;
use crate::run::Run;

/// A file, or the part of it between two times: `FILE`, `FILE@FROM..TO`, `FILE@..TO`, `FILE@FROM..`.
///
/// The times are in s after the first time stamp of the file; FROM is inside, TO is not. So one half of a log
/// can be fitted and the other kept to check on.
///
/// # Example
/// ```
/// use sinew_data::RunSpec;
/// let spec: RunSpec = "log.csv@12.5..".parse().unwrap();
/// assert_eq!(spec.path.to_str(), Some("log.csv"));
/// assert_eq!(spec.window, Some((12.5, f64::INFINITY)));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RunSpec {
    /// The file.
    pub path: PathBuf,
    /// Begin and end of the window, s.
    pub window: Option<(f64, f64)>,
}

impl RunSpec {
    /// Reads the file and cuts out the window.
    ///
    /// # Errors
    /// Those of [`read_run`] and [`Run::window`].
    pub fn read(&self, columns: Option<&ColumnMap>) -> Result<Run, DataError> {
        let run = read_run(&self.path, columns)?;
        match self.window {
            Some((from, to)) => run.window(from, to),
            None => Ok(run),
        }
    }
}

impl FromStr for RunSpec {
    type Err = DataError;

    fn from_str(text: &str) -> Result<Self, DataError> {
        // An @ in a folder or file name opens no window.
        let split = text.rsplit_once('@').filter(|(_, tail)| !tail.contains(['/', '\\']));
        let Some((file, (from, to))) = split.and_then(|(file, tail)| Some((file, tail.split_once("..")?)))
        else {
            return Ok(RunSpec { path: text.into(), window: None });
        };
        let bad = |what: String| DataError::BadSpec { text: text.into(), what };
        let seconds = |word: &str, if_empty: f64| match word.trim() {
            "" => Ok(if_empty),
            word => word
                .parse::<f64>()
                .ok()
                .filter(|s| !s.is_nan())
                .ok_or_else(|| bad(format!("not a time (got \"{word}\")"))),
        };
        let (from, to) = (seconds(from, 0.0)?, seconds(to, f64::INFINITY)?);
        if file.is_empty() {
            return Err(bad("no file before the @".into()));
        }
        if from >= to {
            return Err(bad(format!("the window ends before it begins (got {from}..{to} s)")));
        }
        Ok(RunSpec { path: file.into(), window: Some((from, to)) })
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
    fn a_wrong_window_says_how_to_write_one() {
        let message = |text: &str| text.parse::<RunSpec>().unwrap_err().to_string();
        assert!(message("a.csv@x..3").starts_with("a.csv@x..3: not a time (got \"x\")\n  help: write FILE"));
        assert!(message("a.csv@3..1").contains("ends before it begins (got 3..1 s)"));
        assert!(message("@1..2").contains("no file"));
    }
}
