//! Joint elasticity: a spring and a damper between motor and link.

use sinew_effect::{
    Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, PlaceKind, Prior, Requirement, Rival,
    Screening, Site,
};
use sinew_model::Scalar;

/// A gear that gives way: a spring and a damper between motor and link.
///
/// ```text
/// τ_J = K (θ − q) + D (θ̇ − q̇)
/// ```
///
/// Fitted as the compliance 1/K, which is zero for a rigid joint; files show K.
#[derive(Debug, Clone, Copy)]
pub struct JointElasticity {
    /// Degree of freedom it acts at.
    pub dof: usize,
}

/// The card of [`JointElasticity`].
static CARD: Card = Card {
    name: "joint_elasticity",
    title: "A gear that gives way: a spring and a damper between motor and link",
    law: "τ_J = K (θ − q) + D (θ̇ − q̇)",
    symptom: "θ − q in proportion to the torque; an antiresonance in the motor, residual in proportion to the link's acceleration above it",
    family: Family::Transmission,
    energy: Energy::StoresAndDissipates,
    parameters: &[
        Parameter::positive("stiffness", "1/K", "rad/(N·m)", Prior::Share(0.08)).reciprocal(),
        Parameter::shape("damping", "D", "N·m·s/rad", &[1.0], (0.0, f64::INFINITY), Prior::Share(0.3)),
    ],
    screening: Screening::Resonance {
        hertz: &[4.0, 5.0, 6.3, 7.9, 9.9, 12.4, 15.5, 19.4, 24.3, 30.5, 38.2, 47.9, 60.0],
    },
    requires: &[Requirement::Rigid],
    rivals: &[
        Rival {
            name: "actuator_lag",
            structural: false,
            experiment: "a chirp through the antiresonance in two poses",
            sensors: &[],
        },
        Rival {
            name: "time_skew",
            structural: false,
            experiment: "a chirp through the antiresonance in two poses",
            sensors: &[],
        },
    ],
    sources: &[
        "Spong: ASME J. Dynamic Systems, Measurement, and Control 109(4), 1987",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`JointElasticity`].
pub const JOINT_ELASTICITY: Entry = Entry {
    card: &CARD,
    place: PlaceKind::Joint,
    words: &[],
    hinge: None,
    build: |ask| match ask.site {
        Site::Dof(dof) => Ok(Box::new(JointElasticity { dof })),
        _ => Err("acts at a joint".to_owned()),
    },
};

impl Law for JointElasticity {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    fn elastic_dof(&self) -> Option<usize> {
        Some(self.dof)
    }
    // 1/K ← 1/K + 1/K₀,   D ← D + D₀; a rigid joint has no damper
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        c.compliance[self.dof] += p[0];
        c.damping[self.dof] += S::select(S::ZERO.lt(p[0]), p[1], S::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&JointElasticity { dof: 1 }, &[1.0 / 150.0, 0.5]);
    }
}
