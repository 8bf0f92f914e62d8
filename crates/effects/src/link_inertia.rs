//! Link inertia: the error of a link's second moment.

use sinew_effect::{Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::{Inertia, JointId, Pose, Scalar, Symmetric3};

use crate::entry::{at_link, body_of, link, rival, twin};

/// The difference between the inertia of a link and what the URDF says.
///
/// ```text
/// I ← I + ΔI
/// ```
#[derive(Debug, Clone)]
pub struct LinkInertia {
    /// The body that carries the link.
    pub body: JointId,
    /// The link frame in it.
    pub body_from_link: Pose<f64>,
}

/// The card of [`LinkInertia`].
static CARD: Card = Card {
    name: "link_inertia",
    title: "The difference between the inertia of a link and what the URDF says",
    law: "I ← I + ΔI",
    symptom: "torque residual in proportion to accelerations and squared velocities, on the joints before the link",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[
        Parameter::signed("inertia", "ΔI_xx", "kg·m²", Prior::Free).component(0),
        Parameter::signed("inertia", "ΔI_yy", "kg·m²", Prior::Free).component(1),
        Parameter::signed("inertia", "ΔI_zz", "kg·m²", Prior::Free).component(2),
        Parameter::signed("inertia", "ΔI_xy", "kg·m²", Prior::Free).component(3),
        Parameter::signed("inertia", "ΔI_xz", "kg·m²", Prior::Free).component(4),
        Parameter::signed("inertia", "ΔI_yz", "kg·m²", Prior::Free).component(5),
    ],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        rival(
            "rotor_inertia",
            "move the joint in poses with different load inertia, or excite it above its antiresonance",
        ),
        twin("payload", "postures that move the load of one joint only"),
        rival("torque_constant_error", "repeat the motion with a known payload"),
    ],
    sources: &[
        "Gautier, Khalil: IEEE Trans. Robotics and Automation 6(3), 1990",
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkInertia`].
pub(crate) const ENTRY: Entry = at_link(&CARD, |ask| {
    let (body, body_from_link) = body_of(ask, link(ask)?)?;
    Ok(Box::new(LinkInertia { body, body_from_link }))
});

impl Law for LinkInertia {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Body(self.body)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // I ← I + X* [0, 0, ΔI] X
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let [xx, yy, zz, xy, xz, yz] = core::array::from_fn(|k| p[k]);
        let second_moment = Symmetric3 { xx, yy, zz, xy, xz, yz };
        let change = Inertia { second_moment, ..Inertia::default() };
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
        check(&LinkInertia { body: JointId(1), body_from_link }, &[0.01, 0.02, 0.03, 0.001, -0.002, 0.003]);
    }
}
