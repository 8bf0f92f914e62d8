//! Transmission hysteresis: a spring with inner friction (Bouc–Wen).

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Relaxation, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_encoder, dof, rival};

/// A gear whose torque depends on where the deflection last turned back.
///
/// ```text
/// τ_J ← τ_J + A z
/// ż = (δ̇ − |δ̇| z)/δ_y
/// ```
#[derive(Debug, Clone, Copy)]
pub struct TransmissionHysteresis {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

// Rate at which |δ̇| is rounded off, rad/s: the state forgets in years, not never.
const ROUNDING: f64 = 1e-12;

/// The card of [`TransmissionHysteresis`].
static CARD: Card = Card {
    name: "transmission_hysteresis",
    title: "A gear whose torque depends on where the deflection last turned back",
    law: "τ_J ← τ_J + A z with ż = (δ̇ − |δ̇| z)/δ_y",
    symptom: "a closed loop of deflection against torque that does not depend on the speed and whose width saturates",
    family: Family::Transmission,
    energy: Energy::StoresAndDissipates,
    parameters: &[
        Parameter::positive("stiffness", "A", "N·m", Prior::Share(0.3)),
        Parameter::shape(
            "yield_deflection",
            "δ_y",
            "rad",
            &[5e-5, 1.1e-4, 2.4e-4, 5.2e-4, 1.1e-3, 2.5e-3],
            (2e-5, 0.05),
            Prior::Factor(0.7),
        ),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::Elastic],
    rivals: &[
        rival("joint_damping_error", "slow load cycles at two speeds: damping depends on the speed"),
        rival("link_coulomb_friction", "slow load cycles of two amplitudes with the link held"),
        rival("backlash", "slow load cycles of two amplitudes, and the same under a load of one sign"),
        by_link_encoder(rival(
            "presliding_friction",
            "slow reversals under load: only a spring's loop shows in the deflection",
        )),
    ],
    sources: &[
        "Wen: ASCE J. Engineering Mechanics Division 102(2), 1976",
        "Ruderman, Hoffmann, Bertram: IEEE Trans. Industrial Electronics 56(10), 2009",
        "Dhaouadi, Ghorbel, Gandhi: IEEE Trans. Industrial Electronics 50(6), 2003",
    ],
};

/// The catalogue line of [`TransmissionHysteresis`].
pub(crate) const ENTRY: Entry =
    at_joint(&CARD, |ask| Ok(Box::new(TransmissionHysteresis { dof: dof(ask)? })));

impl Law for TransmissionHysteresis {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::SpringTorque, Act::State]
    }
    fn states(&self) -> usize {
        1
    }
    // τ_J ← τ_J + A z
    fn add_spring_torque<S: Scalar>(&self, p: &[S], at: &At<S>, tau_j: &mut [S]) {
        tau_j[self.dof] += p[0] * at.z[0];
    }
    // ż = |δ̇|/δ_y · (δ̇/|δ̇| − z)
    fn relaxation<S: Scalar>(&self, p: &[S], at: &At<S>, z: &mut [Relaxation<S>]) {
        let v = at.deflection_rate[self.dof];
        let speed = (v * v + ROUNDING * ROUNDING).sqrt();
        z[0] = Relaxation { target: v / speed, rate: speed / p[1] };
    }
    // U = ½ A δ_y z²
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        p[0] * p[1] * at.z[0] * at.z[0] * 0.5
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TransmissionHysteresis { dof: 1 }, &[2.0, 0.02]);
    }
}
