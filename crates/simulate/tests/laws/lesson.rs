//! The lesson's one-joint example, through the whole path from robot to run.

use crate::robots::{lesson, plant, value_at};
use sinew_data::Quantity;
use sinew_simulate::{Options, Torques, simulate};

// Values of an 8th-order Runge–Kutta method at tolerance 1e-12, printed to eight digits.
const LESSON: [(f64, f64, f64); 4] = [
    (0.5, 0.16596843, 0.17314864),
    (1.0, 0.23097613, 0.23812532),
    (1.5, 0.03023677, 0.03645862),
    (2.0, 0.08695858, 0.09340352),
];

#[test]
fn the_lessons_table_is_reproduced() {
    let plant = plant(&lesson());
    let simulated = simulate(
        &plant,
        &plant.parameters(),
        &mut Torques::constant(&[1.0]),
        &Options::new(&plant, 2.0, 1e-3),
    )
    .unwrap();
    for (t, q, theta) in LESSON {
        let at = |quantity| value_at(&simulated.run, quantity, t);
        assert!((at(Quantity::JointPosition) - q).abs() < 1e-7, "q({t}) = {}", at(Quantity::JointPosition));
        assert!((at(Quantity::MotorPosition) - theta).abs() < 1e-7, "θ({t})");
    }
}
