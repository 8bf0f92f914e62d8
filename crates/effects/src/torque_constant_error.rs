//! Torque-constant error: a motor that pulls more or less than its current says.

use sinew_effect::{
    Act, Actuation, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival, twin};

/// A motor torque that differs from the logged one by a constant factor.
///
/// ```text
/// τ_m = (1 + ε) τ_logged
/// ```
#[derive(Debug, Clone, Copy)]
pub struct TorqueConstantError {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`TorqueConstantError`].
static CARD: Card = Card {
    name: "torque_constant_error",
    title: "A motor torque that differs from the logged one by a constant factor",
    law: "τ_m = (1 + ε) τ_logged",
    symptom: "all dynamics of the joint are scaled by one factor",
    family: Family::Instrument,
    energy: Energy::Supplies,
    parameters: &[Parameter {
        range: (-0.6, 1.5),
        ..Parameter::signed("scale_error", "ε", "–", Prior::Free)
    }],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("torque_saturation", "the same motion at half its amplitude: a limit is not reached then"),
        twin("payload", "repeat the motion with and without a known payload"),
        twin("link_first_moment", "repeat the motion with and without a known payload"),
        twin("link_inertia", "repeat the motion with and without a known payload"),
        rival("viscous_friction", "repeat the motion with and without a known payload"),
        rival("coulomb_friction", "repeat the motion with and without a known payload"),
    ],
    sources: &["Gautier, Briot: ASME J. Dynamic Systems, Measurement, and Control 136(5), 2014"],
};

/// The catalogue line of [`TorqueConstantError`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(TorqueConstantError { dof: dof(ask)? })));

impl Law for TorqueConstantError {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Actuation]
    }
    // k ← k + ε
    fn add_actuation<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Actuation<S>]) {
        by_dof[self.dof].gain += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TorqueConstantError { dof: 1 }, &[0.1]);
    }
}
