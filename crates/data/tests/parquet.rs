//! Parquet: what others write is read, what is written is read back, what is broken is refused.
#![cfg(feature = "parquet")]

use std::fs;
use std::path::{Path, PathBuf};

use sinew_data::{ColumnMap, Quantity, Run, RunSpec, Signal, read_run};

// Made by `files/make.py`.
fn held(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

fn folder(test: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("sinew-data-parquet-{test}-{}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    path
}

fn map(text: &str) -> ColumnMap {
    ColumnMap::parse(text, "map.toml").unwrap()
}

const COUNTS: &str = "\"joint_position.wrist\" = { column = \"counts\", scale = 1e-3, offset = 0.3 }";

#[test]
fn what_other_libraries_write_is_read() {
    for (name, torque) in [("polars", 1e-16), ("pyarrow", 1e-8)] {
        let only_elbow =
            format!("{COUNTS}\n\"joint_velocity.elbow\" = {{ column = \"joint_position.elbow\" }}");
        let spec: RunSpec =
            format!("{}@0.0499..", held(&format!("{name}.parquet")).display()).parse().unwrap();
        let run = spec.read(Some(&map(&only_elbow))).unwrap();
        assert_eq!(run.name, format!("{name}@0.0499.."));
        assert_eq!(run.time.len(), 30);
        for (k, time) in run.time.iter().enumerate() {
            let q = (0.01 * (k + 10) as f64).sin();
            let of = |quantity, place| run.signal(quantity, place).unwrap().values[k];
            // Seconds after the first time stamp, to the last digit.
            assert!((time - 0.005 * (k + 10) as f64).abs() < 1e-15);
            assert!((of(Quantity::JointPosition, "elbow") - q).abs() < 1e-15);
            assert!((of(Quantity::MotorTorque, "elbow") - 0.5 * q).abs() <= torque);
            assert!((of(Quantity::JointPosition, "wrist") - q).abs() <= 0.51e-3);
        }
        assert_eq!(run.place_of(0), format!("{name}.parquet, row 11"));
    }
}

#[test]
fn a_gap_and_a_text_are_refused_with_their_place() {
    let message =
        |name: &str, columns: Option<&ColumnMap>| read_run(&held(name), columns).unwrap_err().to_string();
    assert_eq!(
        message("polars.parquet", None),
        "polars.parquet, row 10: column \"motor_torque.elbow\" is not finite (got NaN)\n  help: drop the row, or use a window of the run without it: FILE@FROM..TO"
    );
    assert_eq!(
        message("pyarrow.parquet", None),
        "pyarrow.parquet: column \"joint_velocity.elbow\" does not hold one number a row (its type is byte_array)\n  help: write it as float, double or whole numbers"
    );
    let text = message("polars.parquet", Some(&map("\"joint_position.wrist\" = { column = \"count\" }")));
    assert!(
        text.starts_with(
            "polars.parquet: no column \"count\", which the columns map gives to joint_position.wrist"
        ),
        "{text}"
    );
    assert!(text.ends_with("help: did you mean \"counts\"?"), "{text}");
}

#[test]
fn a_time_stamp_needs_no_scale() {
    let columns = map("time = { column = \"time\", scale = 1e-9 }");
    let text = read_run(&held("polars.parquet"), Some(&columns)).unwrap_err().to_string();
    assert_eq!(
        text,
        "polars.parquet: column \"time\" holds times, which are read in s whatever their unit\n  help: leave `scale` out of its entry in the columns map"
    );
}

// The first bytes tell, not the name.
#[test]
fn a_text_that_is_called_parquet_is_read_as_what_it_is() {
    let folder = folder("text");
    let path = folder.join("run.parquet");
    fs::write(&path, "time,joint_position.elbow\n0,1\n1,2\n").unwrap();
    assert_eq!(read_run(&path, None).unwrap().time, [0.0, 1.0]);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn another_packing_is_refused_with_those_that_are_read() {
    let text = read_run(&held("brotli.parquet"), None).unwrap_err().to_string();
    assert!(text.starts_with("brotli.parquet: cannot be read as Parquet ("), "{text}");
    assert!(text.to_lowercase().contains("brotli") && text.contains("snappy, gzip, lz4, zstd"), "{text}");
}

#[test]
fn a_run_is_read_back_to_the_last_bit() {
    let folder = folder("bits");
    let time: Vec<f64> = (0..100).map(|k| 1e9 + f64::from(k) / 3.0).collect();
    let wild = (0..100).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k - 50)).collect();
    let signals = vec![
        Signal::new(Quantity::MotorTorque, "a \"b\", c.d", wild),
        Signal::new(Quantity::LinkAcceleration, "arm.z", vec![-0.0; 100]),
    ];
    let run = Run::new("run".into(), time, signals).unwrap();
    let path = folder.join("run.parquet");
    run.write(&path).unwrap();
    fs::write(folder.join("run.run.toml"), "motor_torque.std = 0.25\n").unwrap();
    let back = read_run(&path, None).unwrap();
    assert_eq!((&back.name, &back.time), (&run.name, &run.time));
    for (a, b) in back.signals.iter().zip(&run.signals) {
        assert_eq!((a.name(), &a.values), (b.name(), &b.values));
    }
    assert_eq!(back.signals[0].std, Some(0.25));
    // By its first bytes, whatever it is called.
    fs::copy(&path, folder.join("log.bin")).unwrap();
    assert_eq!(read_run(&folder.join("log.bin"), None).unwrap().time, run.time);
    fs::remove_dir_all(folder).unwrap();
}

// Cut off anywhere, or with one byte changed: an answer, never a panic.
#[test]
fn a_broken_file_is_refused() {
    let folder = folder("broken");
    let path = folder.join("run.parquet");
    for name in ["polars.parquet", "pyarrow.parquet"] {
        let whole = fs::read(held(name)).unwrap();
        let columns = map("\"joint_velocity.elbow\" = { column = \"joint_position.elbow\" }");
        for end in 4..whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            let text = read_run(&path, Some(&columns)).unwrap_err().to_string();
            assert!(text.starts_with("run.parquet: cannot be read as Parquet ("), "{end}: {text}");
        }
        for at in (0..whole.len()).step_by(3) {
            for flip in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                fs::write(&path, &bytes).unwrap();
                let _ = read_run(&path, Some(&columns));
            }
        }
    }
    fs::remove_dir_all(folder).unwrap();
}
