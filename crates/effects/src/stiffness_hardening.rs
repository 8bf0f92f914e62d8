//! Stiffness hardening: a spring that is not linear.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A spring whose stiffness grows with the load; it softens where negative.
///
/// ```text
/// τ_J ← τ_J + K₃ δ³
/// ```
#[derive(Debug, Clone, Copy)]
pub struct StiffnessHardening {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`StiffnessHardening`].
static CARD: Card = Card {
    name: "stiffness_hardening",
    title: "A spring whose stiffness grows with the load; it softens where negative",
    law: "τ_J ← τ_J + K₃ δ³",
    symptom: "the curve of deflection against torque bends",
    family: Family::Transmission,
    energy: Energy::Stores,
    parameters: &[Parameter::signed("cubic", "K₃", "N·m/rad³", Prior::Share(0.3))],
    screening: Screening::Linear,
    requires: &[Requirement::Elastic],
    rivals: &[
        rival("backlash", "large and small loads: a gap bends the curve the other way"),
        rival("joint_stiffness_error", "large and small loads"),
        rival("transmission_hysteresis", "slow load cycles of two amplitudes: hysteresis opens a loop"),
    ],
    sources: &[
        "Tuttle, Seering: IEEE Trans. Robotics and Automation 12(3), 1996",
        "Ruderman, Hoffmann, Bertram: IEEE Trans. Industrial Electronics 56(10), 2009",
    ],
};

/// The catalogue line of [`StiffnessHardening`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(StiffnessHardening { dof: dof(ask)? })));

impl Law for StiffnessHardening {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::SpringTorque]
    }
    // τ_J ← τ_J + K₃ δ³
    fn add_spring_torque<S: Scalar>(&self, p: &[S], at: &At<S>, tau_j: &mut [S]) {
        let d = at.deflection[self.dof];
        tau_j[self.dof] += p[0] * d * d * d;
    }
    // U = ¼ K₃ δ⁴
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        let d = at.deflection[self.dof];
        p[0] * d * d * d * d * 0.25
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&StiffnessHardening { dof: 1 }, &[50.0]);
    }
}
