//! Writing a run as CSV.

use std::path::Path;

use crate::error::DataError;
use crate::file::{file_name, write_bytes};
use crate::run::Run;

impl Run {
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
