//! Robots as the world publishes them: the URDF collection beside the repository, where it is there.

mod difference;

use std::path::{Path, PathBuf};

use difference::difference;
use sinew_urdf::{Severity, UrdfError, UrdfModel, parse_urdf, read_robot, read_urdf, write_urdf};

/// File, degrees of freedom without mimic, total mass in kg; from the collection's own table, made with Pinocchio.
const TABLE: [(&str, usize, f64); 32] = [
    ("ur5", 6, 21.0),
    ("ur10", 6, 32.7),
    ("ur3", 6, 10.6),
    ("panda", 9, 17.5),
    ("anymal_b", 12, 30.5),
    ("anymal_c", 12, 52.1),
    ("talos_full", 44, 93.3),
    ("talos_left_arm", 7, 9.5),
    ("tiago", 48, 65.9),
    ("baxter", 19, 137.3),
    ("icub", 32, 28.3),
    ("kinova_j2s6s200", 6, 4.8),
    ("xarm7", 7, 11.3),
    ("solo12", 12, 2.5),
    ("unitree_z1", 7, 5.2),
    ("unitree_go2", 12, 16.1),
    ("unitree_g1_29dof", 29, 33.3),
    ("hyq", 12, 86.8),
    ("so101", 6, 0.6),
    ("iiwa14_no_collision", 7, 30.6),
    ("j2s7s300_arm", 7, 4.5),
    ("cassie_v4_leaf_springs", 16, 34.7),
    ("kr120r2500pro", 6, 14.0),
    ("kr16_2", 6, 14.0),
    ("kr210l150", 6, 4879.3),
    ("ur10e", 6, 32.7),
    ("staubli_tx40_mdh", 6, 27.2),
    ("kuka_lwr4", 7, 16.0),
    ("kuka_lbr_med7dock", 7, 25.8),
    ("kuka_kr300_r2500_from_dh", 6, 1064.8),
    ("hilti_trailblazer", 9, 530.8),
    ("kinova_gen3", 7, 7.0),
];

/// The table prints one decimal.
const PRINTED: f64 = 0.05 + 1e-9;

/// The folder of the data sets, or none with a word about it.
fn data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if folder.join("urdf").is_dir() {
        return Some(folder);
    }
    println!("skipped: no {}", folder.display());
    None
}

fn robot(folder: &Path, name: &str) -> UrdfModel {
    read_urdf(&folder.join("urdf").join(format!("{name}.urdf"))).unwrap_or_else(|e| panic!("{e}"))
}

fn notes(model: &UrdfModel, severity: Severity, words: &str) -> usize {
    model.notes.iter().filter(|n| n.severity == severity && n.statement.contains(words)).count()
}

#[test]
fn degrees_of_freedom_and_masses_are_those_of_the_table() {
    let Some(folder) = data() else { return };
    for (name, freedom, mass) in TABLE {
        let model = robot(&folder, name).model;
        let joints: usize = model.joints.iter().map(|j| j.kind.nv()).sum();
        let total: f64 = model.links.iter().map(|l| l.inertia.mass).sum();
        assert_eq!(joints, freedom, "{name}");
        assert!((total - mass).abs() <= PRINTED, "{name}: {total} kg, {mass} kg in the table");
    }
}

#[test]
fn every_robot_is_read_or_refused_for_a_singular_mass_matrix() {
    let Some(folder) = data() else { return };
    let singular = ["staubli_tx40_mdh.urdf", "kuka_kr300_r2500_from_dh.urdf", "kr300_from_dh.urdf"];
    for part in ["urdf", "ur10e_mamedov2020", "kuka_kr300_weigand2021", "panda_gaz2019"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "urdf") {
                continue;
            }
            let name = path.file_name().unwrap().to_str().unwrap();
            match read_robot(&path) {
                Ok(_) => assert!(!singular.contains(&name), "{name}"),
                Err(UrdfError::Singular { .. }) => assert!(singular.contains(&name), "{name}"),
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn placeholder_inertias_and_absurd_masses_are_warned_of() {
    let Some(folder) = data() else { return };
    for (name, ..) in TABLE {
        let model = robot(&folder, name);
        let placeholders = usize::from(matches!(name, "kr16_2" | "kr120r2500pro"));
        let heavy = usize::from(matches!(name, "kr210l150" | "kuka_kr300_r2500_from_dh"));
        let impossible = if name == "kinova_gen3" { 2 } else { 0 };
        assert_eq!(notes(&model, Severity::Warning, "placeholders"), placeholders, "{name}");
        assert_eq!(notes(&model, Severity::Warning, "the links weigh"), heavy, "{name}");
        assert_eq!(notes(&model, Severity::Warning, "impossible inertia"), impossible, "{name}");
    }
}

#[test]
fn the_known_pitfalls_are_noted_and_survived() {
    let Some(folder) = data() else { return };
    let count = |name, words| notes(&robot(&folder, name), Severity::Note, words);
    assert_eq!(count("kuka_lwr4", "a second <origin> is ignored"), 1);
    assert_eq!(count("kinova_gen3", "without lower and upper limit"), 4);
    assert_eq!(count("talos_left_arm", "fixed, yet it mimics"), 6);
    assert_eq!(count("icub", "mass but no inertia"), 10);
    assert_eq!(count("hyq", "impossible inertia"), 4);
    // A follower has no coordinate of its own, wherever its leader stands in the file.
    for (name, nv) in [("hilti_trailblazer", 7), ("talos_full", 32), ("panda", 8), ("baxter", 17)] {
        assert_eq!(robot(&folder, name).model.nv, nv, "{name}");
    }
    let free = robot(&folder, "kinova_gen3").model;
    assert_eq!(free.joints[0].limits.lower, f64::NEG_INFINITY);
    assert_eq!(robot(&folder, "kinova_gen3").model.links[0].name, "world");
}

#[test]
fn a_robot_written_as_urdf_reads_back_to_the_same_model() {
    let Some(folder) = data() else { return };
    for (name, ..) in TABLE {
        let model = robot(&folder, name).model;
        let text = write_urdf(&model);
        let back = parse_urdf(&text, name).unwrap_or_else(|e| panic!("{e}")).model;
        let worst = difference(&model, &back);
        assert!(worst < 1e-12, "{name}: {worst}");
    }
}
