//! `sinew report`: the page.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use sinew_data::RunSpec;
use sinew_effects::CATALOGUE;
use sinew_identify::{Comparison, Known, compare_knowing, discover};
use sinew_model::Robot;
use sinew_report::{ReportInput, page};

use crate::console::Console;
use crate::error::CliError;
use crate::fitted_robot::with_effects;
use crate::inputs::Inputs;
use crate::new_file;

/// Arguments of `sinew report`.
#[derive(Debug, Args)]
pub(crate) struct Report {
    #[command(flatten)]
    inputs: Inputs,
    /// Runs that nothing is fitted to
    #[arg(long, value_name = "RUN", num_args = 1..)]
    check: Vec<RunSpec>,
    /// The page (.html)
    #[arg(short, long, value_name = "HTML")]
    output: PathBuf,
}

impl Report {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        new_file::check(&self.output, &[".html"], &self.inputs.files(&self.check))?;
        let (file, runs) = self.inputs.read(console)?;
        let check = self.inputs.columns.read_pieces(&self.check)?;
        console.say("searching the catalogue …");
        let options = self.inputs.options(console);
        let fit = discover(&file.robot, &CATALOGUE, &runs, &check, &options)?;
        let all = [runs.as_slice(), check.as_slice()].concat();
        let unseen: Vec<String> = check.iter().map(|r| r.name.clone()).collect();
        let compared = |robot: &Robot, floors_of: Option<&Comparison>| {
            let known = Known { torques_early: fit.torques_early, floors_of };
            compare_knowing(robot, &CATALOGUE, &all, &options, known)
        };
        // Both errors beside the same floors.
        let after = compared(&with_effects(&file.robot, &fit.specs), None)?;
        let before = compared(&file.robot, Some(&after))?;
        let input = ReportInput {
            robot: &file.robot,
            unseen: &unseen,
            before: &before,
            diagnosis: &fit.diagnosis,
            fit: Some(&fit),
            after: Some(&after),
        };
        write_page(&input, &self.output)?;
        let answer = json!({ "written": self.output.display().to_string(), "verdict": fit.verdict });
        console.answer(&answer, || format!("{}: written\n", self.output.display()))
    }
}

/// Draws the page and writes it.
pub(crate) fn write_page(input: &ReportInput, path: &Path) -> Result<(), CliError> {
    std::fs::write(path, page(input)).map_err(|source| CliError::Write { path: path.to_owned(), source })
}
