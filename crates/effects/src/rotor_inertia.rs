//! Rotor inertia: what the motor needs to turn itself.

use sinew_effect::{
    Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// The inertia of rotor and gear, seen at the link.
///
/// ```text
/// B θ̈ = τ_m − τ_J
/// ```
#[derive(Debug, Clone, Copy)]
pub struct RotorInertia {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`RotorInertia`].
static CARD: Card = Card {
    name: "rotor_inertia",
    title: "The inertia of rotor and gear, seen at the link",
    law: "B θ̈ = τ_m − τ_J",
    symptom: "torque residual in proportion to the motor acceleration, the same in every pose",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[Parameter::positive("inertia", "B", "kg·m²", Prior::Share(0.03))],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival(
            "link_inertia",
            "move the joint in poses with different load inertia, or excite it above its antiresonance",
        ),
        rival("torque_constant_error", "repeat the motion with a known payload"),
    ],
    sources: &[
        "Spong: ASME J. Dynamic Systems, Measurement, and Control 109(4), 1987",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`RotorInertia`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(RotorInertia { dof: dof(ask)? })));

impl Law for RotorInertia {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // B ← B + B₀
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        c.rotor[self.dof] += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&RotorInertia { dof: 1 }, &[0.4]);
    }
}
