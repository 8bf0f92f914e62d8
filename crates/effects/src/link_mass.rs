//! Link mass: the error of a link's mass.

use sinew_effect::{Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::{Inertia, JointId, Pose, Scalar};

use crate::entry::{at_link, body_of, link, rival, twin};

/// The difference between the mass of a link and what the URDF says.
///
/// ```text
/// m ← m + Δm
/// ```
#[derive(Debug, Clone)]
pub struct LinkMass {
    /// The body that carries the link.
    pub body: JointId,
    /// The link frame in it.
    pub body_from_link: Pose<f64>,
}

/// The card of [`LinkMass`].
static CARD: Card = Card {
    name: "link_mass",
    title: "The difference between the mass of a link and what the URDF says",
    law: "m ← m + Δm",
    symptom: "torque residual as of a point mass at the origin of the link frame, on all joints before it",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[Parameter::signed("mass", "Δm", "kg", Prior::Free)],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        twin("payload", "weigh it, or postures that move the load of one joint only"),
        twin("link_first_moment", "only the base parameters can be told apart: state the mass"),
        rival("torque_constant_error", "repeat the motion with a known payload"),
    ],
    sources: &[
        "Gautier, Khalil: IEEE Trans. Robotics and Automation 6(3), 1990",
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkMass`].
pub(crate) const ENTRY: Entry = at_link(&CARD, |ask| {
    let (body, body_from_link) = body_of(ask, link(ask)?)?;
    Ok(Box::new(LinkMass { body, body_from_link }))
});

impl Law for LinkMass {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Body(self.body)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // I ← I + X* [Δm, 0, 0] X
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let change = Inertia { mass: p[0], ..Inertia::default() };
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
        check(&LinkMass { body: JointId(1), body_from_link }, &[0.3]);
    }
}
