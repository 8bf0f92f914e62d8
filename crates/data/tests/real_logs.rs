//! What the checks say of measured robots. The logs are no part of the project; without them nothing is tested.

use std::path::PathBuf;

use sinew_data::{ColumnMap, Note, Run, check_run, find_repeats, read_run};

/// The file, or `None` with a message if the measured logs are not there.
fn log(path: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if !path.is_file() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(path)
}

/// A columns map for joints 1 … n: pairs of a quantity and a header without its number.
fn map(joints: usize, columns: &[(&str, &str)]) -> ColumnMap {
    let mut text = "time.column = \"t_s\"\n".to_string();
    for joint in 1..=joints {
        for (quantity, header) in columns {
            text += &format!("{quantity}.axis_{joint}.column = \"{header}_{joint}\"\n");
        }
    }
    ColumnMap::parse(&text, "map.toml").unwrap()
}

fn said(notes: &[Note]) -> String {
    notes.iter().map(|note| format!("{note}\n")).collect()
}

fn emps() -> Option<Run> {
    let map = "time.column = \"t_s\"\nmotor_position.slide.column = \"x_motor_m\"\n\
               motor_torque.slide.column = \"force_motor_N\"";
    let path = log("emps_janot2019/emps_estimation.csv.gz")?;
    Some(read_run(&path, Some(&ColumnMap::parse(map, "map.toml").unwrap())).unwrap())
}

/// Columns of the UR10e logs.
const UR10E: &[(&str, &str)] =
    &[("joint_position", "q_rad"), ("joint_velocity", "qd_radps"), ("motor_current", "i_motor_A")];

#[test]
fn the_motion_of_the_electro_mechanical_axis_repeats_every_6_24_s() {
    let Some(run) = emps() else { return };
    let repeats = find_repeats(std::slice::from_ref(&run));
    assert_eq!(repeats.len(), 1);
    approx::assert_relative_eq!(repeats[0].lag(), 6.24, epsilon = 1e-4);
    assert!(repeats[0].difference < 1e-5);
    // so one half of the log is no unseen motion for the other
    let halves = [run.window(0.0, 12.42).unwrap(), run.window(12.42, f64::INFINITY).unwrap()];
    assert!(find_repeats(&halves).iter().any(|r| (r.first, r.second) == (0, 1)));
}

#[test]
fn the_loaded_and_the_unloaded_run_of_the_ur10e_have_one_command_and_the_others_have_not() {
    let names = ["20_02_10-30sec_12harm", "20_02_19_14harm50sec", "20_02_19_14harm50secLoad"];
    let files = names.map(|name| log(&format!("ur10e_mamedov2020/ur-{name}.csv.gz")));
    let Some(files) = files.into_iter().collect::<Option<Vec<_>>>() else { return };
    let runs: Vec<Run> = files.iter().map(|f| read_run(f, Some(&map(6, UR10E))).unwrap()).collect();
    let pairs: Vec<_> = find_repeats(&runs).iter().map(|r| (r.first, r.second)).collect();
    assert_eq!(pairs, [(1, 2)]);
}

#[test]
fn the_stamps_of_the_ur10e_are_uneven_and_true() {
    let Some(file) = log("ur10e_mamedov2020/ur-20_02_12-40sec_12harm.csv.gz") else { return };
    let run = read_run(&file, Some(&map(6, UR10E))).unwrap();
    assert!(said(&check_run(&run)).contains("of the time steps differ"));
    assert!(!said(&check_run(&run)).contains("derivative"));
    // by the number of the sample the velocity no longer fits
    let (n, duration) = (run.time.len(), run.duration());
    let even = (0..n).map(|k| duration * k as f64 / (n - 1) as f64).collect();
    let even = Run::new("even".into(), even, run.signals).unwrap();
    let said = said(&check_run(&even));
    assert!(said.contains("differs from the derivative"), "{said}");
}

#[test]
fn the_link_encoders_of_the_kr300_are_3_ms_late_on_all_axes() {
    let columns = [("motor_position", "q_motorside_rad"), ("joint_position", "q_linkside_rad")];
    for name in ["kr300_A", "kr300_B"] {
        let Some(file) = log(&format!("kuka_kr300_weigand2021/{name}.csv.gz")) else { return };
        let said = said(&check_run(&read_run(&file, Some(&map(3, &columns))).unwrap()));
        for axis in 1..=3 {
            let late = format!("joint_position.axis_{axis}: lags behind motor_position.axis_{axis} by ");
            let (_, ms) = said.split_once(&late).unwrap();
            let ms: f64 = ms.split_once(' ').unwrap().0.parse().unwrap();
            assert!((2.9..3.2).contains(&ms), "{ms}");
        }
    }
}

#[test]
fn the_clock_of_the_panda_log_repeats_and_skips_ticks() {
    let Some(file) = log("panda_gaz2019/panda_trajectory_1.csv.gz") else { return };
    let columns = [("joint_position", "q_rad"), ("joint_velocity", "qd_radps")];
    let said = said(&check_run(&read_run(&file, Some(&map(7, &columns))).unwrap()));
    assert!(said.contains("the clock of this log repeats or skips ticks"), "{said}");
}

#[test]
fn a_log_without_time_stamps_is_refused() {
    let Some(file) = log("kuka_lbr_med7/lbr_med7.csv.gz") else { return };
    let map = ColumnMap::parse("joint_position.A1.column = \"q_rad_0\"", "map.toml").unwrap();
    let message = read_run(&file, Some(&map)).unwrap_err().to_string();
    assert!(message.starts_with("lbr_med7.csv.gz: no time stamps (got sample, q_rad_0, "), "{message}");
    assert!(message.contains("without them velocity and acceleration cannot be computed"), "{message}");
}
