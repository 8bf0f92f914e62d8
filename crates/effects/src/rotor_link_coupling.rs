//! Rotor–link coupling: a spinning rotor feels how the link that carries it turns.

use sinew_effect::{
    Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// The spin of a rotor that rides on a moving link, whose turning adds to it.
///
/// ```text
/// T = ½ B θ̇² + s B/N θ̇ u·ω
/// τ_m ← τ_m + s B/N u·ω̇
/// n   ← n + s B/N (θ̈ u + θ̇ ω × u)
/// ```
///
/// with N motor turns per joint turn, u the rotor's axis, ω the angular velocity of its link and n the moment that the
/// link must be given. The rotor's inertia as a part of that link is in the link's own.
///
/// s = 1 is the complete model of an elastic joint; the reduced one, s = 0, is what a robot is without this effect.
/// Numbers: B = 1 kg·m² and N = 100 give 0.01 kg·m² across, so a motor that speeds up with 5 rad/s² (at the joint) asks
/// 0.05 N·m of the link that carries it.
#[derive(Debug, Clone, Copy)]
pub struct RotorLinkCoupling {
    /// Degree of freedom that the rotor drives.
    pub dof: usize,
}

/// The card of [`RotorLinkCoupling`].
static CARD: Card = Card {
    name: "rotor_link_coupling",
    title: "The spin of a rotor that rides on a moving link, whose turning adds to it",
    law: "T = ½ B θ̇² + s B/N θ̇ u·ω",
    symptom: "torque residual in proportion to the acceleration of the motor in the joints before it, and to that of its \
              link in its own",
    family: Family::Inertial,
    energy: Energy::Exchanges,
    parameters: &[Parameter {
        range: (0.0, 2.0),
        ..Parameter::positive("scale", "s", "–", Prior::Absolute(0.3))
    }],
    screening: Screening::Linear,
    requires: &[Requirement::Parent("rotor_inertia"), Requirement::MotorTorque, Requirement::CarriedRotor],
    rivals: &[
        rival("joint_cross_coupling", "move the carried joint with the others held, fast and slowly"),
        rival("link_inertia", "move the carried joint with the others held, in several postures"),
        rival("rotor_inertia", "move the joints before with the carried one held, in several postures"),
    ],
    sources: &[
        "Tomei: IEEE Trans. Automatic Control 36(10), 1991",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`RotorLinkCoupling`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(RotorLinkCoupling { dof: dof(ask)? })));

impl Law for RotorLinkCoupling {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    fn carried_rotor(&self) -> Option<usize> {
        Some(self.dof)
    }
    // s ← s + s₀
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        c.rotor_link[self.dof] += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&RotorLinkCoupling { dof: 1 }, &[0.8]);
    }
}
