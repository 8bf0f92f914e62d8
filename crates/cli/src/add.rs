//! `sinew add`: effects with start values.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::console::Console;
use crate::effect_argument::{effect, with_start_values};
use crate::error::CliError;
use crate::inputs;
use crate::output_file::{OutputFile, write};

/// Arguments of `sinew add`.
#[derive(Debug, Args)]
pub(crate) struct Add {
    /// Sidecar or URDF
    robot: PathBuf,
    /// EFFECT@PLACE, the place a joint or link, or none for effects of the whole robot; values as ,KEY=VALUE
    #[arg(required = true, value_name = "EFFECT@PLACE")]
    effects: Vec<String>,
    #[command(flatten)]
    output: OutputFile,
}

impl Add {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let file = inputs::robot(&self.robot)?;
        let path = self.output.path(&file)?;
        let mut effects = Vec::new();
        for argument in &self.effects {
            let spec = effect(argument, &file.robot)?;
            let stated = file.robot.all_effects();
            if stated.iter().chain(&effects).any(|e| e.is_same_as(&spec)) {
                let what = "the robot has this effect already".to_owned();
                return Err(CliError::usage(argument, what, "`sinew fit` estimates its parameters"));
            }
            effects.push(with_start_values(spec, &file.robot));
        }
        write(&file.sidecar, &effects, &path)?;
        let answer = json!({ "written": path.display().to_string(), "added": self.effects });
        console.answer(&answer, || format!("{}: {} added\n", path.display(), self.effects.join(", ")))
    }
}
