//! Files in and out: gzip, UTF-8, and writing that leaves the old file or the new one, never half.

use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

use crate::error::DataError;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The last part of a path, for messages.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// The text of a file, unpacked if it is gzip.
///
/// # Errors
/// If it cannot be read, is no whole gzip file although its name says so, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, DataError> {
    text(&file_name(path), read_bytes(path)?)
}

/// The bytes of a file, unpacked if it is gzip.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, DataError> {
    let bytes = fs::read(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => DataError::Missing { path: path.into() },
        _ => DataError::Unreadable { path: path.into(), source },
    })?;
    if bytes.starts_with(&GZIP_MAGIC) {
        let mut unpacked = Vec::new();
        MultiGzDecoder::new(&bytes[..])
            .read_to_end(&mut unpacked)
            .map_err(|error| DataError::NotGzip { file: file_name(path), what: error.to_string() })?;
        return Ok(unpacked);
    }
    if is_gzip_name(path) && !bytes.is_empty() {
        return Err(DataError::NotGzip { file: file_name(path), what: "no gzip header".into() });
    }
    Ok(bytes)
}

/// The text that these bytes of a file are.
pub(crate) fn text(file: &str, bytes: Vec<u8>) -> Result<String, DataError> {
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        DataError::NotText { file: file.into(), line }
    })
}

/// Writes a file, packed if its name ends in `.gz`: first under another name, then renamed.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), DataError> {
    let temporary = path.with_file_name(format!(".{}.{}.part", file_name(path), std::process::id()));
    let write = || -> io::Result<()> {
        let mut file = fs::File::create(&temporary)?;
        if is_gzip_name(path) {
            let mut packer = GzEncoder::new(&mut file, Compression::default());
            packer.write_all(bytes)?;
            packer.finish()?;
        } else {
            file.write_all(bytes)?;
        }
        file.sync_all()?;
        fs::rename(&temporary, path)
    };
    write().map_err(|source| {
        // The write has failed already; a left-over that cannot be removed adds nothing to that.
        let _ = fs::remove_file(&temporary);
        DataError::Unwritable { path: path.into(), source }
    })
}

/// True if a file is to be Parquet by its name.
pub(crate) fn is_parquet_name(path: &Path) -> bool {
    ends_in(path, "parquet")
}

fn is_gzip_name(path: &Path) -> bool {
    ends_in(path, "gz")
}

/// True if the extension of a path is this one, in letters of any size.
pub(crate) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case(ending))
}
