//! Causes that no effect of the catalogue describes: the diagnosis may call them unexplained, not by a name.

use std::sync::LazyLock;

use sinew_data::{Quantity, Run};
use sinew_effect::{
    Act, Actuation, Ask, At, Card, Catalogue, Energy, Entry, Family, Law, Parameter, PlaceKind, Prior,
    Relaxation, Screening, Site,
};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, Place, Pose, Robot, Scalar};

use crate::Arm;

/// One foreign cause.
pub struct Foreign {
    /// What it is called in tables.
    pub name: &'static str,
    /// How it gets into a case.
    pub how: Way,
}

/// Changes what a run logged at a joint.
pub type Edit = fn(&mut Run, &str);

/// How a foreign cause gets into a case.
pub enum Way {
    /// As a law that the truth obeys.
    Law(EffectSpec),
    /// As a change of the truth.
    Changed(fn(&mut Robot, usize)),
    /// As a change of what was logged.
    Logged(Edit),
}

/// The fourteen foreign causes at degree of freedom `dof`, `size` times as strong as plain ones.
pub fn foreign_causes(arm: &Arm, dof: usize, size: f64) -> Vec<Foreign> {
    let place = Place::Joint(arm.robot.model.dof_name(dof).to_owned());
    let strength = size * arm.torque[dof];
    let mut list: Vec<Foreign> = KINDS
        .iter()
        .map(|kind| {
            let spec = EffectSpec::new(kind.card.name, place.clone()).with("strength", strength);
            Foreign { name: kind.card.name, how: Way::Law(spec) }
        })
        .collect();
    list.push(Foreign { name: "misaligned_axis", how: Way::Changed(misalign) });
    list.push(Foreign { name: "notch_filter", how: Way::Logged(notch) });
    list.push(Foreign { name: "two_discs", how: Way::Logged(two_discs) });
    list
}

/// Somebody pushes link `dof` with a torque: where only some runs are measured with it, once.
pub fn push(arm: &Arm, dof: usize, torque: f64) -> EffectSpec {
    let place = Place::Joint(arm.robot.model.dof_name(dof).to_owned());
    EffectSpec::new(PUSH.card.name, place).with("strength", torque)
}

/// From and to when it acts, s.
pub const PUSHED: [f64; 2] = [4.0, 4.8];

/// The catalogue with the laws of this page, for truths only.
pub fn foreign_catalogue() -> &'static Catalogue {
    static EXTENDED: LazyLock<Catalogue> = LazyLock::new(|| {
        let own = KINDS.iter().chain([&PUSH]).map(|kind| Entry {
            card: &kind.card,
            place: PlaceKind::Joint,
            words: &[],
            hinge: None,
            build,
        });
        let entries: Vec<Entry> = CATALOGUE.entries.iter().copied().chain(own).collect();
        Catalogue { entries: entries.leak(), ..CATALOGUE }
    });
    &EXTENDED
}

fn build(ask: &Ask) -> Result<Box<dyn sinew_effect::Effect>, String> {
    let Site::Dof(dof) = ask.site else { return Err("acts at a joint".to_owned()) };
    let mut kinds = KINDS.iter().chain([&PUSH]);
    let kind = kinds.find(|k| k.card.name == ask.spec.kind).ok_or("is no foreign cause")?;
    Ok(Box::new(ForeignLaw { kind, dof }))
}

/// A law with its name: drag and torque are those of a joint with 1 N·m of Coulomb friction.
#[derive(Debug)]
struct Kind {
    card: Card,
    what: What,
    acts: &'static [Act],
    states: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    Bump,
    Hose,
    Hump,
    Dwell,
    Coloured,
    Sagging,
    Swinging,
    TwoStiffnesses,
    EddyBrake,
    Sticking,
    WarmingUp,
    Push,
}

const STRENGTH: &[Parameter] = &[Parameter::signed("strength", "A", "N·m", Prior::Free)];

const fn kind(
    name: &'static str,
    law: &'static str,
    what: What,
    acts: &'static [Act],
    states: usize,
) -> Kind {
    let card = Card {
        name,
        title: "",
        law,
        symptom: "",
        family: Family::Environment,
        energy: Energy::Supplies,
        parameters: STRENGTH,
        screening: Screening::Linear,
        requires: &[],
        rivals: &[],
        sources: &[],
    };
    Kind { card, what, acts, states }
}

static KINDS: [Kind; 11] = [
    kind("friction_bump", "−A s(θ̇) e^(−((θ−c)/w)²)", What::Bump, &[Act::MotorForce], 0),
    kind("hose", "−A tanh(4(q − c))", What::Hose, &[Act::LinkForce], 0),
    kind("drag_hump", "−A s(θ̇) e^(−((|θ̇|−v)/w)²)", What::Hump, &[Act::MotorForce], 0),
    kind("dwell_friction", "−A z s(θ̇) e^(−(θ̇/v)²)", What::Dwell, &[Act::MotorForce, Act::State], 1),
    kind("coloured_torque", "A n(t)", What::Coloured, &[Act::LinkForce, Act::State], 1),
    kind("sagging_supply", "gain 1 − a z, ż ∝ θ̇²", What::Sagging, &[Act::Actuation, Act::State], 1),
    kind("swinging_load", "I(ω²(y − q) + 2ζω(ẏ − q̇))", What::Swinging, &[Act::LinkForce, Act::State], 2),
    kind("two_stiffnesses", "−K′ max(δ, 0)", What::TwoStiffnesses, &[Act::SpringTorque], 0),
    kind("eddy_brake", "−A θ̇/v/(1 + (θ̇/v)²)", What::EddyBrake, &[Act::MotorForce], 0),
    kind("sticking", "−A s(θ̇) at random times", What::Sticking, &[Act::MotorForce, Act::State], 1),
    kind("warming_up", "−A s(θ̇) e^(−t/3 s)", What::WarmingUp, &[Act::MotorForce, Act::State], 1),
];

static PUSH: Kind = kind("push", "A from 4 to 4.8 s", What::Push, &[Act::LinkForce, Act::State], 1);

#[derive(Debug)]
struct ForeignLaw {
    kind: &'static Kind,
    dof: usize,
}

// e^(−((x − c)/w)²)
fn bell<S: Scalar>(x: S, centre: f64, width: f64) -> S {
    let u = (x - centre) / S::constant(width);
    (-(u * u)).exp()
}

// ż = f as a relaxation: rate one towards z + f.
fn rate<S: Scalar>(z: S, f: S) -> Relaxation<S> {
    Relaxation { target: z + f, rate: S::ONE }
}

// Swinging load: 1.6 Hz, 5 % damping.
const SWING: f64 = 10.0;
const SWING_DAMPING: f64 = 0.05;

impl Law for ForeignLaw {
    fn card(&self) -> &'static Card {
        &self.kind.card
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        self.kind.acts
    }
    fn states(&self) -> usize {
        self.kind.states
    }
    fn add_motor_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let (theta, v, s) = (at.theta[self.dof], at.thetad[self.dof], at.motor_sign(self.dof));
        tau[self.dof] -= p[0]
            * match self.kind.what {
                What::Bump => s * bell(theta, 0.15, 0.06),
                What::Hump => s * bell(v.abs(), 0.7, 0.2),
                What::Dwell => s * at.z[0] * bell(v, 0.0, 0.05),
                What::EddyBrake => {
                    let u = v / S::constant(0.5);
                    u / (u * u + 1.0)
                }
                // Three spells in every ten seconds, at times that do not repeat.
                What::Sticking => {
                    let t = at.z[0];
                    let spells = [(2.13, 0.2), (4.71, 0.12), (7.94, 0.3)];
                    spells.iter().fold(S::ZERO, |sum, &(c, w)| sum + bell(t, c, w)) * s
                }
                _ => s * (at.z[0] / S::constant(-3.0)).exp(),
            };
    }
    fn add_link_force<S: Scalar>(&self, p: &[S], at: &At<S>, tau: &mut [S]) {
        let (q, qd) = (at.q[self.dof], at.qd[self.dof]);
        tau[self.dof] += p[0]
            * match self.kind.what {
                What::Hose => -((q - 0.2) * 4.0).tanh(),
                // I = 0.01 s² A: a load of a hundredth of the Coulomb torque at 1 rad/s².
                What::Swinging => {
                    ((at.z[0] - q) * (SWING * SWING) + (at.z[1] - qd) * (2.0 * SWING_DAMPING * SWING)) * 0.01
                }
                // Within 20 ms up and down.
                What::Push => {
                    let [on, off] = PUSHED.map(|t| ((at.z[0] - t) / S::constant(0.02)).tanh());
                    (on - off) * 0.5
                }
                // Tones without a common period, 0.2 to 6 Hz.
                _ => {
                    let tones = [(1.3, 0.0), (3.1, 1.0), (7.7, 2.0), (11.9, 0.5), (19.3, 4.0), (37.1, 3.0)];
                    let t = at.z[0];
                    tones.iter().fold(S::ZERO, |sum, &(w, phase)| sum + (t * w + phase).sin_cos().0) * 0.2
                }
            };
    }
    fn add_spring_torque<S: Scalar>(&self, p: &[S], at: &At<S>, tau_j: &mut [S]) {
        // K′ such that a deflection of a thousandth gives A
        tau_j[self.dof] += p[0] * at.deflection[self.dof].max(S::ZERO) * 1000.0;
    }
    fn add_actuation<S: Scalar>(&self, p: &[S], at: &At<S>, by_dof: &mut [Actuation<S>]) {
        // A tenth of the torque at 1 rad/s where A is 6 N·m.
        by_dof[self.dof].gain *= -(p[0] * at.z[0] / S::constant(60.0)) + 1.0;
    }
    fn relaxation<S: Scalar>(&self, _p: &[S], at: &At<S>, z: &mut [Relaxation<S>]) {
        let v = at.thetad[self.dof];
        match self.kind.what {
            What::Dwell => {
                // Grows within 0.3 s of rest, is gone after 0.01 rad.
                let (rest, gone) = (1.0 / 0.3, v.abs() / S::constant(0.01));
                z[0] = Relaxation { target: (gone / S::constant(rest) + 1.0).recip(), rate: gone + rest };
            }
            What::Sagging => z[0] = Relaxation { target: v * v, rate: S::constant(2.0) },
            What::Swinging => {
                let (q, qd) = (at.q[self.dof], at.qd[self.dof]);
                let pull = (q - at.z[0]) * (SWING * SWING) + (qd - at.z[1]) * (2.0 * SWING_DAMPING * SWING);
                z[0] = rate(at.z[0], at.z[1]);
                z[1] = rate(at.z[1], pull);
            }
            // ż = 1: time.
            _ => z[0] = rate(at.z[0], S::ONE),
        }
    }
}

// One degree about the x axis of the joint's own frame.
fn misalign(robot: &mut Robot, dof: usize) {
    let joint = robot.model.joint_of_dof(dof);
    let turn = Pose::from_xyz_rpy([0.0; 3], [1f64.to_radians(), 0.0, 0.0]);
    let joint = &mut robot.model.joints[joint.0];
    joint.placement = joint.placement * turn;
}

// The drive's torque loop has a notch at 15 Hz, half as wide, 90 % deep; logged is what goes into it.
fn notch(run: &mut Run, joint: &str) {
    let omega = std::f64::consts::TAU * 15.0;
    let k = omega / (0.5 * omega * run.period()).tan();
    // Bilinear transform of (s² + ω s/2 + ω²)/(s² + ω s/20 + ω²), the inverse of the notch.
    let (k2, w2) = (k * k, omega * omega);
    let side = |width: f64| [k2 + width * k * omega + w2, 2.0 * (w2 - k2), k2 - width * k * omega + w2];
    let (b, a) = (side(0.5), side(0.05));
    filter(run, joint, b, a);
}

fn filter(run: &mut Run, joint: &str, b: [f64; 3], a: [f64; 3]) {
    let Some(torque) = signal(run, Quantity::MotorTorque, joint) else { return };
    // At rest before the first sample.
    let (mut x, mut y) = ([torque[0]; 2], [torque[0]; 2]);
    for value in torque.iter_mut() {
        let out = (b[0] * *value + b[1] * x[0] + b[2] * x[1] - a[1] * y[0] - a[2] * y[1]) / a[0];
        (x, y) = ([*value, x[0]], [out, y[0]]);
        *value = out;
    }
}

// Two eccentric discs of 17 and 18.3 periods a turn: their errors beat.
fn two_discs(run: &mut Run, joint: &str) {
    if let Some(position) = signal(run, Quantity::MotorPosition, joint) {
        for value in position {
            *value += 1e-4 * ((17.0 * *value).sin() + (18.3 * *value + 1.0).sin());
        }
    }
}

fn signal<'a>(run: &'a mut Run, quantity: Quantity, joint: &str) -> Option<&'a mut Vec<f64>> {
    let found = run.signals.iter_mut().find(|s| s.quantity == quantity && s.place == joint);
    found.map(|s| &mut s.values)
}
