//! The user's loop as a story: files, a run, the missing effect, a better file, a smaller error.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, compare, discover};
use sinew_model::{EffectSpec, Place, Robot, Setting};
use sinew_plant::Plant;
use sinew_simulate::{
    Controller, Excitation, Limits, Motion, Noise, Options as Simulation, Start, Trajectory, simulate,
};
use sinew_urdf::{Sidecar, parse_robot};

const URDF: &str = r#"<robot name="lever">
  <link name="base"/>
  <link name="lever"><inertial><origin xyz="0.3 0 0"/><mass value="4"/>
    <inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="lever"/><axis xyz="0 -1 0"/>
    <limit lower="-2" upper="2" velocity="4" effort="60"/></joint>
</robot>"#;

const SIDECAR: &str = "format = 1
urdf = \"lever.urdf\"
known = \"exact\"

[joints.pivot]
stiffness = 2000.0        # from the gear's data sheet
damping = 4.0
rotor_inertia = 0.3
";

// Noise of torque and link encoder, steps of both encoders; N·m, rad.
const TORQUE_NOISE: f64 = 0.06;
const LINK_NOISE: f64 = 1.5e-5;
const LINK_STEP: f64 = 6e-6;
const MOTOR_STEP: f64 = 5e-7;
/// Noise floors that may be left: at 500 Hz the instants at which the friction turns round fall between samples.
const NEAR_FLOOR: f64 = 2.5;

fn plant(robot: &Robot) -> Plant {
    Plant::new(robot, &CATALOGUE).unwrap()
}

// Four seconds at 500 Hz behind a controller that knows the rigid lever.
fn measure(truth: &Robot, name: &str, seed: u64) -> Run {
    let rigid = plant(&Robot::rigid(truth.model.clone()));
    let truth = plant(truth);
    let limits = Limits { amplitude: 0.7, speed: 1.5 };
    let motion = Motion::one(0.2, 4.0, Excitation::fourier(seed, 4, 3.0, limits));
    let mut controller = Controller::new(&rigid, &[], Trajectory { joints: vec![motion] }, 20.0);
    let parameters = truth.parameters();
    let mut options = Simulation::new(&truth, 4.0, 2e-3);
    options.start = Start::balanced(&truth, &parameters, &[0.2]).unwrap();
    options.quantities = vec![Quantity::MotorPosition, Quantity::MotorTorque, Quantity::JointPosition];
    options.noise = Noise::default()
        .with(Quantity::MotorPosition, 0.0, MOTOR_STEP)
        .with(Quantity::JointPosition, LINK_NOISE, LINK_STEP)
        .with(Quantity::MotorTorque, TORQUE_NOISE, 0.0);
    options.seed = seed;
    let mut run = simulate(&truth, &parameters, &mut controller, &options).unwrap().run;
    name.clone_into(&mut run.name);
    run
}

// Springs and rotors stand in the joint's table, every other effect in one of its own.
fn state(sidecar: &mut Sidecar, spec: &EffectSpec) {
    let prefix = match spec.kind.as_str() {
        "joint_elasticity" => "",
        "rotor_inertia" => "rotor_",
        _ => return sidecar.set_effect(spec),
    };
    for (key, setting) in &spec.settings {
        let Setting::Number(value) = setting else { continue };
        sidecar.set_joint("pivot", &format!("{prefix}{key}"), *value);
    }
}

#[test]
fn a_hidden_friction_is_named_fitted_written_and_read_back() {
    let file = parse_robot(URDF, SIDECAR, "lever").unwrap();
    let friction = EffectSpec::new("coulomb_friction", Place::Joint("pivot".into())).with("coulomb", 2.0);
    let mut truth = file.robot.clone();
    truth.effects.push(friction);
    let (seen, unseen) = ([measure(&truth, "seen", 1)], [measure(&truth, "unseen", 2)]);

    let found = discover(&file.robot, &CATALOGUE, &seen, &unseen, &Options::default()).unwrap();
    let accepted: Vec<String> =
        found.diagnosis.accepted.iter().map(|a| format!("{}@{}", a.effect, a.place)).collect();
    assert_eq!(accepted, ["coulomb_friction@pivot"]);
    let (first, last) = (&found.steps[0], found.steps.last().unwrap());
    for (before, after) in
        [(first.rms_error, last.rms_error), (first.check_rms_error.unwrap(), last.check_rms_error.unwrap())]
    {
        assert!(after < NEAR_FLOOR && after < 0.1 * before, "{before} {after}");
    }

    let mut sidecar = file.sidecar.clone();
    found.specs.iter().for_each(|spec| state(&mut sidecar, spec));
    assert!(sidecar.text().contains("# from the gear's data sheet"), "the author's comments stay");
    let better = parse_robot(URDF, &sidecar.text(), "lever").unwrap().robot;
    let written = |kind: &str| found.specs.iter().find(|spec| spec.kind == kind).unwrap();
    assert_eq!(better.joints[0].stiffness, written("joint_elasticity").number("stiffness"));
    let spec = better.effects.iter().find(|spec| spec.kind == "coulomb_friction").unwrap();
    assert_eq!(spec, written("coulomb_friction"));
    let (coulomb, std) = (spec.number("coulomb").unwrap(), spec.number("coulomb_std").unwrap());
    assert!((coulomb - 2.0).abs() < 4.0 * std && std < 0.1, "{coulomb} ± {std}");

    // The error of the motor torque on the unseen run, N·m.
    let error = |robot: &Robot| {
        let comparison = compare(robot, &CATALOGUE, &unseen, &Options::default()).unwrap();
        comparison.signals.iter().find(|signal| signal.signal == "motor_torque").unwrap().rms_error
    };
    let (before, after) = (error(&file.robot), error(&better));
    assert!(after < 0.1 * before, "{before} {after}");
}
