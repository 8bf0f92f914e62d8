//! What is known of the sensors of a run: noise and resolution.

use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::error::DataError;
use crate::quantity::{Quantity, SignalName};
use crate::run::Signal;
use crate::settings_file::{Settings, SettingsFile};

/// Noise and resolution of sensors, from `[sensors]` of a columns map or from `arm.run.toml` beside `arm.csv`.
///
/// # Example
/// ```
/// let facts = sinew_data::SensorFacts::parse("motor_torque.elbow.std = 0.02", "arm.run.toml").unwrap();
/// assert_eq!((facts.list[0].place.as_deref(), facts.list[0].std), (Some("elbow"), Some(0.02)));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SensorFacts {
    /// The facts, in the order of the file.
    pub list: Vec<SensorFact>,
}

/// A quantity of one place, or of every place that has no fact of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorFact {
    /// The quantity.
    pub quantity: Quantity,
    /// The place; none for all.
    pub place: Option<String>,
    /// Standard deviation of white noise, in the quantity's unit.
    pub std: Option<f64>,
    /// Step between two readings, in the quantity's unit.
    pub resolution: Option<f64>,
}

impl SensorFacts {
    /// Reads a `.run.toml`.
    ///
    /// # Errors
    /// If the file cannot be read or says something else than noise and resolution.
    pub fn read(path: &Path) -> Result<SensorFacts, DataError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| DataError::Unreadable { path: path.to_owned(), source })?;
        SensorFacts::parse(&text, &path.display().to_string())
    }

    /// The facts of a whole `.run.toml`, called `name` in errors; they may stand under `[sensors]`, as in a columns map.
    ///
    /// # Errors
    /// If it is not well-formed or says something else than noise and resolution.
    pub fn parse(text: &str, name: &str) -> Result<SensorFacts, DataError> {
        let file = SettingsFile { name, text };
        let whole = file.table()?;
        // A table of its own, as in a columns map.
        match whole.get_ref().get("sensors").map(|value| value.get_ref()) {
            Some(DeValue::Table(sensors)) if whole.get_ref().len() == 1 => {
                SensorFacts::from_table(&file, sensors)
            }
            _ => SensorFacts::from_table(&file, whole.get_ref()),
        }
    }

    /// The facts of a table.
    pub(crate) fn from_table(file: &SettingsFile, table: &DeTable) -> Result<SensorFacts, DataError> {
        file.settings(table)?
            .iter()
            .map(|settings| fact(file, settings))
            .collect::<Result<_, _>>()
            .map(|list| SensorFacts { list })
    }

    /// Writes into a signal what is known of it; what is said of its own place wins.
    pub(crate) fn apply(&self, signal: &mut Signal) {
        for own in [true, false] {
            let of_signal = |f: &&SensorFact| {
                f.quantity == signal.quantity
                    && if own { f.place.as_deref() == Some(&signal.place) } else { f.place.is_none() }
            };
            for fact in self.list.iter().filter(of_signal) {
                signal.std = signal.std.or(fact.std);
                signal.resolution = signal.resolution.or(fact.resolution);
            }
        }
    }
}

fn fact(file: &SettingsFile, settings: &Settings) -> Result<SensorFact, DataError> {
    let wrong_name = |error: DataError| match error {
        DataError::BadName { what, help, .. } => file.error(settings.at, what, help),
        other => other,
    };
    let (quantity, place) = if settings.key.contains('.') {
        let name: SignalName = settings.key.parse().map_err(wrong_name)?;
        (name.quantity, Some(name.place))
    } else {
        (settings.key.parse().map_err(wrong_name)?, None)
    };
    file.allow(settings, &["std", "resolution"])?;
    let positive = |key: &str| match file.number(settings, key)? {
        Some(x) if x < 0.0 => Err(file.error(
            settings.at,
            format!("\"{key}\" of \"{}\" is negative (got {x}, allowed ≥ 0)", settings.key),
            "leave it out if it is not known",
        )),
        number => Ok(number),
    };
    Ok(SensorFact { quantity, place, std: positive("std")?, resolution: positive("resolution")? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_one_joint_wins_over_what_is_said_of_all() {
        let text = "motor_position.std = 1e-5\nmotor_position.resolution = 4e-5\n\
                    [\"motor_position.elbow\"]\nstd = 2e-5\n[motor_torque.elbow]\nstd = 1\n";
        let facts = SensorFacts::parse(text, "arm.run.toml").unwrap();
        let known = |quantity, place| {
            let mut signal = Signal::new(quantity, place, vec![]);
            facts.apply(&mut signal);
            (signal.std, signal.resolution)
        };
        assert_eq!(known(Quantity::MotorPosition, "elbow"), (Some(2e-5), Some(4e-5)));
        assert_eq!(known(Quantity::MotorPosition, "wrist"), (Some(1e-5), Some(4e-5)));
        assert_eq!(known(Quantity::MotorTorque, "elbow"), (Some(1.0), None));
        assert_eq!(known(Quantity::MotorTorque, "wrist"), (None, None));
        assert_eq!(
            SensorFacts::parse(
                &format!("[sensors]\n{text}")
                    .replace('[', "[sensors.")
                    .replace("[sensors.sensors]", "[sensors]"),
                "m"
            )
            .unwrap(),
            facts
        );
    }

    #[test]
    fn wrong_facts_name_line_and_column() {
        let message = |text: &str| SensorFacts::parse(text, "arm.run.toml").unwrap_err().to_string();
        assert_eq!(
            message("motor_position.std = 1e-5\nmotor_torque.sdt = 0.1\n"),
            "arm.run.toml:2:14: unknown key \"sdt\" of \"motor_torque\" (allowed: std, resolution)\n  help: did you mean \"std\"?"
        );
        assert!(message("motor_torqe.std = 1").contains("did you mean \"motor_torque\"?"));
        assert!(message("motor_torque.std = -1").contains("is negative (got -1, allowed ≥ 0)"));
        assert!(message("motor_torque.std = \"big\"").contains("is not a finite number"));
    }
}
