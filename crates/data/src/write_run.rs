//! Writing a run.

use std::path::Path;

use crate::error::DataError;
use crate::file::{file_name, is_parquet_name, write_bytes};
use crate::run::Run;

#[cfg(feature = "parquet")]
use crate::parquet_file::write as write_parquet;

#[cfg(not(feature = "parquet"))]
fn write_parquet(_run: &Run, path: &Path) -> Result<(), DataError> {
    Err(DataError::NoParquet { file: file_name(path) })
}

impl Run {
    /// Writes the run as Parquet if the name ends in `.parquet`, else as [`Run::write_csv`] does.
    ///
    /// # Errors
    /// If the file cannot be written, or is to be Parquet and the feature `parquet` is not there.
    ///
    /// # Example
    /// ```
    /// # use sinew_data::{Quantity, Run, Signal};
    /// # let folder = std::env::temp_dir().join(format!("sinew-data-write-{}", std::process::id()));
    /// # std::fs::create_dir_all(&folder).unwrap();
    /// let q = Signal::new(Quantity::JointPosition, "elbow", vec![0.5, 0.6]);
    /// let run = Run::new("log".into(), vec![0.0, 0.01], vec![q])?;
    /// run.write(&folder.join("log.csv.gz"))?;
    /// assert_eq!(sinew_data::read_run(&folder.join("log.csv.gz"), None)?.time, run.time);
    /// # std::fs::remove_dir_all(&folder).unwrap();
    /// # Ok::<(), sinew_data::DataError>(())
    /// ```
    pub fn write(&self, path: &Path) -> Result<(), DataError> {
        if is_parquet_name(path) { write_parquet(self, path) } else { self.write_csv(path) }
    }

    /// Writes the run as CSV, packed if the name ends in `.gz`.
    ///
    /// Every number is written with the fewest digits that read back as the same number. The file appears whole
    /// or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), DataError> {
        let csv = self.csv().map_err(|source| DataError::BadCsv { file: file_name(path), source })?;
        write_bytes(path, &csv)
    }

    fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut out = csv::Writer::from_writer(Vec::new());
        out.write_field("time")?;
        for signal in &self.signals {
            out.write_field(signal.name().to_string())?;
        }
        out.write_record(None::<&[u8]>)?;
        for (k, time) in self.time.iter().enumerate() {
            out.write_field(format!("{time:?}"))?;
            for signal in &self.signals {
                out.write_field(format!("{:?}", signal.values[k]))?;
            }
            out.write_record(None::<&[u8]>)?;
        }
        out.into_inner().map_err(|error| error.into_error().into())
    }
}
