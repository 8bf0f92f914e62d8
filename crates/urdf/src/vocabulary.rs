//! Whether the effects of a sidecar are effects of a catalogue.

use sinew_model::Place;

use crate::effects::{EffectTable, effect, start, value_span};
use crate::grammar::read_table;
use crate::source::Source;
use crate::{Location, Note, RobotFile, Severity, UrdfError};

/// The effects that a catalogue knows. This crate knows none itself.
#[derive(Debug, Clone, Copy)]
pub struct Vocabulary<'a> {
    /// One entry for each kind.
    pub kinds: &'a [KindWords<'a>],
}

/// The words of one kind of effect.
#[derive(Debug, Clone, Copy)]
pub struct KindWords<'a> {
    /// Its name, as in `kind = "coulomb_friction"`.
    pub kind: &'a str,
    /// The keys of its parameters; `KEY_std` is allowed with each.
    pub keys: &'a [&'a str],
    /// Those of them that switch it on: without any of them its law is zero.
    pub strengths: &'a [&'a str],
    /// Where it acts.
    pub place: PlaceKind,
}

/// What an effect is stated for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// `joint = "…"`
    Joint,
    /// `link = "…"`
    Link,
    /// Neither.
    Robot,
}

impl RobotFile {
    /// Checks every effect of the sidecar against a catalogue's words. Warns of effects without any strength, which do nothing.
    ///
    /// # Errors
    /// At the first unknown kind, unknown key or wrong place, with the allowed words and the nearest spelling.
    pub fn check_vocabulary(&self, vocabulary: &Vocabulary) -> Result<Vec<Note>, UrdfError> {
        let (text, file) = (self.sidecar.text(), self.sidecar.file());
        let source = Source { file, text: &text };
        let effects = read_table(file, &text)?.effects;
        effects.iter().filter_map(|table| check(table, vocabulary, source).transpose()).collect()
    }

    /// Where the sidecar states `key` of the effect `kind` at `place` (of which [`Place`] shows the name); none where it does not.
    pub fn where_stated(&self, kind: &str, place: &str, key: &str) -> Option<Location> {
        let (text, file) = (self.sidecar.text(), self.sidecar.file());
        let source = Source { file, text: &text };
        let effects = read_table(file, &text).ok()?.effects;
        let is_it = |table: &&EffectTable| {
            effect(table, source)
                .is_ok_and(|e| e.kind == kind && e.place.to_string() == place && e.get(key).is_some())
        };
        effects.iter().find(is_it).map(|table| source.at(value_span(table, key)))
    }
}

fn check(table: &EffectTable, vocabulary: &Vocabulary, source: Source) -> Result<Option<Note>, UrdfError> {
    let effect = effect(table, source)?;
    let Some(words) = vocabulary.kinds.iter().find(|k| k.kind == effect.kind) else {
        return Err(UrdfError::UnknownName {
            at: source.at(value_span(table, "kind")),
            what: "effect",
            name: effect.kind,
            scope: "in the catalogue".to_owned(),
            known: vocabulary.kinds.iter().map(|k| k.kind.to_owned()).collect(),
        });
    };
    let (place, got) = match effect.place {
        Place::Joint(_) => (PlaceKind::Joint, "a joint"),
        Place::Link(_) => (PlaceKind::Link, "a link"),
        Place::Robot => (PlaceKind::Robot, "neither joint nor link"),
    };
    if place != words.place {
        let allowed = match words.place {
            PlaceKind::Joint => "joint = \"…\"",
            PlaceKind::Link => "link = \"…\"",
            PlaceKind::Robot => "neither joint nor link",
        };
        let what = format!("effect \"{}\" stands at the wrong place", words.kind);
        return Err(source.value(start(table), what, got.to_owned(), allowed, "state the place it acts at"));
    }
    for (key, _) in &table.get_ref().0 {
        let name = key.get_ref().as_str();
        let base = name.strip_suffix("_std").unwrap_or(name);
        let placed = matches!(name, "kind" | "joint" | "link");
        if !placed && !words.keys.contains(&name) && !words.keys.contains(&base) {
            let ending = &name[base.len()..];
            return Err(UrdfError::UnknownKey {
                at: source.at(key.span()),
                table: format!("effect \"{}\"", words.kind),
                key: name.to_owned(),
                allowed: words.keys.iter().map(|k| format!("{k}{ending}")).collect(),
            });
        }
    }
    let is_strength = |key: &str| words.strengths.contains(&key);
    let is_idle =
        !words.strengths.is_empty() && !table.get_ref().0.iter().any(|(key, _)| is_strength(key.get_ref()));
    Ok(is_idle.then(|| Note {
        severity: Severity::Warning,
        place: source.at(start(table)).to_string(),
        statement: format!("effect \"{}\" has no strength and does nothing", words.kind),
        help: format!("state its {}, or let sinew fit find it", words.strengths.join(" or ")),
    }))
}
