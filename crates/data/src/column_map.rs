//! Which column of somebody's log is which signal.

use std::collections::BTreeMap;
use std::path::Path;

use toml::de::DeValue;

use crate::error::DataError;
use crate::file::{file_name, read_text};
use crate::quantity::SignalName;
use crate::sensor_facts::SensorFacts;
use crate::settings_file::{Settings, SettingsFile};

/// Names, scales and offsets for logs with headers of their own (`--columns map.toml`).
///
/// ```text
/// value = scale · (column + plus) · times + offset
/// ```
///
/// Keys are `time` or `QUANTITY.PLACE`; `scale` is 1 and `offset` 0 if left out. `plus` and `times` name further
/// columns: a deflection that comes on top of the motor's angle, a supply voltage behind a duty cycle. `wraps` is how far a
/// column goes until it begins anew, in its own unit (360 of degrees): steps of more than half of it are taken for whole ones and
/// taken out. A table `[sensors]` gives `"QUANTITY.PLACE" = { std, resolution }`.
///
/// # Example
/// ```
/// use sinew_data::ColumnMap;
/// let map = ColumnMap::parse(
///     r#"
///     time = { column = "stamp_ns", scale = 1e-9 }
///     "joint_position.shoulder" = { column = "q1_deg", scale = 0.017453292519943295 }
///     [sensors]
///     "joint_position.shoulder" = { resolution = 1e-5 }
///     "#,
///     "map.toml",
/// );
/// assert!(map.is_ok());
/// ```
#[derive(Debug, Clone)]
pub struct ColumnMap {
    pub(crate) time: Option<Column>,
    pub(crate) signals: BTreeMap<SignalName, Column>,
    pub(crate) sensors: SensorFacts,
}

/// A column of the file and how its numbers become SI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Column {
    pub header: String,
    pub plus: Option<String>,
    pub times: Option<String>,
    pub scale: f64,
    pub offset: f64,
    pub wraps: Option<f64>,
}

impl ColumnMap {
    /// True if a name is made of this column of the file.
    pub(crate) fn uses(&self, header: &str) -> bool {
        let of = |column: &Column| {
            column.header == header
                || [&column.plus, &column.times].into_iter().any(|more| more.as_deref() == Some(header))
        };
        self.time.iter().chain(self.signals.values()).any(of)
    }

    /// Reads a columns map from a file.
    ///
    /// # Errors
    /// If the file cannot be read, or as for [`ColumnMap::parse`].
    pub fn read(path: &Path) -> Result<ColumnMap, DataError> {
        ColumnMap::parse(&read_text(path)?, &file_name(path))
    }

    /// Reads a columns map from its text; `name` stands for the file in messages.
    ///
    /// # Errors
    /// Wrong TOML, an unknown key or signal, a missing `column`, a scale of zero: each with line and column.
    pub fn parse(text: &str, name: &str) -> Result<ColumnMap, DataError> {
        let file = SettingsFile { name, text };
        let mut whole = file.table()?;
        let sensors = match whole.get_mut().remove("sensors") {
            None => SensorFacts::default(),
            Some(value) => match value.get_ref() {
                DeValue::Table(table) => SensorFacts::from_table(&file, table)?,
                other => {
                    let what = format!("\"sensors\" is no table (got {})", other.type_str());
                    return Err(file.error(value.span().start, what, "write [sensors] on a line of its own"));
                }
            },
        };
        let mut map = ColumnMap { time: None, signals: BTreeMap::new(), sensors };
        for settings in file.settings(whole.get_ref())? {
            let column = column(&file, &settings)?;
            if settings.key == "time" {
                if column.wraps.is_some() {
                    let what = "\"time\" wraps".to_owned();
                    return Err(file.error(settings.at, what, "write seconds that do not begin anew"));
                }
                map.time = Some(column);
            } else if let Some((other, _)) = map.signals.iter().find(|(_, other)| **other == column) {
                let what = format!("\"{}\" is made of the same column as \"{other}\", alike", settings.key);
                return Err(file.error(settings.at, what, "give each its own column"));
            } else {
                map.signals.insert(signal_name(&file, &settings)?, column);
            }
        }
        Ok(map)
    }
}

fn signal_name(file: &SettingsFile, settings: &Settings) -> Result<SignalName, DataError> {
    settings.key.parse().map_err(|error| match error {
        DataError::BadName { what, help, .. } => file.error(
            settings.at,
            format!("\"{}\": {what} (allowed: time, sensors, QUANTITY.PLACE)", settings.key),
            help,
        ),
        other => other,
    })
}

fn column(file: &SettingsFile, settings: &Settings) -> Result<Column, DataError> {
    file.allow(settings, &["column", "plus", "times", "scale", "offset", "wraps"])?;
    let Some(header) = file.string(settings, "column")? else {
        return Err(file.error(
            settings.at,
            format!("\"{}\" names no column", settings.key),
            "write { column = \"HEADER OF THE FILE\" }",
        ));
    };
    let scale = file.number(settings, "scale")?.unwrap_or(1.0);
    if scale == 0.0 {
        let what = format!("\"scale\" of \"{}\" is zero", settings.key);
        return Err(file.error(settings.at, what, "leave it out for a scale of 1"));
    }
    let times = file.string(settings, "times")?;
    let wraps = file.number(settings, "wraps")?;
    if let Some(wraps) = wraps
        && (wraps <= 0.0 || times.is_some())
    {
        let what = match &times {
            Some(times) => format!("\"{}\" wraps and is multiplied by \"{times}\"", settings.key),
            None => format!("\"wraps\" of \"{}\" is {wraps}", settings.key),
        };
        let help = "wraps is a whole turn in the unit of the column, 360 of degrees, and goes without times";
        return Err(file.error(settings.at, what, help));
    }
    Ok(Column {
        header,
        plus: file.string(settings, "plus")?,
        times,
        wraps,
        scale,
        offset: file.number(settings, "offset")?.unwrap_or(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        ColumnMap::parse(text, "map.toml").unwrap_err().to_string()
    }

    #[test]
    fn quoted_dotted_and_table_keys_are_the_same() {
        let quoted =
            ColumnMap::parse("\"joint_position.elbow\" = { column = \"q\", scale = 2 }", "m").unwrap();
        let dotted = ColumnMap::parse("joint_position.elbow = { column = \"q\", scale = 2 }", "m").unwrap();
        let table = ColumnMap::parse("[joint_position.elbow]\ncolumn = \"q\"\nscale = 2.0", "m").unwrap();
        assert_eq!(quoted.signals, dotted.signals);
        assert_eq!(quoted.signals, table.signals);
        let expected =
            Column { header: "q".into(), plus: None, times: None, scale: 2.0, offset: 0.0, wraps: None };
        assert_eq!(quoted.signals[&"joint_position.elbow".parse().unwrap()], expected);
    }

    #[test]
    fn an_unknown_key_is_answered_with_its_place_and_the_nearest_one() {
        assert_eq!(
            message("time = { column = \"t\" }\n\"motor_torque.é\" = { colunm = \"x\" }"),
            "map.toml:2:22: unknown key \"colunm\" of \"motor_torque.é\" (allowed: column, plus, times, scale, offset, wraps)\n  help: did you mean \"column\"?"
        );
    }

    #[test]
    fn an_unknown_signal_is_answered_with_the_nearest_one() {
        assert_eq!(
            message("\"motor_torqe.elbow\" = { column = \"x\" }"),
            "map.toml:1:1: \"motor_torqe.elbow\": no quantity \"motor_torqe\" (allowed: time, sensors, QUANTITY.PLACE)\n  help: did you mean \"motor_torque\"?"
        );
    }

    #[test]
    fn entries_that_cannot_be_used_are_refused() {
        assert!(message("time = \"t\"").starts_with("map.toml:1:1: \"time\" is no table (got string)"));
        assert!(message("time = { scale = 2 }").contains("names no column"));
        assert!(message("time = { column = 3 }").contains("is not a text (got integer)"));
        assert!(message("time = { column = \"t\", scale = 0 }").contains("\"scale\" of \"time\" is zero"));
        assert!(message("time = { column = \"t\", wraps = -1 }").contains("\"wraps\" of \"time\" is -1"));
        assert!(message("time = { column = \"t\", wraps = 1 }").contains("\"time\" wraps"));
        assert!(
            message("time = { column = \"t\", wraps = 1, times = \"u\" }").contains("multiplied by \"u\"")
        );
        assert!(message("time = { column = ").starts_with("map.toml:1:"));
        assert!(message("[sensors]\nmotor_torque.sd = 1").starts_with("map.toml:2:14: unknown key \"sd\""));
    }
}
