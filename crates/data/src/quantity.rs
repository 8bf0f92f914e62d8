//! What a column of a run measures, and the name of the column.

use std::fmt;
use std::str::FromStr;

use crate::error::DataError;
use crate::spelling::nearest;

/// A measured quantity. Motor quantities are reflected to the link side: θ = θ_motor / N, τ = N τ_motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// θ, rad (m).
    MotorPosition,
    /// θ̇, rad/s (m/s).
    MotorVelocity,
    /// τ_m, N·m (N).
    MotorTorque,
    /// Motor current, A.
    MotorCurrent,
    /// q, rad (m), on the link side of the gear.
    JointPosition,
    /// q̇, rad/s (m/s), on the link side of the gear.
    JointVelocity,
    /// τ_J, N·m (N): the sensor between gear and link.
    JointTorque,
    /// Temperature of the joint, °C.
    Temperature,
    /// Force at the tool, N, along one axis.
    ToolForce,
    /// Moment at the tool, N·m, about one axis.
    ToolMoment,
    /// Position of the tool, m, along one axis.
    ToolPosition,
    /// Acceleration of a link, m/s², along one axis.
    LinkAcceleration,
}

/// The name of a column, `QUANTITY.PLACE`.
///
/// The place is a joint (`motor_torque.shoulder`), an axis (`tool_force.x`) or a link and an axis
/// (`link_acceleration.forearm.z`).
///
/// # Example
/// ```
/// use sinew_data::{Quantity, SignalName};
/// let name: SignalName = "motor_torque.shoulder".parse().unwrap();
/// assert_eq!((name.quantity, name.place.as_str()), (Quantity::MotorTorque, "shoulder"));
/// assert_eq!(name.to_string(), "motor_torque.shoulder");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SignalName {
    /// What is measured.
    pub quantity: Quantity,
    /// Where: a joint, `x|y|z`, or `LINK.x|y|z`.
    pub place: String,
}

impl Quantity {
    /// Every quantity, in the order of their columns.
    pub const ALL: &[Quantity] = &[
        Quantity::MotorPosition,
        Quantity::MotorVelocity,
        Quantity::MotorTorque,
        Quantity::MotorCurrent,
        Quantity::JointPosition,
        Quantity::JointVelocity,
        Quantity::JointTorque,
        Quantity::Temperature,
        Quantity::ToolForce,
        Quantity::ToolMoment,
        Quantity::ToolPosition,
        Quantity::LinkAcceleration,
    ];

    /// The word used in files: `motor_position` and so on.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::MotorPosition => "motor_position",
            Quantity::MotorVelocity => "motor_velocity",
            Quantity::MotorTorque => "motor_torque",
            Quantity::MotorCurrent => "motor_current",
            Quantity::JointPosition => "joint_position",
            Quantity::JointVelocity => "joint_velocity",
            Quantity::JointTorque => "joint_torque",
            Quantity::Temperature => "temperature",
            Quantity::ToolForce => "tool_force",
            Quantity::ToolMoment => "tool_moment",
            Quantity::ToolPosition => "tool_position",
            Quantity::LinkAcceleration => "link_acceleration",
        }
    }

    /// The SI unit; `sliding` tells whether the joint is a sliding one (rad becomes m, N·m becomes N).
    ///
    /// ```
    /// use sinew_data::Quantity;
    /// assert_eq!(Quantity::MotorTorque.unit(false), "N·m");
    /// assert_eq!(Quantity::MotorTorque.unit(true), "N");
    /// ```
    pub fn unit(self, sliding: bool) -> &'static str {
        use Quantity::*;
        match (self, sliding) {
            (MotorPosition | JointPosition, false) => "rad",
            (MotorPosition | JointPosition, true) | (ToolPosition, _) => "m",
            (MotorVelocity | JointVelocity, false) => "rad/s",
            (MotorVelocity | JointVelocity, true) => "m/s",
            (MotorTorque | JointTorque, false) | (ToolMoment, _) => "N·m",
            (MotorTorque | JointTorque, true) | (ToolForce, _) => "N",
            (MotorCurrent, _) => "A",
            (Temperature, _) => "°C",
            (LinkAcceleration, _) => "m/s²",
        }
    }

    /// Whether the place of the quantity is a joint.
    pub fn is_of_joint(self) -> bool {
        use Quantity::*;
        !matches!(self, ToolForce | ToolMoment | ToolPosition | LinkAcceleration)
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Quantity {
    type Err = DataError;

    fn from_str(text: &str) -> Result<Self, DataError> {
        Quantity::ALL.iter().copied().find(|q| q.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Quantity::ALL.iter().map(|q| q.name()).collect();
            let help = match nearest(text, &names) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("the quantities are {}", names.join(", ")),
            };
            DataError::BadName { name: text.into(), what: format!("no quantity \"{text}\""), help }
        })
    }
}

impl fmt::Display for SignalName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.quantity, self.place)
    }
}

impl FromStr for SignalName {
    type Err = DataError;

    fn from_str(text: &str) -> Result<Self, DataError> {
        let bad = |what: &str, help: &str| DataError::BadName {
            name: text.into(),
            what: what.into(),
            help: help.into(),
        };
        let (quantity, place) = text.split_once('.').ok_or_else(|| {
            bad("not a signal (no full stop)", "write QUANTITY.PLACE, for example motor_torque.shoulder")
        })?;
        let quantity: Quantity = quantity.parse()?;
        let is_axis = |axis: &str| matches!(axis, "x" | "y" | "z");
        if place.is_empty() {
            return Err(bad("the place is empty", "write QUANTITY.PLACE, for example motor_torque.shoulder"));
        }
        if quantity == Quantity::LinkAcceleration {
            if !place.rsplit_once('.').is_some_and(|(link, axis)| !link.is_empty() && is_axis(axis)) {
                return Err(bad("no link and axis", "write link_acceleration.LINK.x, .y or .z"));
            }
        } else if !quantity.is_of_joint() && !is_axis(place) {
            return Err(bad("no such axis", "the axis is x, y or z"));
        }
        Ok(SignalName { quantity, place: place.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_is_read_back_from_its_name() {
        for &quantity in Quantity::ALL {
            assert_eq!(quantity.to_string().parse::<Quantity>().unwrap(), quantity);
        }
    }

    #[test]
    fn a_misspelt_quantity_is_answered_with_the_nearest_one() {
        let error = "motor_positon.shoulder".parse::<SignalName>().unwrap_err();
        assert_eq!(
            error.to_string(),
            "motor_positon: no quantity \"motor_positon\"\n  help: did you mean \"motor_position\"?"
        );
    }

    #[test]
    fn tool_and_link_quantities_name_an_axis() {
        assert!("tool_force.z".parse::<SignalName>().is_ok());
        assert!("tool_force.w".parse::<SignalName>().is_err());
        assert_eq!("link_acceleration.fore.arm.z".parse::<SignalName>().unwrap().place, "fore.arm.z");
        assert!("link_acceleration.z".parse::<SignalName>().is_err());
        assert!("motor_torque.".parse::<SignalName>().is_err());
        assert!("motor_torque".parse::<SignalName>().is_err());
    }
}
