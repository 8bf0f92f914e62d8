//! Base tilt: a base that does not stand level.

use sinew_effect::{
    Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::{Matrix3, Scalar, Vector3};

use crate::entry::{at_robot, rival};

/// A base mounted out of level by two small angles.
///
/// ```text
/// g ← Rᵀ g,  R = R_y(φ_y) R_x(φ_x)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct BaseTilt;

/// The card of [`BaseTilt`].
static CARD: Card = Card {
    name: "base_tilt",
    title: "A base mounted out of level by two small angles",
    law: "g ← Rᵀ g,  R = R_y(φ_y) R_x(φ_x)",
    symptom: "torque residual as of a first moment on all joints, in one direction",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[
        Parameter::signed("about_x", "φ_x", "rad", Prior::Absolute(0.01)),
        Parameter::signed("about_y", "φ_y", "rad", Prior::Absolute(0.01)),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::Joints(2)],
    rivals: &[
        rival("link_first_moment", "the same postures at two yaw angles of the base"),
        rival("position_sensor_offset", "the same postures at two yaw angles of the base"),
        rival("balancer_spring", "the same postures at two yaw angles of the base"),
    ],
    sources: &[
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`BaseTilt`].
pub(crate) const ENTRY: Entry = at_robot(&CARD, |_| Ok(Box::new(BaseTilt)));

impl Law for BaseTilt {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Robot
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // g ← R_x(φ_x)ᵀ R_y(φ_y)ᵀ g
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let about_x = Matrix3::rotation(Vector3 { x: 1.0, y: 0.0, z: 0.0 }, p[0]);
        let about_y = Matrix3::rotation(Vector3 { x: 0.0, y: 1.0, z: 0.0 }, p[1]);
        c.gravity = about_x.transpose_mul(about_y.transpose_mul(c.gravity));
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&BaseTilt, &[0.02, -0.03]);
    }
}
