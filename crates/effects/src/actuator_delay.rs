//! Actuator delay: a drive that acts late.

use sinew_effect::{
    Act, Actuation, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A motor torque that follows the logged one with a dead time.
///
/// ```text
/// τ_m(t) = τ_logged(t − d)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ActuatorDelay {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`ActuatorDelay`].
static CARD: Card = Card {
    name: "actuator_delay",
    title: "A motor torque that follows the logged one with a dead time",
    law: "τ_m(t) = τ_logged(t − d)",
    symptom: "a phase error that grows with frequency: residual in proportion to the rate of the torque",
    family: Family::Instrument,
    energy: Energy::Supplies,
    parameters: &[Parameter {
        range: (-0.03, 0.03),
        ..Parameter::signed("time", "d", "s", Prior::Share(0.3))
    }],
    screening: Screening::Exact { strengths: &[-4e-3, -2e-3, -1e-3, 1e-3, 2e-3, 4e-3, 8e-3] },
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("actuator_lag", "a multisine from 20 to 60 Hz: the two differ by (ωT)³/3"),
        rival("presliding_friction", "the same strokes at two speeds"),
        rival("joint_damping_error", "a multisine from 20 to 60 Hz"),
        rival("time_skew", "compare the stamps of the two channels, or log the drive's own clock"),
    ],
    sources: &["Ljung: System Identification, 2nd ed., Prentice Hall, 1999"],
};

/// The catalogue line of [`ActuatorDelay`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(ActuatorDelay { dof: dof(ask)? })));

impl Law for ActuatorDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Actuation]
    }
    // d ← d + d₀
    fn add_actuation<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Actuation<S>]) {
        by_dof[self.dof].delay += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&ActuatorDelay { dof: 1 }, &[-1e-3]);
    }
}
