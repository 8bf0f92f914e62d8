//! Files that NumPy, SciPy and MATLAB read: read back by Python where it is there.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use sinew_linear::{StateSpace, discretize, linearize};

use crate::robots::{planar_2r, plant};

fn model() -> StateSpace {
    let plant = plant(&planar_2r());
    linearize(&plant, &plant.parameters(), &[-1.2, 0.4]).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("sinew-export-{}-{name}", std::process::id()));
    fs::create_dir_all(&dir).unwrap();
    dir
}

// Runs a script with the model's files beside it; false where this machine has no Python with these libraries. The
// interpreter is `SINEW_PYTHON`, else `python3`.
fn python(name: &str, needs: &str, script: &str) -> bool {
    let interpreter = std::env::var("SINEW_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let import = format!("import {needs}");
    let probe = Command::new(&interpreter).args(["-c", &import]).output();
    if !probe.is_ok_and(|o| o.status.success()) {
        println!("skipped: {interpreter} has no {needs} here (SINEW_PYTHON names another interpreter)");
        return false;
    }
    let (dir, whole) = (folder(name), model());
    let sampled = discretize(&whole, 1e-3).unwrap();
    for (file, bytes) in [
        ("model.npz", whole.to_npz()),
        ("model.mat", whole.to_mat()),
        ("sampled.npz", sampled.to_npz()),
        ("sampled.mat", sampled.to_mat()),
    ] {
        fs::write(dir.join(file), bytes).unwrap();
    }
    let numbers = |m: &faer::Mat<f64>| {
        let rows =
            (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| format!("{:e}", m[(i, j)])).collect::<Vec<_>>());
        format!("[{}]", rows.map(|r| format!("[{}]", r.join(","))).collect::<Vec<_>>().join(","))
    };
    let exact = format!(
        "exact = dict(A={}, B={}, C={}, D={}, states={:?}, inputs={:?}, outputs={:?})\n",
        numbers(&whole.A),
        numbers(&whole.B),
        numbers(&whole.C),
        numbers(&whole.D),
        whole.states,
        whole.inputs,
        whole.outputs
    );
    let output = Command::new(&interpreter)
        .args(["-c", &format!("{import}\n{exact}{script}")])
        .current_dir(&dir)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::remove_dir_all(dir).unwrap();
    true
}

#[test]
fn numpy_reads_every_number_and_name_back() {
    python(
        "npz",
        "numpy",
        r#"
m = numpy.load("model.npz")
assert sorted(m.files) == sorted(["A", "B", "C", "D", "dt", "states", "inputs", "outputs", "input_delay", "output_delay"])
for key in "ABCD":
    assert m[key].dtype == float and (m[key] == numpy.array(exact[key])).all(), key
for key in ("states", "inputs", "outputs"):
    assert list(m[key]) == exact[key], key
assert m["dt"].shape == () and float(m["dt"]) == 0.0 and m["input_delay"].shape == (2,)
assert float(numpy.load("sampled.npz")["dt"]) == 1e-3
"#,
    );
}

#[test]
fn scipy_reads_the_matlab_file_back() {
    python(
        "mat",
        "numpy, scipy.io",
        r#"
m = scipy.io.loadmat("model.mat", simplify_cells=True)
for key in "ABCD":
    assert (m[key] == numpy.array(exact[key])).all(), key
for key in ("states", "inputs", "outputs"):
    assert list(m[key]) == exact[key], key
assert m["dt"] == 0.0 and len(m["output_delay"]) == 10
assert scipy.io.loadmat("sampled.mat", simplify_cells=True)["dt"] == 1e-3
assert [name for name, shape, kind in scipy.io.whosmat("model.mat")][:5] == ["A", "B", "C", "D", "dt"]
"#,
    );
}

#[test]
fn python_control_makes_a_system_of_it_in_one_line() {
    python(
        "control",
        "numpy, scipy.io, control",
        r#"
m = numpy.load("model.npz"); sys = control.ss(m["A"], m["B"], m["C"], m["D"], float(m["dt"]))
assert (sys.nstates, sys.ninputs, sys.noutputs, sys.dt) == (8, 2, 10, 0.0)
m = scipy.io.loadmat("sampled.mat", simplify_cells=True); sampled = control.ss(m["A"], m["B"], m["C"], m["D"], m["dt"])
other = control.sample_system(sys, 1e-3, "zoh")
assert abs(other.A - sampled.A).max() < 1e-9 * abs(other.A).max()
assert abs(other.B - sampled.B).max() < 1e-9 * abs(other.B).max()
"#,
    );
}

#[test]
fn the_same_model_gives_the_same_bytes() {
    let (a, b) = (model(), model());
    assert_eq!(a.to_npz(), b.to_npz());
    assert_eq!(a.to_mat(), b.to_mat());
    // Level 5 begins with 124 letters, its version and its byte order.
    assert_eq!(&a.to_mat()[124..128], [0x00, 0x01, b'I', b'M']);
    assert_eq!(a.to_mat().len() % 8, 0);
}
