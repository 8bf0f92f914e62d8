//! The frequency response against a run: a chirp through the simulator, and what is estimated from its log.
//!
//! The torque is a chirp of one period over and over, held between samples. Each period gives an estimate of the
//! response at every line of the band; their scatter is the uncertainty of their mean, by which each line is judged.

use core::f64::consts::TAU;

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use sinew_data::Quantity;
use sinew_linear::{StateSpace, Transfer, discretize, linearize};
use sinew_model::{BeamSection, Bending, EffectSpec, LinkId, Place, Robot};
use sinew_simulate::{Options, Start, Tolerance, Torques, simulate};

use crate::robots::{planar_2r, plant};

// Time between samples, s, samples of a period, periods until the start is forgotten, periods that count.
const HOLD: f64 = 2e-3;
const PERIOD: usize = 1024;
const SETTLING: usize = 6;
const PERIODS: usize = 8;
// Lines of the band: 1 to 60 Hz.
const LINES: core::ops::Range<usize> = 2..124;
// N·m: some mrad, so that what gravity and inertia bend stays below the noise (tested below).
const AMPLITUDE: f64 = 0.1;
// Hanging obliquely, so that gravity holds the arm there on its own.
const AT: [f64; 2] = [-1.2, 0.5];
const SIGNALS: [(Quantity, f64); 3] =
    [(Quantity::MotorPosition, 2e-5), (Quantity::JointPosition, 2e-5), (Quantity::JointTorque, 2e-3)];
const JOINTS: [&str; 2] = ["shoulder", "elbow"];
// Neighbours of a line that sampling folds onto it, on each side. Those left out are below 5e-4 of it (tested below).
const FOLDED: i32 = 60;

// The elastic arm with grease in its gears.
fn arm() -> Robot {
    let mut robot = planar_2r();
    for joint in JOINTS {
        let grease = EffectSpec::new("viscous_friction", Place::Joint(joint.into()));
        robot.effects.push(grease.with("viscous", 2.0));
    }
    robot
}

// The same with an upper arm that bends.
fn bending_arm() -> Robot {
    let mut robot = arm();
    let beam = BeamSection {
        length: 0.5,
        flexural_rigidity: 60.0,
        torsional_rigidity: None,
        mass_per_length: 4.0,
        polar_inertia_per_length: 0.0,
    };
    let bending = Bending::beam(LinkId(1), &['y'], 2, &[beam]);
    robot.bending.push(Bending { damping_ratio: 0.02, ..bending });
    robot
}

// The same, its upper arm following its load at once.
fn following_arm() -> Robot {
    let mut robot = bending_arm();
    robot.bending[0].quasi_static = true;
    robot
}

fn chirp() -> Vec<f64> {
    let (length, low, high) = (PERIOD as f64, LINES.start as f64, LINES.end as f64);
    let phase = |s: f64| TAU * (low * s + 0.5 * (high - low) * s * s);
    (0..PERIOD).map(|k| AMPLITUDE * phase(k as f64 / length).sin()).collect()
}

// Σ_k x_k e^{−2πi·line·k/N}
fn line_of(x: &[f64], line: usize) -> c64 {
    let turn = |k: usize| c64::cis(-TAU * ((k * line) % x.len()) as f64 / x.len() as f64);
    x.iter().enumerate().map(|(k, x)| turn(k) * *x).sum()
}

fn omega(line: usize) -> f64 {
    TAU * line as f64 / (PERIOD as f64 * HOLD)
}

// Samples of one signal over the periods that count, under a chirp in the drive of `driven`.
struct Log(Vec<(String, Vec<f64>)>);

fn run(robot: &Robot, driven: usize, noise: f64) -> Log {
    let plant = plant(robot);
    let p = plant.parameters();
    let linear = linearize(&plant, &p, &AT).unwrap();
    let samples = (SETTLING + PERIODS) * PERIOD;
    let mut options = Options::new(&plant, samples as f64 * HOLD, HOLD);
    options.start = Start::balanced(&plant, &p, &AT).unwrap();
    options.tolerance = Tolerance { relative: 1e-8, absolute: 1e-9 };
    options.seed = 7 + driven as u64;
    for (quantity, std) in SIGNALS {
        options.noise = options.noise.with(quantity, noise * std, 0.0);
    }
    let torque = |joint: usize| -> Vec<f64> {
        let hold = linear.at.tau_m[plant.joints()[joint]];
        let shape = chirp();
        let push = |k: usize| if joint == driven { shape[k % PERIOD] } else { 0.0 };
        (0..=samples).map(|k| hold + push(k)).collect()
    };
    let mut drive = Torques { time: options.times.clone(), tau: vec![torque(0), torque(1)] };
    let run = simulate(&plant, &p, &mut drive, &options).unwrap().run;
    let counted = SETTLING * PERIOD..samples;
    let all = SIGNALS.iter().flat_map(|(q, _)| JOINTS.map(|joint| (*q, joint)));
    Log(all
        .map(|(q, joint)| {
            let values = run.signal(q, joint).unwrap().values[counted.clone()].to_vec();
            (format!("{q}.{joint}"), values)
        })
        .collect())
}

// What one period of the samples shows of each line: the response folded by sampling.
//
//   H(ω) = Σ_k G(i(ω + k ω_s)) · (1 − e^{−iωh})/(i(ω + k ω_s) h)
fn held(response: &Transfer, omega: f64, folded: i32) -> c64 {
    let one = c64::new(1.0, 0.0) - c64::cis(-omega * HOLD);
    let term = |k: i32| {
        let w = omega + TAU * f64::from(k) / HOLD;
        response.at(w) * one / c64::new(0.0, w * HOLD)
    };
    (-folded..=folded).map(term).sum()
}

// The estimate of a line: mean over the periods, and the variance of that mean.
fn estimate(values: &[f64], torque: &[f64], line: usize) -> (c64, f64) {
    let by = line_of(torque, line);
    let each: Vec<c64> = values.chunks(PERIOD).map(|period| line_of(period, line) / by).collect();
    let n = each.len() as f64;
    let mean = each.iter().sum::<c64>() / n;
    let scatter: f64 = each.iter().map(|h| (*h - mean).norm_sqr()).sum();
    (mean, scatter / (n - 1.0) / n)
}

/// How improbable the distance of each line from `model` is, if nothing but noise parts them.
///
/// |H − G|²/σ² follows F(2, m) with m = 2 (periods − 1), of which P(F > x) = (1 + 2x/m)^(−m/2).
fn probabilities(log: &Log, driven: usize, model: &StateSpace) -> Vec<(String, Vec<f64>)> {
    let (torque, m) = (chirp(), 2.0 * (PERIODS as f64 - 1.0));
    let of = |(name, values): &(String, Vec<f64>)| {
        let response = Transfer::new(model, &format!("motor_torque.{}", JOINTS[driven]), name).unwrap();
        let at = |line| {
            let (mean, variance) = estimate(values, &torque, line);
            let distance = (mean - held(&response, omega(line), FOLDED)).norm_sqr() / variance;
            (1.0 + 2.0 * distance / m).powf(-m / 2.0)
        };
        (name.clone(), LINES.map(at).collect())
    };
    log.0.iter().map(of).collect()
}

fn model(robot: &Robot) -> StateSpace {
    let plant = plant(robot);
    linearize(&plant, &plant.parameters(), &AT).unwrap()
}

// −ln p of a true model is exponential: Σ has mean and variance n.
fn surprise(p: &[f64]) -> f64 {
    let n = p.len() as f64;
    (p.iter().map(|p| -p.ln()).sum::<f64>() - n) / n.sqrt()
}

// Standard deviations that the sum of all lines of a signal may be off; of thirty-six signals one is beyond with 2e-3.
const SUM: f64 = 4.0;
// The least probability of one line among the 122 of a signal.
const WORST: f64 = 1e-6;

#[test]
fn a_frequency_response_estimated_from_a_chirp_agrees_within_its_own_uncertainty() {
    for robot in [arm(), bending_arm(), following_arm()] {
        let model = model(&robot);
        for driven in [0, 1] {
            for (name, p) in probabilities(&run(&robot, driven, 1.0), driven, &model) {
                let worst = p.iter().copied().fold(1.0, f64::min);
                let sum = surprise(&p);
                println!("{} to {name}: sum {sum:+.2} σ, least probability {worst:.1e}", JOINTS[driven]);
                assert!(sum.abs() < SUM && worst > WORST, "{name}: {sum} σ, {worst:e}");
            }
        }
    }
}

#[test]
fn a_spring_two_per_cent_too_stiff_or_a_link_taken_for_rigid_is_seen_by_the_same_chirp() {
    for (dof, joint) in JOINTS.iter().enumerate() {
        let robot = arm();
        let mut wrong = robot.clone();
        wrong.joints[dof].stiffness = wrong.joints[dof].stiffness.map(|k| 1.02 * k);
        let (mut least, mut most) = (1.0f64, f64::NEG_INFINITY);
        for (name, p) in probabilities(&run(&robot, dof, 1.0), dof, &model(&wrong)) {
            let worst = p.iter().copied().fold(1.0, f64::min);
            println!("{joint} 2 % stiffer, {name}: sum {:+.1} σ, {worst:.1e}", surprise(&p));
            least = least.min(worst);
            most = most.max(surprise(&p));
        }
        assert!(least < WORST && most > 3.0 * SUM, "{joint}: {least:e} {most}");
    }
    let rigid = model(&arm());
    let seen = probabilities(&run(&bending_arm(), 0, 1.0), 0, &rigid);
    assert!(seen.iter().all(|(_, p)| surprise(p) > 10.0 * SUM));
}

#[test]
fn what_the_linear_model_leaves_out_is_below_the_uncertainty_of_every_line() {
    for robot in [arm(), bending_arm(), following_arm()] {
        let model = model(&robot);
        let (torque, lines) = (chirp(), PERIOD as f64 * PERIODS as f64);
        let silent = run(&robot, 0, 0.0);
        for ((name, values), std) in silent.0.iter().zip(SIGNALS.iter().flat_map(|(_, s)| [*s, *s])) {
            let response = Transfer::new(&model, "motor_torque.shoulder", name).unwrap();
            let share = |line| {
                let (mean, _) = estimate(values, &torque, line);
                let by = line_of(&torque, line).norm();
                // White noise of this size gives a line of one period the variance N σ².
                let noise = std * PERIOD as f64 / lines.sqrt() / by;
                (mean - held(&response, omega(line), FOLDED)).norm() / noise
            };
            let worst = LINES.map(share).fold(0.0, f64::max);
            println!("{name}: left out {worst:.3} of the uncertainty");
            assert!(worst < 0.25, "{name}: {worst}");
        }
    }
}

// The two ways to the response of sampled signals: folding what `frf` gives, and the model of `--sample-time`.
#[test]
fn the_folded_response_is_that_of_the_sampled_model() {
    let continuous = model(&bending_arm());
    let sampled = discretize(&continuous, HOLD).unwrap();
    let n = sampled.A.nrows();
    for name in ["motor_position.shoulder", "joint_position.elbow", "joint_torque.shoulder"] {
        let response = Transfer::new(&continuous, "motor_torque.shoulder", name).unwrap();
        let row = sampled.outputs.iter().position(|o| o == name).unwrap();
        for line in [2, 20, 60, 123] {
            // C (z − A)⁻¹ B + D at z = e^{iωh}
            let z = c64::cis(omega(line) * HOLD);
            let pencil = Mat::from_fn(n, n, |i, j| {
                let own = if i == j { z } else { c64::new(0.0, 0.0) };
                own - c64::new(sampled.A[(i, j)], 0.0)
            });
            let b = Mat::from_fn(n, 1, |i, _| c64::new(sampled.B[(i, 0)], 0.0));
            let x = pencil.partial_piv_lu().solve(&b);
            let direct: c64 = (0..n).map(|j| x[(j, 0)] * sampled.C[(row, j)]).sum();
            let off = |folded| (held(&response, omega(line), folded) - direct).norm() / direct.norm();
            // What is left out falls with the number of terms, and with its cube where no damper hands torque on.
            let (few, many) = (off(FOLDED), off(4 * FOLDED));
            assert!(few < 5e-4 && (many < 0.3 * few || many < 1e-9), "{name} {line}: {few:e} {many:e}");
        }
    }
}
