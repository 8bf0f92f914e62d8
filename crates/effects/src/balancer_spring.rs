//! Balancer spring: a spring that helps to carry the arm.

use sinew_effect::{Act, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// A spring between link and base that carries part of the weight.
///
/// ```text
/// τ = −k_b q − c_b
/// ```
#[derive(Debug, Clone, Copy)]
pub struct BalancerSpring {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`BalancerSpring`].
static CARD: Card = Card {
    name: "balancer_spring",
    title: "A spring between link and base that carries part of the weight",
    law: "τ = −k_b q − c_b",
    symptom: "torque residual that depends on the position only, and is the same at rest",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[
        Parameter::positive("stiffness", "k_b", "N·m/rad", Prior::Share(0.08)),
        Parameter::signed("preload", "c_b", "N·m", Prior::Share(0.08)),
    ],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        rival(
            "link_first_moment",
            "holds over the whole range: weight bends as a cosine, a spring is straight",
        ),
        rival("torque_sensor_offset", "holds over the whole range, in both directions"),
        rival("base_tilt", "holds over the whole range at two mountings of the base"),
    ],
    sources: &[
        "Arakelian: Advanced Robotics 30(2), 2016",
        "Khalil, Dombre: Modeling, Identification and Control of Robots, Hermes Penton, 2002",
    ],
};

/// The catalogue line of [`BalancerSpring`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(BalancerSpring { dof: dof(ask)? })));

impl Law for BalancerSpring {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::LinkForce]
    }
    // τ ← τ − k_b q − c_b
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * at.q[self.dof] + p[1];
    }
    // U = ½ k_b q² + c_b q
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        let q = at.q[self.dof];
        (p[0] * q * 0.5 + p[1]) * q
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&BalancerSpring { dof: 1 }, &[20.0, -3.0]);
    }
}
