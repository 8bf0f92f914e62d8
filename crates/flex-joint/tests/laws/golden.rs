//! Numbers of Pinocchio, checked against MuJoCo, for a planar arm with two elastic joints.

use serde_json::Value;
use sinew_flex_joint::{ElasticJoints, Scratch};
use sinew_model::{Dual, Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot, Scalar, Vector3};

use crate::trees::assert_close;

const FIGURES: &str = include_str!("../../../../tests/golden/planar_2r_elastic.json");
/// Rounding of sums along two joints.
const ALGEBRA: f64 = 1e-13;
/// Rounding of what solves with M, times its condition.
const SOLUTION: f64 = 1e-14;
/// Accuracy of a linearisation by central differences.
const DIFFERENCES: f64 = 1e-10;

/// Two uniform rods, 3 kg and 0.5 m, 2 kg and 0.4 m, with the springs and rotors of the file.
fn planar_2r(file: &Value) -> ElasticJoints {
    let rod = |mass: f64, length: f64| {
        let I = mass * length * length / 12.0;
        let centre = Vector3::new(length / 2.0, 0.0, 0.0);
        Inertia::at_centre_of_mass(mass, centre, [0.001, I, I, 0.0, 0.0, 0.0])
    };
    let joint = |name, parent, child, x| {
        let place = Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
        JointSpec::new(name, JointShape::Revolute, parent, child).about([0.0, -1.0, 0.0]).at(place)
    };
    let mut builder = ModelBuilder::new("planar_2r");
    builder
        .link("base", Inertia::default())
        .link("upper", rod(3.0, 0.5))
        .link("lower", rod(2.0, 0.4))
        .joint(joint("shoulder", "base", "upper", 0.0))
        .joint(joint("elbow", "upper", "lower", 0.5));
    let mut robot = Robot::rigid(builder.build().expect("a chain is a tree"));
    for (settings, joint) in robot.joints.iter_mut().zip(file["joints"].as_array().expect("joints")) {
        settings.stiffness = joint["stiffness"].as_f64();
        settings.damping = number(&joint["damping"]);
        settings.rotor_inertia = number(&joint["rotor_inertia"]);
    }
    ElasticJoints::new(&robot).expect("the springs are sound")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(number).collect()
}

#[test]
fn accelerations_and_energies_agree_with_the_figures_of_pinocchio() {
    let file: Value = serde_json::from_str(FIGURES).expect("JSON");
    let arm = planar_2r(&file);
    for state in file["states"].as_array().expect("states") {
        let get = |key: &str| numbers(&state[key]);
        let (q, qd) = (get("position"), get("velocity"));
        let (theta, thetad, tau_m) = (get("motor_position"), get("motor_velocity"), get("motor_torque"));
        let tau_j = arm.spring_torque(&q, &qd, &theta, &thetad);
        assert_close("spring_torque", tau_j.as_slice(), &get("spring_torque"), ALGEBRA);
        let (qdd, thetadd) = arm.forward_dynamics(&q, &qd, &theta, &thetad, &tau_m);
        let solution = SOLUTION * (1.0 + number(&state["condition"]));
        assert_close("acceleration", qdd.as_slice(), &get("acceleration"), solution);
        assert_close("motor_acceleration", thetadd.as_slice(), &get("motor_acceleration"), ALGEBRA);
        let energy = ["kinetic_energy", "elastic_energy", "gravity_energy"].map(|key| number(&state[key]));
        let H = arm.energy(&q, &qd, &theta, &thetad);
        assert_close("energy", &[H], &[energy.iter().sum()], ALGEBRA);
        assert_close("power_lost", &[arm.power_lost(&qd, &thetad)], &[number(&state["power_lost"])], ALGEBRA);
    }
}

#[test]
fn equilibria_and_linearisations_agree_with_the_figures_of_pinocchio() {
    let file: Value = serde_json::from_str(FIGURES).expect("JSON");
    let arm = planar_2r(&file);
    for point in file["linearisations"].as_array().expect("linearisations") {
        let q = numbers(&point["position"]);
        let (theta, tau_m) = arm.equilibrium(&q);
        assert_close("motor_position", theta.as_slice(), &numbers(&point["motor_position"]), ALGEBRA);
        assert_close("motor_torque", tau_m.as_slice(), &numbers(&point["motor_torque"]), ALGEBRA);
        // x = (q, θ, q̇, θ̇): ∂(q̈, θ̈)/∂x, one direction after the other, are the lower rows of A
        let x: Vec<f64> = [q.as_slice(), theta.as_slice(), &[0.0; 4]].concat();
        let tau: Vec<_> = tau_m.iter().map(|&tau| Dual::constant(tau)).collect();
        let (ws, mut rows) = (&mut Scratch::new(&arm), vec![Vec::new(); 4]);
        for column in 0..x.len() {
            let along = |(k, &x)| if k == column { Dual::<1>::variable(x, 0) } else { Dual::constant(x) };
            let x: Vec<_> = x.iter().enumerate().map(along).collect();
            let (mut qdd, mut thetadd) = ([Dual::ZERO; 2], [Dual::ZERO; 2]);
            arm.forward_dynamics_with(ws, &x[..2], &x[4..6], &x[2..4], &x[6..], &tau, &mut qdd, &mut thetadd);
            rows.iter_mut().zip(qdd.iter().chain(&thetadd)).for_each(|(row, x)| row.push(x.derivative[0]));
        }
        for (row, got) in rows.iter().enumerate() {
            assert_close("A", got, &numbers(&point["A"][4 + row]), DIFFERENCES);
        }
    }
}
