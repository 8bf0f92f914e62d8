//! What can be wrong with a model.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use thiserror::Error;

use crate::nearest;

/// Why a model could not be built or asked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A link that was never declared.
    #[error(
        "joint \"{joint}\": no link \"{link}\" in robot \"{robot}\"\n  help: declare the link before the joint, or correct its name"
    )]
    NoSuchLink {
        /// The robot.
        robot: String,
        /// The joint that names the link.
        joint: String,
        /// The missing link.
        link: String,
    },
    /// A joint that does not exist or has no coordinate of its own.
    #[error("robot \"{robot}\": no joint \"{joint}\" with one degree of freedom (joints: {})\n  help: {}", known.join(", "), nearest_help(joint, known))]
    NoSuchJoint {
        /// The robot.
        robot: String,
        /// The joint asked for.
        joint: String,
        /// The joints there are.
        known: Vec<String>,
    },
    /// Two things of one name.
    #[error("robot \"{robot}\": two {what} are called \"{name}\"\n  help: give each its own name")]
    Duplicate {
        /// The robot.
        robot: String,
        /// "links" or "joints".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A link with two parents, a loop, or a second root.
    #[error(
        "robot \"{robot}\": the links do not form a tree: {detail}\n  help: every link but the root must be the child of exactly one joint"
    )]
    NotATree {
        /// The robot.
        robot: String,
        /// What breaks it.
        detail: String,
    },
    /// A joint axis of no length.
    #[error(
        "joint \"{joint}\": the axis ({x}, {y}, {z}) has no direction\n  help: give a vector of length one"
    )]
    NoAxis {
        /// The joint.
        joint: String,
        /// x.
        x: f64,
        /// y.
        y: f64,
        /// z.
        z: f64,
    },
    /// A mimic joint whose leader is missing, mimics itself, or is of several degrees of freedom.
    #[error(
        "joint \"{joint}\": cannot mimic \"{leader}\": {detail}\n  help: mimic a joint that has one coordinate of its own"
    )]
    BadMimic {
        /// The joint that mimics.
        joint: String,
        /// The leader it names.
        leader: String,
        /// Why not.
        detail: String,
    },
}

fn nearest_help(name: &str, known: &[String]) -> String {
    match nearest(name, known) {
        Some(k) => format!("did you mean \"{k}\"?"),
        None => "use one of the names listed".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_joint_is_answered_with_the_nearest_name() {
        let error = ModelError::NoSuchJoint {
            robot: "arm".into(),
            joint: "elbw".into(),
            known: vec!["shoulder".into(), "elbow".into()],
        };
        assert!(error.to_string().ends_with("help: did you mean \"elbow\"?"));
    }
}
