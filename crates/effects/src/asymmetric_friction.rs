//! Asymmetric friction: drag that differs between the two directions.

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// Drag that differs between the two directions of motion.
///
/// ```text
/// τ = −F_a |θ̇| − F_o tanh²(θ̇/v₀)
/// ```
///
/// Alone it gives back on the way there what it takes on the way back: only together with the drag of its parent is
/// it a friction. The offset cannot be told from that of the torque sensor and is never fitted.
#[derive(Debug, Clone, Copy)]
pub struct AsymmetricFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`AsymmetricFriction`].
static CARD: Card = Card {
    name: "asymmetric_friction",
    title: "Drag that differs between the two directions of motion",
    law: "τ = −F_a |θ̇| − F_o tanh²(θ̇/v₀)",
    symptom: "the mean of forward and backward strokes is shifted in proportion to the speed",
    family: Family::Friction,
    energy: Energy::Exchanges,
    parameters: &[
        Parameter::signed("slope", "F_a", "N·m·s/rad", Prior::Share(0.2)),
        Parameter::stated("offset", "F_o", "N·m"),
    ],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Parent("coulomb_friction")],
    rivals: &[
        rival("torque_sensor_offset", "equal strokes both ways at two speeds"),
        rival("balancer_spring", "equal strokes both ways at two speeds, at three places"),
        rival("viscous_friction", "equal strokes both ways at two speeds"),
    ],
    sources: &[
        "Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
        "Bittencourt, Gunnarsson: ASME J. Dynamic Systems, Measurement, and Control 134(5), 2012",
    ],
};

/// The catalogue line of [`AsymmetricFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(AsymmetricFriction { dof: dof(ask)? })));

impl Law for AsymmetricFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce]
    }
    // τ ← τ − F_a |θ̇| − F_o tanh²(θ̇/v₀)
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let s = at.motor_sign(self.dof);
        tau[self.dof] -= p[0] * at.thetad[self.dof].abs() + p[1] * s * s;
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&AsymmetricFriction { dof: 1 }, &[0.2, 0.1]);
    }
}
