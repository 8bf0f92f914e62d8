//! The lesson's one-joint example: frequencies, poles and limits in closed form.

use faer::c64;
use sinew_linear::linearize;
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};

use crate::robots::{modes_of, plant};

const J: f64 = 0.5;
const B: f64 = 0.05;
const K: f64 = 150.0;
const D: f64 = 0.5;
const LINK: f64 = 0.02;
const MOTOR: f64 = 0.01;
const GRAVITY: f64 = 2.0 * 9.81 * 0.4;

fn robot(stiffness: f64, rotor: f64) -> Robot {
    let mut robot = Robot::rigid(samples::hanging_link(J, 2.0, 0.4));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (Some(stiffness), rotor);
    robot
}

fn damped() -> Robot {
    let mut robot = robot(K, B);
    robot.joints[0].damping = D;
    for (kind, value) in [("link_viscous_friction", LINK), ("viscous_friction", MOTOR)] {
        robot.effects.push(EffectSpec::new(kind, Place::Joint("joint".into())).with("viscous", value));
    }
    robot
}

fn weightless(mut robot: Robot) -> Robot {
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    robot
}

// ω² of J B ω⁴ − (J K + B (K + g)) ω² + g K = 0, slowest first.
fn exact(gravity: f64) -> [f64; 2] {
    let half = (J * K + B * (K + gravity)) / (2.0 * J * B);
    let fast = half + (half * half - gravity * K / (J * B)).sqrt();
    [gravity * K / (J * B) / fast, fast]
}

// A root of det(M s² + D s + K) near `start`, by Newton's method in complex numbers.
fn pole(start: c64) -> c64 {
    let c = [J * B, J * (D + MOTOR) + B * (D + LINK), 0.0, 0.0, GRAVITY * K];
    let c2 = J * K + B * (K + GRAVITY) + (D + LINK) * (D + MOTOR) - D * D;
    let c1 = (D + LINK) * K + (K + GRAVITY) * (D + MOTOR) - 2.0 * D * K;
    let c = [c[0], c[1], c2, c1, c[4]];
    let mut s = start;
    for _ in 0..50 {
        let (mut p, mut dp) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
        for a in c {
            dp = dp * s + p;
            p = p * s + c64::new(a, 0.0);
        }
        s -= p / dp;
    }
    s
}

fn near(a: f64, b: f64, scale: f64) {
    assert!((a - b).abs() < 1e-9 * scale, "{a} {b}");
}

#[test]
fn natural_frequencies_are_the_lessons() {
    for (robot, gravity, printed) in [
        (robot(K, B), GRAVITY, [3.77662507, 57.45809867]),
        (weightless(robot(K, B)), 0.0, [0.0, 57.44562647]),
    ] {
        let (modes, exact) = (modes_of(&robot, &[0.0]), exact(gravity));
        for k in 0..2 {
            near(modes[k].omega, exact[k].sqrt(), exact[1].sqrt());
            assert!((modes[k].omega - printed[k]).abs() < 1e-8);
            near(modes[k].frequency * core::f64::consts::TAU, modes[k].omega, 1.0);
        }
    }
}

#[test]
fn poles_are_the_lessons() {
    let modes = modes_of(&damped(), &[0.0]);
    let printed = [c64::new(-0.02734636, 3.77652822), c64::new(-5.59265364, 57.18523898)];
    for (mode, printed) in modes.iter().zip(printed) {
        let exact = pole(printed);
        assert!((exact - printed).norm() < 1e-8);
        let [a, b] = mode.poles[..] else { panic!("{:?}", mode.poles) };
        assert!((a - exact).norm() < 1e-9 * 57.0 && (b - exact.conj()).norm() < 1e-9 * 57.0, "{a} {b}");
        near(mode.damping_ratio.unwrap(), -exact.re / exact.norm(), 1.0);
        assert!(mode.stable);
    }
}

#[test]
fn motions_without_stiffness_have_exactly_zero_frequency() {
    let free = &modes_of(&weightless(robot(K, B)), &[0.3])[0];
    assert_eq!((free.omega, free.frequency, free.damping_ratio), (0.0, 0.0, None));
    assert!(free.stable);
    let zero = c64::new(0.0, 0.0);
    assert_eq!(free.poles, [zero, zero]);
    // Motor and link go together.
    assert!((free.shape[0].1 - free.shape[1].1).abs() < 1e-12);
    assert_eq!(
        free.shape.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        ["q.joint", "theta.joint"]
    );
}

#[test]
fn upright_the_slow_mode_falls_over() {
    let mode = &modes_of(&damped(), &[core::f64::consts::PI])[0];
    assert!(mode.omega_squared < 0.0 && mode.omega == 0.0 && !mode.stable, "{mode:?}");
}

// Problem 2: a light rotor leaves the band, a heavy one is a wall; a soft spring gives the link alone.
#[test]
fn rotor_limits_of_the_flexible_mode() {
    let flexible = |rotor: f64| modes_of(&weightless(robot(K, rotor)), &[0.0])[1].omega;
    for rotor in [1e-6, 1e-2, 1.0, 1e6] {
        near(flexible(rotor), (K * (1.0 / J + 1.0 / rotor)).sqrt(), flexible(rotor));
    }
    near(flexible(1e12), (K / J).sqrt(), 1.0);
    assert!(flexible(1e-6) > 1e4);
}

#[test]
fn stiff_joints_give_back_the_rigid_mode() {
    let rigid = (GRAVITY / (J + B)).sqrt();
    let error = |stiffness: f64| (modes_of(&robot(stiffness, B), &[0.0])[0].omega - rigid).abs();
    let order = (error(1e3) / error(1e4)).log10();
    assert!((order - 1.0).abs() < 0.01, "{order}");
    let mut stiffless = robot(K, B);
    stiffless.joints[0].stiffness = None;
    near(modes_of(&stiffless, &[0.0])[0].omega, rigid, 1.0);
}

#[test]
fn inputs_and_outputs_are_named_and_true() {
    let plant = plant(&damped());
    let linear = linearize(&plant, &plant.parameters(), &[0.4]).unwrap();
    assert_eq!(linear.states, ["q.joint", "theta.joint", "qd.joint", "thetad.joint"]);
    assert_eq!(linear.inputs, ["motor_torque.joint"]);
    assert_eq!(linear.outputs[4], "joint_torque.joint");
    // τ_J = K (θ − q) + D (θ̇ − q̇)
    let row: Vec<f64> = (0..4).map(|k| linear.C[(4, k)]).collect();
    for (a, b) in row.iter().zip([-K, K, -D, D]) {
        near(*a, b, K);
    }
    near(linear.B[(3, 0)], 1.0 / B, 1.0 / B);
    // At rest: the spring carries gravity and the motor the spring.
    let torque = GRAVITY * 0.4f64.sin();
    near(linear.at.tau_m[0], torque, 1.0);
    near(linear.at.theta[0], 0.4 + torque / K, 1.0);
}

#[test]
fn springs_that_harden_or_have_play_find_their_rest() {
    let q = 0.4f64;
    let torque = GRAVITY * q.sin();
    let rest = |kind: &str, key: &str, value: f64| {
        let mut robot = robot(K, B);
        robot.effects.push(EffectSpec::new(kind, Place::Joint("joint".into())).with(key, value));
        let plant = plant(&robot);
        linearize(&plant, &plant.parameters(), &[q]).unwrap().at.theta[0] - q
    };
    let (cubic, half_width) = (1e7, 0.02);
    let delta = rest("stiffness_hardening", "cubic", cubic);
    near(K * delta + cubic * delta.powi(3), torque, torque);
    let delta = rest("backlash", "half_width", half_width);
    near(K * (delta - half_width), torque, torque);
}
