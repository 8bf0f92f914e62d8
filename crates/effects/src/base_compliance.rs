//! Base compliance: a robot whose base stands on a spring.

use sinew_effect::{
    Act, Ask, At, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening,
    Site,
};
use sinew_model::{Carried, Hinge, JointId, LinkId, Scalar, Setting, Symmetric3, Vector3};

use crate::entry::{at_robot, hinge, rival};

/// A base that turns on a spring about an axis of the world through its origin, and carries the whole robot.
///
/// ```text
/// τ_b = −K_b φ − D_b φ̇,   K_b = 1/c,   I_b = K_b/ω²,   D_b = 2ζ K_b/ω,   ω = 2πf
/// ```
///
/// f is the frequency at which the base swings without the robot: it says how much inertia I_b of its own it has.
/// `axis` is "x", "y" or "z" of the world; "x" where it says nothing. Several axes are several effects.
#[derive(Debug, Clone, Copy)]
pub struct BaseCompliance {
    /// Degree of freedom of the base, φ.
    pub swing: usize,
    /// The base.
    pub base: JointId,
}

/// The card of [`BaseCompliance`].
static CARD: Card = Card {
    name: "base_compliance",
    title: "A base that turns on a spring about an axis of the world, and carries the whole robot",
    law: "τ_b = −K_b φ − D_b φ̇,  K_b = 1/c,  I_b = K_b/ω²,  D_b = 2ζ K_b/ω,  ω = 2πf",
    symptom: "the same resonance in the torques of several joints, also in one that is held still",
    family: Family::Inertial,
    energy: Energy::StoresAndDissipates,
    parameters: &[
        Parameter::positive("compliance", "c", "rad/(N·m)", Prior::Share(0.3)),
        Parameter::shape("frequency", "f", "Hz", &[12.0], (0.5, 200.0), Prior::Share(0.1)),
        Parameter::shape("damping_ratio", "ζ", "–", &[0.03], (1e-4, 1.0), Prior::Factor(1.0)),
    ],
    screening: Screening::Swing { hertz: &[3.0, 4.5, 6.6, 9.7, 14.2, 20.8, 30.0], shares: &[0.2, 1.0] },
    requires: &[Requirement::Joints(2)],
    rivals: &[
        rival(
            "joint_elasticity",
            "hold one joint and excite another: a spring in a joint shows in that joint only",
        ),
        rival(
            "link_bending_mode",
            "hold one joint and excite another: a bending link shows in that joint only",
        ),
        rival(
            "base_tilt",
            "hold the arm stretched out to either side: a soft base leans with it, a tilted one does not",
        ),
    ],
    sources: &["Nenchev, Yoshida, Vichitkulsawat, Uchiyama: IEEE Trans. Robotics and Automation 15(6), 1999"],
};

/// The catalogue line of [`BaseCompliance`].
pub(crate) const ENTRY: Entry = Entry {
    words: &["axis"],
    hinge: Some(|ask| Ok(Hinge { link: LinkId(0), carries: Carried::Robot, axis: axis(ask)? })),
    ..at_robot(&CARD, |ask| {
        axis(ask)?;
        let swing = hinge(ask)?;
        Ok(Box::new(BaseCompliance { swing, base: ask.model.joint_of_dof(swing) }))
    })
};

fn axis(ask: &Ask) -> Result<Vector3<f64>, String> {
    match ask.spec.get("axis") {
        None => Ok(Vector3::new(1.0, 0.0, 0.0)),
        Some(Setting::Word(word)) if word == "x" => Ok(Vector3::new(1.0, 0.0, 0.0)),
        Some(Setting::Word(word)) if word == "y" => Ok(Vector3::new(0.0, 1.0, 0.0)),
        Some(Setting::Word(word)) if word == "z" => Ok(Vector3::new(0.0, 0.0, 1.0)),
        Some(other) => Err(format!("`axis` must be \"x\", \"y\" or \"z\" (got {other:?})")),
    }
}

impl Law for BaseCompliance {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Robot
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients, Act::LinkForce]
    }
    // I_b = 1/(c ω²); a base without compliance stays as immovable as it is
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let omega = p[1] * core::f64::consts::TAU;
        let own = stiffness(p[0]) / (omega * omega);
        let of = |before: S| S::select(S::ZERO.lt(p[0]), own, before);
        let before = c.inertia[self.base.0].second_moment;
        let second_moment = Symmetric3 { xx: of(before.xx), yy: of(before.yy), zz: of(before.zz), ..before };
        c.inertia[self.base.0].second_moment = second_moment;
    }
    // τ_φ = −K_b φ − D_b φ̇
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let omega = p[1] * core::f64::consts::TAU;
        let stiffness = stiffness(p[0]);
        let damping = stiffness * p[2] * 2.0 / omega;
        tau[self.swing] -= stiffness * at.q[self.swing] + damping * at.qd[self.swing];
    }
    // U = ½ K_b φ²
    fn energy<S: Scalar>(&self, p: &[S], at: &At<S>) -> S {
        stiffness(p[0]) * at.q[self.swing] * at.q[self.swing] * 0.5
    }
}

// 1/c; none of a base that does not give way.
#[inline(always)]
fn stiffness<S: Scalar>(compliance: S) -> S {
    let gives = S::ZERO.lt(compliance);
    S::select(gives, S::select(gives, compliance, S::ONE).recip(), S::ZERO)
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&BaseCompliance { swing: 1, base: JointId(1) }, &[0.3, 0.8, 0.03]);
    }
}
