//! Stribeck friction: extra drag at low speed.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// Extra drag at low speed, before the lubricant carries.
///
/// ```text
/// τ = −F_s exp(−(θ̇/v_s)²) tanh(θ̇/v₀)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct StribeckFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`StribeckFriction`].
static CARD: Card = Card {
    name: "stribeck_friction",
    title: "Extra drag at low speed, before the lubricant carries",
    law: "τ = −F_s exp(−(θ̇/v_s)²) tanh(θ̇/v₀)",
    symptom: "extra drag below v_s only, which falls as the speed rises",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::positive("stribeck", "F_s", "N·m", Prior::Share(0.2)),
        Parameter::shape(
            "stribeck_velocity",
            "v_s",
            "rad/s",
            &[0.01, 0.02, 0.04, 0.08, 0.16, 0.32],
            (4e-3, 1.0),
            Prior::Factor(0.7),
        ),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Parent("coulomb_friction")],
    rivals: &[
        rival("presliding_friction", "slow strokes from 0.002 to 0.1 rad/s, and reversals of micrometres"),
        rival(
            "coulomb_friction",
            "slow strokes from 0.002 to 0.1 rad/s: a wrong v₀ spreads the jump, it adds no drag",
        ),
        rival("quadratic_viscous_friction", "constant speeds from 0.002 rad/s to the fastest"),
    ],
    sources: &[
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
        "Stribeck: Zeitschrift des VDI 46, 1902",
    ],
};

/// The catalogue line of [`StribeckFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(StribeckFriction { dof: dof(ask)? })));

impl Law for StribeckFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − F_s exp(−(θ̇/v_s)²) tanh(θ̇/v₀)
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let x = at.thetad[self.dof] / p[1];
        tau[self.dof] -= p[0] * (-(x * x)).exp() * at.motor_sign(self.dof);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&StribeckFriction { dof: 1 }, &[0.6, 0.3]);
    }
}
