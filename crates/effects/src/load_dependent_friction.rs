//! Load-dependent friction: drag that grows with the torque through the gear.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_encoder, dof, rival};

/// Drag that grows with the torque that the gear hands on.
///
/// ```text
/// τ = −f_ℓ |τ_J|^e tanh(θ̇/v₀)
/// ```
///
/// The exponent stays where the file puts it: too few robots move enough load to tell it from the coefficient.
#[derive(Debug, Clone, Copy)]
pub struct LoadDependentFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

// Load below which |τ|^e is rounded off, N·m: it keeps the slope at zero load finite.
const ROUNDING: f64 = 1e-6;

/// The card of [`LoadDependentFriction`].
static CARD: Card = Card {
    name: "load_dependent_friction",
    title: "Drag that grows with the torque that the gear hands on",
    law: "τ = −f_ℓ |τ_J|^e tanh(θ̇/v₀)",
    symptom: "the jump at velocity reversals grows with the load",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::positive("load_coefficient", "f_ℓ", "–", Prior::Share(0.2)),
        Parameter::shape("exponent", "e", "–", &[1.0], (0.5, 1.5), Prior::Absolute(1e-3)),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Parent("coulomb_friction")],
    rivals: &[
        rival("coulomb_friction", "the same strokes with the arm raised and lowered"),
        rival("torque_constant_error", "the same strokes with the arm raised and lowered, at two speeds"),
        by_link_encoder(rival(
            "transmission_hysteresis",
            "slow reversals under load: only a spring's loop shows in the deflection",
        )),
        rival("payload", "the same strokes both ways"),
    ],
    sources: &[
        "Bittencourt, Gunnarsson: ASME J. Dynamic Systems, Measurement, and Control 134(5), 2012",
        "Hamon, Gautier, Garrec: IEEE/RSJ Int. Conf. Intelligent Robots and Systems, 2010",
    ],
};

/// The catalogue line of [`LoadDependentFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(LoadDependentFriction { dof: dof(ask)? })));

impl Law for LoadDependentFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::LoadedMotorForce]
    }
    // τ ← τ − f_ℓ |τ_J|^e tanh(θ̇/v₀)
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let load = power(at.tau_j[self.dof], p[1]);
        tau[self.dof] -= p[0] * load * at.motor_sign(self.dof);
    }
}

// |τ|^e ≈ (τ² + ε²)^(e/2)
#[inline(always)]
fn power<S: Scalar>(tau: S, exponent: S) -> S {
    ((tau * tau + ROUNDING * ROUNDING).ln() * exponent * 0.5).exp()
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&LoadDependentFriction { dof: 1 }, &[0.05, 1.0]);
    }
}
