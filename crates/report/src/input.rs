//! What the page is made of.

use sinew_identify::{Comparison, Diagnosis, Fit};
use sinew_model::Robot;

/// Everything a page shows. Comparisons are of the same runs, the unseen ones included.
#[derive(Debug, Clone, Copy)]
pub struct ReportInput<'a> {
    /// The robot as given: its name, and which joints slide.
    pub robot: &'a Robot,
    /// Names of the runs that nothing was fitted to.
    pub unseen: &'a [String],
    /// The error of the model as given.
    pub before: &'a Comparison,
    /// What is missing in the model as given.
    pub diagnosis: &'a Diagnosis,
    /// The ladder and the parameters, where a fit was made.
    pub fit: Option<&'a Fit>,
    /// The error of the fitted model.
    pub after: Option<&'a Comparison>,
}
