//! Files that a command writes: never one that it reads.

use std::path::Path;

use crate::error::CliError;

/// Refuses a file to write, before any work is done, that ends otherwise, has no folder or is one of those `read`.
pub(crate) fn check(path: &Path, endings: &[&str], read: &[&Path]) -> Result<(), CliError> {
    let name = path.display().to_string();
    let ends = |end: &&str| name.to_ascii_lowercase().ends_with(end);
    if !endings.iter().any(ends) {
        let help = format!("end the name with {}", endings.join(" or "));
        return Err(CliError::usage(name, "says another format than what is written", help));
    }
    check_folder(path)?;
    if read.iter().any(|other| is_same(path, other)) {
        return Err(CliError::usage(name, "is read by this command and would be lost", "give another name"));
    }
    Ok(())
}

/// Refuses a file that has no folder.
pub(crate) fn check_folder(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        let name = path.display().to_string();
        return Err(CliError::usage(name, "there is no such folder", "make the folder first"));
    }
    Ok(())
}

/// True if both are one file that is there.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
