//! Numbers of Pinocchio for a planar arm, which travel with the project.
#![allow(non_snake_case)]

use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use sinew_kinematics::{Axes, hessian, jacobian, jacobian_rate, link_pose};
use sinew_model::{Inertia, JointShape, JointSpec, Model, ModelBuilder, Pose, Vector3};
use sinew_rigid::{
    bias, centroidal_momentum, centroidal_momentum_matrix, centroidal_momentum_rate, coriolis_matrix,
    forward_dynamics, forward_dynamics_derivatives, gravity, inverse_dynamics, inverse_dynamics_derivatives,
    inverse_mass_matrix, kinetic_energy, kinetic_energy_regressor, mass_matrix, potential_energy,
    potential_energy_regressor, regressor,
};

const FIGURES: &str = include_str!("../../../tests/golden/planar_2r_rigid.json");
/// Rounding of sums along two joints, times the condition of M (at most 30).
const ALGEBRA: f64 = 1e-13;

/// Two uniform rods, 3 kg and 0.5 m, 2 kg and 0.4 m.
fn planar_2r() -> Model {
    let rod = |mass: f64, length: f64| {
        let I = mass * length * length / 12.0;
        let centre = Vector3::new(length / 2.0, 0.0, 0.0);
        Inertia::at_centre_of_mass(mass, centre, [0.001, I, I, 0.0, 0.0, 0.0])
    };
    let along_x = |x| Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
    let joint = |name, shape, parent, child, x| {
        JointSpec::new(name, shape, parent, child).about([0.0, -1.0, 0.0]).at(along_x(x))
    };
    let mut builder = ModelBuilder::new("planar_2r");
    builder
        .link("base", Inertia::default())
        .link("upper", rod(3.0, 0.5))
        .link("lower", rod(2.0, 0.4))
        .link("tip", Inertia::default())
        .joint(joint("shoulder", JointShape::Revolute, "base", "upper", 0.0))
        .joint(joint("elbow", JointShape::Revolute, "upper", "lower", 0.5))
        .joint(joint("tip_joint", JointShape::Fixed, "lower", "tip", 0.4));
    builder.build().expect("a chain is a tree")
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}

fn assert_close(key: &str, got: &[f64], state: &Value) {
    let want = numbers(&state[key]);
    let error = DVector::from_row_slice(got) - DVector::from_row_slice(&want);
    let largest = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    assert!(error.amax() <= ALGEBRA * largest, "{key}: got {got:?}, want {want:?}");
}

fn rows(M: &DMatrix<f64>) -> Vec<f64> {
    M.transpose().as_slice().to_vec()
}

#[test]
fn a_planar_arm_agrees_with_the_figures_of_pinocchio() {
    let model = planar_2r();
    let tip = model.link("tip").unwrap();
    let file: Value = serde_json::from_str(FIGURES).unwrap();
    let mut derivatives = 0;
    for state in file["states"].as_array().unwrap() {
        let get = |key: &str| numbers(&state[key]);
        let (q, qd, qdd, tau) = (get("position"), get("velocity"), get("acceleration"), get("torque"));
        let vectors = [
            ("inverse_dynamics", inverse_dynamics(&model, &q, &qd, &qdd)),
            ("nonlinear_torque", bias(&model, &q, &qd)),
            ("gravity_torque", gravity(&model, &q)),
            ("forward_dynamics", forward_dynamics(&model, &q, &qd, &tau)),
        ];
        for (key, got) in vectors {
            assert_close(key, got.as_slice(), state);
        }
        let J = jacobian(&model, &q, tip, Axes::WorldAligned);
        let J_rate = jacobian_rate(&model, &q, &qd, tip, Axes::WorldAligned);
        let matrices = [
            ("mass_matrix", mass_matrix(&model, &q)),
            ("inverse_mass_matrix", inverse_mass_matrix(&model, &q)),
            ("coriolis_matrix", coriolis_matrix(&model, &q, &qd)),
            ("torque_regressor", regressor(&model, &q, &qd, &qdd)),
            ("jacobian_world_aligned", DMatrix::from_column_slice(6, 2, J.as_slice())),
            ("jacobian_rate_world_aligned", DMatrix::from_column_slice(6, 2, J_rate.as_slice())),
        ];
        for (key, got) in matrices {
            assert_close(key, &rows(&got), state);
        }
        derivatives += usize::from(compare_derivatives(&model, state));
        assert_close("kinetic_energy", &[kinetic_energy(&model, &q, &qd)], state);
        assert_close("potential_energy", &[potential_energy(&model, &q)], state);
        let place = link_pose(&model, &q, tip).translation.to_array();
        assert_close("position", &place, &state["frames"]["tip"]);
    }
    assert_eq!(derivatives, 2, "states with derivatives");
}

/// Derivatives, momentum and energy maps, in the states that have all of them.
fn compare_derivatives(model: &Model, state: &Value) -> bool {
    if state.get("kinematic_hessian_world_aligned").is_none() {
        return false;
    }
    let get = |key: &str| numbers(&state[key]);
    let (q, qd, qdd, tau) = (get("position"), get("velocity"), get("acceleration"), get("torque"));
    let of_torque = inverse_dynamics_derivatives(model, &q, &qd, &qdd);
    let of_motion = forward_dynamics_derivatives(model, &q, &qd, &tau);
    let A = centroidal_momentum_matrix(model, &q);
    for (key, got) in [
        ("inverse_dynamics_by_position", of_torque.by_position),
        ("inverse_dynamics_by_velocity", of_torque.by_velocity),
        ("forward_dynamics_by_position", of_motion.by_position),
        ("forward_dynamics_by_velocity", of_motion.by_velocity),
        ("centroidal_momentum_matrix", DMatrix::from_column_slice(6, 2, A.as_slice())),
    ] {
        assert_close(key, &rows(&got), state);
    }
    assert_close("centroidal_momentum", &centroidal_momentum(model, &q, &qd).to_array(), state);
    let rate = centroidal_momentum_rate(model, &q, &qd, &qdd);
    assert_close("centroidal_momentum_rate", &rate.to_array(), state);
    assert_close("kinetic_energy_regressor", kinetic_energy_regressor(model, &q, &qd).as_slice(), state);
    assert_close("potential_energy_regressor", potential_energy_regressor(model, &q).as_slice(), state);
    let tip = model.link("tip").unwrap();
    let H = hessian(model, &q, tip, Axes::WorldAligned);
    let by_rows = H.iter().flat_map(|H| rows(&DMatrix::from_column_slice(6, 2, H.as_slice())));
    assert_close("kinematic_hessian_world_aligned", &by_rows.collect::<Vec<_>>(), state);
    true
}
