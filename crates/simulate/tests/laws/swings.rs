//! What swings beside the joints: a part of a link and the base, against their closed forms.

use core::f64::consts::TAU;

use sinew_data::Quantity;
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};
use sinew_simulate::{Options, Simulated, Torques, simulate};

use crate::robots::plant;

const INERTIA: f64 = 0.5;
const FREQUENCY: f64 = 9.0;

// One rigid link without gravity under 1 N·m, with one more effect.
fn pushed(effect: EffectSpec) -> Simulated {
    let model = samples::hanging_link(INERTIA, 2.0, 0.4).with_gravity(Vector3::new(0.0, 0.0, 0.0));
    let mut robot = Robot::rigid(model);
    robot.effects.push(effect.with("frequency", FREQUENCY).with("damping_ratio", 1e-4));
    let plant = plant(&robot);
    let options = Options::new(&plant, 0.5, 1e-3);
    simulate(&plant, &plant.parameters(), &mut Torques::constant(&[1.0]), &options).unwrap()
}

// Joint velocities against a law; the little damping that a swing must have takes a share of 4e-3 of it in the time.
fn follows(run: &Simulated, law: impl Fn(f64) -> f64) {
    let velocity = &run.run.signal(Quantity::JointVelocity, "joint").unwrap().values;
    for (t, v) in run.run.time.iter().zip(velocity) {
        assert!((v - law(*t)).abs() < 5e-3 * law(0.5).abs(), "{t}: {v} {}", law(*t));
    }
    assert!(run.audit.worst_defect < 1e-6, "{:?}", run.audit);
}

// I q̇ + s I η̇ = τ t,  η̈ + Ω² η = −τ/((1 − s) I),  Ω² = ω²/(1 − s):  q̇ = τ t/I + s τ Ω/(I ω²) sin Ωt
#[test]
fn a_part_of_a_link_swings_at_its_own_frequency() {
    let share: f64 = 0.25;
    let omega = TAU * FREQUENCY;
    let fast = omega / (1.0 - share).sqrt();
    let effect = EffectSpec::new("link_bending_mode", Place::Joint("joint".into()));
    let run = pushed(effect.with("inertia_share", share));
    follows(&run, |t| t / INERTIA + share * fast / (INERTIA * omega * omega) * (fast * t).sin());
}

// I_b φ̈ = −τ − K φ,  J (q̈ + φ̈) = τ:  q̇ = τ t/J + τ ω/K sin ωt
#[test]
fn a_base_gives_way_to_what_its_joint_pushes_with() {
    let compliance = 2e-4;
    let omega = TAU * FREQUENCY;
    let effect = EffectSpec::new("base_compliance", Place::Robot).said("axis", "y");
    let run = pushed(effect.with("compliance", compliance));
    follows(&run, |t| t / INERTIA + compliance * omega * (omega * t).sin());
}
