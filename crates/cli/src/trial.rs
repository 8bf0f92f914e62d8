//! `sinew trial`: what a name found on these runs is worth.

use clap::Args;
use sinew_effects::CATALOGUE;
use sinew_identify::{SurrogateReport, TrialReport, Turned, trial};

use crate::console::Console;
use crate::error::CliError;
use crate::inputs::Inputs;
use crate::table::table;

/// Arguments of `sinew trial`.
#[derive(Debug, Args)]
pub(crate) struct Trial {
    #[command(flatten)]
    inputs: Inputs,
}

impl Trial {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (robot, runs) = self.inputs.read(console)?;
        console.say("searching the runs, then surrogates of them …");
        let found = trial(&robot.robot, &CATALOGUE, &runs, &self.inputs.options(console))?;
        console.answer(&found, || text(&found))
    }
}

fn text(report: &TrialReport) -> String {
    let row = |turned: Turned, name: &str| {
        let of: Vec<&SurrogateReport> = report.surrogates.iter().filter(|s| s.turned == turned).collect();
        let mut named: Vec<String> = of.iter().filter_map(|s| s.accepted.clone()).collect();
        let accepted = named.len();
        named.sort();
        named.dedup();
        let named = if named.is_empty() { "–".to_owned() } else { named.join(", ") };
        vec![name.to_owned(), format!("{accepted} of {}", of.len()), named]
    };
    let rows =
        [row(Turned::Flipped, "sign of each second drawn by lot"), row(Turned::Shifted, "shifted in time")];
    let model = if report.effects.is_empty() { "nothing".to_owned() } else { report.effects.join(", ") };
    let table = table(&["surrogate", ">accepted", "first name"], rows);
    format!("added to the model first: {model}\n\n{table}\n\n{}\n", report.sentence)
}
