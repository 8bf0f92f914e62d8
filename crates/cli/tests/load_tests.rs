//! `sinew stiffness --measured`: springs out of load tests, and answers to wrong tables.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");
// Of the sidecar, N·m/rad.
const SPRINGS: [f64; 2] = [1800.0, 600.0];
// A table of load tests as `gzip -n` packs it.
const PACKED: &[u8] = b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x2b\xc9\xcf\xcf\x89O\xcb\x2fJN\xd5\xab\xd2\x29\x01q\x8a32\xd3J\xf4\xaa\xb8t\x0d\x0dtt\x0d\xf4\x0c\x0c\x8c\xb9t\x8d\xa0L3\x2e\x5d\x13\x08\xd3\xd0\x88\x0b\x00\x0d\xd3\xf7\xa9\x3b\x00\x00\x00";

struct Bench {
    dir: PathBuf,
}

impl Bench {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("sinew-loads-{}-{name}", std::process::id()));
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

    fn refused(&self, table: &str, more: &[&str]) -> String {
        std::fs::write(self.dir.join("loads.csv"), table).unwrap();
        let fit = ["stiffness", "arm.sinew.toml", "--measured", "loads.csv"];
        let output = self.run(&[&fit[..], more].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{table}: {message}");
        assert!(output.stdout.is_empty() && message.contains("help:"), "{message}");
        message
    }

    // What the robot of the sidecar does under loads, moved up and down by `noise` m in turn.
    fn tests(&self, noise: f64) -> String {
        let mut table = "joint_position.shoulder,joint_position.elbow,tool_force.x,tool_force.z,tool_shift.x,tool_shift.z\n".to_owned();
        for (k, (q, force)) in [
            ([0.3, -0.5], [0.0, -80.0]),
            ([0.3, -0.5], [60.0, 0.0]),
            ([0.8, -1.2], [0.0, -80.0]),
            ([0.8, 0.9], [40.0, 50.0]),
        ]
        .into_iter()
        .enumerate()
        {
            let (at, load) = (format!("{},{}", q[0], q[1]), format!("{},0,{}", force[0], force[1]));
            let told = self.json(&["stiffness", "arm.sinew.toml", "--at", &at, "--force", &load]);
            let shift = |k: usize| told["loaded"]["deflection"][k].as_f64().unwrap();
            let moved = if k % 2 == 0 { noise } else { -noise };
            let _ = writeln!(
                table,
                "{at},{},{},{},{}",
                force[0],
                force[1],
                shift(3) + moved,
                if k == 1 { String::new() } else { (shift(5) - moved).to_string() }
            );
        }
        table
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
    }
}

#[test]
fn load_tests_give_back_the_springs_of_the_sidecar_with_their_exactness() {
    let bench = Bench::new("springs");
    std::fs::write(bench.dir.join("loads.csv"), bench.tests(0.0)).unwrap();
    let fit = ["stiffness", "arm.sinew.toml", "--measured", "loads.csv"];
    let told = bench.json(&fit);
    // One shift was left empty, and so was not measured.
    assert_eq!((&told["tests"], &told["components"], &told["freedom"]), (&4.into(), &7.into(), &5.into()));
    for (k, spring) in SPRINGS.into_iter().enumerate() {
        let joint = &told["joints"][k];
        assert!((joint["stiffness"].as_f64().unwrap() / spring - 1.0).abs() < 1e-6, "{joint}");
        assert_eq!(joint["stated_stiffness"].as_f64(), Some(spring));
        assert_eq!(joint["excited"], true);
    }
    assert!(told["condition"].as_f64().unwrap() < 20.0, "{told}");
    // Deviations from the scatter and stated ones agree where the statement is true.
    std::fs::write(bench.dir.join("loads.csv"), bench.tests(1e-5)).unwrap();
    let (scatter, stated) = (bench.json(&fit), bench.json(&[&fit[..], &["--shift-std", "1e-5"]].concat()));
    for (k, spring) in SPRINGS.into_iter().enumerate() {
        for told in [&scatter, &stated] {
            let joint = &told["joints"][k];
            let (value, std) =
                (joint["stiffness"].as_f64().unwrap(), joint["stiffness_std"].as_f64().unwrap());
            assert!((value - spring).abs() < 4.0 * std && std < 0.05 * spring, "{joint}");
        }
    }
    assert_eq!(scatter["residual"], Value::Null);
    assert!((0.3..2.0).contains(&stated["residual"].as_f64().unwrap()), "{stated}");
    // A joint that is not asked for counts as rigid.
    let one = bench.json(&[&fit[..], &["--joints", "elbow"]].concat());
    assert_eq!(one["joints"].as_array().unwrap().len(), 1);
}

#[test]
fn a_joint_that_no_test_shows_gets_no_number() {
    let bench = Bench::new("hidden");
    // A force along the line from the shoulder turns nothing there.
    let table = "tool_moment.y,tool_turn.y\n0.5,\n2.0,1e-3\n";
    std::fs::write(bench.dir.join("loads.csv"), table).unwrap();
    let told = bench.json(&["stiffness", "arm.sinew.toml", "--measured", "loads.csv"]);
    assert_eq!(told["condition"], Value::Null);
    for joint in told["joints"].as_array().unwrap() {
        assert_eq!((&joint["excited"], &joint["stiffness"]), (&false.into(), &Value::Null));
    }
    let output = bench.run(&["stiffness", "arm.sinew.toml", "--measured", "loads.csv"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("no test shows it") && text.contains("Not every joint is shown"), "{text}");
    // One component and one joint: a value, and nothing that tells how exact it is.
    let told = bench.json(&["stiffness", "arm.sinew.toml", "--measured", "loads.csv", "--joints", "elbow"]);
    assert!(told["joints"][0]["stiffness"].as_f64().is_some());
    assert_eq!(told["joints"][0]["stiffness_std"], Value::Null);
}

#[test]
fn deflections_that_no_spring_explains_are_told_and_not_called_rigid() {
    let bench = Bench::new("doubt");
    let fit = |table: &str, joints: &str| {
        std::fs::write(bench.dir.join("loads.csv"), table).unwrap();
        let verb = ["stiffness", "arm.sinew.toml", "--measured", "loads.csv", "--joints", joints];
        let text = String::from_utf8(bench.run(&verb).stdout).unwrap();
        (bench.json(&verb), text)
    };
    // The tool rises under a load that pulls it down.
    let (told, text) = fit("tool_force.z,tool_shift.z\n-10,0.003\n-20,0.006\n-40,0.012\n", "elbow");
    assert_eq!(told["joints"][0]["evidence"], "impossible");
    assert!(
        told["notes"][0].as_str().unwrap().contains("loads.csv: the link moves against its loads"),
        "{told}"
    );
    assert!(text.contains("impossible: it moves against its load") && !text.contains("rigid:"), "{text}");
    let (told, _) = fit("tool_force.z,tool_shift.z\n-10,0.003\n-20,0.006\n-40,0.012\n", "shoulder,elbow");
    let notes = told["notes"].as_array().unwrap();
    assert!(notes.len() == 1 && notes[0].as_str().unwrap().contains("(they do -0.63 J in all)"), "{told}");
    // One force in one position hardly tells the joints apart.
    let (told, text) =
        fit("tool_force.z,tool_shift.z\n-10,-0.003\n-20,-0.006\n-40,-0.012\n", "shoulder,elbow");
    for joint in told["joints"].as_array().unwrap() {
        assert_eq!((&joint["evidence"], &joint["stiffness"]), (&"undetermined".into(), &Value::Null));
        assert!(joint["stiffness_at_least"].as_f64().unwrap() > 0.0);
    }
    assert_eq!(told["notes"], serde_json::json!([]));
    assert!(text.contains("undetermined by these loads: K is above"), "{text}");
    // Shifts in mm.
    let (told, text) = fit("tool_force.z,tool_shift.z\n-10,-3\n-20,-6\n-40,-12\n", "elbow");
    assert!(told["notes"][0].as_str().unwrap().contains("a shift of 12 m"), "{told}");
    assert!(text.contains("shifts are in m"), "{text}");
}

#[test]
fn packed_tables_are_read_as_plain_ones() {
    let bench = Bench::new("packed");
    std::fs::write(bench.dir.join("loads.csv.gz"), PACKED).unwrap();
    std::fs::write(
        bench.dir.join("loads.csv"),
        "tool_force.z,tool_shift.z\n-10,-0.003\n-20,-0.006\n-40,-0.012\n",
    )
    .unwrap();
    let fit =
        |file: &str| bench.json(&["stiffness", "arm.sinew.toml", "--measured", file, "--joints", "elbow"]);
    assert_eq!(fit("loads.csv.gz"), fit("loads.csv"));
}

#[test]
fn wrong_tables_are_answered_with_line_column_and_a_way_out() {
    let bench = Bench::new("wrong");
    let good = "tool_force.z,tool_shift.z\n-80,-1e-3\n";
    for (table, more, words) in [
        (
            "tool_force.z,tool_shift.z\n-80,nan\n",
            &[][..],
            &["loads.csv:2", "\"tool_shift.z\" is \"nan\""][..],
        ),
        ("tool_force.z,tool_shift.z\n,-1e-3\n", &[], &["loads.csv:2", "\"tool_force.z\" is \"\""]),
        ("tool_force.z,tool_shift.z\n-80,1e-3,4\n", &[], &["loads.csv:2", "cannot be read"]),
        (
            "tool_force.z,tool_shft.z\n-80,1e-3\n",
            &[],
            &["loads.csv:1", "tool_shft.z", "did you mean \"tool_shift.z\"?"],
        ),
        ("tool_force.z,tool_force.z,tool_shift.z\n1,1,1\n", &[], &["loads.csv:1", "stands there twice"]),
        ("joint_position.elbow,tool_force.z\n0,-80\n", &[], &["loads.csv:1", "no column of a deflection"]),
        ("joint_position.elbow,tool_shift.z\n0,-80\n", &[], &["loads.csv:1", "no column of a load"]),
        (
            "joint_position.elbo,tool_force.z,tool_shift.z\n0,1,1\n",
            &[],
            &["did you mean \"joint_position.elbow\"?"],
        ),
        ("tool_force.z,tool_shift.z\n", &[], &["no load test in it"]),
        ("tool_force.z,tool_shift.z\n-80,\n", &[], &["no component of a deflection"]),
        ("tool_force.z,tool_shift.z,tool_turn.y\n-80,1e-3,1e-3\n", &[], &["--shift-std", "--turn-std"]),
        (good, &["--shift-std", "0"], &["--shift-std", "allowed > 0"]),
        (good, &["--joints", "elbo"], &["--joints", "did you mean \"elbow\"?"]),
        (good, &["--joints", "elbow,elbow"], &["stands there twice"]),
    ] {
        let message = bench.refused(table, more);
        for word in words {
            assert!(message.contains(word), "no {word:?} in: {message}");
        }
    }
    let gone = bench.run(&["stiffness", "arm.sinew.toml", "--measured", "gone.csv"]);
    let message = String::from_utf8(gone.stderr).unwrap();
    assert!(gone.status.code() == Some(2) && message.contains("gone.csv: no such file"), "{message}");
    // Links that bend are not in the fit.
    let bending = "\n[links.forearm.bending]\nlength = 0.3\nEI = 900.0\naxes = [\"y\"]\n";
    std::fs::write(bench.dir.join("arm.sinew.toml"), SIDECAR.to_owned() + bending).unwrap();
    let message = bench.refused(good, &[]);
    assert!(message.contains("link \"forearm\" bends"), "{message}");
}
