//! An effect that is part of a plant: the law, where it came from and its values.

use sinew_effect::{Ask, Catalogue, Effect, Entry, PlaceKind, Site, Written};
use sinew_model::{EffectSpec, Hinge, LinkId, Model, Place, Setting};

use crate::PlantError;

/// An effect with its values, in the order of its card.
#[derive(Debug)]
pub struct Active {
    /// The law.
    pub effect: Box<dyn Effect>,
    /// What the sidecar says of it.
    pub spec: EffectSpec,
    /// One value for each parameter of the card.
    pub values: Vec<f64>,
    /// Standard deviations that the sidecar states.
    pub stds: Vec<Option<f64>>,
}

impl Active {
    /// Makes the effect that `spec` describes; `hinge`: the degree of freedom of its own hinge, if it has one.
    ///
    /// # Errors
    /// If the catalogue has no such effect, it cannot act there, or a value is no number in its range.
    pub fn new(
        model: &Model,
        tool: LinkId,
        spec: &EffectSpec,
        catalogue: &Catalogue,
        hinge: Option<usize>,
    ) -> Result<Self, PlantError> {
        let entry = entry(spec, catalogue)?;
        let site = site(model, spec, entry.place)?;
        let ask = Ask { model, tool, site, spec, hinge };
        let effect = (entry.build)(&ask).map_err(|reason| refused(spec, reason))?;
        let mut values = Vec::new();
        let mut stds = Vec::new();
        for parameter in entry.card.parameters {
            let value = read(spec, parameter.key, parameter.component)?;
            let std = read(spec, &format!("{}_std", parameter.key), parameter.component)?;
            let (value, std) = match (parameter.written, value) {
                // c = 1/K, σ_c = σ_K/K²
                (Written::Reciprocal, Some(k)) if k != 0.0 => (Some(1.0 / k), std.map(|s| s / (k * k))),
                _ => (value, std),
            };
            let value = value.unwrap_or_else(|| parameter.start());
            let (low, high) = parameter.range;
            let in_range = value >= low && value <= high;
            if !(value.is_finite() && (in_range || parameter.is_stated())) {
                return Err(PlantError::BadParameter {
                    kind: spec.kind.clone(),
                    place: spec.place.to_string(),
                    key: parameter.key.to_owned(),
                    reason: "is outside its range".to_owned(),
                    got: format!("{value} {}", parameter.unit),
                    help: format!("allowed is {low} to {high}"),
                });
            }
            values.push(value);
            stds.push(std);
        }
        Ok(Self { effect, spec: spec.clone(), values, stds })
    }

    /// `effect@place`.
    pub fn label(&self) -> String {
        self.spec.place.label(&self.spec.kind)
    }

    /// The specification with the present values written into it, as files write them.
    pub fn with_values(&self, values: &[f64], stds: &[Option<f64>]) -> EffectSpec {
        let mut spec = self.spec.clone();
        for (k, parameter) in self.effect.card().parameters.iter().enumerate() {
            let (value, std) = match parameter.written {
                Written::Plain => (values[k], stds[k]),
                Written::Reciprocal if values[k] == 0.0 => continue,
                Written::Reciprocal => (1.0 / values[k], stds[k].map(|s| s / (values[k] * values[k]))),
            };
            let stated = spec.get(parameter.key).is_some();
            if parameter.is_stated() && !stated {
                continue;
            }
            write(&mut spec, parameter.key, parameter.component, value);
            if let Some(std) = std {
                write(&mut spec, &format!("{}_std", parameter.key), parameter.component, std);
            }
        }
        spec
    }
}

/// The hinge that the effect adds to `model`, if any.
///
/// # Errors
/// As of [`Active::new`].
pub(crate) fn hinge_of(
    model: &Model,
    tool: LinkId,
    spec: &EffectSpec,
    catalogue: &Catalogue,
) -> Result<Option<Hinge>, PlantError> {
    let entry = entry(spec, catalogue)?;
    let Some(hinge) = entry.hinge else { return Ok(None) };
    let site = site(model, spec, entry.place)?;
    let ask = Ask { model, tool, site, spec, hinge: None };
    hinge(&ask).map(Some).map_err(|reason| refused(spec, reason))
}

fn entry(spec: &EffectSpec, catalogue: &Catalogue) -> Result<&'static Entry, PlantError> {
    catalogue.find(&spec.kind).ok_or_else(|| {
        let known = catalogue.entries.iter().map(|e| e.card.name).collect();
        PlantError::NoSuchEffect { kind: spec.kind.clone(), known }
    })
}

pub(crate) fn refused(spec: &EffectSpec, reason: String) -> PlantError {
    let help = format!("`sinew effects {}` says where it acts and what it needs", spec.kind);
    wrong_place(spec, reason, help)
}

fn site(model: &Model, spec: &EffectSpec, kind: PlaceKind) -> Result<Site, PlantError> {
    let needs = |what: &str| {
        wrong_place(
            spec,
            format!("acts at {what}"),
            format!("write `{} = \"…\"` in its table", what.trim_start_matches("a ")),
        )
    };
    match (kind, &spec.place) {
        (PlaceKind::Joint, Place::Joint(name)) => model.require_dof(name).map(Site::Dof).map_err(|e| {
            let text = e.to_string();
            let (reason, help) =
                text.split_once("\n  help: ").unwrap_or((&text, "name a joint of the robot"));
            wrong_place(spec, reason.to_owned(), help.to_owned())
        }),
        (PlaceKind::Link, Place::Link(name)) => model.link(name).map(Site::Link).ok_or_else(|| {
            let known: Vec<_> = model.links.iter().map(|l| l.name.as_str()).collect();
            let reason = format!("no link \"{name}\" in robot \"{}\"", model.name);
            wrong_place(spec, reason, format!("the links are {}", known.join(", ")))
        }),
        (PlaceKind::Robot, Place::Robot) => Ok(Site::Robot),
        (PlaceKind::Joint, _) => Err(needs("a joint")),
        (PlaceKind::Link, _) => Err(needs("a link")),
        (PlaceKind::Robot, _) => Err(wrong_place(
            spec,
            "acts on the whole robot".to_owned(),
            "leave `joint` and `link` out of its table".to_owned(),
        )),
    }
}

fn wrong_place(spec: &EffectSpec, reason: String, help: String) -> PlantError {
    PlantError::WrongPlace { kind: spec.kind.clone(), place: spec.place.to_string(), reason, help }
}

fn read(spec: &EffectSpec, key: &str, component: Option<usize>) -> Result<Option<f64>, PlantError> {
    let bad = |reason: &str, got: String| PlantError::BadParameter {
        kind: spec.kind.clone(),
        place: spec.place.to_string(),
        key: key.to_owned(),
        reason: reason.to_owned(),
        got,
        help: "see `sinew effects` for its form".to_owned(),
    };
    match (spec.get(key), component) {
        (None, _) => Ok(None),
        (Some(Setting::Number(x)), None) => Ok(Some(*x)),
        (Some(Setting::Numbers(list)), Some(k)) if k < list.len() => Ok(Some(list[k])),
        (Some(other), None) => Err(bad("must be one number", format!("{other:?}"))),
        (Some(other), Some(_)) => Err(bad("must be a list of numbers", format!("{other:?}"))),
    }
}

fn write(spec: &mut EffectSpec, key: &str, component: Option<usize>, value: f64) {
    let position = spec.settings.iter().position(|(k, _)| k == key);
    let slot = match position {
        Some(p) => &mut spec.settings[p].1,
        None => {
            spec.settings.push((key.to_owned(), Setting::Numbers(Vec::new())));
            &mut spec.settings.last_mut().expect("a setting was just added").1
        }
    };
    match component {
        None => *slot = Setting::Number(value),
        Some(k) => {
            let mut list = match slot {
                Setting::Numbers(list) => core::mem::take(list),
                _ => Vec::new(),
            };
            list.resize(list.len().max(k + 1), 0.0);
            list[k] = value;
            *slot = Setting::Numbers(list);
        }
    }
}
