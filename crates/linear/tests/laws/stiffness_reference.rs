//! Compliance, tangent compliance and geometric stiffness of three robots by Pinocchio 4.1.0, its loaded equilibria
//! by Newton's method and differences of them.

use std::path::{Path, PathBuf};

use nalgebra::DMatrix;
use serde_json::Value;
use sinew_effects::CATALOGUE;
use sinew_linear::{
    CartesianStiffness, Loaded, UnderLoad, Wrench, cartesian_stiffness, directions, equilibrium_under_load,
    stiffness_of,
};
use sinew_model::{Robot, Vector3};
use sinew_plant::Plant;

/// Sums along a robot's joints and a solution with its springs.
const ALGEBRA: f64 = 1e-11;
/// Newton's equilibria: positions of a few rad are known to 1e-15, displacements are as small as 1e-6.
const EQUILIBRIUM: f64 = 1e-9;
/// The reference's differences of its equilibrium.
const DIFFERENCES: f64 = 1e-9;

struct Reference {
    file: Value,
    robot: Robot,
}

impl Reference {
    fn read(folder: &Path, name: &str) -> Self {
        let text = std::fs::read_to_string(folder.join(format!("stiffness/{name}.json"))).unwrap();
        let file: Value = serde_json::from_str(&text).unwrap();
        let urdf = std::fs::read_to_string(folder.join(file["urdf"].as_str().unwrap())).unwrap();
        let mut model = sinew_urdf::parse_urdf(&urdf, name).unwrap().model;
        // Friction of the URDF does nothing at rest; the sidecar's springs are the file's.
        model.gravity = Vector3::new(0.0, 0.0, -9.81);
        let mut robot = Robot::rigid(model);
        robot.tool = robot.model.link(file["tip"].as_str().unwrap()).unwrap();
        for (name, stiffness) in names(&file["elastic_joints"]).iter().zip(numbers(&file["joint_stiffness"]))
        {
            let dof = robot.model.dof(name).unwrap();
            robot.joints[dof].stiffness = Some(stiffness);
        }
        Self { file, robot }
    }

    fn plant(&self, with_gravity: bool) -> Plant {
        let mut robot = self.robot.clone();
        if !with_gravity {
            robot.model.gravity = Vector3::ZERO;
        }
        Plant::new(&robot, &CATALOGUE).unwrap()
    }

    // A position of the file, locked joints included.
    fn position(&self, value: &Value) -> Vec<f64> {
        let model = &self.robot.model;
        let mut q = vec![0.0; model.nv];
        for (name, x) in names(&self.file["elastic_joints"]).iter().zip(numbers(value)) {
            q[model.dof(name).unwrap()] = x;
        }
        for (name, x) in self.file["locked_joints"].as_object().unwrap() {
            if let Some(dof) = model.dof(name) {
                q[dof] = x.as_f64().unwrap();
            }
        }
        q
    }

    fn unloaded(&self, plant: &Plant, q: &[f64]) -> CartesianStiffness {
        let told = cartesian_stiffness(plant, &plant.parameters(), q, self.robot.tool).unwrap();
        let joints: Vec<String> =
            names(&self.file["elastic_joints"]).iter().map(|j| format!("q.{j}")).collect();
        assert_eq!(told.coordinates, joints);
        told
    }
}

fn names(value: &Value) -> Vec<String> {
    value.as_array().unwrap().iter().map(|x| x.as_str().unwrap().to_owned()).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Compares a matrix with rows of a file, by the largest entry of the whole.
fn near(what: &str, ours: &[f64], rows: usize, theirs: &Value, tolerance: f64) {
    let theirs: Vec<f64> = match &theirs[0] {
        Value::Array(_) => theirs.as_array().unwrap().iter().flat_map(numbers).collect(),
        _ => numbers(theirs),
    };
    // Ours stands by columns, theirs by rows.
    let ours = DMatrix::from_column_slice(rows, ours.len() / rows, ours);
    let theirs = DMatrix::from_row_slice(rows, theirs.len() / rows, &theirs);
    let scale = theirs.amax();
    let error = (&ours - &theirs).amax();
    assert!(error <= tolerance * scale, "{what}: {error:e} of {scale:e}");
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

const ROBOTS: [&str; 3] = ["planar_2r", "ur10e", "panda"];

#[test]
fn compliances_agree_and_stiffness_is_told_where_there_is_one() {
    let Some(folder) = shared() else { return };
    for name in ROBOTS {
        let reference = Reference::read(&folder, name);
        let plant = reference.plant(true);
        for state in reference.file["unloaded"].as_array().unwrap() {
            let told = reference.unloaded(&plant, &reference.position(&state["position"]));
            near("jacobian", told.jacobian.as_slice(), 6, &state["jacobian"], ALGEBRA);
            near("compliance", told.compliance.as_slice(), 6, &state["compliance"], ALGEBRA);
            let n = told.elastic.len();
            let slope = told.gravity_stiffness.as_slice();
            near("gravity stiffness", slope, n, &state["gravity_stiffness"], ALGEBRA);
            let parts = directions(&told.compliance);
            assert_eq!(parts.rank as u64, state["rank"].as_u64().unwrap(), "{name}");
            match stiffness_of(&told.compliance) {
                Some(K) => {
                    let condition = state["compliance_condition"].as_f64().unwrap();
                    near("stiffness", K.as_slice(), 6, &state["stiffness"], 1e-15 * condition + ALGEBRA);
                }
                None => assert!(state.get("stiffness").is_none(), "{name}"),
            }
            // Stiff directions move nothing.
            assert_eq!(parts.stiff.len(), 6 - parts.rank);
            for w in &parts.stiff {
                assert!((told.compliance * w).amax() <= 1e-9 * told.compliance.amax() * w.amax());
            }
        }
    }
}

#[test]
fn loaded_equilibria_and_their_tangents_agree() {
    let Some(folder) = shared() else { return };
    for name in ROBOTS {
        let reference = Reference::read(&folder, name);
        let mut worst_classical = 0.0_f64;
        for with_gravity in [false, true] {
            let plant = reference.plant(with_gravity);
            let states = reference.file["loaded"].as_array().unwrap();
            for state in states.iter().filter(|s| s["with_gravity"] == with_gravity) {
                let q = reference.position(&state["unloaded_position"]);
                let unloaded = reference.unloaded(&plant, &q);
                let load = Wrench::from_vec(numbers(&state["wrench"]));
                let outcome = equilibrium_under_load(
                    &plant,
                    &plant.parameters(),
                    &unloaded,
                    reference.robot.tool,
                    &load,
                );
                let UnderLoad::Holds(told) = outcome.unwrap() else { panic!("{name}: it bears {load:?}") };
                compare_loaded(&unloaded, &told, state);
                let C = told.compliance;
                worst_classical = worst_classical.max((told.classical_compliance - C).amax() / C.amax());
            }
        }
        // What leaving the geometric term and gravity out costs there.
        assert!(worst_classical > 0.05, "{name}: {worst_classical}");
    }
}

fn compare_loaded(unloaded: &CartesianStiffness, told: &Loaded, state: &Value) {
    let n = unloaded.elastic.len();
    let picked: Vec<f64> = unloaded.elastic.iter().map(|&dof| told.q[dof]).collect();
    near("position", &picked, n, &state["position"], 1e-13);
    near("displacement", told.deflection.as_slice(), 6, &state["displacement"], EQUILIBRIUM);
    near("linear", (unloaded.compliance * told.load).as_slice(), 6, &state["linear"], ALGEBRA);
    near("K_G", told.geometric_stiffness.as_slice(), n, &state["K_G"], ALGEBRA);
    near("compliance", told.compliance.as_slice(), 6, &state["tangent_compliance"], ALGEBRA);
    let differences = &state["tangent_compliance_by_differences"];
    near("by differences", told.compliance.as_slice(), 6, differences, DIFFERENCES);
    near("classical", told.classical_compliance.as_slice(), 6, &state["classical_compliance"], ALGEBRA);
    if let Some(theirs) = state.get("tangent_stiffness") {
        let K = stiffness_of(&told.compliance).expect("rank 6");
        near("stiffness", K.as_slice(), 6, theirs, EQUILIBRIUM);
    }
}
