//! Energy: conserved without losses, never made from nothing with them.

use sinew_model::{EffectSpec, Place, Robot};
use sinew_simulate::{Method, Options, Start, Tolerance, Torques, simulate};

use crate::robots::{arm, lesson, lossless, plant};

// Near rounding: a hundred seconds of a mode at 57 rad/s are a thousand swings.
const TIGHT: Tolerance = Tolerance { relative: 1e-13, absolute: 1e-14 };

// Largest change of energy, relative to what there was above rest.
fn drift(robot: &Robot, start: Start, seconds: f64) -> f64 {
    let plant = plant(robot);
    let p = plant.parameters();
    let energy = |start: &Start, seconds: f64| {
        let mut options = Options::new(&plant, seconds, 0.02);
        (options.start, options.tolerance, options.method) = (start.clone(), TIGHT, Method::Explicit);
        options.quantities.clear();
        let rest = vec![0.0; start.q.len()];
        simulate(&plant, &p, &mut Torques::constant(&rest), &options).unwrap().energy
    };
    let hanging = energy(&Start::at(&vec![0.0; start.q.len()]), 0.02)[0];
    let along = energy(&start, seconds);
    along.iter().map(|h| (h - along[0]).abs()).fold(0.0, f64::max) / (along[0] - hanging).abs()
}

#[test]
fn energy_is_conserved_over_a_hundred_seconds_without_damping() {
    let drift = drift(&lossless(150.0), Start { q: vec![0.5], theta: vec![0.45] }, 100.0);
    assert!(drift < 1e-9, "{drift:e}");
}

#[test]
fn energy_of_a_two_link_arm_is_conserved() {
    let mut robot = arm();
    robot.effects.clear();
    robot.joints.iter_mut().for_each(|j| j.damping = 0.0);
    let drift = drift(&robot, Start { q: vec![-0.8, 0.6], theta: vec![-0.81, 0.62] }, 10.0);
    assert!(drift < 1e-9, "{drift:e}");
}

// A gear whose ratio wavers turns torque over as it turns position over: τ on the motor = τ_J ∂δ/∂θ.
#[test]
fn a_gear_with_a_transmission_error_makes_no_energy() {
    let mut robot = lossless(150.0);
    let error = EffectSpec::new("transmission_error", Place::Joint("joint".into()));
    robot.effects.push(error.with("sine", 4e-3).with("cosine", -3e-3).with("per_turn", 9.0));
    let drift = drift(&robot, Start { q: vec![0.5], theta: vec![0.45] }, 10.0);
    assert!(drift < 1e-9, "{drift:e}");
}

// ∫ τ_m θ̇ dt ≥ H(t) − H(0), between any two samples
#[test]
fn a_damped_joint_is_passive() {
    let plant = plant(&lesson());
    let times: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
    let tau = times.iter().map(|t| 3.0 * (7.0 * t).sin() + (53.0 * t).sin()).collect();
    let mut options = Options::new(&plant, 4.0, 1e-3);
    options.start = Start { q: vec![0.4], theta: vec![0.5] };
    let mut drive = Torques { time: times, tau: vec![tau] };
    let audit = simulate(&plant, &plant.parameters(), &mut drive, &options).unwrap().audit;
    assert!(audit.dissipated > 0.1 && audit.work_in > 0.1, "{audit:?}");
    assert!(audit.worst_defect < 1e-8, "{audit:?}");
    assert!((audit.work_in - audit.stored_change - audit.dissipated).abs() < 1e-12);
}

#[test]
fn an_effect_that_supplies_energy_shows_as_a_defect() {
    let mut robot = lossless(150.0);
    let negative = EffectSpec::new("viscous_friction", Place::Joint("joint".into())).with("viscous", 0.0);
    robot.effects.push(negative);
    let plant = plant(&robot);
    let mut p = plant.parameters();
    *p.last_mut().unwrap() = -0.05;
    let mut options = Options::new(&plant, 2.0, 1e-2);
    options.start = Start { q: vec![0.4], theta: vec![0.4] };
    let audit = simulate(&plant, &p, &mut Torques::constant(&[0.0]), &options).unwrap().audit;
    assert!(audit.worst_defect > 1e-2 && audit.dissipated < 0.0, "{audit:?}");
}
