//! Why a comparison, diagnosis or fit is refused.

use sinew_plant::PlantError;
use thiserror::Error;

/// Why there is no answer. Wrong data is refused before anything is inferred from it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The robot is no plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A run lacks what the method needs.
    #[error("{run}: {what}\n  help: {help}")]
    Run {
        /// The run.
        run: String,
        /// What is missing or wrong.
        what: String,
        /// What to do.
        help: String,
    },
    /// The question itself cannot be answered.
    #[error("{what}\n  help: {help}")]
    Question {
        /// What is wrong.
        what: String,
        /// What to do.
        help: String,
    },
}

impl IdentifyError {
    pub(crate) fn run(run: &str, what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Run { run: run.to_owned(), what: what.into(), help: help.into() }
    }
}
