//! Laws of elastic joints: energy, passivity, the rigid limit, and the closed form of one joint.
#![allow(non_snake_case)]

use sinew_flex_joint::{ElasticJoints, Workspace};
use sinew_model::{Coupling, Dual, Robot, Scalar, samples};

/// Rounding of sums along four joints.
const ALGEBRA: f64 = 1e-11;

/// Four joints: two coupled elastic ones, one rigid, one elastic.
fn mixed_arm(damping: f64) -> ElasticJoints {
    let mut robot = Robot::rigid(samples::planar_arm(4, 1.5, 0.4));
    robot.joints.iter_mut().enumerate().for_each(|(k, j)| j.rotor_inertia = 0.05 + 0.01 * k as f64);
    robot.couplings.push(Coupling {
        dofs: vec![0, 2],
        stiffness: vec![300.0, 60.0, 60.0, 200.0],
        damping: [0.5, 0.1, 0.1, 0.3].map(|d| d * damping).to_vec(),
    });
    robot.joints[3].stiffness = Some(100.0);
    robot.joints[3].damping = 0.2 * damping;
    ElasticJoints::new(&robot).expect("the springs are sound")
}

/// The lesson's joint with a spring of `stiffness` N·m/rad.
fn hanging_link(stiffness: f64, damping: f64) -> ElasticJoints {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(stiffness);
    robot.joints[0].damping = damping;
    robot.joints[0].rotor_inertia = 0.05;
    ElasticJoints::new(&robot).expect("the spring is sound")
}

// A few states without chance: numbers of size one.
fn state(seed: usize) -> [[f64; 4]; 5] {
    let number = |k: usize| (1.7 * (1 + 20 * seed + k) as f64).sin();
    core::array::from_fn(|row| core::array::from_fn(|k| number(4 * row + k)))
}

// dH/dt along the motion that the joints make by themselves.
fn energy_rate(arm: &ElasticJoints, [q, qd, theta, thetad, tau_m]: &[[f64; 4]; 5]) -> f64 {
    let (qdd, thetadd) = arm.forward_dynamics(q, qd, theta, thetad, tau_m);
    let moving = |x: &[f64], rate: &[f64]| -> Vec<Dual<1>> {
        x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
    };
    let (q, theta) = (moving(q, qd), moving(theta, thetad));
    let (qd, thetad) = (moving(qd, qdd.as_slice()), moving(thetad, thetadd.as_slice()));
    arm.energy_with(&mut Workspace::new(arm), &q, &qd, &theta, &thetad).derivative[0]
}

#[test]
fn power_in_equals_energy_rate_plus_power_lost() {
    for seed in 0..20 {
        let arm = mixed_arm(1.0);
        let x = state(seed);
        let [_, qd, _, thetad, tau_m] = &x;
        let motor = |dof: usize| if arm.elastic()[dof] { thetad[dof] } else { qd[dof] };
        let power_in: f64 = (0..4).map(|dof| tau_m[dof] * motor(dof)).sum();
        let lost = arm.power_lost(qd, thetad);
        assert!((energy_rate(&arm, &x) - power_in + lost).abs() < ALGEBRA * (1.0 + power_in.abs() + lost));
    }
}

#[test]
fn nothing_is_lost_without_damping_and_motor_torque() {
    for seed in 0..20 {
        let mut x = state(seed);
        x[4] = [0.0; 4];
        assert!(energy_rate(&mixed_arm(0.0), &x).abs() < ALGEBRA);
    }
}

#[test]
fn energy_never_grows_without_motor_torque() {
    for seed in 0..20 {
        let mut x = state(seed);
        x[4] = [0.0; 4];
        assert!(energy_rate(&mixed_arm(1.0), &x) < 0.0);
    }
}

#[test]
fn joints_at_equilibrium_stay() {
    let arm = mixed_arm(1.0);
    for seed in 0..20 {
        let [q, ..] = state(seed);
        let (theta, tau_m) = arm.equilibrium(&q);
        let still = [0.0; 4];
        let (qdd, thetadd) = arm.forward_dynamics(&q, &still, theta.as_slice(), &still, tau_m.as_slice());
        assert!(qdd.amax().max(thetadd.amax()) < 1e-9, "{qdd} {thetadd}");
    }
}

#[test]
fn a_robot_without_springs_is_the_rigid_robot_with_its_rotors() {
    let mut robot = Robot::rigid(samples::planar_arm(4, 1.5, 0.4));
    robot.joints.iter_mut().for_each(|j| j.rotor_inertia = 0.05);
    let arm = ElasticJoints::new(&robot).expect("rigid joints need no spring");
    let [q, qd, theta, thetad, tau_m] = state(3);
    let (qdd, thetadd) = arm.forward_dynamics(&q, &qd, &theta, &thetad, &tau_m);
    // (M + B) q̈ + C q̇ + g = τ_m
    let torque = sinew_rigid::inverse_dynamics(&robot.model, &q, &qd, qdd.as_slice());
    for dof in 0..4 {
        assert!((torque[dof] + 0.05 * qdd[dof] - tau_m[dof]).abs() < ALGEBRA);
        assert_eq!(qdd[dof], thetadd[dof]);
    }
}

// ∂(q̈, θ̈)/∂(q, θ, q̇, θ̇) of one joint, hanging at rest.
fn linearised(arm: &ElasticJoints) -> [[f64; 4]; 2] {
    let x: [Dual<4>; 4] = core::array::from_fn(|k| Dual::variable(0.0, k));
    let (mut qdd, mut thetadd) = ([Dual::ZERO], [Dual::ZERO]);
    let [q, theta, qd, thetad] = x.each_ref().map(core::slice::from_ref);
    let ws = &mut Workspace::new(arm);
    arm.forward_dynamics_with(ws, q, qd, theta, thetad, &[Dual::ZERO], &mut qdd, &mut thetadd);
    [qdd[0].derivative, thetadd[0].derivative]
}

// Undamped frequencies, slow and fast: roots of ω⁴ + tr ω² + det = 0.
fn frequencies(arm: &ElasticJoints) -> [f64; 2] {
    let [[a, b, ..], [c, d, ..]] = linearised(arm);
    let (half, det) = (-(a + d) / 2.0, a * d - b * c);
    let fast = half + (half * half - det).sqrt();
    [(det / fast).sqrt(), fast.sqrt()]
}

#[test]
fn the_lessons_joint_has_its_closed_form_frequencies() {
    let [slow, fast] = frequencies(&hanging_link(150.0, 0.5));
    assert!((slow - 3.77662507).abs() < 5e-9 && (fast - 57.45809867).abs() < 5e-9, "{slow} {fast}");
}

#[test]
fn stiff_joints_give_back_the_rigid_robot() {
    // ω² = m g ℓ/(J + B); the error is of order one in 1/K
    let rigid = (2.0 * 9.81 * 0.4 / 0.55_f64).sqrt();
    let error = |K: f64| (frequencies(&hanging_link(K, 0.0))[0] - rigid).abs();
    for K in [1e3, 1e4, 1e5] {
        let ratio = error(K) / error(10.0 * K);
        assert!((ratio - 10.0).abs() < 0.1, "at {K}: {ratio}");
    }
    assert!(error(1e6) < 1e-4);
}

#[test]
fn the_lessons_joint_moves_as_computed() {
    let arm = hanging_link(150.0, 0.5);
    // The lesson's bearings drag: −b_ℓ q̇ on the link of 0.5 kg·m², −b_m θ̇ on the motor.
    let rate = |x: [f64; 4]| {
        let [q, theta, qd, thetad] = x;
        let (qdd, thetadd) = arm.forward_dynamics(&[q], &[qd], &[theta], &[thetad], &[1.0 - 0.01 * thetad]);
        [qd, thetad, qdd[0] - 0.02 * qd / 0.5, thetadd[0]]
    };
    let plus = |x: [f64; 4], k: [f64; 4], h: f64| core::array::from_fn(|i| x[i] + h * k[i]);
    let h = 2.5e-4;
    let mut x = [0.0; 4];
    for [q, theta] in [
        [0.16596843, 0.17314864],
        [0.23097613, 0.23812532],
        [0.03023677, 0.03645862],
        [0.08695858, 0.09340352],
    ] {
        for _ in 0..2000 {
            // Runge–Kutta of order four
            let a = rate(x);
            let b = rate(plus(x, a, h / 2.0));
            let c = rate(plus(x, b, h / 2.0));
            let d = rate(plus(x, c, h));
            x = core::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        assert!((x[0] - q).abs() < 1e-8 && (x[1] - theta).abs() < 1e-8, "{x:?}, want {q} {theta}");
    }
}
