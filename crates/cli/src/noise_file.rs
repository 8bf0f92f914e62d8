//! The file of `--noise`: what the sensors add, written as in `arm.run.toml`.

use std::path::Path;

use sinew_data::{SensorFact, SensorFacts};
use sinew_model::Model;
use sinew_simulate::{Noise, SensorNoise};

use crate::error::{CliError, did_you_mean};

/// Reads noise from a file: `QUANTITY.std`, `QUANTITY.resolution`, and the same with `QUANTITY.JOINT`.
///
/// # Errors
/// If it cannot be read, or names a joint that the robot does not have.
pub(crate) fn read(path: &Path, model: &Model) -> Result<Noise, CliError> {
    let noise = noise(SensorFacts::read(path)?);
    let joints: Vec<&str> = (0..model.nv).map(|dof| model.dof_name(dof)).collect();
    let unknown = noise.sensors.iter().filter_map(|s| s.joint.as_deref()).find(|j| !joints.contains(j));
    let Some(unknown) = unknown else { return Ok(noise) };
    let what = format!("no joint \"{unknown}\" in robot \"{}\" (it has {})", model.name, joints.join(", "));
    let help = did_you_mean(unknown, &joints).unwrap_or_else(|| {
        "write QUANTITY.JOINT with a joint of the robot, or QUANTITY alone for all".to_owned()
    });
    Err(CliError::usage(path.display().to_string(), what, help))
}

fn noise(facts: SensorFacts) -> Noise {
    let sensor = |fact: SensorFact| SensorNoise {
        quantity: fact.quantity,
        joint: fact.place,
        std: fact.std.unwrap_or(0.0),
        resolution: fact.resolution.unwrap_or(0.0),
    };
    Noise { sensors: facts.list.into_iter().map(sensor).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_of_all_joints_and_of_one_become_noise() {
        let text = "motor_position.std = 1e-5\nmotor_position.elbow = { resolution = 2e-5 }\n\"motor_torque.elbow\".std = 1";
        let noise = noise(SensorFacts::parse(text, "noise.toml").unwrap());
        let found: Vec<_> = noise.sensors.iter().map(|s| (s.joint.as_deref(), s.std, s.resolution)).collect();
        assert_eq!(found.len(), 3);
        assert!(found.contains(&(None, 1e-5, 0.0)) && found.contains(&(Some("elbow"), 0.0, 2e-5)));
        assert!(found.contains(&(Some("elbow"), 1.0, 0.0)));
    }
}
