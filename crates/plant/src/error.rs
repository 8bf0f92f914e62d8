//! What can be wrong with a plant.

use thiserror::Error;

/// Why a robot cannot be made into a plant.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PlantError {
    /// An effect that the catalogue does not have.
    #[error("effect \"{kind}\": not in the catalogue (it has {})\n  help: `sinew effects` prints each with its law", known.join(", "))]
    NoSuchEffect {
        /// The name asked for.
        kind: String,
        /// The names there are.
        known: Vec<&'static str>,
    },
    /// An effect at a place where it cannot act.
    #[error("effect \"{kind}\" at \"{place}\": {reason}\n  help: {help}")]
    WrongPlace {
        /// The effect.
        kind: String,
        /// The place.
        place: String,
        /// Why not.
        reason: String,
        /// What to do.
        help: String,
    },
    /// A parameter of the wrong form or outside its range.
    #[error("effect \"{kind}\" at \"{place}\": `{key}` {reason} (got {got})\n  help: {help}")]
    BadParameter {
        /// The effect.
        kind: String,
        /// The place.
        place: String,
        /// The parameter.
        key: String,
        /// What is wrong.
        reason: String,
        /// What was given.
        got: String,
        /// What to do.
        help: String,
    },
    /// A link that cannot bend as stated.
    #[error("{message}")]
    Bending {
        /// What is wrong and how to mend it.
        message: String,
    },
    /// A model part that the plant does not take.
    #[error("robot \"{robot}\": {what}\n  help: {help}")]
    Unsupported {
        /// The robot.
        robot: String,
        /// The part.
        what: String,
        /// What to do.
        help: String,
    },
}
