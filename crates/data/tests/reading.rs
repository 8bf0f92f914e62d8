//! What is written is read back; names, scales, windows and sensors are taken from where they are stated.

use std::fs;
use std::path::PathBuf;

use sinew_data::{ColumnMap, Quantity, Run, RunSpec, Severity, Signal, read_run};

fn folder(test: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("sinew-data-{test}-{}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn a_run_is_read_back_to_the_last_bit() {
    let folder = folder("bits");
    let time: Vec<f64> = (0..100).map(|k| 1e9 + f64::from(k) / 3.0).collect();
    let wild = (0..100).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k - 50)).collect();
    let run = Run::new(
        "run".into(),
        time,
        vec![
            Signal::new(Quantity::MotorTorque, "a \"b\", c.d", wild),
            Signal::new(Quantity::LinkAcceleration, "arm.z", vec![-0.0; 100]),
        ],
    )
    .unwrap();
    for name in ["run.csv", "run.csv.gz"] {
        let path = folder.join(name);
        run.write_csv(&path).unwrap();
        let back = read_run(&path, None).unwrap();
        assert_eq!((&back.name, &back.time), (&run.name, &run.time));
        for (a, b) in back.signals.iter().zip(&run.signals) {
            assert_eq!((a.name(), &a.values), (b.name(), &b.values));
        }
        assert_eq!(back.notes, []);
    }
    let packed = fs::read(folder.join("run.csv.gz")).unwrap();
    run.write_csv(&folder.join("run.csv.gz")).unwrap();
    assert_eq!(fs::read(folder.join("run.csv.gz")).unwrap(), packed);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_columns_map_names_scales_and_offsets() {
    let folder = folder("map");
    let path = folder.join("log.csv");
    fs::write(&path, "\u{feff}stamp_ns ; q1_deg;motor_torque.elbow\r\n0;180;1\r\n5000000;360;2\r\n").unwrap();
    fs::write(folder.join("log.run.toml"), "joint_position.resolution = 1e-3\n").unwrap();
    let map = "time = { column = \"stamp_ns\", scale = 1e-9 }\n\
               \"joint_position.elbow\" = { column = \"q1_deg\", scale = 0.017453292519943295, offset = 1 }\n\
               [sensors]\n\"joint_position.elbow\" = { std = 2e-4, resolution = 9 }";
    let run = read_run(&path, Some(&ColumnMap::parse(map, "map.toml").unwrap())).unwrap();
    assert_eq!(run.time, [0.0, 0.005]);
    let q = run.signal(Quantity::JointPosition, "elbow").unwrap();
    approx::assert_relative_eq!(q.values[0], std::f64::consts::PI + 1.0, max_relative = 1e-15);
    assert_eq!((q.std, q.resolution), (Some(2e-4), Some(1e-3)));
    assert_eq!(run.signal(Quantity::MotorTorque, "elbow").unwrap().values, [1.0, 2.0]);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_columns_map_adds_and_multiplies_columns() {
    let folder = folder("sums");
    let path = folder.join("log.csv");
    fs::write(&path, "time,angle,bend,duty,supply\n0,1,0.25,0.5,7\n1,2,-0.5,-0.25,8\n").unwrap();
    let map = "\"joint_position.elbow\" = { column = \"angle\", plus = \"bend\", scale = 2 }\n\
               \"motor_torque.elbow\" = { column = \"duty\", times = \"supply\", offset = 1 }";
    let run = read_run(&path, Some(&ColumnMap::parse(map, "map.toml").unwrap())).unwrap();
    assert_eq!(run.signal(Quantity::JointPosition, "elbow").unwrap().values, [2.5, 3.0]);
    assert_eq!(run.signal(Quantity::MotorTorque, "elbow").unwrap().values, [4.5, -1.0]);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn an_unknown_column_is_ignored_and_told() {
    let folder = folder("unknown");
    let path = folder.join("log.csv");
    fs::write(&path, "time,joint_position.elbow,joint_velocty.elbow\n0,1,5\n1,2,6\n").unwrap();
    let run = read_run(&path, None).unwrap();
    assert_eq!(run.signals.len(), 1);
    assert_eq!(run.notes.len(), 1);
    assert_eq!(run.notes[0].severity, Severity::Note);
    assert_eq!(
        run.notes[0].to_string(),
        "note: log.csv:1: column \"joint_velocty.elbow\" is not known and was ignored\n  help: did you mean \"joint_velocity\"?"
    );
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_window_keeps_the_lines_of_the_file() {
    let folder = folder("window");
    let path = folder.join("log.csv");
    fs::write(&path, "time,joint_position.elbow\n10,1\n11,2\n12,3\n13,4\n").unwrap();
    let spec: RunSpec = format!("{}@1..3", path.display()).parse().unwrap();
    let run = spec.read(None).unwrap();
    assert_eq!((run.name.as_str(), run.time.as_slice()), ("log@1..3", &[11.0, 12.0][..]));
    assert_eq!(run.place_of(1), "log.csv:4");
    fs::remove_dir_all(folder).unwrap();
}
