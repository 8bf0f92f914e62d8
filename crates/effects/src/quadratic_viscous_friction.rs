//! Quadratic viscous friction: the bend of the drag curve at speed.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// The bend of the drag curve at speed; negative for a lubricant that thins.
///
/// ```text
/// τ = −F_q θ̇ |θ̇|
/// ```
///
/// Dissipates where positive; where negative, together with its parent as long as the total drag opposes the motion.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticViscousFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`QuadraticViscousFriction`].
static CARD: Card = Card {
    name: "quadratic_viscous_friction",
    title: "The bend of the drag curve at speed; negative for a lubricant that thins",
    law: "τ = −F_q θ̇ |θ̇|",
    symptom: "the drag curve bends at high speed",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[Parameter::signed("quadratic", "F_q", "N·m·s²/rad²", Prior::Share(0.2))],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Parent("viscous_friction")],
    rivals: &[
        rival("viscous_friction", "two speeds in a ratio of five or more"),
        rival("stribeck_friction", "constant speeds from 0.002 rad/s to the fastest"),
    ],
    sources: &[
        "Bittencourt, Gunnarsson: ASME J. Dynamic Systems, Measurement, and Control 134(5), 2012",
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
    ],
};

/// The catalogue line of [`QuadraticViscousFriction`].
pub(crate) const ENTRY: Entry =
    at_joint(&CARD, |ask| Ok(Box::new(QuadraticViscousFriction { dof: dof(ask)? })));

impl Law for QuadraticViscousFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − F_q θ̇ |θ̇|
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let v = at.thetad[self.dof];
        tau[self.dof] -= p[0] * v * v.abs();
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&QuadraticViscousFriction { dof: 1 }, &[0.3]);
    }
}
