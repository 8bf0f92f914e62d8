//! What is known of the sensors of a run: noise and resolution.

use toml::de::DeTable;

use crate::error::DataError;
use crate::quantity::{Quantity, SignalName};
use crate::run::Signal;
use crate::settings_file::{Settings, SettingsFile};

/// Noise and resolution of sensors, from `[sensors]` of a columns map or from `arm.run.toml` beside `arm.csv`.
#[derive(Debug, Clone, Default)]
pub(crate) struct SensorFacts(Vec<Fact>);

/// A quantity of one place, or of every place that has no fact of its own.
#[derive(Debug, Clone)]
struct Fact {
    quantity: Quantity,
    place: Option<String>,
    std: Option<f64>,
    resolution: Option<f64>,
}

impl SensorFacts {
    /// The facts of a whole `.run.toml`.
    pub fn parse(text: &str, name: &str) -> Result<SensorFacts, DataError> {
        let file = SettingsFile { name, text };
        SensorFacts::from_table(&file, file.table()?.get_ref())
    }

    /// The facts of a table.
    pub fn from_table(file: &SettingsFile, table: &DeTable) -> Result<SensorFacts, DataError> {
        file.settings(table)?
            .iter()
            .map(|settings| fact(file, settings))
            .collect::<Result<_, _>>()
            .map(SensorFacts)
    }

    /// Writes into a signal what is known of it; what is said of its own place wins.
    pub fn apply(&self, signal: &mut Signal) {
        for own in [true, false] {
            let of_signal = |f: &&Fact| {
                f.quantity == signal.quantity
                    && if own { f.place.as_deref() == Some(&signal.place) } else { f.place.is_none() }
            };
            for fact in self.0.iter().filter(of_signal) {
                signal.std = signal.std.or(fact.std);
                signal.resolution = signal.resolution.or(fact.resolution);
            }
        }
    }
}

fn fact(file: &SettingsFile, settings: &Settings) -> Result<Fact, DataError> {
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
    Ok(Fact { quantity, place, std: positive("std")?, resolution: positive("resolution")? })
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
