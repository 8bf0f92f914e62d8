//! What can be wrong with elastic joints.

use thiserror::Error;

/// Why a robot's joints are not elastic joints that move.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FlexJointError {
    /// An elastic joint without a rotor: its motor would answer any torque with an infinite acceleration.
    #[error(
        "joint \"{joint}\": an elastic joint needs a rotor inertia (got {got} kg·m², allowed > 0)\n  help: state `rotor_inertia` in [joints.{joint}]"
    )]
    NoRotor {
        /// The joint.
        joint: String,
        /// Its rotor inertia, kg·m².
        got: f64,
    },
    /// A spring that does not pull back, or a damper that drives.
    #[error(
        "joints {}: {what} is not symmetric and positive (got {got})\n  help: {what} must be a symmetric matrix with positive eigenvalues; damping may also have zeros", joints.join(", ")
    )]
    NotPositive {
        /// The joints of the matrix.
        joints: Vec<String>,
        /// "stiffness" or "damping".
        what: &'static str,
        /// The matrix or number.
        got: String,
    },
    /// A coupling whose matrices do not have the size of its list of joints.
    #[error(
        "joints {}: the {what} of their coupling has the wrong size (got {got} numbers, allowed {allowed})\n  help: give one row and one column for each joint of the coupling", joints.join(", ")
    )]
    Size {
        /// The joints of the coupling.
        joints: Vec<String>,
        /// "stiffness" or "damping".
        what: &'static str,
        /// Numbers given.
        got: usize,
        /// Numbers expected.
        allowed: usize,
    },
}
