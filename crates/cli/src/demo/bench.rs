//! The test bench of the demo: an arm that differs from its model, and its measured runs.

use core::f64::consts::TAU;

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, Place, Robot, Setting};
use sinew_plant::Plant;
use sinew_rigid::gravity;
use sinew_simulate::{Controller, Excitation, Limits, Motion, Noise, Options, Trajectory, simulate};

use crate::error::CliError;
use crate::tracking::held_at;

/// What the model does not know: the elbow's motor cogs, ten times a turn of the joint.
pub(super) const HIDDEN: &str = "cogging_torque@elbow";
const HIDDEN_VALUES: [(&str, f64); 3] = [("sine", 0.4), ("cosine", 0.3), ("per_turn", 10.0)];
/// Seed of all noise and of the motions.
pub(super) const SEED: u64 = 2026;

const CENTRE: [f64; 2] = [0.5, -0.9];
const PERIOD: f64 = 2e-3;
const REST: f64 = 0.5;
const DURATION: f64 = 6.0;
const BANDWIDTH: f64 = 20.0;

// Encoders of 17 bit on the motors (gear 100), and noisy ones of 20 bit on the links; rad, N·m.
const MOTOR_STEP: f64 = TAU / 131_072.0 / 100.0;
const LINK_STEP: f64 = TAU / 1_048_576.0;
const LINK_NOISE: f64 = 1.5e-5;
const TORQUE_NOISE: f64 = 0.06;

/// What a user would state of these sensors beside a run.
pub(super) fn sensors() -> String {
    format!(
        "motor_position.resolution = {MOTOR_STEP}\njoint_position = {{ std = {LINK_NOISE}, resolution = {LINK_STEP} }}\nmotor_torque.std = {TORQUE_NOISE}\n"
    )
}

/// A motion of the bench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Program {
    /// Seven harmonics.
    Waves,
    /// Three harmonics, wide and fast.
    Swings,
    /// From place to place.
    Places,
}

/// One run of the true arm: its controller knows the rigid model only, its log holds what encoders and drives show.
pub(super) fn run(model: &Robot, name: &str, program: Program) -> Result<Run, CliError> {
    let robot = truth(model);
    let truth = plant(&robot)?;
    let rigid = plant(&Robot::rigid(model.model.clone()))?;
    let trajectory = trajectory(program);
    let duration = trajectory.joints[0].duration();
    let mut controller = Controller::new(&rigid, &rigid.parameters(), trajectory, BANDWIDTH);
    let mut options = Options::new(&truth, duration, PERIOD);
    options.start = held_at(&robot, &truth, &sagged(&robot))?;
    options.quantities = vec![Quantity::MotorPosition, Quantity::MotorTorque, Quantity::JointPosition];
    options.noise = Noise::default()
        .with(Quantity::MotorPosition, 0.0, MOTOR_STEP)
        .with(Quantity::JointPosition, LINK_NOISE, LINK_STEP)
        .with(Quantity::MotorTorque, TORQUE_NOISE, 0.0);
    options.seed = SEED + program as u64;
    let mut run = simulate(&truth, &truth.parameters(), &mut controller, &options)?.run;
    name.clone_into(&mut run.name);
    Ok(run)
}

// Springs, rotors and friction half a tolerance away from the data sheet, and one effect more.
fn truth(model: &Robot) -> Robot {
    let mut truth = model.clone();
    for joint in &mut truth.joints {
        joint.stiffness = joint.stiffness.map(|k| 1.04 * k);
        joint.damping *= 0.85;
        joint.rotor_inertia *= 1.015;
    }
    for effect in &mut truth.effects {
        for (_, setting) in &mut effect.settings {
            if let Setting::Number(value) = setting {
                *value *= 0.9;
            }
        }
    }
    let hidden = EffectSpec::new("cogging_torque", Place::Joint("elbow".to_owned()));
    truth.effects.push(HIDDEN_VALUES.iter().fold(hidden, |e, (key, value)| e.with(key, *value)));
    truth
}

// Where the links hang when the motors hold the centre: q = θ − g/K.
fn sagged(robot: &Robot) -> Vec<f64> {
    let g = gravity(&robot.model, &CENTRE);
    (0..CENTRE.len())
        .map(|dof| CENTRE[dof] - robot.joints[dof].stiffness.map_or(0.0, |K| g[dof] / K))
        .collect()
}

fn trajectory(program: Program) -> Trajectory {
    let shoulder = Limits { amplitude: 0.8, speed: 1.6 };
    let elbow = Limits { amplitude: 1.1, speed: 2.4 };
    let limits = [shoulder, elbow];
    let of = |dof: usize| {
        let seed = SEED + dof as u64;
        let excitation = match program {
            Program::Waves => Excitation::fourier(seed, 7, 5.0, limits[dof]),
            Program::Swings => Excitation::fourier(seed + 2, 3, 3.5, limits[dof]),
            Program::Places => Excitation::steps(seed, 9, 0.2, limits[dof]),
        };
        let parts = vec![(REST, Excitation::hold()), (DURATION, excitation), (REST, Excitation::hold())];
        Motion { centre: CENTRE[dof], parts }
    };
    Trajectory { joints: (0..2).map(of).collect() }
}

fn plant(robot: &Robot) -> Result<Plant, CliError> {
    let wrong = |source| CliError::Plant { file: "demo arm".to_owned(), source: Box::new(source) };
    Plant::new(robot, &CATALOGUE).map_err(wrong)
}
