//! Changes of the sidecar's document that keep what the author wrote around them.
//!
//! A function that would add a table returns its text instead: the caller appends it at the end of the file, where
//! it moves no comment. Inline forms (`joints = {…}`, `effects = […]`) are changed in place.

use std::ops::Range;

use sinew_model::{EffectSpec, Place, Setting};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// Sets `key` of `[joints.JOINT]`.
pub(crate) fn set_joint(document: &mut DocumentMut, joint: &str, key: &str, value: f64) -> Option<String> {
    let number = Setting::Number(value);
    let joints = document.get_mut("joints").and_then(Item::as_table_like_mut);
    if let Some(joints) = joints {
        if let Some(table) = joints.get_mut(joint).and_then(Item::as_table_like_mut) {
            set_value(table, key, &number);
            return None;
        }
        if document.get("joints").is_some_and(Item::is_inline_table) {
            let mut table = InlineTable::new();
            set_value(&mut table, key, &number);
            let joints = document.get_mut("joints").and_then(Item::as_table_like_mut)?;
            joints.insert(joint, Item::Value(Value::InlineTable(table)));
            return None;
        }
    }
    let mut table = Table::new();
    set_value(&mut table, key, &number);
    let mut parent = Table::new();
    parent.set_implicit(true);
    parent.insert(joint, Item::Table(table));
    Some(alone("joints", Item::Table(parent)))
}

/// Makes the table of the effect's kind, place and words hold exactly its settings.
pub(crate) fn set_effect(document: &mut DocumentMut, effect: &EffectSpec) -> Option<String> {
    let is_it =
        |table: &dyn TableLike| is_effect(table, &effect.kind, &effect.place) && has_words_of(table, effect);
    match document.get_mut("effects") {
        Some(Item::ArrayOfTables(tables)) => {
            if let Some(table) = tables.iter_mut().find(|t| is_it(*t)) {
                settle(table, effect);
                return None;
            }
        }
        Some(Item::Value(Value::Array(array))) => {
            let found = array.iter_mut().filter_map(Value::as_inline_table_mut).find(|t| is_it(*t));
            if let Some(table) = found {
                settle(table, effect);
                return None;
            }
            let mut table = InlineTable::new();
            settle(&mut table, effect);
            array.push(table);
            return None;
        }
        _ => {}
    }
    let mut table = Table::new();
    settle(&mut table, effect);
    Some(alone("effects", Item::ArrayOfTables(ArrayOfTables::from_iter([table]))))
}

/// The lines of the `[[effects]]` table of this kind and place, with the comment right above it and the blank line
/// before that; nothing if there is no such table.
pub(crate) fn effect_lines(text: &str, kind: &str, place: &Place) -> Option<Range<usize>> {
    let document = toml_edit::Document::parse(text).ok()?;
    let tables = document.get("effects")?.as_array_of_tables()?;
    let table = tables.iter().find(|t| is_effect(*t, kind, place))?;
    let header = table.span()?;
    let last = table.iter().filter_map(|(_, item)| item.span()).map(|s| s.end).fold(header.end, usize::max);
    let end = text[last..].find('\n').map_or(text.len(), |k| last + k + 1);
    let mut start = text[..header.start].rfind('\n').map_or(0, |k| k + 1);
    let line_above =
        |start: usize| text[..start].strip_suffix('\n').map(|t| t.rfind('\n').map_or(0, |k| k + 1));
    while let Some(line) = line_above(start)
        && text[line..start].trim_start().starts_with('#')
    {
        start = line;
    }
    if let Some(line) = line_above(start)
        && text[line..start].trim().is_empty()
    {
        start = line;
    }
    Some(start..end)
}

/// Removes the effect of this kind and place from an inline array.
pub(crate) fn remove_inline_effect(document: &mut DocumentMut, kind: &str, place: &Place) -> bool {
    let Some(Item::Value(Value::Array(array))) = document.get_mut("effects") else { return false };
    let before = array.len();
    array.retain(|v| !v.as_inline_table().is_some_and(|t| is_effect(t, kind, place)));
    array.len() < before
}

/// Sets `key` to a value; an equal one stays as it is written, and so do the comments beside it.
pub(crate) fn set_value(table: &mut dyn TableLike, key: &str, setting: &Setting) {
    let mut value = value_of(setting);
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) if setting_of(old).as_ref() == Some(setting) => {}
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

/// The first number of a TOML text that is not finite, and where it stands.
pub(crate) fn not_finite(text: &str) -> Option<(String, Range<usize>)> {
    fn search(item: &Item) -> Option<(String, Range<usize>)> {
        match item {
            Item::None => None,
            Item::Value(value) => search_value(value),
            Item::Table(table) => table.iter().find_map(|(_, item)| search(item)),
            Item::ArrayOfTables(tables) => {
                tables.iter().flat_map(Table::iter).find_map(|(_, item)| search(item))
            }
        }
    }
    fn search_value(value: &Value) -> Option<(String, Range<usize>)> {
        match value {
            Value::Float(x) if !x.value().is_finite() => {
                Some((x.value().to_string(), value.span().unwrap_or_default()))
            }
            Value::Array(array) => array.iter().find_map(search_value),
            Value::InlineTable(table) => table.iter().find_map(|(_, value)| search_value(value)),
            _ => None,
        }
    }
    let document = toml_edit::Document::parse(text).ok()?;
    search(document.as_item())
}

fn alone(key: &str, item: Item) -> String {
    let mut document = DocumentMut::new();
    document.insert(key, item);
    document.to_string()
}

fn is_effect(table: &dyn TableLike, kind: &str, place: &Place) -> bool {
    let word = |key| table.get(key).and_then(Item::as_str);
    let (joint, link) = match place {
        Place::Joint(name) => (Some(name.as_str()), None),
        Place::Link(name) => (None, Some(name.as_str())),
        Place::Robot => (None, None),
    };
    word("kind") == Some(kind) && word("joint") == joint && word("link") == link
}

// True if all that a table says in words besides kind and place is what the effect says.
fn has_words_of(table: &dyn TableLike, effect: &EffectSpec) -> bool {
    let is_word = |setting: &Setting| matches!(setting, Setting::Word(_));
    let stated = table.iter().filter(|(key, _)| !matches!(*key, "kind" | "joint" | "link"));
    let stated: Vec<(&str, &str)> = stated.filter_map(|(key, item)| Some((key, item.as_str()?))).collect();
    let says = |key: &str, word: &str| matches!(effect.get(key), Some(Setting::Word(w)) if w == word);
    let count = effect.settings.iter().filter(|(_, s)| is_word(s)).count();
    stated.len() == count && stated.iter().all(|(key, word)| says(key, word))
}

fn settle(table: &mut dyn TableLike, effect: &EffectSpec) {
    set_value(table, "kind", &Setting::Word(effect.kind.clone()));
    match &effect.place {
        Place::Joint(name) => set_value(table, "joint", &Setting::Word(name.clone())),
        Place::Link(name) => set_value(table, "link", &Setting::Word(name.clone())),
        Place::Robot => {}
    }
    let keeps = |key: &str| matches!(key, "kind" | "joint" | "link") || effect.get(key).is_some();
    let stale: Vec<String> = table.iter().map(|(k, _)| k.to_owned()).filter(|k| !keeps(k)).collect();
    for key in stale {
        table.remove(&key);
    }
    for (key, setting) in &effect.settings {
        set_value(table, key, setting);
    }
}

fn value_of(setting: &Setting) -> Value {
    match setting {
        Setting::Number(x) => number(*x),
        Setting::Numbers(list) => Value::Array(list.iter().map(|x| number(*x)).collect::<Array>()),
        Setting::Word(word) => Value::from(word.as_str()),
    }
}

// The shortest form that reads back to the same number, with an exponent where that is shorter.
fn number(x: f64) -> Value {
    format!("{x:?}").parse().unwrap_or_else(|_| Value::from(x))
}

fn setting_of(value: &Value) -> Option<Setting> {
    let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    match value {
        Value::String(word) => Some(Setting::Word(word.value().clone())),
        Value::Array(list) => list.iter().map(number).collect::<Option<Vec<_>>>().map(Setting::Numbers),
        _ => number(value).map(Setting::Number),
    }
}
