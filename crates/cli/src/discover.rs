//! `sinew discover`: diagnose, add and fit until nothing is left that the catalogue explains.

use clap::Args;
use sinew_data::RunSpec;
use sinew_effects::CATALOGUE;
use sinew_identify::discover;

use crate::console::Console;
use crate::error::CliError;
use crate::inputs::Inputs;
use crate::output_file::{OutputFile, write};
use crate::{diagnose, fit};

/// Arguments of `sinew discover`.
#[derive(Debug, Args)]
pub(crate) struct Discover {
    #[command(flatten)]
    inputs: Inputs,
    /// Runs that nothing is fitted to
    #[arg(long, value_name = "RUN", num_args = 1..)]
    check: Vec<RunSpec>,
    #[command(flatten)]
    output: OutputFile,
    /// Say also which candidates were refused, and why
    #[arg(long)]
    explain: bool,
}

impl Discover {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (file, runs) = self.inputs.read(console)?;
        let path = self.output.path(&file, &self.inputs.files(&self.check))?;
        let check = self.inputs.columns.read_pieces(&self.check)?;
        console.say("searching the catalogue …");
        let found = discover(&file.robot, &CATALOGUE, &runs, &check, &self.inputs.options(console))?;
        write(&file.sidecar, &found.specs, &path)?;
        console.say(&format!("{}: written", path.display()));
        console.answer(&found, || {
            let evidence = diagnose::text(&found.diagnosis, self.explain);
            format!("{evidence}\n{}", fit::text(&found))
        })
    }
}
