//! TOML files that give settings to signals: walked by hand, so that every error names line and column,
//! the keys allowed and the nearest spelling.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::DataError;
use crate::spelling::nearest;

/// A settings file and its name, for messages.
pub(crate) struct SettingsFile<'a> {
    pub name: &'a str,
    pub text: &'a str,
}

/// The settings of one signal: its key, and the entries of its table.
pub(crate) struct Settings<'t, 'a> {
    pub key: String,
    /// Byte at which the key stands.
    pub at: usize,
    entries: Vec<(&'t Spanned<std::borrow::Cow<'a, str>>, &'t Spanned<DeValue<'a>>)>,
}

impl<'a> SettingsFile<'a> {
    /// The whole file as a table.
    pub fn table(&self) -> Result<Spanned<DeTable<'a>>, DataError> {
        DeTable::parse(self.text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            self.error(
                at,
                error.message().trim().into(),
                "the file is TOML; names with a full stop need quotes",
            )
        })
    }

    /// An error at a byte of the file.
    pub fn error(&self, at: usize, what: String, help: impl Into<String>) -> DataError {
        let before = &self.text[..self.text.floor_char_boundary(at)];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        DataError::BadToml { file: self.name.into(), line, column, what, help: help.into() }
    }

    /// The settings of each signal below `table`: `"a.b" = { … }`, `a.b = { … }` and `[a.b]` are the same.
    pub fn settings<'t>(&self, table: &'t DeTable<'a>) -> Result<Vec<Settings<'t, 'a>>, DataError> {
        let mut found = Vec::new();
        for (key, value) in table {
            let DeValue::Table(inner) = value.get_ref() else {
                return Err(self.error(
                    key.span().start,
                    format!("\"{}\" is no table (got {})", key.get_ref(), value.get_ref().type_str()),
                    "write NAME = { KEY = VALUE, … }",
                ));
            };
            collect(key.get_ref().to_string(), key.span().start, inner, &mut found);
        }
        Ok(found)
    }

    /// The number under `key`, if it is there.
    pub fn number(&self, settings: &Settings, key: &str) -> Result<Option<f64>, DataError> {
        let Some(value) = settings.get(key) else { return Ok(None) };
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(int) => {
                i64::from_str_radix(int.as_str(), int.radix()).ok().map(|whole| whole as f64)
            }
            _ => None,
        };
        match number.filter(|x: &f64| x.is_finite()) {
            Some(number) => Ok(Some(number)),
            None => Err(self.error(
                value.span().start,
                format!("\"{key}\" of \"{}\" is not a finite number", settings.key),
                format!("write {key} = 1.0"),
            )),
        }
    }

    /// The text under `key`, if it is there.
    pub fn string(&self, settings: &Settings, key: &str) -> Result<Option<String>, DataError> {
        let Some(value) = settings.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some(text.to_string())),
            other => Err(self.error(
                value.span().start,
                format!("\"{key}\" of \"{}\" is not a text (got {})", settings.key, other.type_str()),
                format!("write {key} = \"…\""),
            )),
        }
    }

    /// Refuses every key that is not allowed.
    pub fn allow(&self, settings: &Settings, allowed: &[&str]) -> Result<(), DataError> {
        match settings.entries.iter().find(|(key, _)| !allowed.contains(&&**key.get_ref())) {
            None => Ok(()),
            Some((key, _)) => Err(self.error(
                key.span().start,
                format!(
                    "unknown key \"{}\" of \"{}\" (allowed: {})",
                    key.get_ref(),
                    settings.key,
                    allowed.join(", ")
                ),
                match nearest(key.get_ref(), allowed) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => "delete it".into(),
                },
            )),
        }
    }
}

impl<'t, 'a> Settings<'t, 'a> {
    fn get(&self, key: &str) -> Option<&'t Spanned<DeValue<'a>>> {
        self.entries.iter().find(|(name, _)| name.get_ref() == key).map(|entry| entry.1)
    }
}

/// A table with plain entries, or with none at all, belongs to a signal; tables inside it belong to longer names.
fn collect<'t, 'a>(name: String, at: usize, table: &'t DeTable<'a>, found: &mut Vec<Settings<'t, 'a>>) {
    let (tables, entries): (Vec<_>, Vec<_>) = table.iter().partition(|(_, v)| v.get_ref().is_table());
    if !entries.is_empty() || tables.is_empty() {
        found.push(Settings { key: name.clone(), at, entries });
    }
    for (key, value) in tables {
        if let DeValue::Table(inner) = value.get_ref() {
            collect(format!("{name}.{}", key.get_ref()), key.span().start, inner, found);
        }
    }
}
