//! Link-side viscous friction: drag behind the gear.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_sensor, dof, rival, twin};

/// Drag of the link-side bearing in proportion to the speed.
///
/// ```text
/// τ = −F_vℓ q̇
/// ```
#[derive(Debug, Clone, Copy)]
pub struct LinkViscousFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`LinkViscousFriction`].
static CARD: Card = Card {
    name: "link_viscous_friction",
    title: "Drag of the link-side bearing in proportion to the speed",
    law: "τ = −F_vℓ q̇",
    symptom: "deflection carries a drag in proportion to the velocity",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[Parameter::positive("viscous", "F_vℓ", "N·m·s/rad", Prior::Share(0.2))],
    screening: Screening::Linear,
    requires: &[Requirement::LinkBalance],
    rivals: &[
        by_link_sensor(twin("viscous_friction", "excitation near the antiresonance")),
        rival("joint_damping_error", "excite the antiresonance at two frequencies"),
        rival("time_skew", "fast reversals at two frequencies"),
    ],
    sources: &[
        "Spong: ASME J. Dynamic Systems, Measurement, and Control 109(4), 1987",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkViscousFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(LinkViscousFriction { dof: dof(ask)? })));

impl Law for LinkViscousFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::LinkForce]
    }
    // τ ← τ − F_vℓ q̇
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * at.qd[self.dof];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&LinkViscousFriction { dof: 1 }, &[0.8]);
    }
}
