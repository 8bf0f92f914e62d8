//! Replaces a file at one stroke: whoever looks, at any moment, finds the old content or the new, never half of one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes `text` to `path`: a temporary file in the same folder, flushed to the disk, then renamed.
pub(crate) fn replace_file(path: &Path, text: &str) -> io::Result<()> {
    stage(path, text)?.commit()
}

/// New content that waits beside its file; removed if it is dropped before it is committed.
struct Staged {
    temporary: PathBuf,
    target: PathBuf,
}

fn stage(path: &Path, text: &str) -> io::Result<Staged> {
    // A link keeps its place: what it points to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let name =
        target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no file name"))?;
    let temporary = (0..)
        .map(|k| target.with_file_name(format!(".{}.{}-{k}.tmp", name.to_string_lossy(), std::process::id())))
        .find(|p| !p.exists())
        .expect("some number is free");
    let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    let staged = Staged { temporary, target };
    file.write_all(text.as_bytes())?;
    if let Ok(old) = fs::metadata(&staged.target) {
        file.set_permissions(old.permissions())?;
    }
    file.sync_all()?;
    Ok(staged)
}

impl Staged {
    fn commit(self) -> io::Result<()> {
        fs::rename(&self.temporary, &self.target)?;
        // The new name reaches the disk with its folder, where folders can be opened at all.
        let folder = self.target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if let Ok(folder) = File::open(folder) {
            folder.sync_all().ok();
        }
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // After the rename there is nothing left to remove.
        fs::remove_file(&self.temporary).ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("sinew-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn the_old_content_stands_until_the_commit_and_nothing_is_left_over() {
        let folder = folder("staged");
        let path = folder.join("arm.sinew.toml");
        replace_file(&path, "old").unwrap();
        let staged = stage(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        drop(staged);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        stage(&path, "new").unwrap().commit().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_that_is_not_there_is_an_error() {
        assert!(replace_file(Path::new("no/such/folder/arm.toml"), "").is_err());
    }
}
