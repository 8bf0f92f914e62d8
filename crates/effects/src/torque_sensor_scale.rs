//! Torque-sensor scale: a torque sensor that reads too much or too little.

use sinew_effect::{
    Act, Card, Energy, Entry, Family, Law, Parameter, Prior, Reading, Screening, Sensor, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A reading of the torque sensor between gear and link that is off by a constant factor.
///
/// ```text
/// y = (1 + ε) τ_J
/// ```
#[derive(Debug, Clone, Copy)]
pub struct TorqueSensorScale {
    /// Degree of freedom whose sensor it is.
    pub dof: usize,
}

/// The card of [`TorqueSensorScale`].
static CARD: Card = Card {
    name: "torque_sensor_scale",
    title: "A reading of the torque sensor between gear and link that is off by a constant factor",
    law: "y = (1 + ε) τ_J",
    symptom: "the whole channel is scaled by one factor",
    family: Family::Instrument,
    energy: Energy::None,
    parameters: &[Parameter::signed("scale_error", "ε", "–", Prior::Absolute(0.05))],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        rival("torque_constant_error", "a known payload: the sensor alone reads wrong"),
        rival("joint_stiffness_error", "a known payload, held still"),
    ],
    sources: &[
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`TorqueSensorScale`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(TorqueSensorScale { dof: dof(ask)? })));

impl Law for TorqueSensorScale {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Reading]
    }
    // k ← k + ε
    fn add_reading<S: Scalar>(&self, p: &[S], sensor: Sensor, by_dof: &mut [Reading<S>]) {
        if sensor == Sensor::JointTorque {
            by_dof[self.dof].gain += p[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TorqueSensorScale { dof: 1 }, &[0.02]);
    }
}
