//! Cogging: a torque that repeats with the position of the motor.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A motor torque that repeats with position and asks neither load nor speed.
///
/// ```text
/// τ = −a sin nθ − b cos nθ
/// ```
#[derive(Debug, Clone, Copy)]
pub struct CoggingTorque {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`CoggingTorque`].
static CARD: Card = Card {
    name: "cogging_torque",
    title: "A motor torque that repeats with position and asks neither load nor speed",
    law: "τ = −a sin nθ − b cos nθ",
    symptom: "a spatial sine in the torque, the same at all loads and speeds",
    family: Family::Periodic,
    energy: Energy::Stores,
    parameters: &[
        Parameter::signed("sine", "a", "N·m", Prior::Free),
        Parameter::signed("cosine", "b", "N·m", Prior::Free),
        Parameter::shape("per_turn", "n", "1/turn", &[12.0], (0.1, 1e4), Prior::Share(0.02)),
    ],
    screening: Screening::Harmonic,
    requires: &[Requirement::MotorTorque, Requirement::Turning],
    rivals: &[
        rival("torque_ripple", "two loads and two speeds"),
        rival("transmission_error", "two speeds in a ratio of four"),
        rival("balancer_spring", "the whole range of the joint: a spring does not repeat"),
    ],
    sources: &[
        "Islam, Mir, Sebastian: IEEE Trans. Industry Applications 40(3), 2004",
        "Holtz, Springob: IEEE Trans. Industrial Electronics 43(2), 1996",
    ],
};

/// The catalogue line of [`CoggingTorque`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(CoggingTorque { dof: dof(ask)? })));

impl Law for CoggingTorque {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − a sin nθ − b cos nθ
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let (s, c) = (p[2] * at.theta[self.dof]).sin_cos();
        tau[self.dof] -= p[0] * s + p[1] * c;
    }
    // U = (b sin nθ − a cos nθ)/n
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        let (s, c) = (p[2] * at.theta[self.dof]).sin_cos();
        (p[1] * s - p[0] * c) / p[2]
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&CoggingTorque { dof: 1 }, &[0.5, -0.3, 3.0]);
    }
}
