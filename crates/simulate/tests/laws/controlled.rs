//! Controlled runs: tracking, noise, determinism, and what lies between command and truth.

use crate::robots::{arm, plant, rms};
use sinew_data::Quantity;
use sinew_model::Robot;
use sinew_simulate::{
    Controller, Excitation, Limits, Motion, Noise, Options, SimulateError, Simulated, Torques, Trajectory,
    simulate,
};

const SECONDS: f64 = 4.0;

fn reference() -> Trajectory {
    let limits = Limits { amplitude: 0.5, speed: 1.5 };
    let motion = |seed| Motion::one(0.1, SECONDS - 0.5, Excitation::fourier(seed, 5, SECONDS / 2.0, limits));
    Trajectory { joints: vec![motion(1), motion(2)] }
}

fn run(robot: &Robot, change: impl FnOnce(&mut Options)) -> Simulated {
    held(robot, 30.0, change).unwrap()
}

fn held(
    robot: &Robot,
    bandwidth: f64,
    change: impl FnOnce(&mut Options),
) -> Result<Simulated, SimulateError> {
    let (plant, nominal) = (plant(robot), plant(&Robot::rigid(robot.model.clone())));
    let mut drive = Controller::new(&nominal, &nominal.parameters(), reference(), bandwidth);
    let mut options = Options::new(&plant, SECONDS, 1e-3);
    options.start = sinew_simulate::Start::at(&[0.1, 0.1]);
    change(&mut options);
    simulate(&plant, &plant.parameters(), &mut drive, &options)
}

#[test]
fn a_controller_faster_than_the_joint_ends_with_an_error() {
    let text = held(&arm(), 3000.0, |_| {}).unwrap_err().to_string();
    assert!(text.contains("runs away") && text.contains("bandwidth"), "{text}");
}

#[test]
fn an_elastic_arm_follows_its_reference() {
    let simulated = run(&arm(), |_| {});
    let run = &simulated.run;
    assert_eq!(run.signals.len(), 12);
    for (dof, joint) in ["joint_1", "joint_2"].into_iter().enumerate() {
        let theta = &run.signal(Quantity::MotorPosition, joint).unwrap().values;
        let error = run.time.iter().zip(theta).map(|(&t, x)| x - reference().at(dof, t).position);
        assert!(rms(error) < 0.02, "{joint}");
        assert!(theta.iter().any(|x| (x - 0.1).abs() > 0.1), "{joint} moves");
    }
}

fn noise() -> Noise {
    let noise = Noise::default().with(Quantity::MotorPosition, 2e-5, 5e-6);
    noise.with(Quantity::JointVelocity, 1e-3, 0.0).with(Quantity::MotorTorque, 0.05, 0.0)
}

fn values<'a>(simulated: &'a Simulated, quantity: Quantity, joint: &str) -> &'a [f64] {
    &simulated.run.signal(quantity, joint).unwrap().values
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let noisy = |seed| run(&arm(), |o| (o.noise, o.seed) = (noise(), seed));
    let (a, b, other) = (noisy(3), noisy(3), noisy(4));
    for (x, y) in a.run.signals.iter().zip(&b.run.signals) {
        let same = x.values.iter().zip(&y.values).all(|(x, y)| x.to_bits() == y.to_bits());
        assert!(same, "{} {}", x.quantity, x.place);
    }
    let first = |s: &Simulated| values(s, Quantity::MotorPosition, "joint_1")[..50].to_vec();
    assert_ne!(first(&a), first(&other));
}

#[test]
fn what_is_logged_does_not_change_what_happens() {
    let all = run(&arm(), |o| o.noise = noise());
    let few = run(&arm(), |o| {
        o.noise = noise();
        o.quantities = vec![Quantity::JointVelocity, Quantity::MotorPosition];
    });
    for signal in &few.run.signals {
        assert_eq!(signal.values, values(&all, signal.quantity, &signal.place));
    }
}

#[test]
fn noise_and_steps_of_an_encoder_are_as_stated() {
    let quiet = run(&arm(), |o| o.noise = Noise::default().with(Quantity::JointPosition, 0.0, 0.0));
    // Noise of a sensor that the controller does not see leaves the motion alone.
    let noisy = run(&arm(), |o| o.noise = Noise::default().with(Quantity::JointPosition, 1e-3, 1e-4));
    let signal = noisy.run.signal(Quantity::JointPosition, "joint_2").unwrap();
    assert_eq!((signal.std, signal.resolution), (Some(1e-3), Some(1e-4)));
    let truth = values(&quiet, Quantity::JointPosition, "joint_2");
    let spread = rms(signal.values.iter().zip(truth).map(|(a, b)| a - b));
    // σ² + step²/12; 4000 samples give σ to 1 %.
    let stated = f64::sqrt(1e-6 + 1e-8 / 12.0);
    assert!((spread / stated - 1.0).abs() < 0.05, "{spread:e}");
    assert!(signal.values.iter().all(|x| (x / 1e-4 - (x / 1e-4).round()).abs() < 1e-6));
}

#[test]
fn noise_of_the_torque_acts_and_is_not_logged() {
    let robot = Robot::rigid(sinew_model::samples::planar_arm(1, 3.0, 0.4));
    let plant = plant(&robot);
    let mut options = Options::new(&plant, 0.5, 1e-3);
    let mut run = |std| {
        options.noise = Noise::default().with(Quantity::MotorTorque, std, 0.0);
        simulate(&plant, &[], &mut Torques::constant(&[2.0]), &options).unwrap()
    };
    let (quiet, noisy) = (run(0.0), run(0.5));
    assert!(values(&noisy, Quantity::MotorTorque, "joint_1").iter().all(|&t| t == 2.0));
    let spread = values(&noisy, Quantity::JointTorque, "joint_1").iter().map(|t| t - 2.0);
    assert!((rms(spread) / 0.5 - 1.0).abs() < 0.15);
    let last = |s: &Simulated| *values(s, Quantity::JointPosition, "joint_1").last().unwrap();
    assert_ne!(last(&quiet), last(&noisy));
}
