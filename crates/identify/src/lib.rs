//! Compare a model with measurements, find the missing effect, fit it, and say how sure that is.
//!
//! [`compare`] evaluates the model as it stands, [`diagnose`] names what is missing, [`fit`] estimates parameters and
//! [`discover`] repeats the loop until nothing structured is left or nothing in the catalogue explains the rest.
//! All of them look at one residual: the measured motor motion is imposed on the plant, and every other sensor is
//! compared with what the plant predicts for it.

mod analysis;
mod arrangement;
mod base;
mod before;
mod colour;
mod comparison;
mod course;
mod descent;
mod diagnosis;
mod driven;
mod episode;
mod equations;
mod error;
mod exchange;
mod explore;
mod features;
mod first_look;
mod fitting;
mod freedom;
mod gates;
mod heterogeneity;
mod imposed;
mod innovation;
mod least_squares;
mod limits;
mod merge;
mod moments;
mod options;
mod other_springs;
mod position_units;
mod probability;
mod problem;
mod range_checks;
mod record;
mod refit;
mod remainder;
mod report;
mod residual;
mod round;
mod scale;
mod screen;
mod search;
mod series;
mod settle;
mod slow;
mod spread;
mod starts;
mod surrogate;
mod swings;
mod tangent;
mod tolerance;
mod torque_checks;
mod trial;
mod unknowns;
mod verdict;
mod views;
mod walk;
mod waves;

pub use before::{listed, readiness, strangers, unlocated};
pub use comparison::{Comparison, Known, RunError, SignalError, Trace, compare, compare_knowing};
pub use diagnosis::{Accepted, CandidateReport, ChannelReport, Diagnosis, RivalReport, diagnose};
pub use episode::NAME as EPISODE;
pub use error::IdentifyError;
pub use fitting::{Fit, ParameterReport, StepReport, UNSEEN, discover, fit};
pub use limits::DetectionLimit;
pub use options::{Options, Residual};
pub use probability::{FEATURES, Grounds};
pub use range_checks::range_checks;
pub use report::{Finding, Refusal, Verdict};
pub use surrogate::{FalseAcceptance, SurrogateReport, TrialReport, Turned, trial};
pub use torque_checks::torque_checks;
