//! `sinew effects`: the catalogue.

use clap::Args;
use serde_json::{Value, json};
use sinew_effect::{Entry, Family};
use sinew_effects::{CATALOGUE, page};

use crate::console::Console;
use crate::effect_argument::entry;
use crate::error::CliError;

/// Arguments of `sinew effects`.
#[derive(Debug, Args)]
pub(crate) struct Effects {
    /// Show the page of this effect
    name: Option<String>,
}

const FAMILIES: [Family; 6] = [
    Family::Friction,
    Family::Transmission,
    Family::Inertial,
    Family::Periodic,
    Family::Instrument,
    Family::Environment,
];

impl Effects {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        match &self.name {
            Some(name) => {
                let entry = entry(name)?;
                console.answer(&object(entry), || page(entry.card))
            }
            None => {
                let all: Vec<Value> = CATALOGUE.entries.iter().map(object).collect();
                console.answer(&json!({ "effects": all }), list)
            }
        }
    }
}

fn list() -> String {
    let width = CATALOGUE.entries.iter().map(|e| e.card.name.len()).max().unwrap_or(0);
    let mut out = String::new();
    for family in FAMILIES {
        out += &format!("{}\n", format!("{family:?}").to_lowercase());
        for entry in CATALOGUE.entries.iter().filter(|e| e.card.family == family) {
            out += &format!("  {:<width$}  {}\n", entry.card.name, entry.card.title);
        }
    }
    out + "\n`sinew effects NAME` shows law, symptom, parameters, rivals and sources of one\n"
}

fn object(entry: &Entry) -> Value {
    let card = entry.card;
    let word = |x: &dyn std::fmt::Debug| format!("{x:?}").to_lowercase();
    let parameters =
        card.parameters.iter().map(|p| json!({ "key": p.label(), "symbol": p.symbol, "unit": p.unit }));
    let rivals = card
        .rivals
        .iter()
        .map(|r| json!({ "effect": r.name, "structural": r.structural, "experiment": r.experiment_with(|_| false) }));
    json!({
        "name": card.name, "title": card.title, "family": word(&card.family), "place": word(&entry.place),
        "law": card.law, "symptom": card.symptom, "energy": word(&card.energy),
        "parameters": parameters.collect::<Vec<_>>(), "rivals": rivals.collect::<Vec<_>>(), "sources": card.sources,
    })
}
