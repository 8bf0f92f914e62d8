//! Bad input: exit status 2 and one message that a user can act on; never a panic.

use std::path::PathBuf;
use std::process::{Command, Output};

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");

/// A folder with a good robot and a good run, gone when the test ends.
struct Bench {
    dir: PathBuf,
}

impl Bench {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("sinew-bad-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let bench = Self { dir };
        bench.write("arm.urdf", URDF);
        bench.write("arm.sinew.toml", SIDECAR);
        bench.write("run.csv", &csv(|_, row| Some(row)));
        bench
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.dir.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_sinew")).args(arguments).current_dir(&self.dir).output().unwrap()
    }

    /// Runs a command that must be refused, and gives back its one message.
    fn refused(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert_eq!(message.matches("error: ").count(), 1, "not one message: {message}");
        assert!(message.contains("help:"), "no way out: {message}");
        assert!(!message.contains("panicked") && !message.contains("internal error"), "{message}");
        message
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
    }
}

const COLUMNS: &str =
    "time,motor_position.shoulder,motor_torque.shoulder,motor_position.elbow,motor_torque.elbow";

// A good log whose lines `edit` may change or drop; line 1 is the header.
fn csv(edit: impl Fn(usize, String) -> Option<String>) -> String {
    let row = |k: usize| {
        let t = k as f64 * 0.01;
        format!("{t},{},{},{},{}", (t * 2.0).sin(), 30.0 - t, t.cos(), 5.0 + t)
    };
    let lines = std::iter::once(COLUMNS.to_owned()).chain((0..600).map(row));
    let kept = lines.enumerate().filter_map(|(k, line)| edit(k + 1, line));
    kept.map(|line| line + "\n").collect()
}

fn run_is_refused(name: &str, text: &str, must_say: &[&str]) {
    let bench = Bench::new(name);
    bench.write("run.csv", text);
    for verb in ["check", "compare"] {
        let message = bench.refused(&[verb, "arm.sinew.toml", "run.csv"]);
        for word in must_say {
            assert!(message.contains(word), "{verb}: no {word:?} in: {message}");
        }
    }
}

fn robot_is_refused(name: &str, file: &str, text: &str, must_say: &[&str]) {
    let bench = Bench::new(name);
    bench.write(file, text);
    let message = bench.refused(&["check", "arm.sinew.toml"]);
    for word in must_say {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn good_input_is_accepted() {
    let bench = Bench::new("good");
    let output = bench.run(&["check", "arm.sinew.toml", "run.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn a_missing_file_is_named() {
    let bench = Bench::new("missing");
    assert!(bench.refused(&["check", "leg.urdf"]).contains("leg.urdf"));
    assert!(bench.refused(&["check", "arm.urdf", "gone.csv"]).contains("gone.csv"));
    assert!(bench.refused(&["check", "arm.urdf", "run.csv", "--columns", "map.toml"]).contains("map.toml"));
}

#[test]
fn a_malformed_urdf_is_answered_with_its_line() {
    robot_is_refused("xml", "arm.urdf", &URDF.replace("</robot>", ""), &["arm.urdf:", "XML"]);
}

#[test]
fn a_urdf_without_inertia_is_refused() {
    let robot = "<robot name=\"arm\"><link name=\"base\"/><link name=\"upper_arm\"/><link name=\"forearm\"/><link name=\"flange\"/>";
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    let joints = joint("shoulder", "base", "upper_arm")
        + &joint("elbow", "upper_arm", "forearm")
        + &joint("wrist", "forearm", "flange");
    robot_is_refused("inertia", "arm.urdf", &format!("{robot}{joints}</robot>"), &["inertial"]);
}

#[test]
fn an_unknown_joint_is_answered_with_the_nearest_one() {
    let text = SIDECAR.replace("[joints.elbow]", "[joints.elbw]");
    robot_is_refused(
        "joint",
        "arm.sinew.toml",
        &text,
        &["arm.sinew.toml:", "elbw", "did you mean \"elbow\"?"],
    );
}

#[test]
fn an_unknown_key_is_answered_with_the_nearest_one() {
    let text = SIDECAR.replace("rotor_inertia = 0.16", "rotor_inerta = 0.16");
    robot_is_refused("key", "arm.sinew.toml", &text, &["rotor_inerta", "did you mean \"rotor_inertia\"?"]);
}

#[test]
fn an_unknown_effect_or_parameter_is_answered_with_its_line() {
    let text = SIDECAR.replace("kind = \"viscous_friction\"", "kind = \"viscous_fricton\"");
    robot_is_refused(
        "kind",
        "arm.sinew.toml",
        &text,
        &["arm.sinew.toml:", "did you mean \"viscous_friction\"?"],
    );
    let text = SIDECAR.replace("viscous = 0.8", "viscos = 0.8");
    robot_is_refused("parameter", "arm.sinew.toml", &text, &["viscos", "did you mean \"viscous\"?"]);
}

#[test]
fn a_missing_column_is_answered_with_the_headers() {
    let bench = Bench::new("column");
    bench.write("map.toml", "time = { column = \"time\" }\n\"motor_position.elbow\" = { column = \"q2\" }\n");
    let message = bench.refused(&["compare", "arm.urdf", "run.csv", "--columns", "map.toml"]);
    assert!(message.contains("q2") && message.contains("motor_position.shoulder"), "{message}");
    let bench = Bench::new("position");
    bench.write("run.csv", &csv(|_, line| Some(line)).replace("motor_position", "temperature"));
    let message = bench.refused(&["compare", "arm.sinew.toml", "run.csv"]);
    assert!(message.contains("position"), "{message}");
}

#[test]
fn a_joint_that_was_not_measured_is_told_by_every_command() {
    let bench = Bench::new("no");
    let without =
        csv(|_, line| Some(line.rsplit_once(',').unwrap().0.rsplit_once(',').unwrap().0.to_owned()));
    bench.write("run.csv", &without);
    let output = bench.run(&["check", "arm.sinew.toml", "run.csv"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("warning: run: no position of joint \"elbow\": the other commands take"), "{said}");
    let output = bench.run(&["compare", "arm.sinew.toml", "run.csv"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("no position of joint \"elbow\" in the runs: taken as held at zero"), "{said}");
}

#[test]
fn text_in_a_number_is_answered_with_row_and_column() {
    let text = csv(|k, line| Some(if k == 7 { line.replacen("0.05,", "0.05,x", 1) } else { line }));
    run_is_refused("text", &text, &["run.csv:7", "motor_position.shoulder"]);
}

#[test]
fn a_value_that_is_not_finite_is_answered_with_row_and_column() {
    let text =
        csv(|k, line| Some(if k == 9 { line.rsplit_once(',').unwrap().0.to_owned() + ",NaN" } else { line }));
    run_is_refused("nan", &text, &["run.csv:9", "motor_torque.elbow", "not finite"]);
}

#[test]
fn time_running_backwards_is_answered_with_its_row() {
    let text = csv(|k, line| Some(if k == 20 { line.replacen("0.18,", "0.08,", 1) } else { line }));
    run_is_refused("backwards", &text, &["run.csv:20", "backwards"]);
}

#[test]
fn an_empty_file_is_refused() {
    run_is_refused("empty", "", &["run.csv", "empty"]);
}

#[test]
fn one_row_is_no_run() {
    run_is_refused("row", &csv(|k, line| (k <= 2).then_some(line)), &["run.csv", "too few samples (got 1"]);
}

#[test]
fn a_window_outside_the_run_is_refused() {
    assert!(
        Bench::new("window").refused(&["compare", "arm.urdf", "run.csv@50..60"]).contains("window 50..60")
    );
}

#[test]
fn too_little_to_compare_is_refused() {
    let bench = Bench::new("little");
    let message = bench.refused(&["compare", "arm.urdf", "run.csv@0..2"]);
    assert!(message.contains("too short"), "{message}");
    let at_rest = csv(|k, line| {
        let time = line.split(',').next().unwrap_or_default().to_owned();
        Some(if k == 1 { line } else { time + ",0.1,30,0.2,5" })
    });
    bench.write("run.csv", &at_rest);
    let message = bench.refused(&["compare", "arm.urdf", "run.csv", "--force"]);
    assert!(message.contains("nothing moves"), "{message}");
}

#[test]
fn an_effect_that_cannot_be_added_is_refused_and_nothing_is_written() {
    let bench = Bench::new("add");
    for (effect, word) in [
        ("coulomb@elbow", "no effect of the catalogue"),
        ("coulomb_friction@wrist", "wrist"),
        ("coulomb_friction", "acts at a joint"),
        ("viscous_friction@elbow", "already"),
    ] {
        let message = bench.refused(&["add", "arm.sinew.toml", effect, "-o", "new.sinew.toml"]);
        assert!(message.contains(word), "no {word:?} in: {message}");
        assert!(!bench.dir.join("new.sinew.toml").exists());
    }
    let message = bench.refused(&["add", "arm.urdf", "payload", "-o", "new.urdf"]);
    assert!(message.contains(".sinew.toml"), "{message}");
}

#[test]
fn a_check_of_several_runs_tells_what_each_of_them_lacks() {
    let bench = Bench::new("check_each");
    bench.write("short.csv", "time,motor_position.elbow\n0,1\n");
    let output = bench.run(&["check", "arm.sinew.toml", "short.csv", "run.csv", "absent.csv"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text.contains("error: short.csv: too few samples") && text.contains("absent.csv"), "{text}");
    assert!(text.contains("not usable"), "{text}");
}

#[test]
fn a_check_run_that_lacks_a_column_is_refused_by_its_name() {
    let bench = Bench::new("check-lacks");
    for (lost, column) in [(3, "motor_torque.shoulder"), (4, "motor_position.elbow")] {
        let without = |_, row: String| {
            let fields = row.split(',').enumerate().filter(|(k, _)| k + 1 != lost);
            Some(fields.map(|(_, field)| field).collect::<Vec<_>>().join(","))
        };
        bench.write("unseen.csv", &csv(without));
        let message = bench.refused(&[
            "fit",
            "arm.sinew.toml",
            "run.csv",
            "--check",
            "unseen.csv",
            "--force",
            "-o",
            "o.toml",
        ]);
        assert!(message.contains(&format!("unseen: no {column}")), "{message}");
    }
}

#[test]
fn a_run_that_is_named_twice_is_refused() {
    let bench = Bench::new("twice");
    for verb in ["check", "compare", "diagnose"] {
        let message = bench.refused(&[verb, "arm.sinew.toml", "run.csv", "run.csv"]);
        assert!(message.contains("run.csv: is named twice"), "{message}");
    }
}

#[test]
fn an_output_that_is_a_folder_is_refused_before_the_search() {
    let bench = Bench::new("folder");
    bench.write("new.sinew.toml/note.txt", "");
    let said = bench.refused(&["discover", "arm.sinew.toml", "run.csv", "-o", "new.sinew.toml"]);
    assert!(said.contains("new.sinew.toml") && said.contains("is a folder"), "{said}");
    assert!(!said.contains("searching"), "{said}");
}

#[test]
fn arguments_in_each_others_place_are_told_as_such() {
    let bench = Bench::new("swapped");
    assert!(
        bench.refused(&["compare", "run.csv", "arm.sinew.toml"]).contains("run.csv: is a run, and a robot")
    );
    assert!(bench.refused(&["compare", "arm.urdf", "arm.sinew.toml"]).contains("is a robot, and a run"));
}

#[test]
fn a_robot_without_a_joint_that_moves_is_not_usable() {
    let bench = Bench::new("fixed");
    bench.write("fixed.urdf", &URDF.replace("type=\"revolute\"", "type=\"fixed\""));
    let output = bench.run(&["check", "fixed.urdf", "run.csv"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("robot \"arm\" has no joint that moves"), "{text}");
}

#[test]
fn an_episode_is_no_law_that_could_be_added() {
    let bench = Bench::new("episode");
    for arguments in [
        &["effects", "external_force_episode"][..],
        &["add", "arm.sinew.toml", "external_force_episode@elbow", "-o", "new.sinew.toml"],
    ] {
        let message = bench.refused(arguments);
        assert!(message.contains("acted once") && message.contains("RUN@FROM..TO"), "{message}");
    }
}

#[test]
fn a_demo_leaves_files_alone_that_it_did_not_write() {
    let bench = Bench::new("demo");
    bench.write("mine/waves.csv", "time\n");
    let message = bench.refused(&["demo", "--dir", "mine"]);
    assert!(message.contains("waves.csv: is there, is not the demo's"), "{message}");
    bench.write("arm.sinew.toml", &SIDECAR.replace("1800.0", "1700.0"));
    assert!(bench.refused(&["demo", "--dir", "."]).contains("arm.sinew.toml: is there"));
}

#[test]
fn noise_that_a_map_states_of_a_sensor_that_is_not_there_is_told() {
    let bench = Bench::new("map");
    bench.write("map.toml", "[sensors]\n\"motor_torque.elbo\" = { std = 0.05 }\n");
    let output = bench.run(&["check", "arm.sinew.toml", "run.csv", "--columns", "map.toml"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("the columns map: states noise of motor_torque.elbo, which"), "{text}");
}
