//! Contact: a soft stop on one side of the range.

use sinew_effect::{Act, Ask, At, Card, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::{Scalar, Setting};

use crate::entry::{at_joint, dof, rival};

/// A one-sided spring that the link meets at some position.
///
/// ```text
/// τ = −k_c (q − q_c)₊  above,  +k_c (q_c − q)₊  below
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Degree of freedom it acts at.
    pub dof: usize,
    /// The side of the position on which it pushes.
    pub side: Side,
}

/// The side of a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Greater positions.
    Above,
    /// Smaller positions.
    Below,
}

/// The card of [`Contact`].
static CARD: Card = Card {
    name: "contact",
    title: "A one-sided spring that the link meets at some position",
    law: "τ = −k_c (q − q_c)₊  above,  +k_c (q_c − q)₊  below",
    symptom: "torque residual on one side of a position only, nothing elsewhere",
    family: Family::Environment,
    energy: Energy::Stores,
    parameters: &[
        Parameter::positive("stiffness", "k_c", "N·m/rad", Prior::Share(0.3)),
        Parameter::shape("position", "q_c", "rad", &[0.0], (-1e3, 1e3), Prior::Free),
    ],
    screening: Screening::Quantiles { quantiles: &[0.5, 0.65, 0.78, 0.88, 0.95] },
    requires: &[],
    rivals: &[
        rival("balancer_spring", "approach slowly from the free side"),
        rival("stiffness_hardening", "approach slowly from the free side"),
    ],
    sources: &["Hunt, Crossley: ASME J. Applied Mechanics 42(2), 1975"],
};

/// The catalogue line of [`Contact`].
pub(crate) const ENTRY: Entry = Entry {
    words: &["side"],
    ..at_joint(&CARD, |ask| Ok(Box::new(Contact { dof: dof(ask)?, side: Side::of(ask)? })))
};

impl Law for Contact {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::LinkForce]
    }
    // τ ← τ ∓ k_c (± (q − q_c))₊
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        tau[self.dof] -= p[0] * self.depth(p, at) * self.side.sign();
    }
    // U = ½ k_c (± (q − q_c))₊²
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        let depth = self.depth(p, at);
        p[0] * depth * depth * 0.5
    }
}

impl Contact {
    // (± (q − q_c))₊
    #[inline(always)]
    fn depth<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        ((at.q[self.dof] - p[1]) * self.side.sign()).max(S::ZERO)
    }
}

impl Side {
    fn of(ask: &Ask) -> Result<Self, String> {
        match ask.spec.get("side") {
            None => Ok(Side::Above),
            Some(Setting::Word(word)) if word == "above" => Ok(Side::Above),
            Some(Setting::Word(word)) if word == "below" => Ok(Side::Below),
            Some(other) => Err(format!("`side` must be \"above\" or \"below\" (got {other:?})")),
        }
    }
    fn sign(self) -> f64 {
        match self {
            Side::Above => 1.0,
            Side::Below => -1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        for side in [Side::Above, Side::Below] {
            check(&Contact { dof: 1, side }, &[100.0, 0.2]);
        }
    }
}
