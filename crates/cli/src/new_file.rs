//! Files that a command writes: never one that it reads.

use std::path::{Path, PathBuf};

use crate::error::CliError;

/// Refuses a file to write, before any work is done, that ends otherwise, has no folder, is one or is one of those `read`.
pub(crate) fn check(path: &Path, endings: &[&str], read: &[PathBuf]) -> Result<(), CliError> {
    let name = path.display().to_string();
    let ends = |end: &&str| name.to_ascii_lowercase().ends_with(end);
    if !endings.iter().any(ends) {
        let help = format!("end the name with {}", endings.join(" or "));
        return Err(CliError::usage(name, "says another format than what is written", help));
    }
    check_place(path, read)
}

/// Refuses a file to write that has no folder, is one or is one of those `read`.
pub(crate) fn check_place(path: &Path, read: &[PathBuf]) -> Result<(), CliError> {
    let name = path.display().to_string();
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        return Err(CliError::usage(name, "there is no such folder", "make the folder first"));
    }
    if path.is_dir() {
        return Err(CliError::usage(name, "is a folder", "give the name of a file"));
    }
    if read.iter().any(|other| is_same(path, other)) {
        return Err(CliError::usage(name, "is read by this command and would be lost", "give another name"));
    }
    Ok(())
}

/// True if both are one file that is there.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
