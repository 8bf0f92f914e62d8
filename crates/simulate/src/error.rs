//! What can go wrong in a simulation.

use sinew_data::DataError;
use sinew_plant::PlantError;
use thiserror::Error;

/// Why a simulation did not come to its end.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The plant cannot be driven by motor torques.
    #[error(transparent)]
    Plant(Box<PlantError>),
    /// The result is no run.
    #[error(transparent)]
    Run(Box<DataError>),
    /// The solver gave up.
    #[error(
        "t = {time} s: {reason}\n  help: loosen the tolerance, or look for a parameter of unlikely size there"
    )]
    Step {
        /// When, s.
        time: f64,
        /// Why.
        reason: String,
    },
    /// The motion left the world of finite numbers.
    #[error(
        "t = {time} s: joint \"{joint}\" runs away ({what} {got:.3e})\n  help: check the torques, or hold the robot with a controller whose bandwidth is well below the joint's resonance and the sample rate"
    )]
    RunsAway {
        /// When, s.
        time: f64,
        /// The joint.
        joint: String,
        /// Which of its quantities.
        what: &'static str,
        /// What that has become, in SI.
        got: f64,
    },
    /// Something asked for that cannot be.
    #[error("{place}: {what}\n  help: {help}")]
    BadRequest {
        /// Where.
        place: String,
        /// What (got, allowed).
        what: String,
        /// The way out.
        help: String,
    },
}

impl From<PlantError> for SimulateError {
    fn from(error: PlantError) -> Self {
        Self::Plant(Box::new(error))
    }
}

impl From<DataError> for SimulateError {
    fn from(error: DataError) -> Self {
        Self::Run(Box::new(error))
    }
}

/// Why and when a method gave up.
#[derive(Debug)]
pub(crate) struct StepFailure {
    pub time: f64,
    pub reason: String,
}
