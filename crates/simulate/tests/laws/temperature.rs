//! Joints that grow warm.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};
use sinew_plant::Plant;
use sinew_simulate::{Options, Start, Torques, simulate};

use crate::robots::plant;

// A weightless link of 0.5 kg·m² whose viscous friction falls from 0.5 N·m·s/rad at 20 °C by a hundredth a kelvin.
fn robot() -> Robot {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO));
    let at = |kind| EffectSpec::new(kind, Place::Joint("joint".into()));
    robot.effects.push(at("viscous_friction").with("viscous", 0.5));
    robot.effects.push(
        at("temperature_dependent_friction")
            .with("viscous_slope", -0.005)
            .with("coulomb_slope", 0.0)
            .with("reference_temperature", 20.0),
    );
    robot
}

fn coasting(temperature: impl Fn(f64) -> f64) -> Run {
    let plant = plant(&robot());
    let mut options = Options::new(&plant, 4.0, 1e-3);
    options.start = Start::at(&[0.0]);
    options.temperature = vec![Some(options.times.iter().map(|t| temperature(*t)).collect())];
    let mut push = Torques { time: vec![0.0, 1.0], tau: vec![vec![1.0, 0.0]] };
    simulate(&plant, &plant.parameters(), &mut push, &options).unwrap().run
}

fn values(run: &Run, quantity: Quantity) -> &[f64] {
    &run.signal(quantity, "joint").unwrap().values
}

// After the push:  q̇ = q̇₁ e^(−F t/J),  F = 0.5 − 0.005 (T − 20)
#[test]
fn a_warm_joint_coasts_as_its_warm_friction_lets_it() {
    for temperature in [20.0, 60.0, 100.0] {
        let run = coasting(|_| temperature);
        let speed = values(&run, Quantity::JointVelocity);
        let decay = (-(0.5 - 0.005 * (temperature - 20.0)) * 2.0 / 0.5f64).exp();
        assert!((speed[3000] / speed[1000] / decay - 1.0).abs() < 1e-6, "{temperature}");
    }
}

// ∫ F dt of a temperature that rises by 10 K/s from 20 °C:  0.5 t − 0.05 t²/2
#[test]
fn friction_falls_while_the_joint_grows_warm() {
    let run = coasting(|t| 20.0 + 10.0 * t);
    let speed = values(&run, Quantity::JointVelocity);
    let lost = |t: f64| 0.5 * t - 0.025 * t * t;
    let decay = (-(lost(3.0) - lost(1.0)) / 0.5f64).exp();
    // Temperatures are held from sample to sample: 5 mK too low on average.
    assert!((speed[3000] / speed[1000] / decay - 1.0).abs() < 2e-4, "{}", speed[3000] / speed[1000] / decay);
    let logged = values(&run, Quantity::Temperature);
    assert_eq!((logged[0], logged[4000]), (20.0, 60.0));
}

#[test]
fn the_temperatures_of_a_log_come_back() {
    let run = coasting(|t| 20.0 + t);
    let plant = plant(&robot());
    let options = Options::new(&plant, 1.0, 1.0).along(&run, &plant);
    assert_eq!(options.times, run.time);
    assert_eq!(options.temperature, vec![Some(values(&run, Quantity::Temperature).to_vec())]);
}

// A slope without the temperature that it counts from is no law.
#[test]
fn a_slope_without_its_reference_temperature_is_refused() {
    let mut robot = robot();
    robot.effects[1].settings.retain(|(key, _)| key != "reference_temperature");
    let refusal = Plant::new(&robot, &CATALOGUE).unwrap_err().to_string();
    assert!(refusal.contains("lacks reference_temperature"), "{refusal}");
}
