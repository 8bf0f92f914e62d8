//! Why a command ended with status 2.

use std::path::PathBuf;

use sinew_data::{DataError, nearest};
use sinew_identify::IdentifyError;
use sinew_linear::LinearError;
use sinew_plant::PlantError;
use sinew_simulate::SimulateError;
use sinew_urdf::{RobotFile, UrdfError};
use thiserror::Error;

/// One message that says where, what, what is allowed and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub(crate) enum CliError {
    /// The robot's files.
    #[error(transparent)]
    Urdf(Box<UrdfError>),
    /// A run or a columns map.
    #[error(transparent)]
    Data(Box<DataError>),
    /// The robot as a plant; the text names the robot's file.
    #[error("{file}: {source}")]
    Plant {
        /// The robot's file.
        file: String,
        /// What is wrong with it.
        source: Box<PlantError>,
    },
    /// The robot as a linear system; the text names the robot's file.
    #[error("{file}: {source}")]
    Linear {
        /// The robot's file.
        file: String,
        /// Why there is none.
        source: Box<LinearError>,
    },
    /// The question.
    #[error(transparent)]
    Identify(Box<IdentifyError>),
    /// The simulation.
    #[error(transparent)]
    Simulate(Box<SimulateError>),
    /// A file that cannot be written.
    #[error("{}: cannot be written ({source})\n  help: check the folder, its permissions and the space left", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A result that is no JSON.
    #[error("result: cannot be written as JSON ({0})\n  help: leave --json out")]
    Json(#[source] serde_json::Error),
    /// Arguments that do not go together or files that do not say what is needed.
    #[error("{place}: {what}\n  help: {help}")]
    Usage {
        /// The argument or file.
        place: String,
        /// What (got, allowed).
        what: String,
        /// The way out.
        help: String,
    },
}

impl CliError {
    pub fn usage(place: impl Into<String>, what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Usage { place: place.into(), what: what.into(), help: help.into() }
    }

    /// What is wrong with the linear model of a robot.
    pub fn linear(file: &RobotFile, source: LinearError) -> Self {
        Self::Linear { file: crate::inputs::name(file), source: Box::new(source) }
    }
}

impl From<UrdfError> for CliError {
    fn from(error: UrdfError) -> Self {
        Self::Urdf(Box::new(error))
    }
}

impl From<DataError> for CliError {
    fn from(error: DataError) -> Self {
        Self::Data(Box::new(error))
    }
}

impl From<IdentifyError> for CliError {
    fn from(error: IdentifyError) -> Self {
        Self::Identify(Box::new(error))
    }
}

impl From<SimulateError> for CliError {
    fn from(error: SimulateError) -> Self {
        Self::Simulate(Box::new(error))
    }
}

/// The help for a misspelt name; none if no known one is like it.
pub(crate) fn did_you_mean<S: AsRef<str>>(name: &str, known: &[S]) -> Option<String> {
    let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
    nearest(name, &known).map(|meant| format!("did you mean \"{meant}\"?"))
}
