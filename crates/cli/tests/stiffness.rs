//! `sinew stiffness` and `sinew info`: the objects of the contract, and answers to wrong input.
#![allow(non_snake_case)]

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");

struct Bench {
    dir: PathBuf,
}

impl Bench {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("sinew-stiffness-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("arm.urdf"), URDF).unwrap();
        std::fs::write(dir.join("arm.sinew.toml"), SIDECAR).unwrap();
        Self { dir }
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_sinew")).args(arguments).current_dir(&self.dir).output().unwrap()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.run(&[arguments, &["--json"]].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
        serde_json::from_slice(&output.stdout).expect("one JSON object and nothing else")
    }

    fn text(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    fn refused(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert_eq!(message.matches("error: ").count(), 1, "not one message: {message}");
        assert!(message.contains("help:"), "no way out: {message}");
        message
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
    }
}

fn table(value: &Value) -> Vec<Vec<f64>> {
    let numbers = |row: &Value| row.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    value.as_array().expect("rows").iter().map(numbers).collect()
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn the_object_has_the_keys_and_meanings_of_the_contract() {
    let bench = Bench::new("contract");
    let told = bench.json(&["stiffness", "arm.sinew.toml", "--at", "0.3,-0.5"]);
    assert_eq!(told["link"], "flange");
    assert_eq!(told["frame"], "base axes at the tool point");
    assert_eq!(told["order"], serde_json::json!(["rx", "ry", "rz", "x", "y", "z"]));
    let (J, C) = (table(&told["jacobian"]), table(&told["compliance"]));
    assert_eq!((J.len(), J[0].len(), C.len(), C[0].len()), (6, 2, 6, 6));
    // J K⁻¹ Jᵀ of the sidecar's springs
    let springs = [1800.0, 600.0];
    for i in 0..6 {
        for j in 0..6 {
            let want: f64 = (0..2).map(|k| J[i][k] * J[j][k] / springs[k]).sum();
            assert!((C[i][j] - want).abs() < 1e-15, "{i} {j}");
        }
    }
    assert_eq!((&told["rank"], &told["stiffness"], &told["loaded"]), (&2.into(), &Value::Null, &Value::Null));
    assert_eq!(told["stiff_directions"].as_array().unwrap().len(), 4);
    assert_ne!(told["compliance_with_gravity"], told["compliance"]);
    let weightless =
        bench.json(&["stiffness", "arm.urdf", "--at", "elbow=-0.5,shoulder=0.3", "--no-gravity"]);
    assert_eq!(weightless["compliance"], told["compliance"]);
    // Nothing pulls: both maps agree but for rounding.
    let same = table(&weightless["compliance_with_gravity"]);
    let apart = same.iter().flatten().zip(C.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-15);
}

#[test]
fn a_load_is_answered_with_the_true_and_the_linear_deflection() {
    let bench = Bench::new("load");
    let load = ["--force", "0,0,-80", "--moment=0,5,0"];
    let told = bench.json(&[&["stiffness", "arm.sinew.toml", "--at", "0.3,-0.5"], &load[..]].concat());
    let loaded = &told["loaded"];
    assert_eq!(list(&loaded["load"]), [0.0, 5.0, 0.0, 0.0, 0.0, -80.0]);
    let (C, x) = (table(&told["compliance"]), list(&loaded["linear_deflection"]));
    for (row, x) in C.iter().zip(&x) {
        assert!((row[1] * 5.0 - row[5] * 80.0 - x).abs() < 1e-15);
    }
    let deflection = list(&loaded["deflection"]);
    assert_eq!((deflection.len(), table(&loaded["compliance"]).len()), (6, 6));
    assert!(deflection[5] < 0.0 && (deflection[5] - x[5]).abs() < 0.2 * x[5].abs());
    assert_eq!((&loaded["stiffness"], &loaded["gives_way"]), (&Value::Null, &Value::Null));
    // The same at another link: the elbow's own frame does not feel the elbow's spring.
    let at = ["stiffness", "arm.sinew.toml", "--at", "0.3,-0.5", "--link", "forearm"];
    let forearm = bench.json(&[&at[..], &load[..]].concat());
    assert_eq!(forearm["link"], "forearm");
}

#[test]
fn a_load_that_the_robot_does_not_bear_is_told_and_gets_no_number() {
    let bench = Bench::new("buckling");
    let push = ["stiffness", "arm.urdf", "--at", "0,0", "--force", "-1e5,0,0", "--no-gravity"];
    let told = bench.json(&push);
    let loaded = &told["loaded"];
    assert_eq!((&loaded["deflection"], &loaded["compliance"]), (&Value::Null, &Value::Null));
    assert_eq!(loaded["gives_way"]["kind"], "buckling");
    let share = loaded["gives_way"]["factor"].as_f64().unwrap();
    assert!(share > 0.0 && share < 1.0);
    assert!(bench.text(&push).contains("of the load it buckles"));
}

#[test]
fn the_text_says_what_is_soft_what_is_stiff_and_what_the_load_does() {
    let bench = Bench::new("text");
    let text = bench.text(&["stiffness", "arm.sinew.toml", "--at", "0.3,-0.5", "--force", "0,0,-80"]);
    for words in
        ["softest", "stiffest", "rigid", "Rank 2", "Stiff directions", "linear map", "misses the shift"]
    {
        assert!(text.contains(words), "no {words:?} in:\n{text}");
    }
}

#[test]
fn info_says_the_order_of_the_numbers_and_what_the_robot_is() {
    let bench = Bench::new("info");
    let told = bench.json(&["info", "arm.sinew.toml"]);
    assert_eq!(told["order"], serde_json::json!(["shoulder", "elbow"]));
    assert_eq!((&told["degrees_of_freedom"], &told["tool"]), (&2.into(), &"flange".into()));
    assert_eq!(told["joints"][1]["joint"], "elbow");
    assert_eq!(told["joints"][1]["stiffness"], 600.0);
    assert_eq!(told["joints"][0]["elastic"], true);
    let mass: f64 = told["links"].as_array().unwrap().iter().map(|l| l["mass"].as_f64().unwrap()).sum();
    assert!(told["moving_mass"].as_f64().unwrap() <= mass + 1e-12);
    assert!(told["modes"].as_array().unwrap().len() >= 4, "{told}");
    assert_eq!(told["effects"].as_array().unwrap().len(), 2);
    let text = bench.text(&["info", "arm.sinew.toml"]);
    for words in ["--at \"shoulder,elbow\"", "flange (tool)", "viscous_friction", "modes at rest"] {
        assert!(text.contains(words), "no {words:?} in:\n{text}");
    }
}

#[test]
fn a_scan_has_a_point_for_each_configuration_and_a_path_for_each_row() {
    let bench = Bench::new("scan");
    let scan = [
        "stiffness",
        "arm.sinew.toml",
        "--at",
        "0,0.4",
        "--scan",
        "shoulder=-1..1,elbow=0..2",
        "--steps",
        "4",
    ];
    let told = bench.json(&[&scan[..], &["--force", "0,0,-50"]].concat());
    let points = told["points"].as_array().unwrap();
    assert_eq!((points.len(), &told["order"][5]), (16, &"z".into()));
    // A point is what the command says of that position alone.
    let alone = bench.json(&["stiffness", "arm.sinew.toml", "--at", "-1,2", "--force", "0,0,-50"]);
    assert_eq!(points[3]["q"], serde_json::json!([-1.0, 2.0]));
    assert_eq!(points[3]["deflection"], alone["loaded"]["deflection"]);
    assert!(bench.text(&scan).contains("16 configurations"));
    let rows = "time,joint_position.shoulder,joint_position.elbow\n0,-1,2\n0.1,0,1\n0.2,0.5,0.5\n";
    std::fs::write(bench.dir.join("path.csv"), rows).unwrap();
    let along = bench.json(&["stiffness", "arm.sinew.toml", "--along", "path.csv", "--force", "0,0,-50"]);
    assert_eq!(along["points"].as_array().unwrap().len(), 3);
    assert_eq!(along["points"][0]["deflection"], points[3]["deflection"]);
}

#[test]
fn drawings_are_whole_files() {
    let bench = Bench::new("plot");
    let at = ["stiffness", "arm.sinew.toml", "--at", "0.3,0.4"];
    bench.text(&[&at[..], &["--plot", "ellipse.svg"]].concat());
    bench.text(
        &[&at[..], &["--scan", "shoulder=-1..1,elbow=0..2", "--steps", "5", "--plot", "map.html"]].concat(),
    );
    let read = |name: &str| std::fs::read_to_string(bench.dir.join(name)).unwrap();
    assert!(
        read("ellipse.svg").starts_with("<svg xmlns") && read("ellipse.svg").matches("<polygon").count() == 6
    );
    assert!(
        read("map.html").starts_with("<!doctype html>") && read("map.html").matches("<circle").count() == 25
    );
    let message = bench.refused(&[&at[..], &["--plot", "ellipse.png"]].concat());
    assert!(message.contains(".svg or .html"), "{message}");
}

#[test]
fn wrong_input_is_answered_with_one_message() {
    let bench = Bench::new("wrong");
    let at = ["stiffness", "arm.sinew.toml", "--at", "0,0"];
    std::fs::write(bench.dir.join("degrees.csv"), "time,joint_position.elbow\n0,0\n0.1,1\n0.2,90\n").unwrap();
    for (arguments, words) in [
        (vec!["stiffness", "arm.sinew.toml", "--at", "0"], vec!["1 number for 2 joints", "shoulder, elbow"]),
        (vec!["stiffness", "arm.sinew.toml", "--at", "elbw=1"], vec!["elbw", "did you mean \"elbow\"?"]),
        (vec!["stiffness", "arm.sinew.toml", "--at", "nan,0"], vec!["\"nan\" is not a number"]),
        ([&at[..], &["--link", "flang"]].concat(), vec!["--link", "flang", "did you mean \"flange\"?"]),
        ([&at[..], &["--link", "gripper9"]].concat(), vec!["gripper9", "the links are base"]),
        ([&at[..], &["--force", "1,2"]].concat(), vec!["--force", "got 2 numbers", "allowed 3"]),
        ([&at[..], &["--moment", "0,inf,0"]].concat(), vec!["--moment", "\"inf\"", "finite"]),
        ([&at[..], &["--scan", "elbo=0..1"]].concat(), vec!["--scan", "elbo", "did you mean \"elbow\"?"]),
        ([&at[..], &["--scan", "elbow=0..100"]].concat(), vec!["--scan", "far outside", "angles are in rad"]),
        (
            [&at[..], &["--scan", "elbow=0..1,elbow=0..1"]].concat(),
            vec!["--scan", "\"elbow\" is named twice"],
        ),
        (vec!["stiffness", "arm.sinew.toml", "--at", "elbow=1,elbow=2"], vec!["\"elbow\" is named twice"]),
        ([&at[..], &["--along", "degrees.csv"]].concat(), vec!["degrees at 0.2 s", "\"90\" is far outside"]),
        ([&at[..], &["--along", "gone.csv"]].concat(), vec!["gone.csv"]),
        (vec!["info", "arm.sinew.toml", "--at", "1,2,3"], vec!["3 numbers for 2 joints"]),
        (vec!["stiffness", "leg.urdf", "--at", "0"], vec!["leg.urdf"]),
    ] {
        let message = bench.refused(&arguments);
        for word in words {
            assert!(message.contains(word), "no {word:?} in: {message}");
        }
    }
    let gap = "\n[[effects]]\nkind = \"backlash\"\njoint = \"elbow\"\nhalf_width = 0.001\n";
    std::fs::write(bench.dir.join("arm.sinew.toml"), SIDECAR.to_owned() + gap).unwrap();
    let message = bench.refused(&["stiffness", "arm.sinew.toml", "--at", "0,0", "--no-gravity"]);
    assert!(message.contains("arm.sinew.toml") && message.contains("joint \"elbow\""), "{message}");
}
