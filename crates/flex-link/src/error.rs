//! What can be wrong with a bending link.

use thiserror::Error;

/// Why a link cannot be split into parts with springs between them.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FlexLinkError {
    /// It is not plain which way the link runs.
    #[error(
        "link \"{link}\": it is not plain along which of its axes it runs (got {got})\n  help: state `along = \"x\"` (or \"-x\", \"y\" …) in [links.{link}.bending]"
    )]
    NoDirection {
        /// The link.
        link: String,
        /// What it carries and where.
        got: String,
    },
    /// The axis of the beam itself, without a torsional rigidity.
    #[error(
        "link \"{link}\": \"{axis}\" is the axis along which the link runs, about which it twists, and it has no torsional rigidity (got no GJ)\n  help: state GJ = … in N·m² in [links.{link}.bending], or leave \"{axis}\" out of axes"
    )]
    NoTorsion {
        /// The link.
        link: String,
        /// The axis.
        axis: char,
    },
    /// The beam has what the link has not.
    #[error(
        "link \"{link}\": the beam does not fit into the link: {what} (got {got}, allowed {allowed})\n  help: lower mass_per_length in [links.{link}.bending], or correct the link's inertia; what the link has beside the beam rides on it as a rigid body"
    )]
    DoesNotFit {
        /// The link.
        link: String,
        /// Of which quantity the beam has more than the link.
        what: &'static str,
        /// The beam's.
        got: String,
        /// The link's.
        allowed: String,
    },
    /// A description that is none.
    #[error("link \"{link}\": {what} (got {got}, allowed {allowed})\n  help: {help}")]
    Value {
        /// The link.
        link: String,
        /// What is wrong.
        what: &'static str,
        /// What was given.
        got: String,
        /// What may be.
        allowed: &'static str,
        /// What to do.
        help: &'static str,
    },
}
