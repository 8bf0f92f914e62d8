//! Actuator lag: a drive that follows its command slowly.

use sinew_effect::{
    Act, Actuation, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A motor torque that follows the logged one with a first-order lag.
///
/// ```text
/// T dτ_m/dt + τ_m = τ_logged
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ActuatorLag {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`ActuatorLag`].
static CARD: Card = Card {
    name: "actuator_lag",
    title: "A motor torque that follows the logged one with a first-order lag",
    law: "T dτ_m/dt + τ_m = τ_logged",
    symptom: "a phase error that grows with frequency: residual in proportion to the rate of the torque",
    family: Family::Instrument,
    energy: Energy::Supplies,
    parameters: &[Parameter {
        range: (0.0, 0.06),
        ..Parameter::positive("time", "T", "s", Prior::Share(0.3))
    }],
    screening: Screening::Exact { strengths: &[1e-3, 2e-3, 4e-3, 8e-3] },
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("actuator_delay", "a multisine from 20 to 60 Hz: the two differ by (ωT)³/3"),
        rival("presliding_friction", "the same strokes at two speeds"),
        rival("joint_damping_error", "a multisine from 20 to 60 Hz"),
        rival("time_skew", "compare the stamps of the two channels, or log the drive's own clock"),
    ],
    sources: &["Ljung: System Identification, 2nd ed., Prentice Hall, 1999"],
};

/// The catalogue line of [`ActuatorLag`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(ActuatorLag { dof: dof(ask)? })));

impl Law for ActuatorLag {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Actuation]
    }
    // T ← T + T₀
    fn add_actuation<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Actuation<S>]) {
        by_dof[self.dof].lag += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&ActuatorLag { dof: 1 }, &[2e-3]);
    }
}
