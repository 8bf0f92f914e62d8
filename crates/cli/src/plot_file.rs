//! Drawings on request: SVG, or a page with one.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_report::Drawing;

use crate::error::CliError;

/// Where a drawing goes.
#[derive(Debug, Args)]
pub(crate) struct PlotFile {
    /// A drawing: .svg, or .html
    #[arg(long, value_name = "DRAWING")]
    plot: Option<PathBuf>,
}

impl PlotFile {
    /// Refuses a name that says no format, before any work is done.
    pub fn check(&self) -> Result<(), CliError> {
        let Some(path) = &self.plot else { return Ok(()) };
        if is(path, "svg") || is(path, "html") {
            return Ok(());
        }
        let place = path.display().to_string();
        Err(CliError::usage(
            place,
            "no format of a drawing (allowed svg, html)",
            "end the name with .svg or .html",
        ))
    }

    /// Writes the drawing, if one is wanted.
    pub fn write(&self, drawing: impl FnOnce() -> Drawing) -> Result<(), CliError> {
        let Some(path) = &self.plot else { return Ok(()) };
        let drawing = drawing();
        let text = if is(path, "svg") { drawing.svg() } else { drawing.html() };
        std::fs::write(path, text).map_err(|source| CliError::Write { path: path.clone(), source })
    }
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
