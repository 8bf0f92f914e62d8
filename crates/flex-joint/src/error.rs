//! What can be wrong with elastic joints.

use sinew_model::UnknownRotorAxis;
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
    /// A link that bends, which joints alone do not describe.
    #[error(
        "link \"{link}\": it bends, and a model of elastic joints has rigid links\n  help: `sinew_plant::Plant` takes both together; or clear `Robot::bending` to have the link rigid"
    )]
    Bends {
        /// The link.
        link: String,
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
    /// The complete model needs the speed of a rotor that a moving link carries.
    #[error(
        "joint \"{joint}\": its rotor rides on link \"{carrier}\", and the complete model needs its speed (no gear ratio)\n  help: state `gear_ratio`, motor turns per joint turn, in [joints.{joint}]; or take the reduced model"
    )]
    NoGearRatio {
        /// The joint.
        joint: String,
        /// The link that carries the rotor.
        carrier: String,
    },
    /// A rotor whose axis is not known in the frame of the link that carries it.
    #[error(
        "joint \"{joint}\": the axis of its rotor is not known in the link that carries it ({reason})\n  help: state {help} in [joints.{joint}]"
    )]
    NoRotorAxis {
        /// The joint.
        joint: String,
        /// Why it is not known.
        reason: String,
        /// What would tell it.
        help: &'static str,
    },
    /// Rotors said to be part of a link that is lighter than they are.
    #[error(
        "link \"{link}\": its moments of inertia are smaller than those of the rotors said to be in them (got {got} kg·m² without the rotors, allowed ≥ 0)\n  help: take `SpinInertia::BesideLinks`, or check gear ratios and rotor inertias of the joints whose rotors it carries"
    )]
    RotorsOutweighLink {
        /// The link.
        link: String,
        /// Smallest principal moment that is left without the rotors, kg·m².
        got: f64,
    },
    /// A motion of the links that is not told in enough derivatives.
    #[error(
        "inverse dynamics: too few derivatives of the links' motion (got order {got}, allowed ≥ {needed})\n  help: in the complete model each rotor on a moving link asks for two more; the reduced model asks for four"
    )]
    TooFewDerivatives {
        /// Order of the highest derivative given.
        got: usize,
        /// Order of the highest derivative that enters.
        needed: usize,
    },
    /// A motor whose torque no finite number of derivatives of the links' motion determines.
    #[error(
        "joint \"{joint}\": its rotor pushes on its own joint or on a later one, so the links' motion does not determine its torque\n  help: let the rotor be carried by an earlier link, or take the reduced model"
    )]
    RotorAhead {
        /// The joint.
        joint: String,
    },
    /// Links that find no rest against their springs.
    #[error(
        "joint \"{joint}\": no rest position of the links was found for these motor positions (torque left: {residual:.3e} after {iterations} steps, allowed {allowed:.1e})\n  help: start nearer to the position expected"
    )]
    NoEquilibrium {
        /// The joint with the largest torque left.
        joint: String,
        /// That torque, N·m (N).
        residual: f64,
        /// Steps taken.
        iterations: usize,
        /// Torque at which the search ends, N·m (N).
        allowed: f64,
    },
}

impl From<UnknownRotorAxis> for FlexJointError {
    fn from(unknown: UnknownRotorAxis) -> Self {
        Self::NoRotorAxis { joint: unknown.joint, reason: unknown.reason, help: unknown.key }
    }
}
