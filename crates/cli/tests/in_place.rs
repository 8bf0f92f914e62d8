//! Changing a sidecar in place: the old file or the new one, never half of one.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const URDF: &str = include_str!("../src/demo/arm.urdf");
const SIDECAR: &str = include_str!("../src/demo/arm.sinew.toml");

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("sinew-place-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    std::fs::write(dir.join("arm.urdf"), URDF).unwrap();
    std::fs::write(dir.join("arm.sinew.toml"), SIDECAR).unwrap();
    dir
}

fn sinew(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sinew"));
    command.args(arguments).current_dir(dir).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

#[test]
fn comments_order_and_urdf_stay_when_an_effect_is_added_in_place() {
    let dir = folder("comments");
    let status =
        sinew(&dir, &["add", "arm.sinew.toml", "stribeck_friction@shoulder", "--in-place"]).status().unwrap();
    assert!(status.success());
    let text = std::fs::read_to_string(dir.join("arm.sinew.toml")).unwrap();
    assert!(text.starts_with(SIDECAR), "the author's text has changed:\n{text}");
    assert!(text.contains("kind = \"stribeck_friction\""));
    assert_eq!(std::fs::read_to_string(dir.join("arm.urdf")).unwrap(), URDF);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let dir = folder("kept");
    std::fs::write(dir.join("log.csv"), "time,motor_torque.elbow\n0,0\n1,0\n").unwrap();
    std::fs::write(dir.join("log.run.toml"), "motor_torque.std = 0.1\n").unwrap();
    std::fs::write(dir.join("map.toml"), "time = \"time\"\n").unwrap();
    let files = ["arm.sinew.toml", "arm.urdf", "log.csv", "log.run.toml", "map.toml"];
    let texts = || files.map(|file| std::fs::read_to_string(dir.join(file)).unwrap());
    let before = texts();
    let refused: [&[&str]; 7] = [
        &["fit", "arm.sinew.toml", "log.csv", "-o", "log.run.toml"],
        &["discover", "arm.sinew.toml", "log.csv", "--columns", "map.toml", "-o", "map.toml"],
        &["add", "arm.sinew.toml", "coulomb_friction@elbow", "-o", "arm.sinew.toml"],
        &["add", "arm.urdf", "coulomb_friction@elbow", "-o", "./arm.sinew.toml"],
        &["simulate", "arm.sinew.toml", "--input", "log.csv", "-o", "log.csv"],
        &["report", "arm.sinew.toml", "log.csv", "-o", "log.csv"],
        &["report", "arm.sinew.toml", "log.csv", "-o", "page.pdf"],
    ];
    for arguments in refused {
        let output = sinew(&dir, arguments).stderr(Stdio::piped()).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(told.contains("help:"), "{arguments:?}: {told}");
    }
    assert_eq!(texts(), before);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_new_sidecar_in_another_folder_finds_the_urdf() {
    let dir = folder("folder");
    std::fs::create_dir_all(dir.join("deep/er")).unwrap();
    let new = "deep/er/new.sinew.toml";
    assert!(sinew(&dir, &["add", "arm.urdf", "payload", "-o", new]).status().unwrap().success());
    assert!(sinew(&dir, &["check", new]).status().unwrap().success());
    assert!(std::fs::read_to_string(dir.join(new)).unwrap().contains("../../arm.urdf"));
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_bare_urdf_gets_a_new_sidecar_in_place() {
    let dir = folder("bare");
    std::fs::remove_file(dir.join("arm.sinew.toml")).unwrap();
    assert!(
        sinew(&dir, &["add", "arm.urdf", "coulomb_friction@elbow", "--in-place"]).status().unwrap().success()
    );
    assert!(std::fs::read_to_string(dir.join("arm.sinew.toml")).unwrap().contains("coulomb_friction"));
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn an_interrupted_write_leaves_the_old_file_or_the_new_one() {
    let dir = folder("killed");
    let path = dir.join("arm.sinew.toml");
    let verb = ["add", "arm.sinew.toml", "stribeck_friction@shoulder", "--in-place"];
    assert!(sinew(&dir, &verb).status().unwrap().success());
    let new = std::fs::read_to_string(&path).unwrap();
    for k in 0..40 {
        std::fs::write(&path, SIDECAR).unwrap();
        let mut child = sinew(&dir, &verb).spawn().unwrap();
        std::thread::sleep(Duration::from_micros(100 * k));
        let _ = child.kill();
        child.wait().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text == SIDECAR || text == new, "neither old nor new:\n{text}");
    }
    std::fs::remove_dir_all(dir).unwrap();
}
