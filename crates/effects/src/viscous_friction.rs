//! Viscous friction: a torque in proportion to the motor speed.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_sensor, dof, rival, twin};

/// Drag of the motor and gear in proportion to the speed.
///
/// ```text
/// τ = −F_v θ̇
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ViscousFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`ViscousFriction`].
static CARD: Card = Card {
    name: "viscous_friction",
    title: "Drag of the motor and gear in proportion to the speed",
    law: "τ = −F_v θ̇",
    symptom: "torque residual in proportion to the velocity",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[Parameter::positive("viscous", "F_v", "N·m·s/rad", Prior::Share(0.2))],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("coulomb_friction", "two speeds in a ratio of five or more, both ways"),
        by_link_sensor(twin(
            "link_viscous_friction",
            "excitation near the antiresonance of an elastic joint",
        )),
        rival("quadratic_viscous_friction", "two speeds in a ratio of five or more"),
        rival("torque_constant_error", "repeat the motion with a known payload"),
    ],
    sources: &[
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
        "Khalil, Dombre: Modeling, Identification and Control of Robots, Hermes Penton, 2002",
    ],
};

/// The catalogue line of [`ViscousFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(ViscousFriction { dof: dof(ask)? })));

impl Law for ViscousFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − F_v θ̇
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * at.thetad[self.dof];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&ViscousFriction { dof: 1 }, &[0.8]);
    }
}
