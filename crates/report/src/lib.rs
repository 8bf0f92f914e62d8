//! The page that shows a diagnosis: one self-contained HTML file, readable in the light, in the dark and on paper.
//!
//! [`page`] draws what `sinew-identify` found: the ladder of errors, the most telling channel over time, the residual against
//! velocity, position and regime, the candidates with their rivals, the tables. No network, no script, no second file.
//! [`bode_view`], [`modes_view`], [`compliance_view`] and [`workspace_view`] are drawings that stand alone. The crate opens no file; [`quantity`] and its kin write numbers the same way for the page and the command line.

mod bins;
mod bode_view;
mod candidate_view;
mod channel;
mod decimate;
mod drawing;
mod frame;
mod input;
mod ladder_view;
mod modes_view;
mod number;
mod page;
mod regime_view;
mod regimes;
mod scale;
mod scatter_view;
mod stiffness_view;
mod svg;
mod time_view;
mod verdict;

pub use bode_view::bode_view;
pub use drawing::Drawing;
pub use input::ReportInput;
pub use modes_view::modes_view;
pub use number::{number, quantity, with_std};
pub use page::page;
pub use stiffness_view::{compliance_view, workspace_view};
pub use verdict::{effect_in_words, verdict_in_words};
