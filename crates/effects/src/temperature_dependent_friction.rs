//! Temperature-dependent friction: a cold gear drags more, or less, than a warm one.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// What friction changes with the temperature of the joint; negative where a warm lubricant is thinner.
///
/// ```text
/// τ = −(T − T₀)(k_v θ̇ + k_c tanh(θ̇/v₀)),   v₀ the width of Coulomb friction
/// ```
///
/// T: the temperature logged for the joint, °C; T₀: that at which the friction beside it is stated. Nothing where no
/// temperature is told. Dissipates where T − T₀ and both strengths are positive; elsewhere together with the friction
/// beside it, as long as the total drag opposes the motion.
#[derive(Debug, Clone, Copy)]
pub struct TemperatureDependentFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

// The key of T₀.
const REFERENCE: &str = "reference_temperature";

/// The card of [`TemperatureDependentFriction`].
static CARD: Card = Card {
    name: "temperature_dependent_friction",
    title: "What friction changes with the temperature of the joint; negative where a warm lubricant is thinner",
    law: "τ = −(T − T₀)(k_v θ̇ + k_c tanh(θ̇/v₀))",
    symptom: "drag that differs between a cold and a warm robot",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::signed("viscous_slope", "k_v", "N·m·s/(rad·K)", Prior::Share(0.2)),
        Parameter::signed("coulomb_slope", "k_c", "N·m/K", Prior::Share(0.2)),
        Parameter::stated(REFERENCE, "T₀", "°C"),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Temperature { mean: REFERENCE }],
    rivals: &[
        rival("quadratic_viscous_friction", "the same motion, cold and warm"),
        rival("load_dependent_friction", "the same motion, cold and warm"),
    ],
    sources: &[
        "Bittencourt, Gunnarsson: ASME J. Dynamic Systems, Measurement, and Control 134(5), 2012",
        "Simoni, Beschi, Legnani, Visioli: IEEE/RSJ Int. Conf. Intelligent Robots and Systems, 2015",
    ],
};

/// The catalogue line of [`TemperatureDependentFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| {
    let is_there = |key: &str| ask.spec.number(key).is_some_and(|slope| slope != 0.0);
    if (is_there("viscous_slope") || is_there("coulomb_slope")) && ask.spec.get(REFERENCE).is_none() {
        return Err(format!("lacks {REFERENCE}, the °C at which the friction beside it is stated"));
    }
    Ok(Box::new(TemperatureDependentFriction { dof: dof(ask)? }))
});

impl Law for TemperatureDependentFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − (T − T₀)(k_v θ̇ + k_c tanh(θ̇/v₀))
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let Some(temperature) = at.temperature[self.dof] else { return };
        let warmer = S::constant(temperature) - p[2];
        tau[self.dof] -= warmer * (p[0] * at.thetad[self.dof] + p[1] * at.motor_sign(self.dof));
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&TemperatureDependentFriction { dof: 1 }, &[0.02, 0.01, 20.0]);
    }
}
