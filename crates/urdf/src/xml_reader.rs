//! Elements and attributes of a URDF, read with the place of whatever is wrong.

use std::fmt::Write;

use roxmltree::Node;

use crate::xml::CheckedXml;
use crate::{Location, Note, Severity, UrdfError};

/// Walks the XML of one file; what it has checked gathers in `checked`.
pub(crate) struct Checker<'a> {
    pub file: &'a str,
    pub source: &'a str,
    pub checked: CheckedXml,
}

impl Checker<'_> {
    /// The first child called `tag`; a second one is noted and ignored, as urdfdom does.
    pub(crate) fn first<'d, 'i>(
        &mut self,
        node: Node<'d, 'i>,
        tag: &str,
        what: &str,
    ) -> Option<Node<'d, 'i>> {
        let mut found = node.children().filter(|n| n.is_element() && n.tag_name().name() == tag);
        let first = found.next();
        if let Some(second) = found.next() {
            self.note(second, format!("{what}: a second <{tag}> is ignored"), "keep the one that is meant");
        }
        first
    }

    pub(crate) fn required<'d, 'i>(
        &mut self,
        node: Node<'d, 'i>,
        tag: &str,
        what: &str,
    ) -> Result<Node<'d, 'i>, UrdfError> {
        let inside = node.tag_name().name();
        self.first(node, tag, what).ok_or_else(|| UrdfError::Missing {
            at: self.at(node),
            what: format!("{what}: <{tag}> in <{inside}>"),
            help: format!("add <{tag} …/> inside <{inside}>"),
        })
    }

    pub(crate) fn word(&self, node: Node, key: &str, what: &str) -> Result<String, UrdfError> {
        match node.attribute(key).map(str::trim) {
            Some(word) if !word.is_empty() => Ok(word.to_owned()),
            _ => Err(self.no_attribute(node, key, what)),
        }
    }

    pub(crate) fn number(
        &self,
        node: Node,
        key: &str,
        default: Option<f64>,
        what: &str,
    ) -> Result<f64, UrdfError> {
        match default {
            Some(value) if !node.has_attribute(key) => Ok(value),
            _ => {
                let value = self.real(node, key, what)?;
                let at = || self.at_attribute(node, key);
                if value.is_finite() { Ok(value) } else { Err(not_finite(at(), what, key, value)) }
            }
        }
    }

    /// A number that may be infinite.
    pub(crate) fn real(&self, node: Node, key: &str, what: &str) -> Result<f64, UrdfError> {
        let text = node.attribute(key).ok_or_else(|| self.no_attribute(node, key, what))?;
        let value: f64 =
            text.trim().parse().map_err(|_| self.no_number(node, key, text, "a number", what))?;
        if value.is_nan() {
            Err(not_finite(self.at_attribute(node, key), what, key, value))
        } else {
            Ok(value)
        }
    }

    pub(crate) fn numbers<const N: usize>(
        &self,
        node: Node,
        key: &str,
        default: [f64; N],
        what: &str,
    ) -> Result<[f64; N], UrdfError> {
        let Some(text) = node.attribute(key) else { return Ok(default) };
        let parsed: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        let values = parsed
            .ok()
            .and_then(|v| <[f64; N]>::try_from(v).ok())
            .ok_or_else(|| self.no_number(node, key, text, &format!("{N} numbers"), what))?;
        match values.iter().find(|v| !v.is_finite()) {
            Some(v) => Err(not_finite(self.at_attribute(node, key), what, key, *v)),
            None => Ok(values),
        }
    }

    fn no_attribute(&self, node: Node, key: &str, what: &str) -> UrdfError {
        let tag = node.tag_name().name();
        UrdfError::Missing {
            at: self.at(node),
            what: format!("{what}: attribute \"{key}\" of <{tag}>"),
            help: format!("write <{tag} {key}=\"…\">"),
        }
    }

    fn no_number(&self, node: Node, key: &str, got: &str, allowed: &str, what: &str) -> UrdfError {
        UrdfError::Value {
            at: self.at_attribute(node, key),
            what: format!("{what}: {key}: text where {allowed} is expected")
                .replace("numbers is", "numbers are"),
            got: format!("\"{got}\""),
            allowed: allowed.to_owned(),
            help: "use decimal points, and spaces between numbers",
        }
    }

    pub(crate) fn bad(
        &self,
        node: Node,
        what: String,
        got: impl ToString,
        allowed: &str,
        help: &'static str,
    ) -> UrdfError {
        UrdfError::Value { at: self.at(node), what, got: got.to_string(), allowed: allowed.to_owned(), help }
    }

    pub(crate) fn note(&mut self, node: Node, statement: String, help: &str) {
        let place = self.at(node).to_string();
        let note = Note { severity: Severity::Note, place, statement, help: help.to_owned() };
        self.checked.notes.push(note);
    }

    pub(crate) fn at(&self, node: Node) -> Location {
        Location::of(self.file, self.source, node.range().start)
    }

    fn at_attribute(&self, node: Node, key: &str) -> Location {
        let start = node.attribute_node(key).map_or(node.range().start, |a| a.range().start);
        Location::of(self.file, self.source, start)
    }

    pub(crate) fn write(&mut self, text: std::fmt::Arguments) {
        self.checked.text.write_fmt(text).expect("a string takes any text");
    }
}

fn not_finite(at: Location, what: &str, key: &str, value: f64) -> UrdfError {
    UrdfError::Value {
        at,
        what: format!("{what}: {key} is not finite"),
        got: value.to_string(),
        allowed: "a finite number".to_owned(),
        help: "state the value",
    }
}
