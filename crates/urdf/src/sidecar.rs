//! The sidecar as a text that can be changed without losing its author's comments and order.

use std::path::{Component, Path, PathBuf};

use sinew_model::{EffectSpec, Place, Setting};
use toml_edit::DocumentMut;

use crate::assembly::check_format;
use crate::atomic_file::replace_file;
use crate::edit;
use crate::grammar::read_table;
use crate::source::Source;
use crate::{Location, UrdfError};

/// The sidecar of a robot, `arm.sinew.toml`: its text, and the few changes that `add` and `fit` make.
///
/// # Example
/// ```
/// let mut sidecar = sinew_urdf::Sidecar::new_for("arm.urdf");
/// sidecar.set_joint("elbow", "stiffness", 150.0);
/// assert_eq!(sidecar.text(), "format = 1\nurdf = \"arm.urdf\"\n\n[joints.elbow]\nstiffness = 150.0\n");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sidecar {
    text: String,
    file: String,
    /// Where it lies, if it comes from a file: `urdf` is relative to this folder.
    folder: Option<PathBuf>,
}

impl Sidecar {
    /// A sidecar that adds nothing yet to the URDF beside it.
    pub fn new_for(urdf_file_name: &str) -> Self {
        let mut document = DocumentMut::new();
        document.insert("format", toml_edit::value(1));
        document.insert("urdf", toml_edit::value(urdf_file_name));
        let file = Path::new(urdf_file_name).with_extension("sinew.toml").display().to_string();
        Self { text: document.to_string(), file, folder: None }
    }

    /// The sidecar `text` of `file`, whose grammar has been checked.
    pub(crate) fn parse(text: &str, file: &str) -> Result<Self, UrdfError> {
        text.parse::<DocumentMut>().map_err(|error| UrdfError::Syntax {
            at: Location::of(file, text, error.span().map_or(0, |s| s.start)),
            language: "TOML",
            detail: error.message().to_owned(),
            help: "write it as TOML 1.0",
        })?;
        Ok(Self { text: text.to_owned(), file: file.to_owned(), folder: None })
    }

    /// The same sidecar, known to lie at `path`.
    pub(crate) fn at(mut self, path: &Path) -> Self {
        self.file = path.display().to_string();
        self.folder = path.parent().map(Path::to_owned);
        self
    }

    /// The file it was read from; for a new one, its place beside the URDF.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Its text: byte for byte what was read, if nothing was changed.
    pub fn text(&self) -> String {
        self.text.clone()
    }

    /// Sets `key` in `[joints.JOINT]`, SI. Comments stay, and an equal value stays as it is written; a joint that is
    /// not there yet is appended.
    pub fn set_joint(&mut self, joint: &str, key: &str, value: f64) {
        self.change(|document| edit::set_joint(document, joint, key, value));
    }

    /// States `effect`: the `[[effects]]` table of the same kind and place in the same words (`signal`, `side`) gets
    /// exactly its settings; if there is none, one is appended.
    pub fn set_effect(&mut self, effect: &EffectSpec) {
        self.change(|document| edit::set_effect(document, effect));
    }

    /// Removes the effect of this kind and place; false if the sidecar does not state it.
    ///
    /// What the URDF's `<dynamics>` states cannot be removed here, only overruled by the same effect of strength zero.
    pub fn remove_effect(&mut self, kind: &str, place: &Place) -> bool {
        if let Some(lines) = edit::effect_lines(&self.text, kind, place) {
            self.text.replace_range(lines, "");
            return true;
        }
        let mut removed = false;
        self.change(|document| {
            removed = edit::remove_inline_effect(document, kind, place);
            None
        });
        removed
    }

    /// Writes it to `path` at one stroke: an interrupted write leaves the old file or the new one. In another folder
    /// than the one it was read from, `urdf` is rewritten to lead to the same file.
    ///
    /// # Errors
    /// If the text is no longer a sidecar, a value in it is not finite, or the file cannot be written; what stood
    /// there before is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), UrdfError> {
        let mut moved = self.clone();
        if let Some(urdf) = self.urdf_seen_from(path) {
            moved.change(|document| {
                edit::set_value(document.as_table_mut(), "urdf", &Setting::Word(urdf));
                None
            });
        }
        let (file, text) = (path.display().to_string(), &moved.text);
        let source = Source { file: &file, text };
        check_format(&read_table(&file, text)?, source)?;
        if let Some((value, span)) = edit::not_finite(text) {
            let help = "a result that is not finite is not worth writing";
            return Err(source.value(
                span,
                "a value is not finite".to_owned(),
                value,
                "finite numbers",
                help,
            ));
        }
        replace_file(path, text).map_err(|source| UrdfError::Write { path: path.to_owned(), source })
    }

    // The URDF's path relative to the folder of `path`, if that is not the present folder.
    fn urdf_seen_from(&self, path: &Path) -> Option<String> {
        let document = self.document();
        let urdf = Path::new(document.get("urdf")?.as_str()?);
        let here = full(self.folder.as_deref()?)?;
        let there = full(path.parent()?)?;
        if urdf.is_absolute() || here == there {
            return None;
        }
        let target = here.join(urdf);
        let target = target.canonicalize().unwrap_or(target);
        let shared = there.components().zip(target.components()).take_while(|(a, b)| a == b).count();
        let up = there.components().skip(shared).map(|_| Component::ParentDir);
        let way: PathBuf = up.chain(target.components().skip(shared)).collect();
        Some(way.to_str()?.replace('\\', "/"))
    }

    // Edits the document; what `edit` returns is appended as text of its own, so that nothing written moves.
    fn change(&mut self, edit: impl FnOnce(&mut DocumentMut) -> Option<String>) {
        let mut document = self.document();
        let appended = edit(&mut document);
        let mut text = document.to_string();
        if let Some(table) = appended {
            if !text.is_empty() && !text.ends_with('\n') {
                text.push('\n');
            }
            text.push('\n');
            text.push_str(table.trim_start());
        }
        if self.text.contains("\r\n") {
            text = text.replace("\r\n", "\n").replace('\n', "\r\n");
        }
        self.text = text;
    }

    fn document(&self) -> DocumentMut {
        self.text.parse().expect("the text was checked when it was read, and edits keep it TOML")
    }
}

fn full(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().ok()
}
