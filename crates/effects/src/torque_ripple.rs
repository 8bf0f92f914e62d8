//! Torque ripple: a torque constant that wavers with position.

use sinew_effect::{
    Act, Actuation, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A torque constant that repeats with the position of the motor.
///
/// ```text
/// τ_m = (1 + a sin nθ + b cos nθ) τ_logged
/// ```
#[derive(Debug, Clone, Copy)]
pub struct TorqueRipple {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`TorqueRipple`].
static CARD: Card = Card {
    name: "torque_ripple",
    title: "A torque constant that repeats with the position of the motor",
    law: "τ_m = (1 + a sin nθ + b cos nθ) τ_logged",
    symptom: "a spatial sine times the torque",
    family: Family::Periodic,
    energy: Energy::Supplies,
    parameters: &[
        Parameter::signed("sine", "a", "–", Prior::Free),
        Parameter::signed("cosine", "b", "–", Prior::Free),
        Parameter::shape("per_turn", "n", "1/turn", &[12.0], (0.1, 1e4), Prior::Share(0.02)),
    ],
    screening: Screening::Harmonic,
    requires: &[Requirement::MotorTorque, Requirement::Turning],
    rivals: &[
        rival("cogging_torque", "the same motion at two loads"),
        rival("transmission_error", "two speeds in a ratio of four, at two loads"),
    ],
    sources: &["Holtz, Springob: IEEE Trans. Industrial Electronics 43(2), 1996"],
};

/// The catalogue line of [`TorqueRipple`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(TorqueRipple { dof: dof(ask)? })));

impl Law for TorqueRipple {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Actuation]
    }
    // k ← k + a sin nθ + b cos nθ
    fn add_actuation<S: Scalar>(&self, p: &[S], at: &At<S>, by_dof: &mut [Actuation<S>]) {
        let (s, c) = (p[2] * at.theta[self.dof]).sin_cos();
        by_dof[self.dof].gain += p[0] * s + p[1] * c;
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TorqueRipple { dof: 1 }, &[0.02, -0.01, 3.0]);
    }
}
