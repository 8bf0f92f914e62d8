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
    /// An effect between motor and link that is not linear, beside a link that follows its load at once.
    #[error(
        "effect \"{effect}\": it is not linear and acts behind an elastic gear, where link \"{link}\" follows its load at once; no describing function is made there\n  help: take its slope (`--nonlinear slope`), leave it out, or state `mass_per_length` in [links.{link}.bending]"
    )]
    BesideFollower {
        /// `effect@place`.
        effect: String,
        /// The link.
        link: String,
    },
    /// A drive that cannot hold the robot.
    #[error(
        "joint \"{joint}\": its drive is at its limit (needed {needed} N·m, allowed {limit} N·m)\n  help: choose a position that it can hold, or state a larger limit"
    )]
    AtLimit {
        /// The joint.
        joint: String,
        /// The torque that holds the robot there.
        needed: f64,
        /// The largest torque that the drive gives.
        limit: f64,
    },
    /// Effects that are not linear over the motion of interest, and are to be refused.
    #[error(
        "robot \"{robot}\": not linear over {size} rad (m) at {frequency} Hz: {}\n  help: describe them by their first harmonic, take their slopes, or leave them out of the sidecar",
        effects.join(", ")
    )]
    NotLinear {
        /// The robot.
        robot: String,
        /// `effect@place` of each.
        effects: Vec<String>,
        /// Amplitude, rad (m).
        size: f64,
        /// Frequency, Hz.
        frequency: f64,
    },
    /// A signal that the linear model does not have.
    #[error(
        "signal \"{name}\": not there (allowed {})\n  help: {}",
        known.join(", "),
        meant.as_ref().map_or_else(|| "write QUANTITY.JOINT, as in motor_torque.J".to_owned(), |m| format!("did you mean \"{m}\"?"))
    )]
    NoSignal {
        /// The name asked for.
        name: String,
        /// The nearest name there is.
        meant: Option<String>,
        /// The names there are.
        known: Vec<String>,
    },
    /// An output that does not answer to an input.
    #[error(
        "from {from} to {to}: the one does not reach the other in this position\n  help: choose signals of joints that move each other"
    )]
    NotReached {
        /// The signal imposed.
        from: String,
        /// The signal that should answer.
        to: String,
    },
    /// A sample time that is none, or a model that has one already.
    #[error(
        "sample time: {} (got {got} s, allowed > 0)\n  help: give the period of the computer that reads and commands, in s",
        if *already { "the model is of discrete time already" } else { "must be greater than zero" }
    )]
    SampleTime {
        /// What was asked for, s.
        got: f64,
        /// True if the model has one.
        already: bool,
    },
    /// A reading or a command that comes before its time.
    #[error(
        "dead time: {delay} s is negative, which no computer can wait for\n  help: shift the log instead, or leave the effect out"
    )]
    NegativeDelay {
        /// The dead time, s.
        delay: f64,
    },
    /// An order that the model cannot be reduced to.
    #[error(
        "order {got}: cannot be reached (allowed {least} to {})\n  help: {least} must stay because they do not die out; all there are is {states}",
        states.saturating_sub(1)
    )]
    Order {
        /// What was asked for.
        got: usize,
        /// The least.
        least: usize,
        /// What the model has.
        states: usize,
    },
    /// A Gramian that does not solve its own equation.
    #[error(
        "Gramian of {size} states: the residual is {residual:e} (allowed {allowed:e})\n  help: give the joints some damping; an almost undamped mode has an almost infinite Gramian"
    )]
    Gramian {
        /// Number of states.
        size: usize,
        /// ‖A P + P Aᵀ + B Bᵀ‖ by ‖A‖‖P‖.
        residual: f64,
        /// What is taken for right.
        allowed: f64,
    },
    /// The mass matrix is not positive definite.
    #[error(
        "robot \"{robot}\": the mass matrix is not positive definite in this position\n  help: give the moving links mass and inertia, or the joint a `rotor_inertia`"
    )]
    Massless {
        /// The robot.
        robot: String,
    },
    /// Load tests without a measured component.
    #[error(
        "load tests: no component of a deflection is measured (got {tests} tests, allowed at least one finite standard deviation)\n  help: state the standard deviation of what was measured, infinity for the rest"
    )]
    NothingMeasured {
        /// Tests given.
        tests: usize,
    },
    /// A spring that does not push back where it stands.
    #[error(
        "joint \"{joint}\": its spring has no stiffness in this position (got {stiffness} N·m/rad, allowed > 0)\n  help: inside the gap of a gear nothing is held; take the backlash out, or load the joint"
    )]
    NoStiffness {
        /// The joint.
        joint: String,
        /// The slope of its torque, N·m/rad.
        stiffness: f64,
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
