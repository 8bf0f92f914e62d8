//! The file of `--noise`: what the sensors add, written as in `arm.run.toml`.

use std::path::Path;

use sinew_data::{Quantity, SignalName};
use sinew_simulate::{Noise, SensorNoise};
use toml::{Table, Value};

use crate::error::CliError;

/// Reads noise from a file: `QUANTITY.std`, `QUANTITY.resolution`, and the same with `QUANTITY.JOINT`.
pub(crate) fn read(path: &Path) -> Result<Noise, CliError> {
    let place = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| {
        CliError::usage(&place, format!("cannot be read ({error})"), "check the path, or write --noise none")
    })?;
    parse(&text, &place)
}

fn parse(text: &str, place: &str) -> Result<Noise, CliError> {
    let wrong = |what: String| {
        let help = "write for example motor_position.std = 1e-5, motor_torque.elbow.std = 0.02 (SI)";
        CliError::usage(place, what, help)
    };
    let table: Table = text.parse().map_err(|error: toml::de::Error| {
        let what = error.message().to_owned();
        wrong(format!("not well-formed TOML ({what})"))
    })?;
    let mut noise = Noise::default();
    for (name, value) in &table {
        let of_all = name.parse::<Quantity>().ok();
        let of_one = name.parse::<SignalName>().ok();
        let (quantity, joint) = match (of_all, of_one) {
            (Some(quantity), _) => (quantity, None),
            (None, Some(signal)) => (signal.quantity, Some(signal.place)),
            (None, None) => return Err(wrong(format!("\"{name}\" is no quantity"))),
        };
        let Value::Table(facts) = value else { return Err(wrong(format!("\"{name}\" is no table"))) };
        for (joint, facts) in of_places(joint, facts) {
            noise.sensors.push(sensor(quantity, joint, &facts).map_err(wrong)?);
        }
    }
    Ok(noise)
}

// A table of facts may hold tables of single joints beside its own numbers.
fn of_places(joint: Option<String>, facts: &Table) -> Vec<(Option<String>, Table)> {
    let (inner, own): (Table, Table) = facts.clone().into_iter().partition(|(_, v)| v.is_table());
    let mut all = Vec::new();
    if !own.is_empty() {
        all.push((joint, own));
    }
    for (name, value) in inner {
        if let Value::Table(facts) = value {
            all.push((Some(name), facts));
        }
    }
    all
}

fn sensor(quantity: Quantity, joint: Option<String>, facts: &Table) -> Result<SensorNoise, String> {
    let mut sensor = SensorNoise { quantity, joint, std: 0.0, resolution: 0.0 };
    for (key, value) in facts {
        let number = value.as_float().or(value.as_integer().map(|k| k as f64));
        let number = number.filter(|x| *x >= 0.0 && x.is_finite());
        let number =
            number.ok_or_else(|| format!("\"{key}\" of {quantity} is no number ≥ 0 (got {value})"))?;
        match key.as_str() {
            "std" => sensor.std = number,
            "resolution" => sensor.resolution = number,
            _ => return Err(format!("unknown key \"{key}\" of {quantity} (allowed: std, resolution)")),
        }
    }
    Ok(sensor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_of_all_joints_and_of_one_are_read() {
        let text = "motor_position.std = 1e-5\nmotor_position.elbow = { resolution = 2e-5 }\n\"motor_torque.elbow\".std = 1";
        let noise = parse(text, "noise.toml").unwrap();
        let found: Vec<_> = noise.sensors.iter().map(|s| (s.joint.as_deref(), s.std, s.resolution)).collect();
        assert_eq!(found.len(), 3);
        assert!(found.contains(&(None, 1e-5, 0.0)) && found.contains(&(Some("elbow"), 0.0, 2e-5)));
        assert!(found.contains(&(Some("elbow"), 1.0, 0.0)));
    }

    #[test]
    fn what_is_no_noise_is_refused_with_an_example() {
        for text in
            ["position.std = 1", "motor_torque.std = -1", "motor_torque.sd = 1", "motor_torque = 3", "x ="]
        {
            let message = parse(text, "noise.toml").unwrap_err().to_string();
            assert!(
                message.starts_with("noise.toml: ") && message.contains("motor_position.std"),
                "{message}"
            );
        }
    }
}
