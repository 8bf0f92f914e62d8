//! Torque-sensor offset: a torque reading that is not zero at zero torque.

use sinew_effect::{
    Act, Card, Energy, Entry, Family, Law, Parameter, Prior, Reading, Screening, Sensor, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival, sensor};

/// A constant error of the torque reading.
///
/// ```text
/// y = τ + o
/// ```
///
/// Of the motor's torque reading, or with `signal = "joint_torque"` of the sensor between gear and link.
#[derive(Debug, Clone, Copy)]
pub struct TorqueSensorOffset {
    /// Degree of freedom whose sensor it is.
    pub dof: usize,
    /// The sensor.
    pub sensor: Sensor,
}

/// The card of [`TorqueSensorOffset`].
static CARD: Card = Card {
    name: "torque_sensor_offset",
    title: "A constant error of the torque reading",
    law: "y = τ + o",
    symptom: "a constant torque residual",
    family: Family::Instrument,
    energy: Energy::None,
    parameters: &[Parameter::signed("offset", "o", "N·m", Prior::Absolute(0.15))],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        rival("balancer_spring", "holds in both directions and in opposite poses"),
        rival("asymmetric_friction", "holds in both directions, and equal strokes at two speeds"),
        rival("base_tilt", "holds in opposite poses"),
    ],
    sources: &[
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`TorqueSensorOffset`].
pub(crate) const ENTRY: Entry = Entry {
    words: &["signal"],
    ..at_joint(&CARD, |ask| {
        let sensor = sensor(ask, Sensor::MotorTorque)?;
        Ok(Box::new(TorqueSensorOffset { dof: dof(ask)?, sensor }))
    })
};

impl Law for TorqueSensorOffset {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Reading]
    }
    // o ← o + o₀
    fn add_reading<S: Scalar>(&self, p: &[S], sensor: Sensor, by_dof: &mut [Reading<S>]) {
        if sensor == self.sensor {
            by_dof[self.dof].offset += p[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TorqueSensorOffset { dof: 1, sensor: Sensor::MotorTorque }, &[0.2]);
    }
}
