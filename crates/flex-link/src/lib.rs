//! Robots with links that bend or twist: lumped springs in virtual joints.
//!
//! [`extend`] splits every bending link of a robot into rigid parts with springs between them, and gives back an
//! ordinary model with the virtual joints among its joints. [`lumped_springs`] says where the springs of a beam stand
//! and how stiff they are; [`extended_compliance`] and [`cartesian_compliance`] put joints and links into one map;
//! [`condense`] eliminates coordinates that have no inertia.
//!
//! # Example
//! The cantilever of 0.8 m and E I = 1200 N·m² with three springs sags under 10 N at its tip by F L³/3EI:
//! ```
//! use sinew_flex_link::{SpringKind, lumped_springs};
//! use sinew_model::BeamSection;
//! let beam = BeamSection {
//!     length: 0.8,
//!     flexural_rigidity: 1200.0,
//!     torsional_rigidity: None,
//!     mass_per_length: 2.1,
//!     polar_inertia_per_length: 0.0,
//! };
//! let springs = lumped_springs(&[beam], 3, SpringKind::Bending);
//! // w = Σ F (L − x)²/k
//! let sag: f64 = springs.iter().map(|s| 10.0 * (0.8 - s.station).powi(2) / s.stiffness).sum();
//! approx::assert_relative_eq!(sag, 10.0 * 0.8f64.powi(3) / (3.0 * 1200.0), max_relative = 1e-14);
//! ```
#![allow(non_snake_case)]

mod base_spring;
mod chain;
mod compliance;
mod condensation;
mod error;
mod extend;
mod following;
mod placement;
mod share;

pub use base_spring::{base_spring, tip_stiffness};
pub use compliance::{cartesian_compliance, extended_compliance, extended_stiffness};
pub use condensation::{Condensed, condense};
pub use error::FlexLinkError;
pub use extend::extend;
pub use placement::{LumpedSpring, SpringKind, lumped_springs};
