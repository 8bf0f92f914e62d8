//! Writing a robot: a new sidecar, or the old one in place.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_model::{EffectSpec, Place, Setting};
use sinew_urdf::{RobotFile, Sidecar};

use crate::error::CliError;
use crate::new_file;

/// Where the changed sidecar goes.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub(crate) struct OutputFile {
    /// The new sidecar (….sinew.toml)
    #[arg(short, long, value_name = "NEW")]
    output: Option<PathBuf>,
    /// Replace the sidecar of ROBOT at one stroke
    #[arg(long)]
    in_place: bool,
}

impl OutputFile {
    /// Refuses an output that could not be read back or would replace one of the files `read`, before any work is done.
    pub fn path(&self, robot: &RobotFile, read: &[PathBuf]) -> Result<PathBuf, CliError> {
        let Some(path) = &self.output else { return Ok(PathBuf::from(robot.sidecar.file())) };
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("toml")) {
            let place = path.display().to_string();
            return Err(CliError::usage(place, "not the name of a sidecar", "end it with .sinew.toml"));
        }
        if new_file::is_same(path, Path::new(robot.sidecar.file())) {
            let place = path.display().to_string();
            let what = "is the sidecar that is read";
            return Err(CliError::usage(place, what, "say --in-place to replace it, or give another name"));
        }
        new_file::check_place(path, read)?;
        Ok(path.clone())
    }
}

/// States effects in a sidecar, springs and rotors in `[joints.…]`, and writes it.
///
/// An interrupted write leaves the old file or the new one, never half of one.
pub(crate) fn write(sidecar: &Sidecar, effects: &[EffectSpec], path: &Path) -> Result<(), CliError> {
    let mut sidecar = sidecar.clone();
    for effect in effects {
        match (&effect.place, key_in_joint(&effect.kind)) {
            (Place::Joint(joint), Some(key)) => {
                for (word, setting) in &known(effect).settings {
                    if let Setting::Number(value) = setting {
                        sidecar.set_joint(joint, &key(word), *value);
                    }
                }
            }
            _ => sidecar.set_effect(&known(effect)),
        }
    }
    Ok(sidecar.write(path)?)
}

// A standard deviation that the data do not bound is not stated.
fn known(effect: &EffectSpec) -> EffectSpec {
    let mut effect = effect.clone();
    effect.settings.retain(|(key, setting)| match setting {
        Setting::Number(x) => x.is_finite() || !key.ends_with("_std"),
        Setting::Numbers(list) => list.iter().all(|x| x.is_finite()) || !key.ends_with("_std"),
        Setting::Word(_) => true,
    });
    effect
}

// Springs and rotors stand in [joints.…]: `inertia` there is `rotor_inertia`.
fn key_in_joint(kind: &str) -> Option<fn(&str) -> String> {
    match kind {
        "joint_elasticity" => Some(str::to_owned),
        "rotor_inertia" => Some(|word| format!("rotor_{word}")),
        _ => None,
    }
}
