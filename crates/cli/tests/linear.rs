//! `sinew modes`, `sinew frf`, `sinew linearize`: the objects that scripts read, the files, and wrong input.

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");
const HANGING: &str = "shoulder=-1.5707963267948966";

/// A folder with the demo's arm, gone when the test ends.
struct Bench {
    dir: PathBuf,
}

impl Bench {
    fn new(name: &str) -> Self {
        Self::with(name, SIDECAR)
    }

    fn with(name: &str, sidecar: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("sinew-linear-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("arm.urdf"), URDF).unwrap();
        std::fs::write(dir.join("arm.sinew.toml"), sidecar).unwrap();
        Self { dir }
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_sinew")).args(arguments).current_dir(&self.dir).output().unwrap()
    }

    fn text(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
        String::from_utf8(output.stdout).unwrap()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let text = self.text(&[arguments, &["--json"]].concat());
        serde_json::from_str(&text).expect("one JSON object and nothing else")
    }

    fn refused(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert_eq!(message.matches("error: ").count(), 1, "not one message: {message}");
        assert!(!message.contains("panicked") && !message.contains("internal error"), "{message}");
        message
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn modes_have_the_keys_of_the_contract_slowest_first() {
    let bench = Bench::new("modes");
    let answer = bench.json(&["modes", "arm.sinew.toml", "--at", HANGING]);
    let modes = answer["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 4);
    let omega: Vec<f64> = modes.iter().map(|m| m["omega"].as_f64().unwrap()).collect();
    assert!(omega.windows(2).all(|w| w[0] <= w[1]) && omega[0] > 0.0);
    for mode in modes {
        let hertz = mode["frequency_hz"].as_f64().unwrap();
        assert!((hertz * std::f64::consts::TAU - mode["omega"].as_f64().unwrap()).abs() < 1e-12 * hertz);
        assert_eq!(mode["stable"], true);
        assert_eq!(mode["poles"].as_array().unwrap().len(), 2);
        assert!(
            mode["poles"][0].as_array().unwrap().len() == 2 && mode["damping_ratio"].as_f64().unwrap() > 0.0
        );
        let coordinates: Vec<&str> =
            mode["shape"].as_array().unwrap().iter().map(|s| s["coordinate"].as_str().unwrap()).collect();
        assert_eq!(coordinates, ["q.shoulder", "q.elbow", "theta.shoulder", "theta.elbow"]);
        assert!(mode["shape"][0]["value"].is_f64());
        let shares: f64 = mode["participation"]
            .as_array()
            .unwrap()
            .iter()
            .map(|s| s["share"].as_f64().unwrap().abs())
            .sum();
        assert!((shares - 1.0).abs() < 1e-3);
    }
    assert_eq!(modes[0]["participation"][0]["part"], "gravity");
    assert!(modes[3]["participation"][0]["part"].as_str().unwrap().ends_with(" spring"));
}

#[test]
fn an_arm_that_falls_over_is_told_in_words() {
    let bench = Bench::new("upright");
    let at = ["modes", "arm.sinew.toml", "--at", "1.5707963267948966, 0"];
    let answer = bench.json(&at);
    assert_eq!(answer["modes"][0]["stable"], false);
    assert!(answer["modes"][0]["omega_squared"].as_f64().unwrap() < 0.0);
    let text = bench.text(&at);
    assert!(text.contains("falls over") && text.contains("mode 1 is unstable: gravity"), "{text}");
    assert!(text.contains("shoulder spring"), "{text}");
}

#[test]
fn a_linear_model_has_the_keys_of_the_contract_in_every_file() {
    let bench = Bench::new("linearize");
    let verb = ["linearize", "arm.sinew.toml", "--at", "0.3,0.5"];
    let answer = bench.json(&verb);
    let states: Vec<&str> =
        answer["states"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    let expected = [
        "q.shoulder",
        "q.elbow",
        "theta.shoulder",
        "theta.elbow",
        "qd.shoulder",
        "qd.elbow",
        "thetad.shoulder",
        "thetad.elbow",
    ];
    assert_eq!(states, expected);
    let (inputs, outputs) = (answer["inputs"].as_array().unwrap(), answer["outputs"].as_array().unwrap());
    assert_eq!(inputs[0], "motor_torque.shoulder");
    for (key, rows, columns) in
        [("A", 8, 8), ("B", 8, inputs.len()), ("C", outputs.len(), 8), ("D", outputs.len(), inputs.len())]
    {
        let matrix = answer[key].as_array().unwrap();
        assert_eq!(matrix.len(), rows, "{key}");
        assert!(matrix.iter().all(|row| numbers(row).len() == columns), "{key}");
    }
    assert_eq!(answer["at"]["q.shoulder"], 0.3);
    assert_eq!(answer["A"][0][4], 1.0);
    let file = |name: &str| -> Vec<u8> {
        bench.text(&[&verb[..], &["-o", name]].concat());
        std::fs::read(bench.dir.join(name)).unwrap()
    };
    let written: Value = serde_json::from_slice(&file("model.json")).unwrap();
    assert_eq!(written["A"], answer["A"]);
    assert!(file("model.npz").starts_with(b"PK"));
    assert!(file("model.mat").starts_with(b"MATLAB 5.0 MAT-file"));
}

#[test]
fn a_reduced_and_sampled_model_says_what_was_lost() {
    let bench = Bench::new("reduced");
    let verb =
        ["linearize", "arm.sinew.toml", "--at", HANGING, "--order", "6", "--to", "joint_velocity.elbow"];
    let answer = bench.json(&[&verb[..], &["--sample-time", "0.001"]].concat());
    assert_eq!(answer["states"].as_array().unwrap().len(), 6);
    assert_eq!(answer["outputs"], serde_json::json!(["joint_velocity.elbow"]));
    assert_eq!(answer["dt"], 0.001);
    let hankel = numbers(&answer["reduction"]["hankel"]);
    let bound = answer["reduction"]["bound"].as_f64().unwrap();
    assert!((bound - 2.0 * (hankel[6] + hankel[7])).abs() < 1e-12 * bound);
    assert!(bench.text(&verb).contains("Hankel singular values"));
    let modal =
        bench.json(&["linearize", "arm.sinew.toml", "--at", HANGING, "--order", "4", "--method", "modal"]);
    assert_eq!(modal["states"][0], "mode.1");
}

#[test]
fn a_frequency_response_has_resonances_antiresonances_and_a_table() {
    let bench = Bench::new("frf");
    let verb = [
        "frf",
        "arm.sinew.toml",
        "--at",
        HANGING,
        "--from",
        "motor_torque.shoulder",
        "--to",
        "motor_velocity.shoulder",
    ];
    let answer = bench.json(&[&verb[..], &["-o", "bode.csv"]].concat());
    let frequency = numbers(&answer["frequency_hz"]);
    assert!(frequency.len() > 100 && frequency.windows(2).all(|w| w[0] < w[1]));
    assert_eq!(numbers(&answer["magnitude"]).len(), frequency.len());
    assert_eq!(numbers(&answer["phase_deg"]).len(), frequency.len());
    assert_eq!(answer["unit"], "(rad/s)/(N·m)");
    // A drive's resonances and antiresonances alternate.
    let peaks = |key: &str| -> Vec<f64> {
        answer[key].as_array().unwrap().iter().map(|p| p["omega"].as_f64().unwrap()).collect()
    };
    assert_eq!((peaks("resonances").len(), peaks("antiresonances").len()), (4, 3));
    let table = std::fs::read_to_string(bench.dir.join("bode.csv")).unwrap();
    assert!(table.starts_with("frequency_Hz,magnitude,phase_rad\n"));
    assert_eq!(table.lines().count(), frequency.len() + 1);
    let text = bench.text(&verb);
    assert!(text.contains("the motor of shoulder stands"), "{text}");
}

#[test]
fn drawings_are_whole_files_without_a_network() {
    let bench = Bench::new("plot");
    bench.text(&["modes", "arm.sinew.toml", "--at", HANGING, "--plot", "modes.svg"]);
    let verb = ["frf", "arm.sinew.toml", "--from", "motor_torque.elbow", "--to", "joint_position.elbow"];
    bench.text(&[&verb[..], &["--at", HANGING, "--plot", "bode.html"]].concat());
    let file = |name: &str| std::fs::read_to_string(bench.dir.join(name)).unwrap();
    let (modes, bode) = (file("modes.svg"), file("bode.html"));
    assert!(modes.starts_with("<svg xmlns=") && modes.contains("mode 4") && modes.contains("theta.elbow"));
    assert!(bode.starts_with("<!doctype html>") && bode.contains("<polyline") && bode.contains("phase, °"));
    for drawing in [modes, bode] {
        assert!(!drawing.contains("<script") && !drawing.contains("NaN"));
    }
    let message = bench.refused(&["modes", "arm.sinew.toml", "--plot", "modes.png"]);
    assert!(message.contains("allowed svg, html"), "{message}");
}

#[test]
fn effects_that_are_not_linear_are_named_described_or_refused() {
    let dry =
        format!("{SIDECAR}\n\n[[effects]]\nkind = \"coulomb_friction\"\njoint = \"elbow\"\ncoulomb = 1.5\n");
    let bench = Bench::with("dry", &dry);
    let verb = ["modes", "arm.sinew.toml", "--at", HANGING];
    let text = bench.text(&verb);
    assert!(text.contains("coulomb_friction@elbow is not linear over 0.01 rad (m) at 10 Hz"), "{text}");
    let answer = bench.json(&verb);
    assert_eq!(answer["described"][0]["effect"], "coulomb_friction@elbow");
    assert!(answer["described"][0]["gains"][0]["damping"].as_f64().unwrap() > 0.0);
    let message = bench.refused(&[&verb[..], &["--nonlinear", "refuse"]].concat());
    assert!(message.contains("arm.sinew.toml") && message.contains("coulomb_friction@elbow"), "{message}");
    assert!(
        bench.json(&[&verb[..], &["--nonlinear", "slope"]].concat())["described"] == serde_json::json!([])
    );
}

#[test]
fn a_robot_without_springs_is_answered_with_a_note() {
    let bench = Bench::new("rigid");
    std::fs::remove_file(bench.dir.join("arm.sinew.toml")).unwrap();
    let output = bench.run(&["modes", "arm.urdf", "--at", HANGING]);
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success()
            && note.contains("no joint is elastic and no link bends")
            && note.contains("help:"),
        "{note}"
    );
}

#[test]
fn wrong_input_is_answered_with_what_is_allowed() {
    let bench = Bench::new("wrong");
    let robot = "arm.sinew.toml";
    for verb in ["modes", "linearize"] {
        let message = bench.refused(&[verb, robot, "--at", "sholder=1"]);
        assert!(message.contains("did you mean \"shoulder\"?") && message.contains("help:"), "{message}");
        for at in ["1", "1,2,3", "nan,0", "inf,0", "shoulder=x"] {
            let message = bench.refused(&[verb, robot, "--at", at]);
            assert!(message.contains("the joints are shoulder, elbow"), "{message}");
        }
    }
    let frf = |from: &str, to: &str| bench.refused(&["frf", robot, "--from", from, "--to", to]);
    let message = frf("motor_torqe.shoulder", "motor_velocity.shoulder");
    assert!(message.contains("did you mean \"motor_torque.shoulder\"?"), "{message}");
    let message = frf("motor_torque.shoulder", "velocity");
    assert!(message.contains("allowed motor_position.shoulder"), "{message}");
    for (arguments, word) in [
        (&["-o", "model.csv"][..], "allowed json, mat, npz"),
        (&["-o", "nowhere/model.mat"], "no such folder"),
        (&["--order", "9"], "allowed 2 to 7"),
        (&["--order", "3", "--method", "modal"], "even"),
        (&["--sample-time", "0"], "greater than zero"),
        (&["--amplitude", "-1"], "greater than zero"),
        (&["--to", "joint_position.elbw"], "did you mean \"joint_position.elbow\"?"),
    ] {
        let message = bench.refused(&[&["linearize", robot][..], arguments].concat());
        assert!(message.contains(word) && message.contains("help:"), "{arguments:?}: {message}");
    }
    assert!(!bench.dir.join("model.csv").exists());
}

#[test]
fn a_link_that_bends_without_mass_takes_part_and_has_no_mode_of_its_own() {
    let bending = "\n[links.upper_arm.bending]\nlength = 0.3\nEI = 900.0\naxes = [\"y\"]\nsprings = 2\n";
    let bench = Bench::with("massless", &(SIDECAR.to_owned() + bending));
    let told = bench.json(&["info", "arm.sinew.toml"]);
    let joints = told["virtual_joints"].as_array().unwrap();
    assert_eq!((joints.len(), &joints[0]["coordinate"]), (2, &"v.upper_arm.1".into()));
    assert_eq!((&joints[1]["axis"], &joints[1]["follows_its_load"]), (&"y".into(), &true.into()));
    assert_eq!(told["modes"].as_array().unwrap().len(), 4);
    let text = bench.text(&["info", "arm.sinew.toml"]);
    assert!(text.contains("v.upper_arm.2") && text.contains("follows its load"), "{text}");
    let at = ["modes", "arm.sinew.toml", "--at", HANGING];
    let soft = bench.json(&at);
    let stiff = Bench::new("massless-stiff").json(&at);
    let omega = |told: &Value| {
        told["modes"].as_array().unwrap().iter().map(|m| m["omega"].as_f64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(omega(&soft).len(), 4);
    assert!(omega(&soft).iter().zip(omega(&stiff)).all(|(soft, stiff)| *soft < stiff * 1.001));
    let parts =
        |m: &Value| m["participation"].as_array().unwrap().iter().any(|s| s["part"] == "upper_arm bending");
    assert!(soft["modes"].as_array().unwrap().iter().any(parts), "{soft}");
    bench.text(&[
        "frf",
        "arm.sinew.toml",
        "--at",
        HANGING,
        "--from",
        "motor_torque.elbow",
        "--to",
        "joint_position.elbow",
    ]);
}

#[test]
fn a_drawing_is_readable_where_svg_knows_no_variables_and_an_error_names_the_file_that_is_there() {
    let bench = Bench::new("plain");
    bench.text(&["modes", "arm.sinew.toml", "--plot", "shapes.svg"]);
    let drawing = std::fs::read_to_string(bench.dir.join("shapes.svg")).unwrap();
    assert!(!drawing.contains("var(") && drawing.contains("fill: #1c1f24"), "{drawing}");
    std::fs::remove_file(bench.dir.join("arm.sinew.toml")).unwrap();
    let message =
        bench.refused(&["frf", "arm.urdf", "--from", "motor_torque.elbw", "--to", "joint_position.elbow"]);
    assert!(message.contains("arm.urdf: signal \"motor_torque.elbw\""), "{message}");
    let message = bench.refused(&[
        "frf",
        "arm.urdf",
        "--from",
        "motor_torque.elbow",
        "--to",
        "joint_position.elbow",
        "--low",
        "-1",
    ]);
    assert!(message.contains("--low: must be greater than zero (got -1 Hz)"), "{message}");
}

#[test]
fn a_range_of_frequencies_that_no_robot_has_is_refused() {
    let bench = Bench::new("range");
    let verb = ["frf", "arm.sinew.toml", "--from", "motor_torque.elbow", "--to", "motor_velocity.elbow"];
    for (low, high, word) in [
        ("1e-300", "1e300", "--low: no frequency of a robot (got 1e-300 Hz, allowed 1e-9 to 1e9 Hz)"),
        ("1", "1e100", "--high: no frequency of a robot (got 1e100 Hz, allowed 1e-9 to 1e9 Hz)"),
        ("1e9", "1e9", "allowed --low below --high"),
    ] {
        let message = bench.refused(&[&verb[..], &["--low", low, "--high", high]].concat());
        assert!(message.contains(word) && message.contains("help:"), "{message}");
    }
    let widest = bench.json(&[&verb[..], &["--low", "1e-9", "--high", "1e9"]].concat());
    assert!((2000..4000).contains(&numbers(&widest["frequency_hz"]).len()));
    assert!(bench.refused(&[&verb[..], &["--low", "1e9"]].concat()).contains("no range"));
}

#[test]
fn a_rigid_arm_answers_as_one_over_its_inertia_without_resonances_of_rounding() {
    let bench = Bench::new("free");
    std::fs::remove_file(bench.dir.join("arm.sinew.toml")).unwrap();
    for (from, to, slope) in [
        ("motor_torque.elbow", "motor_velocity.elbow", -1),
        ("motor_position.elbow", "joint_velocity.elbow", 1),
    ] {
        let verb = ["frf", "arm.urdf", "--from", from, "--to", to];
        let told = bench.json(&verb);
        assert_eq!(
            (&told["resonances"], &told["antiresonances"]),
            (&Value::Array(vec![]), &Value::Array(vec![]))
        );
        let (frequency, magnitude) = (numbers(&told["frequency_hz"]), numbers(&told["magnitude"]));
        assert!((frequency[0] - 0.1).abs() < 1e-12 && (frequency.last().unwrap() - 100.0).abs() < 1e-9);
        // |G| = k ω or k/ω
        let k = |n: usize| magnitude[n] * (std::f64::consts::TAU * frequency[n]).powi(-slope);
        assert!((0..frequency.len()).all(|n| (k(n) / k(0) - 1.0).abs() < 1e-9), "{told}");
        assert!(!bench.text(&verb).contains("unstable"));
    }
    let modes = bench.json(&["modes", "arm.urdf"]);
    assert!(modes["modes"].as_array().unwrap().iter().all(|m| m["omega_squared"] == 0.0), "{modes}");
}
