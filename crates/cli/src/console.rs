//! Where words go: results to standard output, everything else to standard error.

use std::io::{ErrorKind, Write};

use serde::Serialize;

use crate::error::CliError;

/// What the user wants to see.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    pub json: bool,
    pub quiet: bool,
}

impl Console {
    /// Progress or a message.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            to_standard_error(text);
        }
    }

    /// Who is told how long work gets on.
    pub fn progress(&self) -> Option<fn(&str)> {
        (!self.quiet).then_some(to_standard_error)
    }

    /// The result: as one JSON object, or as the text.
    pub fn answer(&self, object: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), CliError> {
        if self.json {
            let line = serde_json::to_string_pretty(object).map_err(CliError::Json)?;
            print(&format!("{line}\n"))
        } else {
            print(&text())
        }
    }

    /// A text for people; nothing with `--json`.
    pub fn tell(&self, text: &str) -> Result<(), CliError> {
        if self.json { Ok(()) } else { print(&format!("{text}\n")) }
    }
}

fn to_standard_error(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

// A reader that has seen enough, as `head`, is no error.
fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(CliError::Write { path: "standard output".into(), source: error })
        }
        _ => Ok(()),
    }
}
