//! Time skew: a channel that is logged late.

use sinew_effect::{
    Act, Card, Energy, Entry, Family, Law, Parameter, Prior, Reading, Requirement, Screening, Sensor, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival, sensor, twin};

/// A sensor channel whose time stamps are late by a constant time.
///
/// ```text
/// y(t) = true(t − d)
/// ```
///
/// Of the link-side encoder, or of the channel that `signal` names: "motor_torque" or "joint_torque".
#[derive(Debug, Clone, Copy)]
pub struct TimeSkew {
    /// Degree of freedom whose sensor it is.
    pub dof: usize,
    /// The sensor.
    pub sensor: Sensor,
}

/// The card of [`TimeSkew`].
static CARD: Card = Card {
    name: "time_skew",
    title: "A sensor channel whose time stamps are late by a constant time",
    law: "y(t) = true(t − d)",
    symptom: "residual in proportion to the rate of the channel; the cross-correlation peaks off zero",
    family: Family::Instrument,
    energy: Energy::None,
    parameters: &[Parameter {
        range: (-0.02, 0.02),
        ..Parameter::signed("time", "d", "s", Prior::Absolute(1e-3))
    }],
    screening: Screening::Linear,
    requires: &[Requirement::LinkEncoder],
    rivals: &[
        twin("joint_damping_error", "excite at two frequencies: a skew of d looks like D = K d"),
        rival("actuator_lag", "fast reversals at two frequencies"),
        rival("link_viscous_friction", "fast reversals at two frequencies"),
        rival("viscous_friction", "fast reversals at two frequencies"),
    ],
    sources: &["Ljung: System Identification, 2nd ed., Prentice Hall, 1999"],
};

/// The catalogue line of [`TimeSkew`].
pub(crate) const ENTRY: Entry = Entry {
    words: &["signal"],
    ..at_joint(&CARD, |ask| {
        let sensor = sensor(ask, Sensor::JointPosition)?;
        Ok(Box::new(TimeSkew { dof: dof(ask)?, sensor }))
    })
};

impl Law for TimeSkew {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Reading]
    }
    // d ← d + d₀
    fn add_reading<S: Scalar>(&self, p: &[S], sensor: Sensor, by_dof: &mut [Reading<S>]) {
        if sensor == self.sensor {
            by_dof[self.dof].delay += p[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TimeSkew { dof: 1, sensor: Sensor::JointPosition }, &[1e-3]);
    }
}
