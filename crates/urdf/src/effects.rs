//! `[[effects]]`: any physical effect, its place and its values.

use serde_spanned::Spanned;
use sinew_model::{EffectSpec, Model, Place, Setting};

use crate::UrdfError;
use crate::assembly::{require_dof, require_link};
use crate::grammar::{Entries, Value};
use crate::source::{Source, shown};

// Keys whose values are names, which may look like numbers.
const PLACES: [&str; 3] = ["kind", "joint", "link"];

/// One table of the file.
pub(crate) type EffectTable = Spanned<Entries<Spanned<Value>>>;

/// Checks the effects: kinds are free, places must exist, numbers be finite, and nothing be stated twice.
pub(crate) fn effects(
    model: &Model,
    tables: &[EffectTable],
    source: Source,
) -> Result<Vec<EffectSpec>, UrdfError> {
    let mut list: Vec<EffectSpec> = Vec::with_capacity(tables.len());
    for table in tables {
        let effect = effect(table, source)?;
        let named = |key, name: &String| Spanned::new(value_span(table, key), name.clone());
        match &effect.place {
            Place::Joint(name) => drop(require_dof(model, &named("joint", name), source)?),
            Place::Link(name) => drop(require_link(model, &named("link", name), source)?),
            Place::Robot => {}
        }
        if let Some(first) = list.iter().position(|e| e.is_same_as(&effect)) {
            return Err(UrdfError::Twice {
                at: source.at(start(table)),
                what: format!("effect \"{}\" at {}", effect.kind, effect.place),
                first: source.at(start(&tables[first])).line,
                help: "keep one table for each effect and place, or say in words in what they differ (signal, side, from)",
            });
        }
        list.push(effect);
    }
    Ok(list)
}

/// One table as data, its numbers checked.
pub(crate) fn effect(table: &EffectTable, source: Source) -> Result<EffectSpec, UrdfError> {
    let (mut kind, mut place) = (None, Place::Robot);
    let mut settings = Vec::new();
    for (key, value) in &table.get_ref().0 {
        let setting = &value.get_ref().0;
        check_value(key.get_ref(), value, source)?;
        match key.get_ref().as_str() {
            "kind" => kind = Some(word(key.get_ref(), value, source)?),
            "joint" | "link" => {
                if place != Place::Robot {
                    let help = "split it into two effects";
                    let what = "effects: both joint and link".to_owned();
                    return Err(source.value(
                        key.span(),
                        what,
                        "two places".to_owned(),
                        "one of the two",
                        help,
                    ));
                }
                let name = word(key.get_ref(), value, source)?;
                place = if key.get_ref() == "joint" { Place::Joint(name) } else { Place::Link(name) };
            }
            other => settings.push((other.to_owned(), setting.clone())),
        }
    }
    let kind = kind.ok_or_else(|| UrdfError::Missing {
        at: source.at(start(table)),
        what: "kind in [[effects]]".to_owned(),
        help: "add kind = \"…\", a name of the catalogue".to_owned(),
    })?;
    Ok(EffectSpec { kind, place, settings })
}

/// Where the value of `key` stands.
pub(crate) fn value_span(table: &EffectTable, key: &str) -> std::ops::Range<usize> {
    let entry = table.get_ref().0.iter().find(|(k, _)| k.get_ref() == key);
    entry.map_or(table.span(), |(_, value)| value.span())
}

/// Where the table begins: at its first key.
pub(crate) fn start(table: &EffectTable) -> std::ops::Range<usize> {
    table.get_ref().0.first().map_or(table.span(), |(key, _)| key.span())
}

fn word(key: &str, value: &Spanned<Value>, source: Source) -> Result<String, UrdfError> {
    match &value.get_ref().0 {
        Setting::Word(word) => Ok(word.clone()),
        Setting::Number(x) => Err(no_word(key, value, shown(*x), source)),
        Setting::Numbers(x) => Err(no_word(key, value, format!("{x:?}"), source)),
    }
}

fn no_word(key: &str, value: &Spanned<Value>, got: String, source: Source) -> UrdfError {
    let what = format!("effects.{key}: a number where a name is expected");
    source.value(value.span(), what, got, "a name in quotes", "write the name in quotes")
}

// Numbers are finite and not in quotes; a standard deviation is not negative.
fn check_value(key: &str, value: &Spanned<Value>, source: Source) -> Result<(), UrdfError> {
    let bad = |what: &str, got: String, allowed: &str, help| {
        Err(source.value(value.span(), format!("effects.{key}: {what}"), got, allowed, help))
    };
    let numbers = match &value.get_ref().0 {
        Setting::Word(text) if text.trim().parse::<f64>().is_ok() && !PLACES.contains(&key) => {
            let what = "text where a number is expected";
            return bad(what, format!("\"{text}\""), "a number", "numbers stand without quotes");
        }
        Setting::Word(_) => return Ok(()),
        Setting::Number(x) => std::slice::from_ref(x),
        Setting::Numbers(x) => x.as_slice(),
    };
    if let Some(x) = numbers.iter().find(|x| !x.is_finite()) {
        return bad("not finite", shown(*x), "a finite number", "state the value, or leave the key out");
    }
    match numbers.iter().find(|x| key.ends_with("_std") && **x < 0.0) {
        Some(x) => bad("must not be negative", shown(*x), "≥ 0", "state its size"),
        None => Ok(()),
    }
}
