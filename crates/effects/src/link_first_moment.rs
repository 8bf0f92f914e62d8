//! Link first moment: the error of a link's mass times centre of mass.

use sinew_effect::{Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::{Inertia, JointId, Pose, Scalar, Vector3};

use crate::entry::{at_link, body_of, link, rival, twin};

/// The difference between the first moment of a link and what the URDF says.
///
/// ```text
/// m c ← m c + Δh
/// ```
#[derive(Debug, Clone)]
pub struct LinkFirstMoment {
    /// The body that carries the link.
    pub body: JointId,
    /// The link frame in it.
    pub body_from_link: Pose<f64>,
}

/// The card of [`LinkFirstMoment`].
static CARD: Card = Card {
    name: "link_first_moment",
    title: "The difference between the first moment of a link and what the URDF says",
    law: "m c ← m c + Δh",
    symptom: "torque residual as the sine and cosine of the pose, on the joints before the link",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[
        Parameter::signed("first_moment", "Δh_x", "kg·m", Prior::Free).component(0),
        Parameter::signed("first_moment", "Δh_y", "kg·m", Prior::Free).component(1),
        Parameter::signed("first_moment", "Δh_z", "kg·m", Prior::Free).component(2),
    ],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        twin("payload", "weigh it, or postures that move the load of one joint only"),
        rival("base_tilt", "the same postures at two yaw angles of the base"),
        rival("balancer_spring", "holds over the whole range of the joint"),
        rival("torque_constant_error", "repeat the motion with a known payload"),
    ],
    sources: &[
        "Gautier, Khalil: IEEE Trans. Robotics and Automation 6(3), 1990",
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkFirstMoment`].
pub(crate) const ENTRY: Entry = at_link(&CARD, |ask| {
    let (body, body_from_link) = body_of(ask, link(ask)?)?;
    Ok(Box::new(LinkFirstMoment { body, body_from_link }))
});

impl Law for LinkFirstMoment {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Body(self.body)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // I ← I + X* [0, Δh, 0] X
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let first_moment = Vector3::new(p[0], p[1], p[2]);
        let change = Inertia { first_moment, ..Inertia::default() };
        c.inertia[self.body.0] += Pose::constant(&self.body_from_link).inertia_to_parent(&change);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        let body_from_link = Pose::from_xyz_rpy([0.1, -0.2, 0.3], [0.4, 0.5, -0.6]);
        check(&LinkFirstMoment { body: JointId(1), body_from_link }, &[0.1, -0.2, 0.05]);
    }
}
