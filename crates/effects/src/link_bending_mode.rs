//! Link bending mode: a part of a link's inertia that swings on a spring.

use sinew_effect::{
    Act, Ask, At, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening,
    Site,
};
use sinew_model::{Carried, Hinge, JointId, JointKind, Link, LinkId, Scalar, Vector3};

use crate::entry::{at_joint, dof, hinge, rival};

/// A share of the body that a joint moves, which swings on a spring about the joint's axis.
///
/// ```text
/// η̈ + 2ζω η̇ + ω² η = −q̈ …,   I_m = share · I,   K_m = I_m ω²,   D_m = 2ζ I_m ω,   ω = 2πf
/// ```
///
/// η is the angle between the part and the rest of the body; the part takes its share of mass, first and second moment
/// with it and is a body of its own in the equations of motion, gravity and all other joints included. I is the body's
/// moment of inertia about the joint's axis.
#[derive(Debug, Clone, Copy)]
pub struct LinkBendingMode {
    /// Degree of freedom of the joint.
    pub dof: usize,
    /// Degree of freedom of the swinging part, η.
    pub swing: usize,
    /// The body that the joint moves.
    pub body: JointId,
    /// The swinging part of it.
    pub part: JointId,
    /// The joint's axis in the body.
    pub axis: Vector3<f64>,
}

/// The card of [`LinkBendingMode`].
static CARD: Card = Card {
    name: "link_bending_mode",
    title: "A share of the body that a joint moves, which swings on a spring about the joint's axis",
    law: "η̈ + 2ζω η̇ + ω² η = −q̈,  I_m = share · I,  ω = 2πf",
    symptom: "a resonance with an antiresonance beside it, of a part of the inertia only; residual in proportion to the acceleration near it",
    family: Family::Transmission,
    energy: Energy::StoresAndDissipates,
    parameters: &[
        Parameter {
            range: (0.0, 0.95),
            ..Parameter::positive("inertia_share", "I_m/I", "–", Prior::Share(0.3))
        },
        Parameter::shape("frequency", "f", "Hz", &[12.0], (0.5, 200.0), Prior::Share(0.1)),
        Parameter::shape("damping_ratio", "ζ", "–", &[0.03], (1e-4, 1.0), Prior::Factor(1.0)),
    ],
    screening: Screening::Swing {
        hertz: &[5.0, 6.3, 7.9, 9.9, 12.4, 15.5, 19.4, 24.3, 30.5],
        shares: &[0.2],
    },
    requires: &[Requirement::Torque, Requirement::Turning],
    rivals: &[
        rival(
            "joint_elasticity",
            "a chirp through the resonance in two poses, and an accelerometer at the tip",
        ),
        rival("base_compliance", "hold this joint and excite another one: a base swings then too"),
        rival("stiffness_hardening", "the same chirp at two amplitudes: a mode keeps its frequency"),
    ],
    sources: &[
        "De Luca, Siciliano: IEEE Trans. Systems, Man, and Cybernetics 21(4), 1991",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`LinkBendingMode`].
pub(crate) const ENTRY: Entry = Entry {
    hinge: Some(|ask| {
        let (body, axis) = turning(ask)?;
        let moved = |l: &Link| l.body == Some(body);
        let link = ask.model.links.iter().position(moved).ok_or("its joint moves no link")?;
        Ok(Hinge { link: LinkId(link), carries: Carried::PartOf(body), axis })
    }),
    ..at_joint(&CARD, |ask| {
        let ((body, axis), swing) = (turning(ask)?, hinge(ask)?);
        let part = ask.model.joint_of_dof(swing);
        Ok(Box::new(LinkBendingMode { dof: dof(ask)?, swing, body, part, axis }))
    })
};

// The body that the joint moves, and the axis that it turns about.
fn turning(ask: &Ask) -> Result<(JointId, Vector3<f64>), String> {
    let body = ask.model.joint_of_dof(dof(ask)?);
    match ask.model.joints[body.0].kind {
        JointKind::Revolute { axis } => Ok((body, axis)),
        _ => Err("acts at a joint that turns".to_owned()),
    }
}

impl Law for LinkBendingMode {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients, Act::LinkForce]
    }
    // The part takes its share of the body with it.
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let part = c.inertia[self.body.0].scaled(p[0]);
        c.inertia[self.body.0] += part.scaled(-S::ONE);
        c.inertia[self.part.0] += part;
    }
    // τ_η = −K_m η − D_m η̇
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let (stiffness, damping) = self.spring(p, at.coefficients);
        tau[self.swing] -= stiffness * at.q[self.swing] + damping * at.qd[self.swing];
    }
    // U = ½ K_m η²
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        let (stiffness, _) = self.spring(p, at.coefficients);
        stiffness * at.q[self.swing] * at.q[self.swing] * 0.5
    }
}

impl LinkBendingMode {
    // K_m = I_m ω²,  D_m = 2ζ I_m ω;  the body as it was before it was parted has I = aᵀ I a of both parts together
    #[inline(always)]
    fn spring<S: Scalar>(&self, p: &[S], c: &Coefficients<S>) -> (S, S) {
        let axis = Vector3::constant(self.axis);
        let about = |body: JointId| axis.dot(c.inertia[body.0].second_moment * axis);
        let inertia = p[0] * (about(self.body) + about(self.part));
        let omega = p[1] * core::f64::consts::TAU;
        (inertia * omega * omega, inertia * omega * p[2] * 2.0)
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        let axis = Vector3::new(0.0, 1.0, 0.0);
        check(
            &LinkBendingMode { dof: 0, swing: 1, body: JointId(0), part: JointId(1), axis },
            &[0.2, 0.8, 0.03],
        );
    }
}
