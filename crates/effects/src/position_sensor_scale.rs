//! Position-sensor scale: a link-side encoder of the wrong pitch.

use sinew_effect::{
    Act, Card, Energy, Entry, Family, Law, Parameter, Prior, Reading, Requirement, Screening, Sensor, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A link-side position reading that is off by a constant factor.
///
/// ```text
/// y = (1 + ε) q
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PositionSensorScale {
    /// Degree of freedom whose sensor it is.
    pub dof: usize,
}

/// The card of [`PositionSensorScale`].
static CARD: Card = Card {
    name: "position_sensor_scale",
    title: "A link-side position reading that is off by a constant factor",
    law: "y = (1 + ε) q",
    symptom: "the difference between the two encoders grows with the position",
    family: Family::Instrument,
    energy: Energy::None,
    parameters: &[Parameter::signed("scale_error", "ε", "–", Prior::Absolute(0.01))],
    screening: Screening::Linear,
    requires: &[Requirement::LinkEncoder],
    rivals: &[
        rival("joint_stiffness_error", "a full-range move against a reference, without load"),
        rival("balancer_spring", "a full-range move against a reference, without load"),
    ],
    sources: &["Mooring, Roth, Driels: Fundamentals of Manipulator Calibration, Wiley, 1991"],
};

/// The catalogue line of [`PositionSensorScale`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(PositionSensorScale { dof: dof(ask)? })));

impl Law for PositionSensorScale {
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
        if sensor == Sensor::JointPosition {
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
        check(&PositionSensorScale { dof: 1 }, &[0.02]);
    }
}
