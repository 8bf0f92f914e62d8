//! Position-sensor offset: a link-side encoder that is not zero at zero.

use sinew_effect::{
    Act, Card, Energy, Entry, Family, Law, Parameter, Prior, Reading, Requirement, Screening, Sensor, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A constant error of the link-side position reading.
///
/// ```text
/// y = q + o
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PositionSensorOffset {
    /// Degree of freedom whose sensor it is.
    pub dof: usize,
}

/// The card of [`PositionSensorOffset`].
static CARD: Card = Card {
    name: "position_sensor_offset",
    title: "A constant error of the link-side position reading",
    law: "y = q + o",
    symptom: "a constant difference between the two encoders",
    family: Family::Instrument,
    energy: Energy::None,
    parameters: &[Parameter::signed("offset", "o", "rad", Prior::Absolute(3e-4))],
    screening: Screening::Linear,
    requires: &[Requirement::LinkEncoder],
    rivals: &[
        rival("link_first_moment", "compare with a home mark"),
        rival("base_tilt", "compare with a home mark, or two yaw angles of the base"),
    ],
    sources: &[
        "Mooring, Roth, Driels: Fundamentals of Manipulator Calibration, Wiley, 1991",
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`PositionSensorOffset`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(PositionSensorOffset { dof: dof(ask)? })));

impl Law for PositionSensorOffset {
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
        if sensor == Sensor::JointPosition {
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
        check(&PositionSensorOffset { dof: 1 }, &[1e-3]);
    }
}
