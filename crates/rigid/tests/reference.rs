//! Numbers of independent libraries (Pinocchio, checked against MuJoCo) for 21 robots.
#![allow(non_snake_case)]

mod support;

use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use sinew_kinematics::{
    Axes, centre_of_mass, centre_of_mass_jacobian, classical_acceleration, hessian, jacobian, jacobian_rate,
    link_acceleration, link_pose, link_velocity,
};
use sinew_model::{Force, LinkId, Model, Motion};
use sinew_rigid::{
    Bodies, Scratch, base_parameters, bias, centroidal_momentum, centroidal_momentum_matrix,
    centroidal_momentum_rate, coriolis_matrix, forward_dynamics, forward_dynamics_derivatives,
    forward_dynamics_with, gravity, inertias, inverse_dynamics, inverse_dynamics_derivatives,
    inverse_dynamics_with, inverse_mass_matrix, kinetic_energy, kinetic_energy_regressor, mass_matrix,
    potential_energy, potential_energy_regressor, regressor, tool_wrench_with,
};
use support::{Reading, matrix, numbers, read_urdf, vector};

/// Rounding of sums along a robot's joints.
const ALGEBRA: f64 = 1e-12;
/// Rounding of first derivatives.
const DERIVATIVES: f64 = 1e-11;
/// Rounding of what solves with M, times its condition.
const SOLUTION: f64 = 1e-14;
/// The axes of a frame and their name in the files.
const AXES: [(Axes, &str); 3] =
    [(Axes::Local, "local"), (Axes::World, "world"), (Axes::WorldAligned, "world_aligned")];

/// A model whose order of coordinates may differ from a file's: the same by name.
struct Robot {
    model: Model,
    tool: LinkId,
    /// Place in the file of each of our positions, degrees of freedom and parameters.
    q: Vec<usize>,
    dof: Vec<usize>,
    parameter: Vec<usize>,
}

/// One state of a file and the largest error seen of each field.
struct Comparison<'a> {
    robot: &'a Robot,
    state: &'a Value,
    name: &'a str,
}

impl Robot {
    fn new(model: Model, file: &Value) -> Self {
        let (mut q, mut dof) = (vec![usize::MAX; model.nq], vec![usize::MAX; model.nv]);
        for joint in model.joints.iter().filter(|j| j.mimic.is_none()) {
            let entry =
                if joint.kind.nv() == 6 { &file["floating_base"] } else { joint_of(file, &joint.name) };
            let place = |key: &str| entry[key].as_u64().expect("an index") as usize;
            for k in 0..joint.kind.nq() {
                q[joint.first_q + k] = place("position_index") + k;
            }
            for k in 0..joint.kind.nv() {
                dof[joint.first_dof + k] = place("velocity_index") + k;
            }
        }
        let bodies = file["bodies"].as_array().unwrap();
        let body_of = |name: &str| bodies.iter().position(|b| b["joint"] == name).expect("a body");
        let parameter =
            model.joints.iter().flat_map(|j| (0..10).map(|p| 10 * body_of(&j.name) + p)).collect();
        let tool = model.link(file["end_effector"].as_str().unwrap()).expect("the end-effector");
        Self { model, tool, q, dof, parameter }
    }
}

impl Comparison<'_> {
    fn get(&self, key: &str, order: &[usize]) -> Vec<f64> {
        let all = numbers(&self.state[key]);
        order.iter().map(|&i| all[i]).collect()
    }

    /// Compares with a vector over degrees of freedom.
    fn dofs(&self, key: &str, got: &DVector<f64>, tolerance: f64) {
        self.close(key, got.as_slice(), &self.get(key, &self.robot.dof), tolerance);
    }

    /// Compares with a vector or matrix whose columns (and rows) may be over degrees of freedom.
    fn table(
        &self,
        key: &str,
        got: &DMatrix<f64>,
        rows: Option<&[usize]>,
        columns: &[usize],
        tolerance: f64,
    ) {
        if self.state.get(key).is_none() {
            return;
        }
        let all = matrix(&self.state[key]);
        let want = DMatrix::from_fn(got.nrows(), got.ncols(), |i, j| {
            all[(rows.map_or(i, |rows| rows[i]), columns[j])]
        });
        self.close(key, got.as_slice(), want.as_slice(), tolerance);
    }

    fn motion(&self, key: &str, got: Motion<f64>) {
        self.close(key, &got.to_array(), &numbers(&self.state[key]), ALGEBRA);
    }

    fn number(&self, key: &str, got: f64) {
        self.close(key, &[got], &[self.state[key].as_f64().unwrap()], ALGEBRA);
    }

    /// Largest difference over largest entry.
    fn close(&self, key: &str, got: &[f64], want: &[f64], tolerance: f64) {
        assert_eq!(got.len(), want.len(), "{} {key}", self.name);
        let largest = want.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let error = got.iter().zip(want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error <= tolerance * largest, "{} {key}: {error:e} of {largest:e}", self.name);
    }

    /// What solving with M may lose.
    fn solution(&self) -> f64 {
        (SOLUTION * self.state["mass_matrix_condition"].as_f64().unwrap()).max(ALGEBRA)
    }

    fn wrench(&self) -> Force<f64> {
        let w = numbers(&self.state["wrench"]);
        Force::new([w[0], w[1], w[2]].into(), [w[3], w[4], w[5]].into())
    }
}

#[test]
fn every_robot_agrees_with_pinocchio() {
    let Some(folder) = shared() else { return };
    let mut states = 0;
    for path in files(&folder) {
        let (name, file, urdf) = read(&folder, &path);
        let reading = if name.contains("floating") { Reading::Floating } else { Reading::Independent };
        let robot = Robot::new(read_urdf(&urdf, reading), &file);
        for state in file["states"].as_array().unwrap() {
            let comparison = Comparison { robot: &robot, state, name: &name };
            compare_kinematics(&comparison);
            compare_dynamics(&comparison);
            compare_with_wrench_and_armature(&comparison, &numbers(&file["armature"]));
            compare_derivatives(&comparison);
            compare_momentum_and_energy_maps(&comparison);
            states += 1;
        }
    }
    assert_eq!(states, 696, "states compared");
}

#[test]
fn arms_whose_first_axis_is_vertical_have_as_many_base_parameters_as_theory_says() {
    let Some(folder) = shared() else { return };
    // 7 for each turning joint, less 4 for the first, less 2 for an axis along gravity (Gautier & Khalil 1990)
    for (name, count) in [("ur5", 36), ("iiwa14_no_collision", 43)] {
        let (_, _, urdf) = read(&folder, &folder.join(format!("rigid/{name}.json")));
        let model = read_urdf(&urdf, Reading::Independent);
        assert_eq!(base_parameters(&model).groups.len(), count, "{name}");
    }
}

#[test]
fn an_axis_that_is_vertical_to_five_digits_only_has_two_base_parameters_more() {
    let Some(folder) = shared() else { return };
    // the first axis is turned by 3.1416: gravity feels two first moments more by 7 millionths
    let (_, _, urdf) = read(&folder, &folder.join("rigid/kinova_gen3.json"));
    let count = |text: &str| base_parameters(&read_urdf(text, Reading::Independent)).groups.len();
    let first = "rpy=\"3.1416 ";
    assert_eq!(urdf.matches(first).count(), 1);
    assert_eq!(count(&urdf), 45);
    assert_eq!(count(&urdf.replace(first, "rpy=\"3.141592653589793 ")), 43);
}

#[test]
fn joints_that_mimic_others_agree_with_pinocchio() {
    let Some(folder) = shared() else { return };
    let mut states = 0;
    for path in files(&folder) {
        let (name, file, urdf) = read(&folder, &path);
        if file["mimic"].is_null() || name.contains("floating") {
            continue;
        }
        let mut robot = Robot::new(read_urdf(&urdf, Reading::Mimic), &file);
        let independent: Vec<&str> =
            file["mimic"]["independent_joints"].as_array().unwrap().iter().flat_map(Value::as_str).collect();
        for dof in 0..robot.model.nv {
            let name = robot.model.dof_name(dof);
            robot.dof[dof] = independent.iter().position(|n| *n == name).expect("an independent joint");
        }
        for state in file["mimic_states"].as_array().unwrap() {
            compare_mimic(&Comparison { robot: &robot, state, name: &name });
            states += 1;
        }
    }
    assert!(states > 0, "no state with mimic joints was compared");
}

fn compare_kinematics(c: &Comparison) {
    let (m, tool) = (&c.robot.model, c.robot.tool);
    let (q, qd) = (c.get("position", &c.robot.q), c.get("velocity", &c.robot.dof));
    let qdd = c.get("acceleration", &c.robot.dof);
    for (link, frame) in c.state["frames"].as_object().unwrap() {
        let pose = link_pose(m, &q, m.link(link).unwrap());
        let scale = numbers(&frame["position"]).iter().fold(1.0, |s: f64, x| s.max(x.abs()));
        let turn = matrix(&frame["rotation"]);
        for i in 0..3 {
            let row: Vec<f64> = turn.row(i).iter().copied().collect();
            c.close("rotation", &pose.rotation.rows[i].to_array(), &row, ALGEBRA);
        }
        let position = pose.translation.to_array().map(|x| x / scale);
        let want: Vec<f64> = numbers(&frame["position"]).iter().map(|x| x / scale).collect();
        c.close("position", &[position.as_slice(), &[1.0]].concat(), &[&want[..], &[1.0]].concat(), ALGEBRA);
    }
    for (axes, word) in AXES {
        let dof = &c.robot.dof;
        let J = jacobian(m, &q, tool, axes);
        let rate = jacobian_rate(m, &q, &qd, tool, axes);
        let table = |M: &nalgebra::Matrix6xX<f64>| DMatrix::from_column_slice(6, m.nv, M.as_slice());
        c.table(&format!("jacobian_{word}"), &table(&J), None, dof, ALGEBRA);
        c.table(&format!("jacobian_rate_{word}"), &table(&rate), None, dof, ALGEBRA);
        c.motion(&format!("frame_velocity_{word}"), link_velocity(m, &q, &qd, tool, axes));
        let a = link_acceleration(m, &q, &qd, &qdd, tool, axes);
        c.motion(&format!("frame_spatial_acceleration_{word}"), a);
        if axes != Axes::World {
            let a = classical_acceleration(m, &q, &qd, &qdd, tool, axes);
            c.motion(&format!("frame_classical_acceleration_{word}"), a);
        }
    }
    let centre = centre_of_mass(m, &q).to_array();
    c.close("center_of_mass", &centre, &numbers(&c.state["center_of_mass"]), ALGEBRA);
    let J = centre_of_mass_jacobian(m, &q);
    let table = DMatrix::from_column_slice(3, m.nv, J.as_slice());
    c.table("center_of_mass_jacobian", &table, None, &c.robot.dof, ALGEBRA);
}

fn compare_dynamics(c: &Comparison) {
    let (m, dof) = (&c.robot.model, &c.robot.dof[..]);
    let (q, qd) = (c.get("position", &c.robot.q), c.get("velocity", dof));
    let (qdd, tau) = (c.get("acceleration", dof), c.get("torque", dof));
    c.dofs("inverse_dynamics", &inverse_dynamics(m, &q, &qd, &qdd), ALGEBRA);
    c.dofs("nonlinear_torque", &bias(m, &q, &qd), ALGEBRA);
    c.dofs("gravity_torque", &gravity(m, &q), ALGEBRA);
    c.table("mass_matrix", &mass_matrix(m, &q), Some(dof), dof, ALGEBRA);
    let C = coriolis_matrix(m, &q, &qd);
    c.dofs("coriolis_torque", &(&C * DVector::from_row_slice(&qd)), ALGEBRA);
    if m.nq == m.nv {
        // Christoffel's matrix is unique; with a floating base only its product is.
        c.table("coriolis_matrix", &C, Some(dof), dof, ALGEBRA);
    }
    c.dofs("forward_dynamics", &forward_dynamics(m, &q, &qd, &tau), c.solution());
    c.table("inverse_mass_matrix", &inverse_mass_matrix(m, &q), Some(dof), dof, c.solution());
    c.table("torque_regressor", &regressor(m, &q, &qd, &qdd), Some(dof), &c.robot.parameter, ALGEBRA);
    c.number("kinetic_energy", kinetic_energy(m, &q, &qd));
    // U has no scale of its own: g times the total mass times the centre's distance gives one.
    let reach = vector(&c.state["center_of_mass"]).norm() * c.state["total_mass"].as_f64().unwrap() * 9.81;
    let error = potential_energy(m, &q) - c.state["potential_energy"].as_f64().unwrap();
    assert!(error.abs() <= ALGEBRA * reach, "{} potential_energy: {error:e}", c.name);
}

fn compare_with_wrench_and_armature(c: &Comparison, armature: &[f64]) {
    let (m, dof) = (&c.robot.model, &c.robot.dof[..]);
    let (q, qd) = (c.get("position", &c.robot.q), c.get("velocity", dof));
    let (qdd, tau) = (c.get("acceleration", dof), c.get("torque", dof));
    let inertia = inertias(m);
    let armature: Vec<f64> = dof.iter().map(|&i| armature[i]).collect();
    let plain = Bodies::new(m, &inertia);
    let with_armature = Bodies { armature: &armature, ..plain };
    let ws = &mut Scratch::new(m);
    let mut out = DVector::zeros(m.nv);
    inverse_dynamics_with(&with_armature, ws, &q, &qd, &qdd, out.as_mut_slice());
    c.dofs("inverse_dynamics_with_armature", &out, ALGEBRA);
    forward_dynamics_with(&with_armature, ws, &q, &qd, &tau, out.as_mut_slice());
    c.dofs("forward_dynamics_with_armature", &out, c.solution());

    // M q̈ + h = τ + Jᵀ w
    let mut pushed = vec![0.0; m.nv];
    tool_wrench_with(&plain, ws, &q, c.robot.tool, c.wrench(), &mut pushed);
    let needed = inverse_dynamics(m, &q, &qd, &qdd) - DVector::from_row_slice(&pushed);
    c.dofs("inverse_dynamics_with_wrench", &needed, ALGEBRA);
    let total: Vec<f64> = tau.iter().zip(&pushed).map(|(a, b)| a + b).collect();
    c.dofs("forward_dynamics_with_wrench", &forward_dynamics(m, &q, &qd, &total), c.solution());
}

fn compare_momentum_and_energy_maps(c: &Comparison) {
    let (m, dof) = (&c.robot.model, &c.robot.dof[..]);
    let (q, qd) = (c.get("position", &c.robot.q), c.get("velocity", dof));
    let qdd = c.get("acceleration", dof);
    let want = |key: &str| numbers(&c.state[key]);
    let h = centroidal_momentum(m, &q, &qd);
    c.close("centroidal_momentum", &h.to_array(), &want("centroidal_momentum"), ALGEBRA);
    let rate = centroidal_momentum_rate(m, &q, &qd, &qdd);
    c.close("centroidal_momentum_rate", &rate.to_array(), &want("centroidal_momentum_rate"), ALGEBRA);
    let table = |columns: usize, x: &[f64]| DMatrix::from_column_slice(x.len() / columns, columns, x);
    let A = centroidal_momentum_matrix(m, &q);
    c.table("centroidal_momentum_matrix", &table(m.nv, A.as_slice()), None, dof, ALGEBRA);
    let T = kinetic_energy_regressor(m, &q, &qd);
    let U = potential_energy_regressor(m, &q);
    for (key, y) in [("kinetic_energy_regressor", T), ("potential_energy_regressor", U)] {
        if c.state.get(key).is_some() {
            c.close(key, y.as_slice(), &c.get(key, &c.robot.parameter), ALGEBRA);
        }
    }
    if let Some(file) = c.state.get("kinematic_hessian_world_aligned") {
        let H = hessian(m, &q, c.robot.tool, Axes::WorldAligned);
        for (k, H) in H.iter().enumerate() {
            let all = matrix(&file[dof[k]]);
            let want = DMatrix::from_fn(6, m.nv, |i, j| all[(i, dof[j])]);
            let scale = H.amax().max(1.0);
            let error = (table(m.nv, H.as_slice()) - want).amax();
            assert!(error < ALGEBRA * scale, "{} hessian {k}: {error:e}", c.name);
        }
    }
}

fn compare_derivatives(c: &Comparison) {
    let (m, dof) = (&c.robot.model, &c.robot.dof[..]);
    let (q, qd) = (c.get("position", &c.robot.q), c.get("velocity", dof));
    let (qdd, tau) = (c.get("acceleration", dof), c.get("torque", dof));
    let of_torque = inverse_dynamics_derivatives(m, &q, &qd, &qdd);
    c.table("inverse_dynamics_by_position", &of_torque.by_position, Some(dof), dof, DERIVATIVES);
    c.table("inverse_dynamics_by_velocity", &of_torque.by_velocity, Some(dof), dof, DERIVATIVES);
    c.table("mass_matrix", &of_torque.by_acceleration, Some(dof), dof, ALGEBRA);
    let of_motion = forward_dynamics_derivatives(m, &q, &qd, &tau);
    let tolerance = c.solution().max(DERIVATIVES);
    c.table("forward_dynamics_by_position", &of_motion.by_position, Some(dof), dof, tolerance);
    c.table("forward_dynamics_by_velocity", &of_motion.by_velocity, Some(dof), dof, tolerance);
    c.table("inverse_mass_matrix", &of_motion.by_torque, Some(dof), dof, tolerance);
}

fn compare_mimic(c: &Comparison) {
    let (m, dof) = (&c.robot.model, &c.robot.dof[..]);
    let q = c.get("position_of_all_joints", &c.robot.q);
    let (qd, qdd) = (c.get("independent_velocity", dof), c.get("independent_acceleration", dof));
    c.dofs("inverse_dynamics", &inverse_dynamics(m, &q, &qd, &qdd), ALGEBRA);
    c.dofs("nonlinear_torque", &bias(m, &q, &qd), ALGEBRA);
    let M = mass_matrix(m, &q);
    c.table("mass_matrix", &M, Some(dof), dof, ALGEBRA);
    let values = M.symmetric_eigenvalues();
    let tolerance = (SOLUTION * values.max() / values.min()).max(ALGEBRA);
    let tau = c.get("independent_torque", dof);
    c.dofs("forward_dynamics", &forward_dynamics(m, &q, &qd, &tau), tolerance);
}

fn joint_of<'a>(file: &'a Value, name: &str) -> &'a Value {
    file["joints"].as_array().unwrap().iter().find(|j| j["name"] == name).expect("the joint")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> =
        std::fs::read_dir(folder.join("rigid")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn read(folder: &Path, path: &Path) -> (String, Value, String) {
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let urdf = std::fs::read_to_string(folder.join(file["urdf"].as_str().unwrap())).unwrap();
    (path.file_stem().unwrap().to_string_lossy().into_owned(), file, urdf)
}

/// The folder of reference numbers beside the project; none where only the project is.
fn shared() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: the reference numbers are not beside the project");
    None
}
