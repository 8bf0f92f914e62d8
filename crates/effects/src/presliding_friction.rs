//! Presliding friction: bristles that bend before they slide (Dahl, LuGre).

use sinew_effect::{
    Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Relaxation, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, by_link_encoder, dof, rival};

/// Friction that builds up over a small displacement after each reversal.
///
/// ```text
/// τ = −z − σ₁ θ̇ (1 − s z/F)
/// ż = σ₀ |θ̇|/F · (F s − z),  F = F_c,  s = tanh(θ̇/v₀)
/// ```
///
/// It replaces the jump of its parent: `z` is the whole friction torque, so the law adds the difference. Bristles of no
/// compliance are the parent itself, and then the state rests.
#[derive(Debug, Clone, Copy)]
pub struct PreslidingFriction {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

// Friction torque below which bristles are not told from none, N·m.
const SMALLEST_TORQUE: f64 = 1e-9;
// Shortest bend F/σ₀, rad: it keeps the rate finite.
const SMALLEST_BEND: f64 = 1e-8;

/// The card of [`PreslidingFriction`].
static CARD: Card = Card {
    name: "presliding_friction",
    title: "Friction that builds up over a small displacement after each reversal",
    law: "τ = −z − σ₁ θ̇ (1 − s z/F) with ż = σ₀ |θ̇|/F · (F s − z),  F = F_c,  s = tanh(θ̇/v₀)",
    symptom: "torque builds up over micrometres after each reversal: loops of torque against position that do not depend on the speed",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[
        Parameter::positive("bristle_stiffness", "1/σ₀", "rad/(N·m)", Prior::Factor(0.7)).reciprocal(),
        Parameter::positive("micro_damping", "σ₁", "N·m·s/rad", Prior::Share(0.3)),
    ],
    screening: Screening::Exact {
        strengths: &[
            1.0 / 60.0,
            1.0 / 125.0,
            1.0 / 250.0,
            1.0 / 500.0,
            1.0 / 991.0,
            1.0 / 1963.0,
            1.0 / 3890.0,
            1.0 / 7710.0,
            1.0 / 15_300.0,
            1.0 / 30_300.0,
            1.0 / 60_000.0,
        ],
    },
    requires: &[Requirement::MotorTorque, Requirement::Parent("coulomb_friction")],
    rivals: &[
        rival("stribeck_friction", "strokes of 0.02 rad at 0.05 rad/s at three places"),
        rival("backlash", "the same strokes under a load of one sign: a gap vanishes"),
        rival("actuator_lag", "the same strokes at two speeds: a lag grows with the speed, a loop does not"),
        by_link_encoder(rival(
            "transmission_hysteresis",
            "slow reversals under load: only a spring's loop shows in the deflection",
        )),
    ],
    sources: &[
        "Dahl: Aerospace Corporation TOR-0158(3107-18)-1, 1968",
        "Canudas de Wit, Olsson, Åström, Lischinsky: IEEE Trans. Automatic Control 40(3), 1995",
        "Dupont, Hayward, Armstrong, Altpeter: IEEE Trans. Automatic Control 47(5), 2002",
    ],
};

/// The catalogue line of [`PreslidingFriction`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(PreslidingFriction { dof: dof(ask)? })));

impl Law for PreslidingFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::MotorForce, Act::State]
    }
    fn states(&self) -> usize {
        1
    }
    // τ ← τ + F_c s − z − σ₁ θ̇ (1 − s z/F)
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let s = at.motor_sign(self.dof);
        let sliding = at.coefficients.coulomb[self.dof] * s;
        let z = S::select(S::ZERO.lt(p[0]), at.z[0], sliding);
        let bent = s * z / self.strength(at);
        tau[self.dof] -= z - sliding + p[1] * at.thetad[self.dof] * (-bent + 1.0);
    }
    // ż = |θ̇|/(F/σ₀) · (F s − z)
    fn relaxation<S: Scalar>(&self, p: &[S], at: &At<S>, z: &mut [Relaxation<S>]) {
        let strength = self.strength(at);
        let bend = (p[0] * strength).max(S::constant(SMALLEST_BEND));
        let rate = at.thetad[self.dof].abs() / bend;
        z[0] = Relaxation {
            target: strength * at.motor_sign(self.dof),
            rate: S::select(S::ZERO.lt(p[0]), rate, S::ZERO),
        };
    }
}

impl PreslidingFriction {
    // F
    #[inline(always)]
    fn strength<S: Scalar>(&self, at: &At<S>) -> S {
        at.coefficients.coulomb[self.dof].max(S::constant(SMALLEST_TORQUE))
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&PreslidingFriction { dof: 1 }, &[1.0 / 2000.0, 0.4]);
    }
}
