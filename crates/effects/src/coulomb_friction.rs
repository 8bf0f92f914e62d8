//! Coulomb friction: a torque of constant size against the motion.

use sinew_effect::{
    Act, At, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_sensor, dof, rival, twin};

/// Drag of constant size against the motion of the motor.
///
/// ```text
/// τ = −F_c tanh(θ̇/v₀)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct CoulombFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`CoulombFriction`].
static CARD: Card = Card {
    name: "coulomb_friction",
    title: "Drag of constant size against the motion of the motor",
    law: "τ = −F_c tanh(θ̇/v₀)",
    symptom: "torque residual jumps by 2 F_c where the velocity changes sign and is flat elsewhere",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::positive("coulomb", "F_c", "N·m", Prior::Share(0.2)),
        Parameter::shape("smoothing_velocity", "v₀", "rad/s", &[2e-3], (1e-5, 0.5), Prior::Factor(0.5)),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("viscous_friction", "two speeds in a ratio of five or more, both ways"),
        by_link_sensor(twin("link_coulomb_friction", "slow load reversals of an elastic joint")),
        rival("load_dependent_friction", "the same strokes with the arm raised and lowered"),
        rival("presliding_friction", "strokes of 0.02 rad at 0.05 rad/s at three places"),
    ],
    sources: &[
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
        "Khalil, Dombre: Modeling, Identification and Control of Robots, Hermes Penton, 2002",
    ],
};

/// The catalogue line of [`CoulombFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(CoulombFriction { dof: dof(ask)? })));

impl Law for CoulombFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients, Act::MotorForce]
    }
    // F_c is known to the other friction laws, and v₀ is that of every friction of this motor
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        c.coulomb[self.dof] += p[0];
        c.smoothing_velocity[self.dof] = p[1];
    }
    // τ ← τ − F_c tanh(θ̇/v₀)
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * at.motor_sign(self.dof);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&CoulombFriction { dof: 1 }, &[1.3, 2e-3]);
    }
}
