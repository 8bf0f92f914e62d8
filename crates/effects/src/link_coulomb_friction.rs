//! Link-side Coulomb friction: a torque of constant size behind the gear.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_sensor, dof, rival, twin};

/// Drag of constant size against the motion of the link.
///
/// ```text
/// τ = −F_cℓ tanh(q̇/v₀)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct LinkCoulombFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`LinkCoulombFriction`].
static CARD: Card = Card {
    name: "link_coulomb_friction",
    title: "Drag of constant size against the motion of the link",
    law: "τ = −F_cℓ tanh(q̇/v₀)",
    symptom: "deflection jumps by 2 F_cℓ/K where the velocity changes sign",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::positive("coulomb", "F_cℓ", "N·m", Prior::Share(0.2)),
        Parameter::shape("smoothing_velocity", "v₀", "rad/s", &[2e-3], (1e-5, 0.5), Prior::Factor(0.5)),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::LinkBalance],
    rivals: &[
        by_link_sensor(twin("coulomb_friction", "slow reversals")),
        rival("transmission_hysteresis", "slow load cycles of two amplitudes, and reversals without load"),
        rival("backlash", "the same reversals under a load of one sign"),
    ],
    sources: &[
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkCoulombFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(LinkCoulombFriction { dof: dof(ask)? })));

impl Law for LinkCoulombFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::LinkForce]
    }
    // τ ← τ − F_cℓ tanh(q̇/v₀)
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * at.link_sign(self.dof, p[1]);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&LinkCoulombFriction { dof: 1 }, &[1.3, 0.1]);
    }
}
