//! Every bad input is answered with where, what, got and a way out; none with a panic.

use std::fs;
use std::path::{Path, PathBuf};

use sinew_data::{ColumnMap, RunSpec, read_run};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("sinew-data-{test}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).unwrap();
    }
}

fn message(path: &Path) -> String {
    read_run(path, None).unwrap_err().to_string()
}

/// The message for a file `run.csv` with this content.
fn refusal(test: &str, content: impl AsRef<[u8]>) -> String {
    message(&Folder::new(test).file("run.csv", content))
}

#[test]
fn a_missing_file_is_named() {
    let text = message(Path::new("nowhere/run.csv"));
    assert_eq!(
        text,
        "nowhere/run.csv: no such file\n  help: check the path; a run is a .csv, .csv.gz or .parquet file"
    );
}

#[test]
fn a_folder_is_no_run() {
    let folder = Folder::new("folder");
    assert!(message(&folder.0).contains("cannot be read"));
}

#[test]
fn an_empty_file_is_refused() {
    let expected = "run.csv: the file is empty\n  help: a run needs a header line and at least two samples";
    assert_eq!(refusal("empty", ""), expected);
    assert_eq!(refusal("blank", "\n\n"), expected);
}

#[test]
fn a_header_without_samples_is_refused() {
    let text = refusal("header", "time,joint_position.elbow\n");
    assert!(text.starts_with("run.csv: too few samples (got 0, at least 2)\n  help: "), "{text}");
}

#[test]
fn one_sample_is_no_run() {
    let text = refusal("one", "time,joint_position.elbow\n0,1\n");
    assert!(text.starts_with("run.csv: too few samples (got 1, at least 2)"), "{text}");
}

#[test]
fn text_in_a_number_is_refused_with_line_and_column() {
    let text = refusal("text", "time,joint_position.elbow\n0,1\n\n0.1,fast\n");
    assert_eq!(
        text,
        "run.csv:4: column \"joint_position.elbow\" is not a number (got \"fast\")\n  help: drop the row, correct the field, or use a window of the run without it: FILE@FROM..TO"
    );
}

#[test]
fn lines_are_counted_with_both_kinds_of_line_end() {
    let text = refusal("crlf", "time,joint_position.elbow\r\n0,1\r\n0.1,x\r\n");
    assert!(text.starts_with("run.csv:3: "), "{text}");
}

#[test]
fn a_decimal_comma_is_recognised() {
    let text = refusal("comma", "time;joint_position.elbow\n0,0;1,5\n");
    assert!(text.ends_with("help: write the decimal point as a full stop: 0"), "{text}");
}

#[test]
fn an_empty_field_is_refused() {
    let text = refusal("field", "time,joint_position.elbow\n0,1\n0.1,\n");
    assert!(
        text.starts_with("run.csv:3: column \"joint_position.elbow\" is not a number (got \"\")"),
        "{text}"
    );
    assert!(text.contains("the field is empty"), "{text}");
}

#[test]
fn nan_and_infinity_are_refused_with_line_and_column() {
    let text = refusal("nan", "time,joint_position.elbow\n0,1\n0.1,NaN\n");
    assert_eq!(
        text,
        "run.csv:3: column \"joint_position.elbow\" is not finite (got NaN)\n  help: drop the row, or use a window of the run without it: FILE@FROM..TO"
    );
    let text = refusal("inf", "time,joint_position.elbow\n0,1\n0.1,-inf\n");
    assert!(
        text.starts_with("run.csv:3: column \"joint_position.elbow\" is not finite (got -inf)"),
        "{text}"
    );
    let text = refusal("nantime", "time,joint_position.elbow\n0,1\nnan,1\n");
    assert!(text.starts_with("run.csv:3: column \"time\" is not finite (got NaN)"), "{text}");
}

#[test]
fn what_is_no_number_is_allowed_outside_of_a_window() {
    let folder = Folder::new("window");
    let path = folder.file("run.csv", "time,joint_position.elbow\n0,1\n1,\n2,NaN\n3,4\n4,5\n5,1e300\n");
    let read = |window: &str| {
        let spec: RunSpec = format!("{}@{window}", path.display()).parse().unwrap();
        spec.read(None)
    };
    assert_eq!(read("3..5").unwrap().signals[0].values, [4.0, 5.0]);
    let refused = |window| read(window).unwrap_err().to_string();
    assert!(refused("1..5").starts_with("run.csv:3: column \"joint_position.elbow\" is not a number"));
    assert!(refused("2..5").starts_with("run.csv:4: column \"joint_position.elbow\" is not finite"));
    assert!(refused("3..").contains("no sensor reads that much (got 1e300, at most 1e100)"));
}

#[test]
fn several_recordings_in_one_file_are_named() {
    let mut text = String::from("time,joint_position.elbow\n");
    for k in 0..60 {
        text += &format!("{},{k}\n", 0.01 * f64::from(k % 30));
    }
    let text = refusal("recordings", &text);
    assert!(text.starts_with("run.csv:32: time runs backwards (got 0 s after 0.29 s): the clock"), "{text}");
    assert!(
        text.contains("holds 2 recordings\n  help: name each as a run of its own: run.csv#1 … run.csv#2")
    );
}

#[test]
fn one_stamp_out_of_order_is_no_new_recording() {
    let log = |wrong: usize, stamp: f64| {
        let time = |k: usize| if k == wrong { stamp } else { 0.01 * k as f64 };
        (0..60)
            .fold(String::from("time,joint_position.elbow\n"), |text, k| text + &format!("{},{k}\n", time(k)))
    };
    let help = "help: drop the row if its stamp alone is wrong";
    let late = refusal("late", log(30, 0.25));
    assert!(late.starts_with("run.csv:32: time runs backwards (got 0.25 s after 0.29 s)\n"), "{late}");
    assert!(late.contains(help), "{late}");
    let early = refusal("early", log(30, 0.35));
    assert!(early.starts_with("run.csv:33: time runs backwards (got 0.31 s after 0.35 s)\n"), "{early}");
    assert!(early.contains(help), "{early}");
}

#[test]
fn time_running_backwards_is_refused_with_the_line() {
    let text = refusal("backwards", "time,joint_position.elbow\n0,1\n0.2,1\n0.1,1\n");
    assert!(text.starts_with("run.csv:4: time runs backwards (got 0.1 s after 0.2 s)\n  help: "), "{text}");
}

#[test]
fn a_repeated_time_stamp_is_refused_with_the_line() {
    let text = refusal("repeated", "time,joint_position.elbow\n0,1\n0.2,1\n0.2,1\n");
    assert!(
        text.starts_with("run.csv:4: time stamp 0.2 s is the same as the one before it\n  help: "),
        "{text}"
    );
}

#[test]
fn a_row_of_another_length_is_refused() {
    let text = refusal("fields", "time,joint_position.elbow\n0,1\n0.1\n");
    assert!(
        text.starts_with("run.csv:3: wrong number of fields (got 1, the header has 2)\n  help: "),
        "{text}"
    );
}

#[test]
fn a_run_without_time_is_refused_with_the_reason() {
    let text = refusal("notime", "sample,joint_position.elbow\n0,1\n1,2\n");
    assert!(
        text.starts_with(
            "run.csv: no time stamps (got sample, joint_position.elbow); without them velocity and acceleration cannot be computed\n  help: "
        ),
        "{text}"
    );
}

#[test]
fn unknown_headers_are_listed_with_an_example_of_a_columns_map() {
    let text = refusal("headers", "t_s,q1_deg\n0,1\n1,2\n");
    assert_eq!(
        text,
        "run.csv:1: no column has a name that is known here (got t_s, q1_deg)\n  help: say which column is what with --columns map.toml, for every JOINT of the URDF, for example\n    time = { column = \"t_s\" }\n    \"motor_position.JOINT\" = { column = \"q1_deg\", scale = 1.0 }  # to rad\n    \"motor_torque.JOINT\" = { column = \"…\", scale = 1.0 }  # to N·m behind the gear; motor_current: A\n    # joint_position, joint_torque: what sensors behind the gear show"
    );
}

#[test]
fn a_log_without_names_and_one_in_capitals_are_told_so() {
    let text = refusal("numbers", "0,1\n1,2\n2,3\n");
    assert!(text.contains("help: the first line holds numbers"), "{text}");
    let text = refusal("capitals", "TIME,MOTOR_POSITION.ELBOW\n0,1\n1,2\n");
    assert!(text.contains("help: quantities are written in small letters"), "{text}");
}

#[test]
fn a_column_of_a_slower_sensor_is_told_with_its_rows() {
    let rows: String = (0..8).map(|k| format!("{k},{}\n", if k % 2 == 0 { "1" } else { "nan" })).collect();
    let text = refusal("slower", format!("time,joint_position.elbow\n{rows}"));
    assert!(text.contains("(got NaN, as 4 of its 8 rows)") && text.contains("a sensor slower"), "{text}");
    let text = refusal("none", "time,joint_position.elbow\n0,nan\n1,nan\n");
    assert!(text.contains("as all of its rows") && text.contains("leave the column out"), "{text}");
}

#[test]
fn twice_as_many_fields_may_be_decimal_commas() {
    let text = refusal("comma", "time,joint_position.elbow\n0,00,1,5\n0,01,1,6\n");
    assert!(text.contains("a decimal comma?"), "{text}");
}

#[test]
fn the_example_of_a_columns_map_can_be_used() {
    let text = refusal("example", "t_s,q1_deg\n0,1\n1,2\n");
    let (_, map) = text.split_once("for example\n").unwrap();
    ColumnMap::parse(map, "map.toml").unwrap();
}

#[test]
fn a_column_that_the_map_names_and_the_file_lacks_is_refused() {
    let folder = Folder::new("mapped");
    let path = folder.file("run.csv", "t_s,q1\n0,1\n1,2\n");
    let map = "time.column = \"t_s\"\njoint_position.elbow.column = \"q2\"";
    let map = ColumnMap::parse(map, "map.toml").unwrap();
    assert_eq!(
        read_run(&path, Some(&map)).unwrap_err().to_string(),
        "run.csv:1: no column \"q2\", which the columns map gives to joint_position.elbow (got t_s, q1)\n  help: did you mean \"q1\"?"
    );
}

#[test]
fn two_columns_of_one_name_are_refused() {
    let text = refusal("twice", "time,joint_position.elbow,joint_position.elbow\n0,1,1\n");
    assert!(text.starts_with("run.csv:1: two columns are called \"joint_position.elbow\""), "{text}");
}

#[test]
fn text_that_is_not_utf8_is_refused_with_the_line() {
    let text = refusal("latin", b"time,joint_position.elbow\n0,\xb01\n");
    assert_eq!(text, "run.csv:2: not UTF-8 text\n  help: save the file as CSV in UTF-8");
}

#[test]
fn gz_that_is_not_gz_is_refused() {
    let folder = Folder::new("gz");
    let text = message(&folder.file("run.csv.gz", "time,joint_position.elbow\n0,1\n1,2\n"));
    assert!(
        text.starts_with("run.csv.gz: not a whole gzip file (no gzip header)\n  help: rename it"),
        "{text}"
    );
}

#[test]
fn a_gz_that_was_cut_off_is_refused() {
    let folder = Folder::new("cut");
    let whole = folder.file("whole.csv", "time,joint_position.elbow\n0,1\n1,2\n");
    let packed = folder.0.join("run.csv.gz");
    read_run(&whole, None).unwrap().write_csv(&packed).unwrap();
    let bytes = fs::read(&packed).unwrap();
    fs::write(&packed, &bytes[..bytes.len() - 12]).unwrap();
    assert!(message(&packed).starts_with("run.csv.gz: not a whole gzip file"), "{}", message(&packed));
}

#[test]
fn a_wrong_file_of_sensor_facts_is_refused() {
    let folder = Folder::new("facts");
    let path = folder.file("run.csv", "time,joint_position.elbow\n0,1\n1,2\n");
    folder.file("run.run.toml", "joint_position.noise = 1\n");
    assert!(message(&path).starts_with("run.run.toml:1:16: unknown key \"noise\""), "{}", message(&path));
}

#[test]
fn a_run_that_cannot_be_written_leaves_nothing_behind() {
    let folder = Folder::new("write");
    let run = read_run(&folder.file("run.csv", "time,joint_position.elbow\n0,1\n1,2\n"), None).unwrap();
    let text = run.write_csv(&folder.0.join("no/such/run.csv")).unwrap_err().to_string();
    assert!(text.contains("cannot be written"), "{text}");
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 1);
}
