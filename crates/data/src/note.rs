//! What a check has to tell about a run, short of refusing it.

use std::fmt;

use serde::Serialize;

/// How much a note matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Nothing can be inferred from this part of the run.
    Error,
    /// Probably wrong; every answer depends on whether it is.
    Warning,
    /// Worth knowing.
    Note,
}

/// One finding: where, what, and the way out.
///
/// # Example
/// ```
/// use sinew_data::{Note, Severity};
/// let note = Note {
///     severity: Severity::Warning,
///     place: "run.csv:1042".into(),
///     statement: "gap of 0.31 s in the time stamps".into(),
///     help: "use a window of the run without the gap".into(),
/// };
/// assert_eq!(
///     note.to_string(),
///     "warning: run.csv:1042: gap of 0.31 s in the time stamps\n  help: use a window of the run without the gap"
/// );
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Note {
    /// How much it matters.
    pub severity: Severity,
    /// File and line (`run.csv:1042`), or run and signal.
    #[serde(rename = "where")]
    pub place: String,
    /// What was found, with numbers and units.
    pub statement: String,
    /// What the user can do about it.
    pub help: String,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        })
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}\n  help: {}", self.severity, self.place, self.statement, self.help)
    }
}
