//! `sinew fit`: parameters, their uncertainty, and the error before and after.

use clap::Args;
use sinew_data::RunSpec;
use sinew_effects::CATALOGUE;
use sinew_identify::{ParameterReport, StepReport, fit};
use sinew_report::{number, quantity, with_std};

use crate::console::Console;
use crate::effect_argument::{effect_word, new_effects};
use crate::error::CliError;
use crate::inputs::Inputs;
use crate::output_file::{OutputFile, write};
use crate::table::{item, table};

/// Arguments of `sinew fit`.
#[derive(Debug, Args)]
pub(crate) struct Fit {
    #[command(flatten)]
    inputs: Inputs,
    /// Add these effects first: EFFECT@PLACE
    #[arg(long, value_name = "EFFECT@PLACE", num_args = 1.., value_parser = effect_word)]
    add: Vec<String>,
    /// Runs that nothing is fitted to
    #[arg(long, value_name = "RUN", num_args = 1..)]
    check: Vec<RunSpec>,
    #[command(flatten)]
    output: OutputFile,
}

impl Fit {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (file, runs) = self.inputs.read(console)?;
        let path = self.output.path(&file, &self.inputs.files(&self.check))?;
        let check = self.inputs.columns.read_pieces(&self.check)?;
        let add = new_effects(&self.add, &file.robot)?;
        console.say("fitting …");
        let fit = fit(&file.robot, &CATALOGUE, &runs, &check, &add, &self.inputs.options(console))?;
        write(&file.sidecar, &fit.specs, &path)?;
        console.say(&format!("{}: written", path.display()));
        console.answer(&fit, || text(&fit))
    }
}

/// Parameters, warnings and the error before and after.
pub(crate) fn text(fit: &sinew_identify::Fit) -> String {
    let mut out = parameters(&fit.parameters);
    out.push('\n');
    for told in besides(fit).iter().chain(&fit.warnings) {
        out += &format!("{}\n", item(told));
    }
    out + &format!("\n{}\n", ladder(&fit.steps))
}

// Effects that the table above leaves out and the file holds.
fn besides(fit: &sinew_identify::Fit) -> Option<String> {
    const SHOWN: usize = 6;
    let labels = fit.specs.iter().map(|spec| spec.place.label(&spec.kind));
    let labels: Vec<String> = labels.filter(|label| !fit.effects.contains(label)).collect();
    let more = match labels.len() {
        0 => return None,
        n if n <= SHOWN => String::new(),
        n => format!(" and {} more", n - SHOWN),
    };
    let shown = labels.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    Some(format!("in the file besides, as far as the runs move what is known to a tolerance: {shown}{more}"))
}

fn parameters(parameters: &[ParameterReport]) -> String {
    let row = |p: &ParameterReport| {
        let change = format!("{} →", quantity(p.start, &p.unit));
        vec![p.name.clone(), change, with_std(p.value, p.std, &p.unit), p.note.clone().unwrap_or_default()]
    };
    table(&["parameter", ">start", "value ± standard deviation", ""], parameters.iter().map(row))
}

/// One row a step: what was added, and the error on the runs seen and unseen, in noise floors.
pub(crate) fn ladder(steps: &[StepReport]) -> String {
    let row = |(k, s): (usize, &StepReport)| {
        let added = match s.added.as_slice() {
            [] if k == 0 => "as given".to_owned(),
            [] => "parameters fitted".to_owned(),
            added => format!("+ {}", added.join(" + ")),
        };
        let check = s.check_rms_error.map_or("–".to_owned(), number);
        vec![k.to_string(), added, number(s.rms_error), check, number(s.noise_floor)]
    };
    let header = [">step", "added", ">error, runs", ">error, unseen runs", ">noise floor"];
    table(&header, steps.iter().enumerate().map(row))
}
