//! Torque saturation: a drive that gives no more than its limit.

use sinew_effect::{
    Act, Actuation, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A drive that gives no more torque than its limit, whatever its command says.
///
/// ```text
/// τ_m = clamp(τ_logged, ±τ_s)
/// ```
///
/// Fitted as 1/τ_s, which is zero for a drive without a limit; files show τ_s.
#[derive(Debug, Clone, Copy)]
pub struct TorqueSaturation {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`TorqueSaturation`].
static CARD: Card = Card {
    name: "torque_saturation",
    title: "A drive that gives no more torque than its limit, whatever its command says",
    law: "τ_m = clamp(τ_logged, ±τ_s)",
    symptom: "torque residual at the peaks of the logged torque only, on one side",
    family: Family::Instrument,
    energy: Energy::Supplies,
    parameters: &[Parameter::positive("limit", "1/τ_s", "1/(N·m)", Prior::Share(0.1)).reciprocal()],
    screening: Screening::Peaks { shares: &[0.95, 0.9, 0.8, 0.7, 0.6, 0.45] },
    requires: &[Requirement::MotorTorque],
    rivals: &[
        rival("torque_constant_error", "the same motion at half its amplitude: a limit is not reached then"),
        rival("asymmetric_friction", "the same motion at half its amplitude"),
        rival("quadratic_viscous_friction", "the same speed reached slowly, with less torque"),
    ],
    sources: &["Siciliano, Sciavicco, Villani, Oriolo: Robotics, Springer 2009, section 5.2"],
};

/// The catalogue line of [`TorqueSaturation`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(TorqueSaturation { dof: dof(ask)? })));

impl Law for TorqueSaturation {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Actuation]
    }
    // Several limits of one drive: the lowest counts.
    fn add_actuation<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Actuation<S>]) {
        by_dof[self.dof].limit = by_dof[self.dof].limit.max(p[0]);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TorqueSaturation { dof: 1 }, &[1.0 / 40.0]);
    }
}
