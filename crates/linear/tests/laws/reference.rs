//! Linear models and modes of an independent library (Pinocchio, checked against MuJoCo) for four elastic arms.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sinew_linear::{linearize, modes, poles};
use sinew_model::Robot;
use sinew_urdf::parse_urdf;

use crate::robots::plant;

/// Tolerances that the reference states, each of the largest entry.
const MATRIX: f64 = 1e-11;
const POLE: f64 = 1e-9;
/// Squared frequencies below this share of the largest are rounding there, and exactly zero here.
const ZERO: f64 = 1e-12;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn names(value: &Value) -> Vec<String> {
    value.as_array().unwrap().iter().map(|x| x.as_str().unwrap().to_owned()).collect()
}

// The robot of a file: its joints move on their own there, mimic or not.
fn robot(file: &Value, folder: &Path) -> Robot {
    let text = fs::read_to_string(folder.join(file["urdf"].as_str().unwrap())).unwrap();
    let alone: String = text.lines().filter(|l| !l.contains("<mimic")).map(|l| format!("{l}\n")).collect();
    let mut robot = Robot::rigid(parse_urdf(&alone, "reference.urdf").unwrap().model);
    for joint in file["joints"].as_array().unwrap() {
        let dof = robot.model.dof(joint["name"].as_str().unwrap()).unwrap();
        let number = |key: &str| joint[key].as_f64();
        robot.joints[dof].rotor_inertia = number("rotor_inertia").unwrap();
        robot.joints[dof].stiffness = number("stiffness");
        robot.joints[dof].damping = number("damping").unwrap_or(0.0);
    }
    robot
}

#[test]
fn linear_models_and_modes_agree_with_pinocchio() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference");
    if !folder.is_dir() {
        println!("skipped: the reference numbers are not beside the project");
        return;
    }
    let mut compared = 0;
    for name in ["planar_2r", "ur10e", "panda", "iiwa14_mixed"] {
        let text = fs::read_to_string(folder.join(format!("elastic/{name}.json"))).unwrap();
        let file: Value = serde_json::from_str(&text).unwrap();
        let robot = robot(&file, &folder);
        let all: Vec<String> = file["joints"]
            .as_array()
            .unwrap()
            .iter()
            .map(|j| j["name"].as_str().unwrap().to_owned())
            .collect();
        let (elastic, rigid) = (names(&file["elastic_joints"]), names(&file["rigid_joints"]));
        for point in file["linearisations"].as_array().unwrap() {
            compare(name, &robot, point, &all, &elastic, &rigid);
            compared += 1;
        }
    }
    assert_eq!(compared, 20);
}

fn compare(name: &str, robot: &Robot, point: &Value, all: &[String], elastic: &[String], rigid: &[String]) {
    let plant = plant(robot);
    let p = plant.parameters();
    let mut q = vec![0.0; all.len()];
    for (joint, value) in all.iter().zip(numbers(&point["position"])) {
        q[robot.model.dof(joint).unwrap()] = value;
    }
    let linear = linearize(&plant, &p, &q).unwrap();
    // Our order of states and inputs by the names of theirs.
    let prefixed = |prefix: &str, joints: &[String]| -> Vec<String> {
        joints.iter().map(|j| format!("{prefix}.{j}")).collect()
    };
    let theirs =
        [prefixed("q", all), prefixed("theta", elastic), prefixed("qd", all), prefixed("thetad", elastic)]
            .concat();
    let place = |known: &[String], wanted: &String| known.iter().position(|k| k == wanted).unwrap();
    let states: Vec<usize> = theirs.iter().map(|s| place(&linear.states, s)).collect();
    let driven = prefixed("motor_torque", &[elastic, rigid].concat());
    let inputs: Vec<usize> = driven.iter().map(|s| place(&linear.inputs, s)).collect();
    let largest = |rows: &[Vec<f64>]| rows.iter().flatten().fold(0.0, |s: f64, x| s.max(x.abs()));
    for (key, matrix, columns) in [("A", &linear.A, &states), ("B", &linear.B, &inputs)] {
        let rows: Vec<Vec<f64>> = point[key].as_array().unwrap().iter().map(numbers).collect();
        let size = largest(&rows);
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let error = (matrix[(states[i], columns[j])] - value).abs();
                assert!(
                    error <= MATRIX * size,
                    "{name}: {key}[{}, {j}] off by {error:e} of {size}",
                    theirs[i]
                );
            }
        }
    }
    for (joint, theta) in elastic.iter().zip(numbers(&point["motor_position"])) {
        let dof = robot.model.dof(joint).unwrap();
        assert!((linear.at.theta[dof] - theta).abs() < 1e-12, "{name}: theta of {joint}");
    }
    let found = poles(&linear.A).unwrap();
    let fastest = found.iter().map(|l| l.norm()).fold(0.0, f64::max);
    // A free motion is a double zero, which rounding moves by its root.
    let allowed = |size: f64| POLE * fastest + if size < 1e-3 * fastest { 1e-6 * fastest } else { 0.0 };
    for pair in point["eigenvalues"].as_array().unwrap() {
        let pole = numbers(pair);
        let distance = |l: &faer::c64| (l.re - pole[0]).hypot(l.im - pole[1]);
        let nearest = found.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert!(nearest < allowed(pole[0].hypot(pole[1])), "{name}: pole {pole:?} is {nearest:e} away");
    }
    let squared = numbers(&point["undamped_modes_reduced"]["squared_frequencies"]);
    let largest = squared.iter().fold(0.0, |s: f64, w| s.max(w.abs()));
    let modes = modes(&plant, &p, &q).unwrap();
    assert_eq!(modes.len(), squared.len());
    for (mode, exact) in modes.iter().zip(squared) {
        assert!((mode.omega_squared - exact).abs() <= MATRIX * largest, "{name}: {exact}");
        if exact.abs() < ZERO * largest {
            assert_eq!(mode.omega_squared, 0.0, "{name}: a free motion");
        }
    }
}
