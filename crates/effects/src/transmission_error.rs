//! Transmission error: a gear whose ratio wavers.

use sinew_effect::{
    Act, At, Card, Deflection, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A position error of the gear that repeats with its position.
///
/// ```text
/// δ = θ + a sin nθ + b cos nθ − q
/// τ on the motor = τ_J (1 + n (a cos nθ − b sin nθ))
/// ```
#[derive(Debug, Clone, Copy)]
pub struct TransmissionError {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`TransmissionError`].
static CARD: Card = Card {
    name: "transmission_error",
    title: "A position error of the gear that repeats with its position",
    law: "δ = θ + a sin nθ + b cos nθ − q",
    symptom: "a spatial sine in the deflection; in the torque it grows with the square of the speed",
    family: Family::Periodic,
    energy: Energy::Exchanges,
    parameters: &[
        Parameter::signed("sine", "a", "rad", Prior::Free),
        Parameter::signed("cosine", "b", "rad", Prior::Free),
        Parameter::shape("per_turn", "n", "1/turn", &[12.0], (0.1, 1e4), Prior::Share(0.02)),
    ],
    screening: Screening::Harmonic,
    requires: &[Requirement::ElasticOrLinkEncoder, Requirement::Turning],
    rivals: &[
        rival("cogging_torque", "the same range at two speeds in a ratio of four"),
        rival("torque_ripple", "the same range at two speeds in a ratio of four"),
    ],
    sources: &[
        "Ghorbel, Gandhi, Alpeter: ASME J. Mechanical Design 123(1), 2001",
        "Tuttle, Seering: IEEE Trans. Robotics and Automation 12(3), 1996",
    ],
};

/// The catalogue line of [`TransmissionError`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(TransmissionError { dof: dof(ask)? })));

impl Law for TransmissionError {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Deflection]
    }
    // ε ← ε + a sin nθ + b cos nθ,   ε' ← ε' + n (a cos nθ − b sin nθ)
    fn add_deflection<S: Scalar>(&self, p: &[S], at: &At<S>, by_dof: &mut [Deflection<S>]) {
        let (s, c) = (p[2] * at.theta[self.dof]).sin_cos();
        by_dof[self.dof].shift += p[0] * s + p[1] * c;
        by_dof[self.dof].slope += p[2] * (p[0] * c - p[1] * s);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TransmissionError { dof: 1 }, &[1e-3, 2e-3, 3.0]);
    }
}
