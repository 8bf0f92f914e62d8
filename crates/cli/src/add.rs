//! `sinew add`: effects with start values.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::console::Console;
use crate::effect_argument::{new_effects, with_start_values};
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
        let path = self.output.path(&file, std::slice::from_ref(&self.robot))?;
        let new = new_effects(&self.effects, &file.robot)?;
        let effects: Vec<_> = new.into_iter().map(|spec| with_start_values(spec, &file.robot)).collect();
        write(&file.sidecar, &effects, &path)?;
        let answer = json!({ "written": path.display().to_string(), "added": self.effects });
        console.answer(&answer, || format!("{}: {} added\n", path.display(), self.effects.join(", ")))
    }
}
