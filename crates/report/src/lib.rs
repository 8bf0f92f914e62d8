//! The page that shows a diagnosis: one self-contained HTML file, readable in the light, in the dark and on paper.
//!
//! [`page`] draws what `sinew-identify` found: the ladder of errors, the most telling channel over time, the residual against
//! velocity, position and regime, the candidates with their rivals, the tables. No network, no script, no second file.
//! The crate opens no file; [`quantity`] and its kin write numbers the same way for the page and the command line.

mod bins;
mod candidate_view;
mod channel;
mod decimate;
mod frame;
mod input;
mod ladder_view;
mod number;
mod page;
mod regime_view;
mod regimes;
mod scale;
mod scatter_view;
mod svg;
mod time_view;
mod verdict;

pub use input::ReportInput;
pub use number::{number, quantity, with_std};
pub use page::page;
pub use verdict::{effect_in_words, verdict_in_words};
