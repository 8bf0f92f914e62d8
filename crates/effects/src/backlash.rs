//! Backlash: free play in the gear.

use sinew_effect::{
    Act, At, Card, Deflection, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::Scalar;

use crate::entry::{at_joint, dof, rival};

/// Free play in the gear: the spring does not act within a gap.
///
/// ```text
/// δ = dz(θ − q, g):  0 where |θ − q| < g, else θ − q ∓ g
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Backlash {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`Backlash`].
static CARD: Card = Card {
    name: "backlash",
    title: "Free play in the gear: the spring does not act within a gap",
    law: "δ = dz(θ − q, g):  0 where |θ − q| < g, else θ − q ∓ g",
    symptom: "deflection jumps by 2 g where the load changes sign, and not at all under a load of one sign",
    family: Family::Transmission,
    energy: Energy::Exchanges,
    parameters: &[Parameter::positive("half_width", "g", "rad", Prior::Share(0.3))],
    screening: Screening::Exact { strengths: &[5e-5, 9e-5, 1.6e-4, 2.9e-4, 5.2e-4, 9.3e-4, 1.7e-3, 3e-3] },
    requires: &[Requirement::Elastic],
    rivals: &[
        rival("presliding_friction", "reversals across zero load and, the same, under a load of one sign"),
        rival(
            "transmission_hysteresis",
            "reversals across zero load and, the same, under a load of one sign",
        ),
        rival("joint_stiffness_error", "large and small loads"),
        rival("stiffness_hardening", "large and small loads: hardening bends the curve the other way"),
    ],
    sources: &[
        "Nordin, Gutman: Automatica 38(10), 2002",
        "Ruderman, Hoffmann, Bertram: IEEE Trans. Industrial Electronics 56(10), 2009",
    ],
};

/// The catalogue line of [`Backlash`].
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| Ok(Box::new(Backlash { dof: dof(ask)? })));

impl Law for Backlash {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Deflection]
    }
    // g ← g + g₀
    fn add_deflection<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Deflection<S>]) {
        by_dof[self.dof].half_gap += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&Backlash { dof: 1 }, &[1e-3]);
    }
}
