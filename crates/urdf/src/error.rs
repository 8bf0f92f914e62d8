//! What can be wrong with a robot's files, and where.

use std::fmt;
use std::path::{Path, PathBuf};

use sinew_model::{ModelError, nearest};
use thiserror::Error;

/// A place in a text file; line and column count from one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The file, as the caller named it.
    pub file: Box<str>,
    /// Line.
    pub line: u32,
    /// Column, in characters.
    pub column: u32,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

impl Location {
    /// The place of byte `offset` of `text`.
    pub(crate) fn of(file: &str, text: &str, offset: usize) -> Self {
        let bytes = &text.as_bytes()[..offset.min(text.len())];
        let start = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        let line = 1 + bytes.iter().filter(|b| **b == b'\n').count();
        // Bytes that continue a character of UTF-8 do not count.
        let column = 1 + bytes[start..].iter().filter(|b| *b & 0xC0 != 0x80).count();
        Self { file: file.into(), line: line as u32, column: column as u32 }
    }
}

// What to do about a file that cannot be read.
fn way_to_read(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::InvalidData => "a robot is text: a URDF (XML) or a sidecar (TOML), in UTF-8",
        _ => "check the path and the permissions",
    }
}

/// Reads a file of text.
pub(crate) fn read_text(path: &Path) -> Result<String, UrdfError> {
    std::fs::read_to_string(path).map_err(|source| UrdfError::Read { path: path.to_owned(), source })
}

/// Why a robot could not be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// A file that cannot be read.
    #[error("{}: cannot be read ({source})\n  help: {}", path.display(), way_to_read(source))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file that cannot be written; what was there before is untouched.
    #[error("{}: cannot be written ({source})\n  help: check the folder, its permissions and the free space", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A sidecar whose URDF is not there.
    #[error("{at}: urdf: the file {} cannot be read ({source})\n  help: the path is relative to the sidecar's folder", path.display())]
    NoUrdf {
        /// Where the sidecar names it.
        at: Location,
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Text that is no XML or no TOML.
    #[error("{at}: not well-formed {language}: {detail}\n  help: {help}")]
    Syntax {
        /// Where.
        at: Location,
        /// "XML" or "TOML".
        language: &'static str,
        /// What the parser says.
        detail: String,
        /// The way out.
        help: &'static str,
    },
    /// XML that is no URDF.
    #[error("{at}: not a URDF: {detail}\n  help: {help}")]
    NotUrdf {
        /// Where.
        at: Location,
        /// What it is instead.
        detail: String,
        /// The way out.
        help: &'static str,
    },
    /// An element or attribute that must be there.
    #[error("{at}: {what} is missing\n  help: {help}")]
    Missing {
        /// Where it should be.
        at: Location,
        /// What.
        what: String,
        /// The way out.
        help: String,
    },
    /// A value that cannot be.
    #[error("{at}: {what} (got {got}, allowed: {allowed})\n  help: {help}")]
    Value {
        /// Where.
        at: Location,
        /// The quantity and what is wrong with it.
        what: String,
        /// The value.
        got: String,
        /// What it may be.
        allowed: String,
        /// The way out.
        help: &'static str,
    },
    /// A key that the format does not have.
    #[error("{at}: unknown key \"{key}\"{} (allowed: {})\n  help: {}", in_table(table), allowed.join(", "), did_you_mean(key, allowed, "keys"))]
    UnknownKey {
        /// Where.
        at: Location,
        /// The table it stands in; empty at the top.
        table: String,
        /// The key.
        key: String,
        /// The keys of that table.
        allowed: Vec<String>,
    },
    /// A joint, link, effect or other word that is not known.
    #[error("{at}: no {what} \"{name}\" {scope} ({what}s: {})\n  help: {}", known.join(", "), did_you_mean(name, known, "names"))]
    UnknownName {
        /// Where.
        at: Location,
        /// "joint", "link", "effect".
        what: &'static str,
        /// The name.
        name: String,
        /// Where it was looked for, as in `in robot "arm"`.
        scope: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// Something stated twice.
    #[error("{at}: {what} twice (first in line {first})\n  help: {help}")]
    Twice {
        /// The second place.
        at: Location,
        /// What is stated.
        what: String,
        /// Line of the first.
        first: u32,
        /// The way out.
        help: &'static str,
    },
    /// A URDF without any inertia.
    #[error(
        "{file}: no link of robot \"{robot}\" has an <inertial>: dynamics is impossible\n  help: add <inertial> with mass and inertia to the moving links, or use a description that has them"
    )]
    NoInertia {
        /// The file.
        file: String,
        /// The robot.
        robot: String,
    },
    /// A joint that moves no inertia.
    #[error(
        "{at}: joint \"{joint}\" moves no inertia: the mass matrix is singular\n  help: give link \"{link}\" or what it carries an <inertial>, or{}",
        if *elastic { " remove the stiffness and give the joint a rotor_inertia in the sidecar" } else { " give the joint a rotor_inertia in the sidecar" }
    )]
    Singular {
        /// Where the joint stands.
        at: Location,
        /// The joint.
        joint: String,
        /// The link it moves.
        link: String,
        /// True if a spring separates it from its rotor.
        elastic: bool,
    },
    /// A mechanism that is no tree, has doubtful names or axes.
    #[error("{at}: {source}")]
    Model {
        /// Where.
        at: Location,
        /// What is wrong.
        source: ModelError,
    },
}

pub(crate) fn did_you_mean(name: &str, known: &[String], what: &str) -> String {
    match nearest(name, known) {
        Some(k) => format!("did you mean \"{k}\"?"),
        None => format!("use one of the {what} listed"),
    }
}

fn in_table(table: &str) -> String {
    if table.is_empty() { String::new() } else { format!(" in {table}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one() {
        let text = "a\nτ = x\n";
        let at = |needle: &str| {
            let l = Location::of("f", text, text.find(needle).unwrap());
            (l.line, l.column)
        };
        assert_eq!((at("a"), at("τ"), at("x")), ((1, 1), (2, 1), (2, 5)));
        assert_eq!(Location::of("f", text, 99).to_string(), "f:3:1");
    }
}
