//! Numbers of independent libraries (Pinocchio, checked against MuJoCo and 50-digit arithmetic) for four robots.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use sinew_flex_joint::{
    Deflection, ElasticJoints, FlexJointError, PassivityAudit, Sample, SpinInertia, Workspace,
};
use sinew_model::Robot;
use sinew_urdf::parse_urdf;

/// Rounding of sums along a robot's joints.
const ALGEBRA: f64 = 1e-12;
/// Rounding of what solves with M, times its condition.
const SOLUTION: f64 = 1e-14;
/// Rounding of a linearisation, and of torques with fourth derivatives.
const DERIVATIVES: f64 = 1e-11;
/// Error of the runs: ten times what two integrators of the reference differ by, or this.
const RUNS: f64 = 1e-8;

/// The readings of a robot's link inertias and their names in the files.
const READINGS: [(SpinInertia, &str); 2] = [
    (SpinInertia::BesideLinks, "rotor_spin_inertia_beside_links"),
    (SpinInertia::InLinks, "rotor_spin_inertia_in_links"),
];

/// A robot, and where its joints stand in the lists of the file.
struct Reference {
    file: Value,
    robot: Robot,
    /// Degrees of freedom of all joints, of the elastic and of the rigid ones, as the file lists them.
    all: Vec<usize>,
    elastic: Vec<usize>,
    rigid: Vec<usize>,
}

impl Reference {
    fn read(path: &Path, folder: &Path) -> Self {
        let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let urdf = std::fs::read_to_string(folder.join(file["urdf"].as_str().unwrap())).unwrap();
        let mut robot = Robot::rigid(parse_urdf(&without_mimics(&urdf), "robot").unwrap().model);
        let mut all = Vec::new();
        for joint in file["joints"].as_array().unwrap() {
            let dof = robot.model.dof(joint["name"].as_str().unwrap()).unwrap();
            all.push(dof);
            let carrier = joint["carried_by"].as_str().map(|link| robot.model.link(link).unwrap());
            let settings = &mut robot.joints[dof];
            settings.rotor_inertia = number(&joint["rotor_inertia"]);
            if joint["elastic"].as_bool().unwrap() {
                settings.stiffness = joint["stiffness"].as_f64();
                settings.damping = number(&joint["damping"]);
                settings.gear_ratio = joint["gear_ratio"].as_f64();
                settings.rotor_axis = numbers(&joint["rotor_axis"]).try_into().ok();
                settings.carried_by = carrier;
            }
        }
        let named = |key: &str| {
            let names = file[key].as_array().unwrap().iter();
            names.map(|name| robot.model.dof(name.as_str().unwrap()).unwrap()).collect()
        };
        let (elastic, rigid) = (named("elastic_joints"), named("rigid_joints"));
        Self { file, robot, all, elastic, rigid }
    }

    /// A vector over all joints, in our order.
    fn joints(&self, value: &Value) -> Vec<f64> {
        spread(&[(&self.all, numbers(value))], self.all.len())
    }

    /// A vector over the motors of elastic joints and one over those of rigid ones, in our order.
    fn motors(&self, elastic: &Value, rigid: &Value) -> Vec<f64> {
        let rigid_numbers = if rigid.is_null() { vec![0.0; self.rigid.len()] } else { numbers(rigid) };
        spread(&[(&self.elastic, numbers(elastic)), (&self.rigid, rigid_numbers)], self.all.len())
    }

    fn list(&self, key: &str) -> &[Value] {
        self.file[key].as_array().unwrap()
    }

    /// Numbers over the file's elastic joints out of ours.
    fn of_elastic(&self, x: &[f64]) -> Vec<f64> {
        self.elastic.iter().map(|&dof| x[dof]).collect()
    }
    fn of_all(&self, x: &[f64]) -> Vec<f64> {
        self.all.iter().map(|&dof| x[dof]).collect()
    }
    fn of_rigid(&self, x: &[f64]) -> Vec<f64> {
        self.rigid.iter().map(|&dof| x[dof]).collect()
    }
}

/// The reference lets mimic joints move on their own.
fn without_mimics(urdf: &str) -> String {
    let mut pieces = urdf.split("<mimic");
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(first, |text, piece| text + piece.split_once("/>").expect("an empty element").1)
}

fn spread(parts: &[(&Vec<usize>, Vec<f64>)], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n];
    for (dofs, values) in parts {
        assert_eq!(dofs.len(), values.len());
        dofs.iter().zip(values).for_each(|(&dof, value)| out[dof] = *value);
    }
    out
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(number).collect()
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

/// Equal within `tolerance` of the largest number wanted.
fn assert_near(what: &str, got: &[f64], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len(), "{what}");
    let scale = want.iter().fold(f64::MIN_POSITIVE, |m: f64, x| m.max(x.abs()));
    let worst = got.iter().zip(want).fold(0.0_f64, |m, (got, want)| m.max((got - want).abs()));
    assert!(worst <= tolerance * scale, "{what}: off by {worst:e} of {scale}, allowed {tolerance:e}");
}

fn robots() -> Vec<Reference> {
    let Some(folder) = shared() else { return Vec::new() };
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder.join("elastic")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert_eq!(paths.len(), 4, "reference robots");
    paths.iter().map(|path| Reference::read(path, &folder)).collect()
}

/// The folder of reference numbers beside the project; none where only the project is.
fn shared() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: the reference numbers are not beside the project");
    None
}

/// q, q̇, θ, θ̇, τ_m of a state.
fn state(r: &Reference, state: &Value) -> [Vec<f64>; 5] {
    [
        r.joints(&state["position"]),
        r.joints(&state["velocity"]),
        r.motors(&state["motor_position"], &Value::Null),
        r.motors(&state["motor_velocity"], &Value::Null),
        r.motors(&state["motor_torque"], &state["rigid_motor_torque"]),
    ]
}

fn assert_accelerations(r: &Reference, joints: &ElasticJoints, x: &[Vec<f64>; 5], want: &Value) {
    let [q, qd, theta, thetad, tau_m] = x;
    let (qdd, thetadd) = joints.forward_dynamics(q, qd, theta, thetad, tau_m);
    let tolerance = (SOLUTION * number(&want["condition"])).max(ALGEBRA);
    assert_near("q̈", &r.of_all(qdd.as_slice()), &numbers(&want["acceleration"]), tolerance);
    let motors = r.of_elastic(thetadd.as_slice());
    assert_near("θ̈", &motors, &numbers(&want["motor_acceleration"]), tolerance);
}

#[test]
fn the_reduced_model_moves_as_computed() {
    for r in robots() {
        let joints = ElasticJoints::new(&r.robot).unwrap();
        for value in r.list("states") {
            let (x, want) = (state(&r, value), &value["reduced"]);
            assert_accelerations(&r, &joints, &x, want);
            let [q, qd, theta, thetad, tau_m] = &x;
            let tau_j = joints.spring_torque(q, qd, theta, thetad);
            assert_near("τ_j", &r.of_elastic(tau_j.as_slice()), &numbers(&value["spring_torque"]), ALGEBRA);
            let parts = ["kinetic_energy", "elastic_energy", "gravity_energy"].map(|key| number(&want[key]));
            let size = parts.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let error = joints.energy(q, qd, theta, thetad) - parts.iter().sum::<f64>();
            assert!(error.abs() < ALGEBRA * size, "energy: {error}");
            let lost = joints.power_lost(qd, thetad);
            assert_near("power lost", &[lost], &[number(&want["power_lost"])], ALGEBRA);
            let power = joints.power_in(qd, thetad, tau_m);
            assert_near("power in", &[power], &[number(&want["power_in"])], 1e2 * ALGEBRA);
            if want["mass_matrix"].is_array() {
                let M = matrix(&want["mass_matrix"]);
                let ours = joints.link_mass_matrix(q);
                let ours = DMatrix::from_fn(M.nrows(), M.ncols(), |i, j| ours[(r.all[i], r.all[j])]);
                assert_near("M", ours.as_slice(), M.as_slice(), ALGEBRA);
            }
        }
    }
}

#[test]
fn the_complete_model_moves_as_computed_in_both_readings() {
    for r in robots() {
        for (spin, key) in READINGS {
            let joints = ElasticJoints::complete(&r.robot, spin).unwrap();
            for value in r.list("states") {
                let (x, want) = (state(&r, value), &value["complete"][key]);
                assert_accelerations(&r, &joints, &x, want);
                let [q, qd, theta, thetad, _] = &x;
                let still = vec![0.0; qd.len()];
                let moving = joints.energy(q, qd, theta, thetad);
                let error =
                    moving - joints.energy(q, &still, theta, &still) - number(&want["kinetic_energy"]);
                assert!(error.abs() < 1e2 * ALGEBRA * moving.abs().max(1.0), "kinetic energy: {error}");
                if want["S"].is_array() {
                    let (S, Mc) = (joints.rotor_coupling(q), joints.link_mass_matrix(q));
                    let n = r.all.len();
                    let S = DMatrix::from_fn(n, r.elastic.len(), |i, j| S[(r.all[i], r.elastic[j])]);
                    // by the largest rotor inertia: columns of rotors on the base are zero
                    let scale = joints.rotor_inertia().iter().fold(0.0_f64, |m, x| m.max(*x));
                    assert!((S - matrix(&want["S"])).amax() < ALGEBRA * scale);
                    let Mc = DMatrix::from_fn(n, n, |i, j| Mc[(r.all[i], r.all[j])]);
                    assert_near("Mc", Mc.as_slice(), matrix(&want["mass_matrix_link"]).as_slice(), ALGEBRA);
                }
            }
        }
    }
}

#[test]
fn linear_models_and_equilibria_are_the_computed_ones() {
    for r in robots() {
        let joints = ElasticJoints::new(&r.robot).unwrap();
        let (n, nv) = (joints.displacement_len(), r.all.len());
        // our place of each state of the file: q of all joints, θ of elastic ones, q̇, θ̇
        let motor = |dof: &usize| nv + (0..*dof).filter(|&d| joints.elastic()[d]).count();
        let half: Vec<usize> = r.all.iter().copied().chain(r.elastic.iter().map(motor)).collect();
        let order: Vec<usize> = half.iter().copied().chain(half.iter().map(|k| k + n / 2)).collect();
        let inputs: Vec<usize> = r.elastic.iter().chain(&r.rigid).copied().collect();
        for point in r.list("linearisations") {
            let q = r.joints(&point["position"]);
            let (theta, tau_m) = joints.equilibrium(&q);
            let want = numbers(&point["motor_position"]);
            assert_near("θ", &r.of_elastic(theta.as_slice()), &want, ALGEBRA);
            let held = r.motors(&point["motor_torque"], &point["rigid_motor_torque"]);
            assert_near("τ_m", tau_m.as_slice(), &held, ALGEBRA);
            let motors: Vec<f64> = (0..nv).filter(|&d| joints.elastic()[d]).map(|d| theta[d]).collect();
            let x = [&q[..], &motors, &vec![0.0; n / 2]].concat();
            let (A, B) = joints.linearize(&x, tau_m.as_slice());
            let A = DMatrix::from_fn(n, n, |i, j| A[(order[i], order[j])]);
            assert_near("A", A.as_slice(), matrix(&point["A"]).as_slice(), DERIVATIVES);
            let B = DMatrix::from_fn(n, nv, |i, j| B[(order[i], inputs[j])]);
            assert_near("B", B.as_slice(), matrix(&point["B"]).as_slice(), DERIVATIVES);
            // and back: the links rest where they were
            let start: Vec<f64> = q.iter().map(|q| q + 0.01).collect();
            let start = r.all.iter().fold(start, |mut start, &dof| {
                if !joints.elastic()[dof] {
                    start[dof] = q[dof];
                }
                start
            });
            let rest = joints.rest_position(theta.as_slice(), &start);
            let upright =
                rest.as_ref().is_ok_and(|rest| (DVector::from_vec(q.clone()) - &rest.q).amax() > 1e-6);
            if !upright {
                let rest = rest.unwrap();
                assert!(rest.is_stable());
                let scale = q.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                assert!((DVector::from_vec(q) - rest.q).amax() < 1e-9 * scale);
            } else {
                // only where springs cannot carry the links: a start at balance says so
                assert!(!joints.rest_position(theta.as_slice(), &q).unwrap().is_stable());
            }
        }
    }
}

#[test]
fn complete_models_vibrate_at_the_computed_frequencies() {
    for r in robots() {
        let joints = ElasticJoints::complete(&r.robot, SpinInertia::BesideLinks).unwrap();
        let (n, nv) = (joints.displacement_len(), r.all.len());
        for point in r.list("linearisations") {
            let q = r.joints(&point["position"]);
            let (theta, tau_m) = joints.equilibrium(&q);
            let motors: Vec<f64> = (0..nv).filter(|&d| joints.elastic()[d]).map(|d| theta[d]).collect();
            let x = [&q[..], &motors, &vec![0.0; n / 2]].concat();
            let (A, _) = joints.linearize(&x, tau_m.as_slice());
            // eigenvalues of −∂(q̈, θ̈)/∂(q, θ), through the coefficients of their characteristic polynomial's traces
            let K = -A.view((n / 2, 0), (n / 2, n / 2)).into_owned();
            let squares = numbers(&point["undamped_modes_complete"]["squared_frequencies"]);
            let mut power: DMatrix<f64> = DMatrix::identity(n / 2, n / 2);
            let largest = squares.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for order in 1..=6 {
                power *= &K / largest;
                let want: f64 = squares.iter().map(|s| (s / largest).powi(order)).sum();
                assert!((power.trace() - want).abs() < 1e-10 * want.abs().max(1.0), "{order}");
            }
        }
    }
}

#[test]
fn motor_torques_along_trajectories_are_the_computed_ones() {
    for r in robots() {
        let mut robot = r.robot.clone();
        robot.joints.iter_mut().for_each(|joint| joint.damping = 0.0);
        let joints = ElasticJoints::new(&robot).unwrap();
        for time in r.file["inverse_dynamics"]["times"].as_array().unwrap() {
            let keys = ["position", "velocity", "acceleration", "third_derivative", "fourth_derivative"];
            let motion = keys.map(|key| r.joints(&time[key]));
            let motor =
                joints.inverse_dynamics(motion.each_ref().map(Vec::as_slice), Deflection::Settled).unwrap();
            for (key, got) in [
                ("motor_position", &motor.theta),
                ("motor_velocity", &motor.thetad),
                ("motor_acceleration", &motor.thetadd),
                ("motor_torque", &motor.tau_m),
            ] {
                let want = numbers(&time[key]);
                // at the ends of a rest-to-rest motion rates are zero: by one
                let scale = want.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let got = r.of_elastic(got);
                let worst = got.iter().zip(&want).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                assert!(worst < DERIVATIVES * scale, "{key}: {worst:e} of {scale}");
            }
            let rigid = numbers(&time["rigid_motor_torque"]);
            if !rigid.is_empty() {
                let scale = rigid.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let got = r.of_rigid(&motor.tau_m);
                let worst = got.iter().zip(&rigid).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                assert!(worst < DERIVATIVES * scale, "rigid joints: {worst:e}");
            }
        }
        let x = vec![0.1; r.all.len()];
        let complete = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
        let refused = complete.inverse_dynamics([&x; 5], Deflection::Settled).unwrap_err();
        assert!(matches!(refused, FlexJointError::TooFewDerivatives { got: 4, .. }), "{refused}");
    }
}

/// A run of the file.
struct Run<'a> {
    r: &'a Reference,
    joints: ElasticJoints,
    // The solver evaluates through a shared reference.
    ws: RefCell<Workspace>,
    hold: Vec<f64>,
    offset: Vec<f64>,
    size: Vec<f64>,
    speed: Vec<f64>,
    phase: Vec<f64>,
    gain: f64,
}

impl<'a> Run<'a> {
    fn new(r: &'a Reference, run: &Value) -> Self {
        let mut robot = r.robot.clone();
        let factor = number(&run["damping_factor"]);
        robot.joints.iter_mut().for_each(|joint| joint.damping *= factor);
        let (law, rigid) = (&run["motor_torque"], &run["rigid_motor_torque"]);
        let of = |key: &str| r.motors(&law[key], &Value::Null);
        let joints = ElasticJoints::new(&robot).unwrap();
        Self {
            ws: RefCell::new(Workspace::new(&joints)),
            joints,
            hold: r.motors(&law["hold"], &rigid["hold"]),
            offset: of("offset"),
            size: of("size"),
            speed: of("speed"),
            phase: of("phase"),
            gain: number(&rigid["gain"]),
            r,
        }
    }

    fn torque(&self, t: f64, qd: &[f64]) -> Vec<f64> {
        let law = |dof: usize| match self.joints.elastic()[dof] {
            true => self.offset[dof] + self.size[dof] * (self.speed[dof] * t + self.phase[dof]).sin(),
            false => -self.gain * qd[dof],
        };
        (0..qd.len()).map(|dof| self.hold[dof] + law(dof)).collect()
    }

    /// q, θ, q̇, θ̇ of a state, motors by degree of freedom.
    fn parts(&self, x: &[f64]) -> [Vec<f64>; 4] {
        let (nv, half) = (self.r.all.len(), x.len() / 2);
        let motors = |x: &[f64]| {
            let mut all = vec![0.0; nv];
            let elastic = (0..nv).filter(|&dof| self.joints.elastic()[dof]);
            elastic.zip(x).for_each(|(dof, x)| all[dof] = *x);
            all
        };
        let (q, theta, qd, thetad) = (&x[..nv], &x[nv..half], &x[half..half + nv], &x[half + nv..]);
        [q.to_vec(), motors(theta), qd.to_vec(), motors(thetad)]
    }
}

impl ODE<f64, Vec<f64>> for Run<'_> {
    fn diff(&self, t: f64, x: &Vec<f64>, rate: &mut Vec<f64>) {
        let half = x.len() / 2;
        let tau_m = self.torque(t, &x[half..half + self.r.all.len()]);
        self.joints.state_rate_into(&mut self.ws.borrow_mut(), x, &tau_m, rate);
    }
}

#[test]
fn runs_are_the_computed_ones_and_their_books_balance() {
    for r in robots() {
        for value in r.list("runs") {
            let run = Run::new(&r, value);
            let times = value["times"].as_array().unwrap();
            let (nv, motors) = (r.all.len(), r.elastic.len());
            let q = r.joints(&times[0]["position"]);
            let theta = r.motors(&times[0]["motor_position"], &Value::Null);
            let moved: Vec<f64> = (0..nv).filter(|&d| run.joints.elastic()[d]).map(|d| theta[d]).collect();
            let mut x = [&q[..], &moved, &vec![0.0; nv + motors]].concat();
            let differ = value["largest_state_difference"].as_object().unwrap();
            let differ = differ.values().map(number).fold(0.0, f64::max);
            let (tolerance, mut ws) = ((10.0 * differ).max(RUNS), Workspace::new(&run.joints));
            let sample = |x: &[f64], t: f64| {
                let [q, theta, qd, thetad] = run.parts(x);
                let tau_m = run.torque(t, &qd);
                [q, qd, theta, thetad, tau_m]
            };
            fn view(x: &[Vec<f64>; 5]) -> Sample<'_> {
                Sample { q: &x[0], qd: &x[1], theta: &x[2], thetad: &x[3], tau_m: &x[4] }
            }
            let mut before = sample(&x, 0.0);
            let mut audit = PassivityAudit::new(&run.joints, &view(&before));
            for pair in times.windows(2) {
                let (from, to) = (number(&pair[0]["time"]), number(&pair[1]["time"]));
                // the books want the torque nearly linear between their entries
                let entries = 400;
                for k in 0..entries {
                    let at = |k: usize| from + (to - from) * k as f64 / entries as f64;
                    advance(&run, at(k), &mut x, at(k + 1));
                    let now = sample(&x, at(k + 1));
                    audit.advance(&run.joints, &mut ws, at(k + 1) - at(k), &view(&before), &view(&now));
                    before = now;
                }
                let [q, theta, qd, thetad] = run.parts(&x);
                for (key, got) in [
                    ("position", r.of_all(&q)),
                    ("motor_position", r.of_elastic(&theta)),
                    ("velocity", r.of_all(&qd)),
                    ("motor_velocity", r.of_elastic(&thetad)),
                ] {
                    let want = numbers(&pair[1][key]);
                    let worst = got.iter().zip(&want).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                    assert!(worst < tolerance, "{key} at {to}: {worst:e}, allowed {tolerance:e}");
                }
                let energy = audit.energy - audit.start;
                let want = number(&pair[1]["energy"]) - number(&times[0]["energy"]);
                assert!((energy - want).abs() < 1e-7 * number(&pair[1]["energy"]).abs().max(1.0));
                let work = number(&pair[1]["work_in"]);
                assert!((audit.work - work).abs() < 1e-5 * work.abs().max(1.0), "{} {work}", audit.work);
                let lost = number(&pair[1]["energy_lost"]);
                assert!((audit.lost - lost).abs() < 1e-6 * lost.max(1.0), "{} {lost}", audit.lost);
            }
            assert!(audit.worst_defect < 1e-5 * audit.work.abs().max(1.0), "{audit:?}");
            assert!(audit.worst_margin > -1e-6 * audit.work.abs().max(1.0), "{audit:?}");
        }
    }
}

/// Dormand and Prince's 8(5,3) from `t` to `end`.
fn advance(run: &Run, t: f64, x: &mut Vec<f64>, end: f64) {
    type Dop853 = ExplicitRungeKutta<Ordinary, DormandPrince, f64, Vec<f64>, 8, 12, 16>;
    let mut solver = Dop853::dop853().rtol(1e-11).atol(1e-12).max_steps(usize::MAX);
    solver.init(run, t, end, x).unwrap();
    while end - solver.t() > 1e-12 {
        if solver.t() + solver.h() > end {
            solver.set_h(end - solver.t());
        }
        solver.step(run).unwrap();
    }
    x.copy_from_slice(solver.y());
}
