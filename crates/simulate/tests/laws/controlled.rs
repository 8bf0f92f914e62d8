//! Controlled runs: tracking, noise, determinism, and what lies between command and truth.

use crate::robots::{arm, plant, rms};
use sinew_data::Quantity;
use sinew_model::Robot;
use sinew_simulate::{Controller, Excitation, Limits, Motion, Options, Simulated, Trajectory, simulate};

const SECONDS: f64 = 4.0;

fn reference() -> Trajectory {
    let limits = Limits { amplitude: 0.5, speed: 1.5 };
    let motion = |seed| Motion::one(0.1, SECONDS - 0.5, Excitation::fourier(seed, 5, SECONDS / 2.0, limits));
    Trajectory { joints: vec![motion(1), motion(2)] }
}

fn run(robot: &Robot, change: impl FnOnce(&mut Options)) -> Simulated {
    let (plant, nominal) = (plant(robot), plant(&Robot::rigid(robot.model.clone())));
    let mut drive = Controller::new(&nominal, &nominal.parameters(), reference(), 30.0);
    let mut options = Options::new(&plant, SECONDS, 1e-3);
    options.start = sinew_simulate::Start::at(&[0.1, 0.1]);
    change(&mut options);
    simulate(&plant, &plant.parameters(), &mut drive, &options).unwrap()
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
