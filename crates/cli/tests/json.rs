//! The JSON objects that other people's scripts read.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");

/// A small robot whose model lacks the elbow's dry friction, and two runs of it.
fn bench(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("sinew-json-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    std::fs::write(dir.join("arm.urdf"), URDF).unwrap();
    std::fs::write(dir.join("arm.sinew.toml"), SIDECAR).unwrap();
    std::fs::write(
        dir.join("noise.toml"),
        "motor_torque.std = 0.05\njoint_position.std = 1e-5\njoint_torque.std = 0.05\n",
    )
    .unwrap();
    for (run, w) in [("a", 2.1), ("b", 2.7)] {
        let row = |k: usize| {
            let t = k as f64 * 0.002;
            let s = (1.0 - (-t).exp()).powi(3);
            format!("{t},{},{}\n", 0.6 * s * (w * t).sin(), 0.8 * s * (1.7 * w * t).sin())
        };
        let rows: String = (0..1500).map(row).collect();
        let text = format!("time,joint_position.shoulder,joint_position.elbow\n{rows}");
        std::fs::write(dir.join(format!("{run}.ref.csv")), text).unwrap();
    }
    json(&dir, &["add", "arm.sinew.toml", "coulomb_friction@elbow,coulomb=1.5", "-o", "true.sinew.toml"]);
    for run in ["a", "b"] {
        let (input, output) = (format!("{run}.ref.csv"), format!("{run}.csv"));
        json(
            &dir,
            &[
                "simulate",
                "true.sinew.toml",
                "--input",
                &input,
                "--controller",
                "--noise",
                "noise.toml",
                "-o",
                &output,
            ],
        );
    }
    dir
}

fn json(dir: &PathBuf, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_sinew"))
        .args(arguments)
        .arg("--json")
        .current_dir(dir)
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    serde_json::from_slice(&output.stdout).expect("one JSON object and nothing else")
}

fn has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "no key {key:?} in {value}");
    }
}

#[test]
fn a_run_in_parquet_is_told_as_one_in_csv_is() {
    let dir = bench("parquet");
    let of_run = |output: &str| {
        let noise = ["--noise", "noise.toml"];
        let from = ["simulate", "true.sinew.toml", "--input", "a.ref.csv", "--controller", "-o", output];
        json(&dir, &[&from[..], &noise].concat());
        json(&dir, &["compare", "arm.sinew.toml", output])
    };
    let (csv, parquet) = (of_run("log.csv"), of_run("log.parquet"));
    assert!(csv["signals"][0]["rms_error"].as_f64().unwrap() > 0.0);
    assert_eq!(csv["signals"], parquet["signals"]);
    let magic = std::fs::read(dir.join("log.parquet")).unwrap();
    assert_eq!(&magic[..4], b"PAR1");
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn check_and_compare_have_the_keys_of_the_contract() {
    let dir = bench("compare");
    let check = json(&dir, &["check", "arm.sinew.toml", "a.csv"]);
    has(&check, &["ok", "problems"]);
    let map = "\"motor_position.elbow\" = { column = \"motor_position.elbow\" }\n\"joint_position.elbow\" = { column = \"x\" }\n";
    std::fs::write(dir.join("map.toml"), map).unwrap();
    let compare = json(&dir, &["compare", "arm.sinew.toml", "a.csv", "b.csv"]);
    has(&compare, &["signals", "runs", "rms_error", "findings"]);
    let signal = &compare["signals"][0];
    has(
        signal,
        &["signal", "joint", "unit", "rms_error", "rms_measured", "noise_floor", "fit_percent", "white"],
    );
    assert_eq!(compare["runs"].as_array().unwrap().len(), 2);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn diagnose_has_the_keys_of_the_contract() {
    let dir = bench("diagnose");
    let diagnosis = json(&dir, &["diagnose", "arm.sinew.toml", "a.csv"]);
    has(
        &diagnosis,
        &["verdict", "scope", "channels", "false_acceptance", "accepted", "candidates", "findings"],
    );
    let words = ["adequate", "missing", "partly_explained", "unexplained", "undecidable"];
    assert!(words.contains(&diagnosis["verdict"].as_str().unwrap()));
    has(
        &diagnosis["channels"][0],
        &["signal", "joint", "unseen_error", "predictable_remainder", "distance_to_floor"],
    );
    has(&diagnosis["candidates"][0], &["effect", "place", "probability", "error_explained", "rivals"]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn fit_has_the_keys_of_the_contract_and_writes_what_it_found() {
    let dir = bench("fit");
    let verb = [
        "fit",
        "arm.sinew.toml",
        "a.csv",
        "--add",
        "coulomb_friction@elbow",
        "--check",
        "b.csv",
        "-o",
        "better.sinew.toml",
    ];
    let fit = json(&dir, &verb);
    has(&fit, &["steps", "effects", "parameters", "verdict"]);
    has(&fit["steps"][0], &["added", "rms_error", "check_rms_error", "noise_floor"]);
    has(&fit["parameters"][0], &["name", "value", "std", "unit", "low", "high"]);
    let parameters = fit["parameters"].as_array().unwrap();
    let coulomb =
        parameters.iter().find(|p| p["name"] == "elbow.coulomb").expect("the added effect is reported");
    approx::assert_relative_eq!(coulomb["value"].as_f64().unwrap(), 1.5, max_relative = 0.05);
    assert!(std::fs::read_to_string(dir.join("better.sinew.toml")).unwrap().contains("coulomb_std = "));
    assert_eq!(json(&dir, &["check", "better.sinew.toml"])["ok"], true);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn the_catalogue_is_an_object_too() {
    let dir = std::env::temp_dir();
    let all = json(&dir, &["effects"]);
    assert!(all["effects"].as_array().unwrap().len() >= 15);
    has(
        &json(&dir, &["effects", "backlash"]),
        &["name", "law", "symptom", "parameters", "rivals", "sources"],
    );
}

#[test]
fn a_trial_counts_false_acceptances_and_says_what_follows() {
    let dir = bench("trial");
    let trial = json(&dir, &["trial", "arm.sinew.toml", "a.csv", "b.csv"]);
    has(&trial, &["effects", "false_acceptance", "surrogates", "sentence"]);
    let count = &trial["false_acceptance"];
    let surrogates = trial["surrogates"].as_array().unwrap();
    assert_eq!(count["surrogates"], surrogates.len());
    let accepted = surrogates.iter().filter(|s| !s["accepted"].is_null()).count();
    assert_eq!(count["accepted"], accepted);
    assert!(
        trial["sentence"].as_str().unwrap().starts_with(&format!("on {accepted} of {} ", surrogates.len()))
    );
    // Two runs of 3 s on which the elbow's friction is the only thing missing.
    assert!(trial["effects"].to_string().contains("coulomb_friction@elbow"), "{trial}");
    std::fs::remove_dir_all(dir).unwrap();
}
