//! A write that is interrupted leaves the old file or the new one, never half of one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use sinew_model::{EffectSpec, Place};
use sinew_urdf::Sidecar;

const TARGET: &str = "SINEW_TEST_WRITE_TARGET";

/// Two sidecars of very different length, so that a mixture of them would show.
fn sidecar(effects: usize) -> Sidecar {
    let mut sidecar = Sidecar::new_for("arm.urdf");
    for k in 0..effects {
        let effect = EffectSpec::new("cogging_torque", Place::Joint(format!("joint_{k}"))).with("sine", 0.1);
        sidecar.set_effect(&effect);
    }
    sidecar
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("sinew-urdf-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn write_for_ever(target: &Path) -> ! {
    let (short, long) = (sidecar(1), sidecar(60));
    loop {
        short.write(target).unwrap();
        long.write(target).unwrap();
    }
}

#[test]
fn a_process_killed_while_it_writes_leaves_a_whole_file() {
    // The same test, started by itself with a target, is the process that gets killed.
    if let Some(target) = std::env::var_os(TARGET) {
        write_for_ever(Path::new(&target));
    }
    let folder = folder("killed");
    let target = folder.join("arm.sinew.toml");
    let whole = [sidecar(1).text(), sidecar(60).text()];
    for delay in [1, 3, 7, 13, 29, 31, 37, 41] {
        sidecar(1).write(&target).unwrap();
        let mut writer = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "a_process_killed_while_it_writes_leaves_a_whole_file"])
            .env(TARGET, &target)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        // It is at work once the long text has been seen.
        while fs::read_to_string(&target).unwrap() != whole[1] {
            assert!(writer.try_wait().unwrap().is_none(), "the writer ended by itself");
        }
        std::thread::sleep(Duration::from_micros(100 * delay));
        writer.kill().unwrap();
        writer.wait().unwrap();
        assert!(whole.contains(&fs::read_to_string(&target).unwrap()));
    }
    // What the dead left behind does not hinder the next.
    sidecar(60).write(&target).unwrap();
    assert_eq!(fs::read_to_string(&target).unwrap(), whole[1]);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_reader_at_any_moment_sees_a_whole_file() {
    let folder = folder("read");
    let target = folder.join("arm.sinew.toml");
    let (short, long) = (sidecar(1), sidecar(60));
    short.write(&target).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for _ in 0..50 {
                long.write(&target).unwrap();
                short.write(&target).unwrap();
            }
            done.store(true, Ordering::Relaxed);
        });
        while !done.load(Ordering::Relaxed) {
            let seen = fs::read_to_string(&target).unwrap();
            assert!(seen == short.text() || seen == long.text());
        }
    });
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "no temporary file is left");
    fs::remove_dir_all(folder).unwrap();
}
