//! The grammar of the sidecar: what serde reads, with the place of each key and value.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_spanned::Spanned;
use sinew_model::Setting;

use crate::{Location, UrdfError};

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SidecarTable {
    pub format: Option<Spanned<Number>>,
    pub urdf: Option<Spanned<String>>,
    pub gravity: Option<Spanned<Vec<Number>>>,
    pub tool: Option<Spanned<String>>,
    pub known: Option<Spanned<String>>,
    #[serde(default)]
    pub joints: Entries<JointTable>,
    #[serde(default)]
    pub couplings: Vec<CouplingTable>,
    #[serde(default)]
    pub links: Entries<LinkTable>,
    #[serde(default)]
    pub effects: Vec<Spanned<Entries<Spanned<Value>>>>,
}

/// `[joints.J]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointTable {
    pub stiffness: Option<Spanned<Number>>,
    pub damping: Option<Spanned<Number>>,
    pub rotor_inertia: Option<Spanned<Number>>,
    pub gear_ratio: Option<Spanned<Number>>,
    pub torque_constant: Option<Spanned<Number>>,
    pub rotor_axis: Option<Spanned<Vec<Number>>>,
    pub carried_by: Option<Spanned<String>>,
    pub stiffness_std: Option<Spanned<Number>>,
    pub damping_std: Option<Spanned<Number>>,
    pub rotor_inertia_std: Option<Spanned<Number>>,
}

/// `[[couplings]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CouplingTable {
    pub joints: Spanned<Vec<Spanned<String>>>,
    pub stiffness: Spanned<Vec<Vec<Number>>>,
    pub damping: Option<Spanned<Vec<Vec<Number>>>>,
}

/// `[links.L]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkTable {
    pub bending: Option<Spanned<BendingTable>>,
}

/// `[links.L.bending]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BendingTable {
    pub springs: Option<Spanned<Number>>,
    pub axes: Spanned<Vec<Spanned<String>>>,
    pub length: Option<Spanned<Number>>,
    #[serde(rename = "EI")]
    pub flexural_rigidity: Option<Spanned<Number>>,
    pub stiffness: Option<Spanned<Number>>,
    pub mass_per_length: Option<Spanned<Number>>,
    pub damping_ratio: Option<Spanned<Number>>,
    #[serde(rename = "GJ")]
    pub torsional_rigidity: Option<Spanned<Number>>,
    pub polar_inertia_per_length: Option<Spanned<Number>>,
    pub along: Option<Spanned<String>>,
    pub sections: Option<Spanned<Vec<Spanned<SectionTable>>>>,
    pub stations: Option<Spanned<Vec<Number>>>,
    pub stiffnesses: Option<Spanned<Vec<Number>>>,
    pub quasi_static: Option<Spanned<bool>>,
}

/// One of `sections` in `[links.L.bending]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SectionTable {
    pub length: Spanned<Number>,
    #[serde(rename = "EI")]
    pub flexural_rigidity: Spanned<Number>,
    #[serde(rename = "GJ")]
    pub torsional_rigidity: Option<Spanned<Number>>,
    pub mass_per_length: Option<Spanned<Number>>,
    pub polar_inertia_per_length: Option<Spanned<Number>>,
}

/// Reads the text of the sidecar `file`.
pub(crate) fn read_table(file: &str, text: &str) -> Result<SidecarTable, UrdfError> {
    toml::from_str(text).map_err(|error| explain(file, text, error))
}

// Turns the parser's message into one with place, table, allowed keys and help.
fn explain(file: &str, text: &str, mut error: toml::de::Error) -> UrdfError {
    let span = error.span().unwrap_or(0..0);
    let at = Location::of(file, text, span.start);
    let message = error.message().to_owned();
    error.set_input(None);
    let shown = error.to_string();
    let path =
        shown.split_once("in `").and_then(|(_, p)| p.split_once('`')).map_or("", |(p, _)| p).to_owned();
    if let Some(rest) = message.strip_prefix("unknown field ") {
        // serde's words: unknown field `key`, expected one of `a`, `b`
        let mut words = rest.split('`').skip(1).step_by(2).map(str::to_owned);
        let key = words.next().unwrap_or_default();
        return UrdfError::UnknownKey { at, table: bracketed(&path), key, allowed: words.collect() };
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        let key = rest.trim_matches('`').to_owned();
        let what = format!("{} in {}", key, bracketed(&path));
        return UrdfError::Missing { at, what, help: format!("add {key} = …") };
    }
    if let Some((what, got)) = message.split_once(" (got ") {
        let (got, allowed) = got.trim_end_matches(')').split_once(", allowed: ").unwrap_or((got, ""));
        return UrdfError::Value {
            at,
            what: format!("{path}: {what}"),
            got: got.to_owned(),
            allowed: allowed.to_owned(),
            help: "numbers stand without quotes, words within them",
        };
    }
    if let Some(rest) = message.strip_prefix("invalid type: ") {
        let (got, allowed) = rest.split_once(", expected ").unwrap_or((rest, "another"));
        return UrdfError::Value {
            at,
            what: format!("{path}: wrong kind of value"),
            got: got.to_owned(),
            allowed: allowed.to_owned(),
            help: match path.as_str() {
                "couplings" => "write [[couplings]]: each is a table of its own, in any number",
                "effects" => "write [[effects]]: each is a table of its own, in any number",
                _ => "numbers stand without quotes, words within them",
            },
        };
    }
    let help = "strings stand in quotes, lists in brackets, and a table or key is stated once";
    UrdfError::Syntax { at, language: "TOML", detail: message, help }
}

fn bracketed(path: &str) -> String {
    match path {
        "" => String::new(),
        "couplings" | "effects" => format!("[[{path}]]"),
        _ => format!("[{path}]"),
    }
}

/// A number; text gets its own message.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Number(pub f64);

struct NumberVisitor;

impl Visitor<'_> for NumberVisitor {
    type Value = Number;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number")
    }
    fn visit_f64<E: Error>(self, x: f64) -> Result<Number, E> {
        Ok(Number(x))
    }
    fn visit_i64<E: Error>(self, x: i64) -> Result<Number, E> {
        Ok(Number(x as f64))
    }
    fn visit_str<E: Error>(self, text: &str) -> Result<Number, E> {
        Err(E::custom(format_args!("text where a number is expected (got \"{text}\", allowed: a number)")))
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumberVisitor)
    }
}

/// A value of an effect.
#[derive(Debug, Clone)]
pub(crate) struct Value(pub Setting);

struct ValueVisitor;

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Value;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, a list of numbers or a word")
    }
    fn visit_f64<E: Error>(self, x: f64) -> Result<Value, E> {
        Ok(Value(Setting::Number(x)))
    }
    fn visit_i64<E: Error>(self, x: i64) -> Result<Value, E> {
        Ok(Value(Setting::Number(x as f64)))
    }
    fn visit_str<E: Error>(self, word: &str) -> Result<Value, E> {
        Ok(Value(Setting::Word(word.to_owned())))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Value, A::Error> {
        let mut numbers = Vec::new();
        while let Some(Number(x)) = seq.next_element()? {
            numbers.push(x);
        }
        Ok(Value(Setting::Numbers(numbers)))
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ValueVisitor)
    }
}

/// The entries of a table with free keys, in the author's order.
#[derive(Debug)]
pub(crate) struct Entries<T>(pub Vec<(Spanned<String>, T)>);

impl<T> Default for Entries<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

struct EntriesVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for EntriesVisitor<T> {
    type Value = Entries<T>;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a table")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries<T>, A::Error> {
        let mut entries: Vec<(Spanned<String>, T)> = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        entries.sort_by_key(|(key, _)| key.span().start);
        Ok(Entries(entries))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Entries<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(EntriesVisitor(PhantomData))
    }
}
