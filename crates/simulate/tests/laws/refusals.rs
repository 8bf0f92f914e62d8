//! What is refused, and how it is said.

use sinew_data::Quantity;
use sinew_simulate::{Options, Start, Torques, simulate};

use crate::robots::{lesson, plant};

fn message(change: impl FnOnce(&mut Options)) -> String {
    let plant = plant(&lesson());
    let mut options = Options::new(&plant, 1.0, 0.1);
    change(&mut options);
    let result = simulate(&plant, &plant.parameters(), &mut Torques::constant(&[1e9]), &options);
    result.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_motor_without_inertia_is_named() {
    let mut robot = lesson();
    robot.joints[0].rotor_inertia = 0.0;
    let plant = plant(&robot);
    let options = Options::new(&plant, 1.0, 0.1);
    let error = simulate(&plant, &plant.parameters(), &mut Torques::constant(&[0.0]), &options).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("\"joint\"") && text.contains("help: state `rotor_inertia`"), "{text}");
}

#[test]
fn times_that_run_backwards_are_refused() {
    let text = message(|o| o.times = vec![0.0, 0.2, 0.1]);
    assert!(text.starts_with("simulation: times must increase") && text.contains("help:"), "{text}");
}

#[test]
fn a_signal_that_is_not_simulated_is_refused() {
    let text = message(|o| o.quantities = vec![Quantity::Temperature]);
    assert!(text.starts_with("simulation: temperature is not simulated"), "{text}");
}

#[test]
fn temperatures_are_as_many_as_samples() {
    let text = message(|o| o.temperature = vec![Some(vec![20.0, 21.0])]);
    assert!(text.starts_with("simulation: temperatures must be as many as times (got 2 for 11)"), "{text}");
}

#[test]
fn a_robot_that_runs_away_is_named_with_the_time() {
    let text = message(|o| {
        o.times = (0..100).map(f64::from).collect();
        o.start = Start::at(&[0.0]);
    });
    assert!(text.contains("joint \"joint\" runs away"), "{text}");
}
