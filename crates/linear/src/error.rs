//! What can go wrong in a linearisation.

use thiserror::Error;

/// Why a plant has no linear model there.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LinearError {
    /// The plant cannot be driven by motor torques.
    #[error(transparent)]
    Plant(#[from] Box<sinew_plant::PlantError>),
    /// No motor position carries the links.
    #[error(
        "robot \"{robot}\": the springs cannot carry gravity in this position (torque left over {missing} N·m)\n  help: look at stiffness and gap of its joints"
    )]
    NoEquilibrium {
        /// The robot.
        robot: String,
        /// The torque that no spring carries.
        missing: f64,
    },
    /// The mass matrix is not positive definite.
    #[error(
        "robot \"{robot}\": the mass matrix is not positive definite in this position\n  help: give the moving links mass and inertia, or the joint a `rotor_inertia`"
    )]
    Massless {
        /// The robot.
        robot: String,
    },
    /// An eigenvalue problem whose answer does not check.
    #[error(
        "eigenvalues of {size} states: the residual is {residual:e} (allowed {allowed:e})\n  help: look for stiffnesses or inertias of very different size"
    )]
    Eigenvalues {
        /// Number of states.
        size: usize,
        /// ‖A v − λ v‖/‖A‖, the largest.
        residual: f64,
        /// What is taken for right.
        allowed: f64,
    },
}

impl From<sinew_plant::PlantError> for LinearError {
    fn from(error: sinew_plant::PlantError) -> Self {
        Self::Plant(Box::new(error))
    }
}
