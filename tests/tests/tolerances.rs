//! How far the inertias of a URDF are trusted.

use sinew_data::{Quantity, Run, Signal};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, Verdict, compare, diagnose};
use sinew_model::{Inertia, Model, Robot, Vector3};
use sinew_rigid::inverse_dynamics;
use sinew_tests::six_joints;

// Six joints without springs and without friction.
fn rigid() -> Robot {
    let mut robot = Robot::rigid(six_joints().robot.model);
    robot.joints.iter_mut().for_each(|joint| joint.rotor_inertia = 0.05);
    robot
}

// 10 s at 100 Hz of sines that differ from joint to joint and run to run, torques with noise.
fn runs(truth: &Robot, scale: [f64; 6]) -> Vec<Run> {
    let time: Vec<f64> = (0..1000).map(|k| 1e-2 * f64::from(k)).collect();
    let motion = |run: usize, joint: usize, t: f64| {
        let wave = |n: f64| {
            let w = 0.9 + 0.7 * n + 0.23 * joint as f64 + 0.11 * run as f64;
            let (size, phase) = (0.5 / n, n + 2.0 * joint as f64);
            let (s, c) = (w * t + phase).sin_cos();
            [size * s, size * w * c, -size * w * w * s]
        };
        [1.0, 2.0, 3.0].map(wave).into_iter().fold([0.0; 3], |a, b| [0, 1, 2].map(|k| a[k] + b[k]))
    };
    let of = |run: usize| {
        let mut theta = vec![Vec::new(); 6];
        let mut torque = vec![Vec::new(); 6];
        for (k, &t) in time.iter().enumerate() {
            let all: Vec<[f64; 3]> = (0..6).map(|joint| motion(run, joint, t)).collect();
            let [q, qd, qdd] = [0, 1, 2].map(|d| all.iter().map(|m| m[d]).collect::<Vec<f64>>());
            let tau = inverse_dynamics(&truth.model, &q, &qd, &qdd);
            for joint in 0..6 {
                let rotor = truth.joints[joint].rotor_inertia * qdd[joint];
                let noise = ((12.9898 * (k * 7 + joint) as f64 + run as f64).sin() * 43_758.547)
                    .rem_euclid(1.0)
                    - 0.5;
                theta[joint].push(q[joint]);
                torque[joint].push(scale[joint] * (tau[joint] + rotor) + 0.1 * noise);
            }
        }
        let name = |joint: usize| truth.model.dof_name(joint);
        let positions = theta.into_iter().enumerate().map(|(j, x)| (Quantity::MotorPosition, j, x));
        let torques = torque.into_iter().enumerate().map(|(j, x)| (Quantity::MotorTorque, j, x));
        let signals = positions.chain(torques).map(|(quantity, j, x)| Signal::new(quantity, name(j), x));
        Run::new(format!("run {run}"), time.clone(), signals.collect()).unwrap()
    };
    (0..2).map(of).collect()
}

// What is told first of all, if it is of inertias.
fn told(robot: &Robot, runs: &[Run]) -> Option<String> {
    let compared = compare(robot, &CATALOGUE, runs, &Options::default()).unwrap();
    let first = compared.findings.into_iter().next().map(|f| f.statement);
    first.filter(|statement| statement.contains("inertias of the URDF"))
}

fn scaled(model: &mut Model, factors: [f64; 6]) {
    for (joint, factor) in model.joints.iter_mut().zip(factors) {
        let inertia = &mut joint.inertia;
        inertia.mass *= factor;
        inertia.first_moment = inertia.first_moment * factor;
        inertia.second_moment = inertia.second_moment.scaled(factor);
    }
}

#[test]
fn a_urdf_with_wrong_inertias_is_told_before_anything_else() {
    let robot = rigid();
    let plain = runs(&robot, [1.0; 6]);
    assert_eq!(told(&robot, &plain), None);
    let mut near = robot.clone();
    scaled(&mut near.model, [0.98, 1.015, 1.01, 0.985, 1.02, 1.01]);
    assert_eq!(told(&near, &plain), None);
    let mut wrong = robot.clone();
    scaled(&mut wrong.model, [0.6, 1.5, 1.4, 0.6, 1.5, 0.5]);
    let statement = told(&wrong, &plain).expect("five links are far off");
    assert!(statement.contains("5 of 6 links") && statement.contains("taken"), "{statement}");
    // Bodies of which much is free are no list of effects.
    let diagnosis = diagnose(&wrong, &CATALOGUE, &plain, &Options::default()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Adequate, "{:?}", diagnosis.candidates);
}

#[test]
fn a_load_and_a_wrong_torque_constant_are_no_wrong_urdf() {
    let robot = rigid();
    let mut loaded = robot.clone();
    let load = Inertia::at_centre_of_mass(1.0, Vector3::new(0.08, 0.0, 0.0), [0.0; 6]);
    let hand = &mut loaded.model.joints[5].inertia;
    *hand += load;
    assert_eq!(told(&robot, &runs(&loaded, [1.0; 6])), None);
    assert_eq!(told(&robot, &runs(&robot, [1.0, 0.8, 1.0, 1.0, 1.0, 1.0])), None);
    let mut one = robot.clone();
    scaled(&mut one.model, [1.0, 1.0, 1.5, 1.0, 1.0, 1.0]);
    assert_eq!(told(&one, &runs(&robot, [1.0; 6])), None);
}
