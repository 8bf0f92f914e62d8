//! Measured runs: reading, checking, resampling, differentiation, noise.
//!
//! A [`Run`] is a set of time stamps and of signals with a value for each. [`read_run`] reads one from CSV
//! and, with the feature `parquet`, from Parquet, with a [`ColumnMap`] for logs that have headers of their own. The crate knows no robot model: joints are
//! names. What would have to be guessed is refused ([`DataError`]); what is suspicious is told ([`Note`]).

mod checks;
mod column_map;
mod csv_file;
mod error;
mod file;
mod kernel;
mod layout;
mod noise;
mod note;
#[cfg(feature = "parquet")]
mod parquet_file;
mod quantisation;
mod quantity;
mod read_run;
mod rebuild_clock;
mod repeats;
mod resample;
mod run;
mod run_spec;
#[cfg(test)]
mod samples;
mod sensor_facts;
mod settings_file;
mod smoother;
mod spelling;
mod statistics;
mod write_run;

pub use checks::check_run;
pub use column_map::ColumnMap;
pub use error::DataError;
pub use file::read_text;
pub use kernel::Kernel;
pub use noise::{autocovariance, fourth_difference_lag1, instrument_noise, white_noise_std};
pub use note::{Note, Severity};
pub use quantisation::quantisation_step;
pub use quantity::{Quantity, SignalName};
pub use read_run::{read_recording, read_run};
pub use rebuild_clock::rebuild_clock;
pub use repeats::{Repeat, find_repeats};
pub use resample::{Uniform, resample, resample_through};
pub use run::{Run, Signal};
pub use run_spec::RunSpec;
pub use sensor_facts::{SensorFact, SensorFacts};
pub use smoother::Smoother;
pub use spelling::nearest;
