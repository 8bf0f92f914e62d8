//! The contract accepts a sound law and names the clause that a broken one breaks.

use sinew_effect::contract::check;
use sinew_effect::{
    Act, Actuation, At, Card, Energy, Family, Law, Parameter, Prior, Relaxation, Screening, Site,
};
use sinew_model::Scalar;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    ActsAtZero,
    Undeclared,
    Loaded,
    Feeds,
    ForgetsDerivatives,
    NegativeRate,
    NotFiniteAtRest,
    Blind,
}

/// Viscous friction with one thing wrong.
#[derive(Debug)]
struct Drag(Fault);

static CARD: Card = Card {
    name: "drag",
    title: "drag",
    law: "τ = −F θ̇",
    symptom: "drag",
    family: Family::Friction,
    energy: Energy::Dissipates,
    parameters: &[Parameter::positive("viscous", "F", "N·m·s/rad", Prior::Free)],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[],
    sources: &["the law of drag"],
};

impl Law for Drag {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(0)
    }
    fn acts(&self) -> &'static [Act] {
        if self.0 == Fault::NegativeRate { &[Act::MotorForce, Act::State] } else { &[Act::MotorForce] }
    }
    fn states(&self) -> usize {
        usize::from(self.0 == Fault::NegativeRate)
    }
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let v = at.thetad[0];
        tau[0] -= match self.0 {
            Fault::ActsAtZero => v * 1e-9,
            Fault::Loaded => p[0] * at.tau_j[0].abs() * v,
            Fault::Feeds => -(p[0] * v),
            Fault::ForgetsDerivatives => p[0] * S::constant(v.value()),
            Fault::NotFiniteAtRest => p[0] * (v * v).sqrt() * at.motor_sign(0),
            Fault::Blind => S::ZERO,
            _ => p[0] * v,
        };
    }
    fn add_actuation<S: Scalar>(&self, p: &[S], _at: &At<S>, by_dof: &mut [Actuation<S>]) {
        if self.0 == Fault::Undeclared {
            by_dof[0].gain += p[0];
        }
    }
    fn relaxation<S: Scalar>(&self, p: &[S], _at: &At<S>, z: &mut [Relaxation<S>]) {
        z[0] = Relaxation { target: S::ZERO, rate: -p[0] };
    }
}

fn complaint(fault: Fault) -> Option<String> {
    let result = std::panic::catch_unwind(|| check(&Drag(fault), &[0.7]));
    result.err().map(|e| e.downcast_ref::<String>().cloned().unwrap_or_default())
}

#[test]
fn the_contract_accepts_a_sound_law() {
    assert_eq!(complaint(Fault::None), None);
}

#[test]
fn the_contract_names_the_broken_clause() {
    for (fault, words) in [
        (Fault::ActsAtZero, "with all strengths zero it still changes MotorForce"),
        (Fault::Undeclared, "changes Actuation without declaring it"),
        (Fault::Loaded, "declare LoadedMotorForce"),
        (Fault::Feeds, "claims Dissipates"),
        (Fault::ForgetsDerivatives, "derivative by the state"),
        (Fault::NegativeRate, "a relaxation rate is negative"),
        (Fault::NotFiniteAtRest, "is not finite"),
        (Fault::Blind, "`viscous` leaves no fingerprint"),
    ] {
        let said = complaint(fault).unwrap_or_default();
        assert!(said.starts_with("drag: ") && said.contains(words), "{fault:?}: {said}");
    }
}
