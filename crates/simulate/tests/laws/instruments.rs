//! Drives and sensors: gain, lag and delay against their closed forms.

use sinew_data::Quantity;
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};
use sinew_plant::Dynamics;
use sinew_simulate::{Options, Simulated, Torques, simulate};

use crate::robots::{lesson, plant};

const INERTIA: f64 = 0.5;

// One rigid link without gravity, with one more effect.
fn free(effect: EffectSpec) -> Robot {
    let model = samples::hanging_link(INERTIA, 2.0, 0.4).with_gravity(Vector3::new(0.0, 0.0, 0.0));
    let mut robot = Robot::rigid(model);
    robot.effects.push(effect);
    robot
}

fn effect(kind: &str, key: &str, value: f64) -> EffectSpec {
    EffectSpec::new(kind, Place::Joint("joint".into())).with(key, value)
}

fn run_at(robot: &Robot, times: Vec<f64>, mut drive: Torques) -> Simulated {
    let plant = plant(robot);
    let mut options = Options::new(&plant, 1.0, 1.0);
    options.times = times;
    simulate(&plant, &plant.parameters(), &mut drive, &options).unwrap()
}

fn every_millisecond(shift: f64) -> Vec<f64> {
    (0..100).map(|k| f64::from(k) * 1e-3 + shift).collect()
}

// Torques that jump at every sample.
fn jumping(times: Vec<f64>) -> Torques {
    let tau = times.iter().enumerate().map(|(k, _)| if k % 3 == 0 { 1.0 } else { -0.7 }).collect();
    Torques { time: times, tau: vec![tau] }
}

fn values(simulated: &Simulated, quantity: Quantity) -> &[f64] {
    &simulated.run.signal(quantity, "joint").unwrap().values
}

// All samples of the union of two rows of times.
fn merged(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = [a, b].concat();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

#[test]
fn a_delayed_drive_switches_exactly_its_dead_time_late() {
    // Within a sample, not by whole samples, and by whole samples up to rounding.
    for delay in [0.4e-3, 2.4e-3, 2e-3] {
        let mut robot = lesson();
        robot.effects.push(effect("actuator_delay", "time", delay));
        let times = every_millisecond(0.0);
        let late = run_at(&robot, times.clone(), jumping(times.clone()));
        // The same by an ideal drive whose table is late, with samples at its switches.
        let shifted = every_millisecond(delay);
        let ideal = run_at(&lesson(), merged(&times, &shifted), jumping(shifted));
        for (k, t) in times.iter().enumerate() {
            let other = ideal.run.time.iter().position(|s| s == t).unwrap();
            for quantity in [Quantity::JointPosition, Quantity::MotorVelocity] {
                let (a, b) = (values(&late, quantity)[k], values(&ideal, quantity)[other]);
                assert!((a - b).abs() < 1e-9, "{delay}, {quantity} at {t}: {a} {b}");
            }
        }
        assert_eq!(values(&late, Quantity::MotorTorque)[1], -0.7);
    }
}

#[test]
fn a_drive_ahead_of_its_log_acts_at_once_and_is_logged_late() {
    let mut robot = lesson();
    robot.effects.push(effect("actuator_delay", "time", -1e-3));
    let times = every_millisecond(0.0);
    let ahead = run_at(&robot, times.clone(), jumping(times.clone()));
    let ideal = run_at(&lesson(), times.clone(), jumping(times));
    assert_eq!(values(&ahead, Quantity::JointPosition), values(&ideal, Quantity::JointPosition));
    let (late, prompt) = (values(&ahead, Quantity::MotorTorque), values(&ideal, Quantity::MotorTorque));
    assert_eq!(late[1..], prompt[..99]);
}

#[test]
fn a_lagging_drive_answers_a_step_with_an_exponential() {
    let lag = 5e-3;
    let robot = free(effect("actuator_lag", "time", lag));
    let times = every_millisecond(0.0);
    let step = Torques { time: vec![0.0, 0.01], tau: vec![vec![0.0, 1.0]] };
    let run = run_at(&robot, times.clone(), step);
    for (t, v) in times.iter().zip(values(&run, Quantity::JointVelocity)) {
        let s = (t - 0.01).max(0.0);
        // J q̇ = t − T(1 − e^{−t/T})
        let exact = (s - lag * (1.0 - (-s / lag).exp())) / INERTIA;
        assert!((v - exact).abs() < 1e-9, "{t}: {v} {exact}");
    }
}

#[test]
fn a_wrong_torque_constant_scales_what_acts_and_not_what_is_logged() {
    let robot = free(effect("torque_constant_error", "scale_error", 0.05));
    let run = run_at(&robot, every_millisecond(0.0), Torques::constant(&[1.0]));
    let (v, logged) = (values(&run, Quantity::JointVelocity)[99], values(&run, Quantity::MotorTorque)[99]);
    let acting = v * INERTIA / 0.099;
    assert!((acting - 1.05).abs() < 1e-9 || (acting - 0.95).abs() < 1e-9, "{acting}");
    assert_eq!(logged, 1.0);
}

#[test]
fn a_drive_at_its_limit_gives_no_more_than_that() {
    let robot = free(effect("torque_saturation", "limit", 0.75));
    for (command, acts) in [(1.0, 0.75), (-2.0, -0.75), (0.5, 0.5)] {
        let run = run_at(&robot, every_millisecond(0.0), Torques::constant(&[command]));
        let (v, logged) =
            (values(&run, Quantity::JointVelocity)[99], values(&run, Quantity::MotorTorque)[99]);
        assert!((v * INERTIA / 0.099 - acts).abs() < 1e-9, "{command}");
        assert_eq!(logged, command);
    }
}

// κ₁₀ = 0.3, κ₀₁ = −0.2
#[test]
fn what_drives_give_together_is_taken_apart_again() {
    let mut robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
    for (onto, from, share) in [("joint_2", "joint_1", 0.3), ("joint_1", "joint_2", -0.2)] {
        let spec = EffectSpec::new("joint_cross_coupling", Place::Joint(onto.to_owned()));
        robot.effects.push(spec.with("coupling", share).said("from", from));
    }
    let plant = plant(&robot);
    let dynamics = Dynamics::new(&plant, &plant.parameters());
    let mut tau = [10.0, 20.0];
    dynamics.add_crosstalk(&mut tau);
    assert_eq!(tau, [10.0 - 0.2 * 20.0, 20.0 + 0.3 * 10.0]);
    let mut drives = [0.0; 2];
    dynamics.of_drives(&tau, &mut drives);
    // The first term left out is κ⁸ of 0.06⁴ and twice the torque.
    assert!((drives[0] - 10.0).abs() < 1e-3 && (drives[1] - 20.0).abs() < 1e-3, "{drives:?}");
}

#[test]
fn a_late_sensor_shows_the_state_of_exactly_then() {
    for skew in [0.4e-3, 2.7e-3, -1.6e-3] {
        let mut robot = lesson();
        robot.effects.push(effect("time_skew", "time", skew));
        let times = every_millisecond(0.0);
        let late = run_at(&robot, times.clone(), jumping(times.clone()));
        // An ideal sensor that samples then as well.
        let then: Vec<f64> = times.iter().map(|t| (t - skew).clamp(0.0, 0.099)).collect();
        let both = merged(&times, &then);
        let ideal = run_at(&lesson(), both.clone(), jumping(times.clone()));
        for (k, t) in then.iter().enumerate() {
            let at = both.iter().position(|s| s == t).unwrap();
            let (a, b) =
                (values(&late, Quantity::JointPosition)[k], values(&ideal, Quantity::JointPosition)[at]);
            assert!((a - b).abs() < 1e-9, "{skew} {t}: {a} {b}");
            assert!(
                (values(&late, Quantity::MotorPosition)[k]
                    - values(&ideal, Quantity::MotorPosition)
                        [both.iter().position(|s| *s == times[k]).unwrap()])
                .abs()
                    < 1e-9
            );
        }
    }
}

#[test]
fn sensors_add_their_offset_and_scale() {
    let mut robot = lesson();
    robot.effects.push(effect("position_sensor_offset", "offset", 0.01));
    robot.effects.push(effect("torque_sensor_offset", "offset", -0.3));
    let times = every_millisecond(0.0);
    let read = run_at(&robot, times.clone(), Torques::constant(&[1.0]));
    let truth = run_at(&lesson(), times, Torques::constant(&[1.0]));
    for (quantity, offset) in
        [(Quantity::JointPosition, 0.01), (Quantity::MotorTorque, -0.3), (Quantity::JointVelocity, 0.0)]
    {
        for (a, b) in values(&read, quantity).iter().zip(values(&truth, quantity)) {
            assert!((a - b - offset).abs() < 1e-12, "{quantity}");
        }
    }
}
