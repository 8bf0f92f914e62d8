//! `sinew compare`: the error of the model as it stands.

use clap::Args;
use sinew_effects::CATALOGUE;
use sinew_identify::{Comparison, SignalError, compare};
use sinew_report::{number, quantity};

use crate::console::Console;
use crate::error::CliError;
use crate::inputs::Inputs;
use crate::table::{item, percent, table};

/// Arguments of `sinew compare`.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    inputs: Inputs,
}

impl Compare {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (robot, runs) = self.inputs.read(console)?;
        let comparison = compare(&robot.robot, &CATALOGUE, &runs, &self.inputs.options(console))?;
        console.answer(&comparison, || text(&comparison))
    }
}

/// The comparison as a table, one line a run and the findings.
pub(crate) fn text(comparison: &Comparison) -> String {
    let mut out = signals(&comparison.signals);
    out += &format!("\n\nall signals: error {} × noise floor", number(comparison.rms_error));
    if comparison.runs.len() > 1 {
        let of_run = |r: &sinew_identify::RunError| format!("{} {} ×", r.run, number(r.rms_error));
        let runs: Vec<_> = comparison.runs.iter().map(of_run).collect();
        out += &format!(" ({})", runs.join(", "));
    }
    out.push('\n');
    for finding in &comparison.findings {
        out += &format!("{}\n", item(&finding.statement));
    }
    out
}

/// The table of errors by joint and signal.
pub(crate) fn signals(signals: &[SignalError]) -> String {
    let row = |s: &SignalError| {
        vec![
            s.joint.clone(),
            s.signal.replace('_', " "),
            quantity(s.rms_error, &s.unit),
            s.share().map_or("–".to_owned(), percent),
            quantity(s.noise_floor, &s.unit),
            if s.white { "yes" } else { "no" }.to_owned(),
        ]
    };
    let header = ["joint", "signal", ">rms error", ">of signal", ">noise floor", "white"];
    table(&header, signals.iter().map(row))
}
