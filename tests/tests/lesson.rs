//! The lesson, line by line: what it states, and where it had to be corrected (`docs/errata.md`).
//!
//! Each test is named after its line. The longer runs are tests of the crates: a hundred seconds without loss of
//! energy and two-link arms in `sinew-simulate`, coupled springs in `sinew-flex-joint`, repeated modes in `sinew-linear`.
#![allow(non_snake_case)]

use core::f64::consts::PI;

use sinew_data::Quantity;
use sinew_effect::Derivative;
use sinew_effects::CATALOGUE;
use sinew_flex_joint::{Deflection, ElasticJoints, PassivityAudit, Sample, Scratch, SpinInertia, Workspace};
use sinew_kinematics::{Axes, compliance, jacobian};
use sinew_linear::{Mode, modes};
use sinew_model::samples::{Random, hanging_link, planar_arm};
use sinew_model::{
    Dual, EffectSpec, Inertia, JointShape, JointSpec, ModelBuilder, Place, Pose, Robot, Scalar, Vector3,
};
use sinew_plant::{Dynamics, Plant, Rates, State};
use sinew_simulate::{Options, Torques, simulate};

// The example of §6.
const J_L: f64 = 0.5;
const J_M: f64 = 0.05;
const B_L: f64 = 0.02;
const B_M: f64 = 0.01;
const K: f64 = 150.0;
const D: f64 = 0.5;
const WEIGHT: f64 = 2.0 * 9.81 * 0.4;
const TAU_0: f64 = 1.0;

/// Rounding of a few operations on numbers of size one.
const ALGEBRA: f64 = 1e-12;
/// Eigenvalues, relative to the largest.
const SPECTRUM: f64 = 1e-9;
/// Half of the last digit printed.
const PRINTED: f64 = 5.1e-9;

// The joint without any loss; a rigid one if `stiffness` is none.
fn lossless(stiffness: Option<f64>, rotor: f64) -> Robot {
    let mut robot = Robot::rigid(hanging_link(J_L, 2.0, 0.4));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (stiffness, rotor);
    robot
}

fn example() -> Robot {
    let mut robot = lossless(Some(K), J_M);
    robot.joints[0].damping = D;
    for (kind, value) in [("link_viscous_friction", B_L), ("viscous_friction", B_M)] {
        robot.effects.push(EffectSpec::new(kind, Place::Joint("joint".into())).with("viscous", value));
    }
    robot
}

fn weightless(mut robot: Robot) -> Robot {
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    robot
}

fn plant(robot: &Robot) -> Plant {
    Plant::new(robot, &CATALOGUE).unwrap()
}

fn modes_of(robot: &Robot, q: f64) -> Vec<Mode> {
    let plant = plant(robot);
    modes(&plant, &plant.parameters(), &[q]).unwrap()
}

fn constants(p: &[f64]) -> Vec<Derivative> {
    p.iter().map(|&x| Derivative::constant(x)).collect()
}

fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

// Random states [q, q̇, θ, θ̇, τ_m].
fn states() -> Vec<[f64; 5]> {
    let mut random = Random::new(14);
    let mut number = |size: f64| random.uniform(-size, size);
    (0..50).map(|_| [number(3.0), number(5.0), number(3.0), number(5.0), number(10.0)]).collect()
}

#[test]
fn problem_1_the_slopes_of_the_lagrangian_have_these_signs() {
    let plant = plant(&lossless(Some(K), J_M));
    let p = constants(&plant.parameters());
    for [q, _, theta, ..] in states() {
        let mut x = State::zero(&plant);
        x.q[0] = Derivative::variable(q, 0);
        x.theta[0] = Derivative::variable(theta, 1);
        // At rest L = −U.
        let slope = Dynamics::new(&plant, &p).energy(&x).derivative.map(|d| -d);
        near(slope[0], -WEIGHT * q.sin() + K * (theta - q), 1e3 * ALGEBRA);
        near(slope[1], -K * (theta - q), 1e3 * ALGEBRA);
    }
}

#[test]
fn section_2_the_equations_of_motion_hold_in_any_state() {
    let plant = plant(&example());
    let p = plant.parameters();
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    for [q, qd, theta, thetad, tau_m] in states() {
        let mut x = State::zero(&plant);
        (x.q[0], x.qd[0], x.theta[0], x.thetad[0]) = (q, qd, theta, thetad);
        dynamics.forward(&x, &[tau_m], &mut rates);
        let spring = K * (theta - q) + D * (thetad - qd);
        near(J_L * rates.qdd[0], spring - WEIGHT * q.sin() - B_L * qd, 1e3 * ALGEBRA);
        near(J_M * rates.thetadd[0], tau_m - spring - B_M * thetad, 1e3 * ALGEBRA);
    }
}

#[test]
fn section_2_1_natural_frequencies_are_the_closed_form() {
    for (robot, gravity, printed) in [
        (lossless(Some(K), J_M), WEIGHT, [3.77662507, 57.45809867]),
        (weightless(lossless(Some(K), J_M)), 0.0, [0.0, 57.44562647]),
    ] {
        // J_ℓ J_m ω⁴ − (J_ℓ k + J_m (k + m g ℓ)) ω² + m g ℓ k = 0
        let half = (J_L * K + J_M * (K + gravity)) / (2.0 * J_L * J_M);
        let fast = half + (half * half - gravity * K / (J_L * J_M)).sqrt();
        let exact = [(gravity * K / (J_L * J_M) / fast).sqrt(), fast.sqrt()];
        for (mode, (exact, printed)) in modes_of(&robot, 0.0).iter().zip(exact.into_iter().zip(printed)) {
            near(mode.omega, exact, SPECTRUM);
            near(mode.omega, printed, PRINTED);
        }
    }
}

#[test]
fn section_2_1_zero_hangs_and_is_stable_and_upright_falls_over() {
    let robot = example();
    assert!(modes_of(&robot, 0.0).iter().all(|mode| mode.stable));
    let upright = &modes_of(&robot, PI)[0];
    assert!(!upright.stable && upright.omega_squared < 0.0);
    // The spring's slope in gravity: +m g ℓ below, −m g ℓ above.
    for (q, slope) in [(0.0, WEIGHT), (PI, -WEIGHT)] {
        let rigid = &modes_of(&lossless(None, J_M), q)[0];
        near(rigid.omega_squared, slope / (J_L + J_M), ALGEBRA * 1e3);
    }
}

#[test]
fn section_2_1_poles_with_damping_are_the_printed_ones() {
    let c2 = J_L * K + J_M * (K + WEIGHT) + (D + B_L) * (D + B_M) - D * D;
    let c1 = (D + B_L) * K + (K + WEIGHT) * (D + B_M) - 2.0 * D * K;
    let polynomial = [J_L * J_M, J_L * (D + B_M) + J_M * (D + B_L), c2, c1, WEIGHT * K];
    let printed = [(-0.02734636, 3.77652822), (-5.59265364, 57.18523898)];
    for (mode, (re, im)) in modes_of(&example(), 0.0).iter().zip(printed) {
        let s = mode.poles[0];
        near(s.re, re, PRINTED);
        near(s.im, im, PRINTED);
        // Newton's step towards the root of det(M s² + D s + K): the distance that is left.
        let (mut value, mut slope) = (s * 0.0, s * 0.0);
        for c in polynomial {
            slope = slope * s + value;
            value = value * s + c;
        }
        assert!((value / slope).norm() < SPECTRUM, "{s} is no root");
    }
}

#[test]
fn problem_2_only_a_heavy_rotor_is_a_wall_and_a_light_one_leaves_the_band() {
    let flexible = |rotor: f64| modes_of(&weightless(lossless(Some(K), rotor)), 0.0)[1].omega;
    for rotor in [1e-6, 1e-3, 1.0, 1e3] {
        let exact = (K * (1.0 / J_L + 1.0 / rotor)).sqrt();
        near(flexible(rotor), exact, SPECTRUM * exact);
    }
    near(flexible(1e12), (K / J_L).sqrt(), SPECTRUM * 17.0);
    // A rotor a hundred times lighter makes the mode ten times faster.
    near(flexible(1e-8) / flexible(1e-6), 10.0, 1e-4);
}

#[test]
fn section_3_the_elastic_torque_drives_the_link_and_holds_the_motor_back() {
    let plant = plant(&weightless(lossless(Some(K), J_M)));
    let p = plant.parameters();
    let (mut x, mut rates) = (State::zero(&plant), Rates::new(&plant));
    x.theta[0] = 0.1;
    Dynamics::new(&plant, &p).forward(&x, &[0.0], &mut rates);
    near(rates.tau_j[0], 0.1 * K, ALGEBRA * 1e3);
    near(J_L * rates.qdd[0], rates.tau_j[0], ALGEBRA * 1e3);
    near(J_M * rates.thetadd[0], -rates.tau_j[0], ALGEBRA * 1e3);
}

#[test]
fn section_2_1_the_linear_model_has_the_matrices_of_the_lesson() {
    // M z̈ + K z = 0,   z = (q, θ):   A = [0 1; −M⁻¹K 0] with K = [m g ℓ + k, −k; −k, k]
    let joint = ElasticJoints::new(&lossless(Some(K), J_M)).unwrap();
    for (q, gravity) in [(0.0, WEIGHT), (PI, -WEIGHT)] {
        let (A, B) = joint.linearize(&[q, q, 0.0, 0.0], &[0.0]);
        let want = [[-(gravity + K) / J_L, K / J_L], [K / J_M, -K / J_M]];
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            near(A[(row, column)], if row + 2 == column { 1.0 } else { 0.0 }, 0.0);
            near(A[(row + 2, column)], want[row][column], 1e4 * ALGEBRA);
            near(A[(row, column + 2)], if row == column { 1.0 } else { 0.0 }, 0.0);
            near(A[(row + 2, column + 2)], 0.0, 0.0);
        }
        assert_eq!(B.as_slice(), [0.0, 0.0, 0.0, 1.0 / J_M]);
    }
}

// A chain of three such joints, the middle one rigid, with rotors geared 1:20.
fn chain(damping: f64) -> Robot {
    let mut robot = Robot::rigid(planar_arm(3, 1.5, 0.4));
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        (joint.rotor_inertia, joint.gear_ratio) = (0.05 + 0.01 * k as f64, Some(20.0));
        (joint.stiffness, joint.damping) = ((k != 1).then_some(120.0), damping);
    }
    robot
}

#[test]
fn section_3_the_state_space_form_solves_both_equations() {
    // M q̈ + C q̇ + g = τ_j,   J_m θ̈ + τ_j = τ_m,   τ_j = K (θ − q) + D (θ̇ − q̇)
    let robot = chain(0.5);
    let joints = ElasticJoints::new(&robot).unwrap();
    let mut random = Random::new(3);
    for _ in 0..20 {
        // x = (q, θ of elastic joints, q̇, θ̇ of elastic joints)
        let (x, tau_m) = (random.vector(10), random.vector(3));
        let rate = joints.state_rate(&x, &tau_m);
        let (q, qd, qdd) = (&x[..3], &x[5..8], &rate.as_slice()[5..8]);
        assert_eq!((&rate.as_slice()[..3], &rate.as_slice()[3..5]), (qd, &x[8..]));
        let link = sinew_rigid::inverse_dynamics(&robot.model, q, qd, qdd);
        for (k, motor) in [(0, 0), (2, 1)] {
            let spring = 120.0 * (x[3 + motor] - q[k]) + 0.5 * (x[8 + motor] - qd[k]);
            near(link[k], spring, 1e4 * ALGEBRA);
            near(joints.rotor_inertia()[k] * rate[8 + motor] + spring, tau_m[k], 1e3 * ALGEBRA);
        }
        near(link[1] + joints.rotor_inertia()[1] * qdd[1], tau_m[1], 1e4 * ALGEBRA);
    }
}

#[test]
fn section_3_the_complete_model_keeps_the_coupling_that_the_reduced_one_drops() {
    let robot = chain(0.5);
    let [reduced, complete] = [
        ElasticJoints::new(&robot).unwrap(),
        ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap(),
    ];
    let q = [0.3, -0.4, 0.9];
    assert!(reduced.rotor_coupling(&q).amax() == 0.0);
    // The third joint's rotor turns with both links before it: S = B/N in rows 1 and 2; the first one's with none.
    let S = complete.rotor_coupling(&q);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        near(S[(row, column)], if row < 2 && column == 2 { 0.07 / 20.0 } else { 0.0 }, ALGEBRA);
    }
    // M = links + S B⁻¹ Sᵀ + rotors of rigid joints
    let coupled = complete.link_mass_matrix(&q) - reduced.link_mass_matrix(&q);
    near(coupled[(0, 1)], 0.07 / 400.0, ALGEBRA);
    // A rotor that speeds up pushes its links back: at rest, without gravity, S θ̈ is what they feel.
    let still = weightless(robot);
    let complete = ElasticJoints::complete(&still, SpinInertia::BesideLinks).unwrap();
    let o = [0.0; 3];
    let (qdd, thetadd) = complete.forward_dynamics(&q, &o, &q, &o, &[0.0, 0.0, 1.0]);
    let felt = complete.link_mass_matrix(&q) * &qdd + complete.rotor_coupling(&q) * &thetadd;
    assert!(felt.amax() < ALGEBRA && qdd.amax() > 1e-3, "{felt} {qdd}");
    let motor = (complete.rotor_coupling(&q).transpose() * &qdd)[2] + 0.07 * thetadd[2];
    near(motor, 1.0, ALGEBRA);
}

#[test]
fn section_3_a_link_follows_a_motion_of_which_four_derivatives_are_known() {
    // One joint: τ_m = τ_j + J_m (q̈ + τ̈_j/k),   τ_j = J_ℓ q̈ + m g ℓ sin q
    let joint = ElasticJoints::new(&lossless(Some(K), J_M)).unwrap();
    for [q, v, a, j, s] in states() {
        let motor = joint.inverse_dynamics([&[q], &[v], &[a], &[j], &[s]], Deflection::Settled).unwrap();
        let torque = J_L * a + WEIGHT * q.sin();
        let second = J_L * s + WEIGHT * (a * q.cos() - v * v * q.sin());
        near(motor.theta[0], q + torque / K, 1e2 * ALGEBRA);
        near(motor.tau_m[0], torque + J_M * (a + second / K), 1e2 * ALGEBRA);
    }
}

// dH/dt along the motion: the state with its rates as derivatives.
fn energy_rate(plant: &Plant, [q, qd, theta, thetad, tau_m]: [f64; 5]) -> f64 {
    let p = plant.parameters();
    let mut rates = Rates::new(plant);
    let mut at = State::zero(plant);
    (at.q[0], at.qd[0], at.theta[0], at.thetad[0]) = (q, qd, theta, thetad);
    Dynamics::new(plant, &p).forward(&at, &[tau_m], &mut rates);
    let moving = |value: f64, rate: f64| {
        let mut number = Derivative::variable(value, 0);
        number.derivative[0] = rate;
        vec![number]
    };
    let x = State {
        q: moving(q, qd),
        qd: moving(qd, rates.qdd[0]),
        theta: moving(theta, thetad),
        thetad: moving(thetad, rates.thetadd[0]),
        ..State::zero(plant)
    };
    Dynamics::new(plant, &constants(&p)).energy(&x).derivative[0]
}

#[test]
fn section_3_1_energy_stays_without_damping_and_motor_torque() {
    let plant = plant(&lossless(Some(K), J_M));
    for [q, qd, theta, thetad, _] in states() {
        // The terms that cancel are of the size K δ q̇.
        near(energy_rate(&plant, [q, qd, theta, thetad, 0.0]), 0.0, 1e4 * ALGEBRA);
    }
}

#[test]
fn section_3_1_the_energy_rate_is_motor_power_less_losses() {
    let plant = plant(&example());
    for [q, qd, theta, thetad, tau_m] in states() {
        let lost = B_L * qd * qd + B_M * thetad * thetad + D * (thetad - qd) * (thetad - qd);
        let rate = energy_rate(&plant, [q, qd, theta, thetad, tau_m]);
        near(rate, tau_m * thetad - lost, 1e4 * ALGEBRA);
    }
}

#[test]
fn section_3_1_motor_work_covers_the_energy_gained_along_a_run() {
    // ∫ τ_m θ̇ dt ≥ H(t) − H(s) for every s < t
    let plant = plant(&example());
    let options = Options::new(&plant, 2.0, 1e-2);
    let mut torque = Torques::constant(&[TAU_0]);
    let audit = simulate(&plant, &plant.parameters(), &mut torque, &options).unwrap().audit;
    assert!(audit.dissipated > 0.0 && audit.worst_defect < 1e-9, "{audit:?}");
}

#[test]
fn section_3_1_chains_of_both_models_keep_their_energy_or_lose_it_to_the_dampers() {
    let mut random = Random::new(31);
    for damping in [0.0, 0.5].into_iter().cycle().take(20) {
        let robot = chain(damping);
        let complete = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
        for joints in [ElasticJoints::new(&robot).unwrap(), complete] {
            let [q, qd, theta, thetad] = [(); 4].map(|()| random.vector(3));
            let (qdd, thetadd) = joints.forward_dynamics(&q, &qd, &theta, &thetad, &[0.0; 3]);
            let moving = |x: &[f64], rate: &[f64]| -> Vec<Dual<1>> {
                x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
            };
            let (q, theta) = (moving(&q, &qd), moving(&theta, &thetad));
            let rates = (moving(&qd, qdd.as_slice()), moving(&thetad, thetadd.as_slice()));
            let H = joints.energy_with(&mut Scratch::new(&joints), &q, &rates.0, &theta, &rates.1);
            // Ḣ = −(θ̇ − q̇)ᵀ D (θ̇ − q̇)
            let slip: f64 = [0, 2].map(|k| (thetad[k] - qd[k]).powi(2)).iter().sum();
            near(H.derivative[0], -damping * slip, 1e4 * ALGEBRA);
        }
    }
}

#[test]
fn section_3_1_the_books_of_a_chain_balance_along_a_run() {
    // ∫ τ_mᵀ θ̇ dt ≥ H(t) − H(0), of the complete model by Runge and Kutta's steps
    let joints = ElasticJoints::complete(&chain(0.5), SpinInertia::BesideLinks).unwrap();
    let (mut x, tau_m, h) = (vec![0.0; 10], [2.0, -1.0, 0.5], 2e-4);
    let parts = |x: &[f64]| {
        let motors = |x: &[f64]| vec![x[0], 0.0, x[1]];
        [x[..3].to_vec(), x[5..8].to_vec(), motors(&x[3..5]), motors(&x[8..])]
    };
    let sample = |x: &[Vec<f64>; 4], audit: &mut dyn FnMut(&Sample)| {
        audit(&Sample { q: &x[0], qd: &x[1], theta: &x[2], thetad: &x[3], tau_m: &tau_m });
    };
    let mut ws = Workspace::new(&joints);
    let mut books = None;
    sample(&parts(&x), &mut |at| books = Some(PassivityAudit::new(&joints, at)));
    let mut books = books.unwrap();
    let plus =
        |x: &[f64], k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + h * k).collect() };
    for _ in 0..5000 {
        let before = parts(&x);
        let a = joints.state_rate(&x, &tau_m);
        let b = joints.state_rate(&plus(&x, a.as_slice(), h / 2.0), &tau_m);
        let c = joints.state_rate(&plus(&x, b.as_slice(), h / 2.0), &tau_m);
        let d = joints.state_rate(&plus(&x, c.as_slice(), h), &tau_m);
        let mean = (a + (b + c) * 2.0 + d) / 6.0;
        x = plus(&x, mean.as_slice(), h);
        sample(&before, &mut |from| {
            sample(&parts(&x), &mut |to| books.advance(&joints, &mut ws, h, from, to))
        });
    }
    assert!(books.lost > 1e-3 && books.worst_margin > -1e-9, "{books:?}");
    assert!(books.worst_defect < 1e-7, "{books:?}");
}

// Two turning joints whose tool stands above the first one, a metre from the second: rows [turn; rise] of its
// Jacobian are −[1 1; 0 1].
fn folded_arm(stiffness: [f64; 2]) -> Robot {
    let mut builder = ModelBuilder::new("folded");
    let body = Inertia::at_centre_of_mass(1.0, Vector3::new(0.5, 0.0, 0.0), [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]);
    builder.link("base", Inertia::default()).link("out", body).link("back", body);
    builder.link("tool", Inertia::default());
    let turning = |name, parent, child| JointSpec::new(name, JointShape::Revolute, parent, child);
    let along = |x| Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
    builder.joint(turning("first", "base", "out").about([0.0, -1.0, 0.0]));
    builder.joint(turning("second", "out", "back").about([0.0, -1.0, 0.0]).at(along(1.0)));
    builder.joint(JointSpec::new("flange", JointShape::Fixed, "back", "tool").at(along(-1.0)));
    let mut robot = Robot::rigid(builder.build().unwrap());
    for (joint, stiffness) in robot.joints.iter_mut().zip(stiffness) {
        (joint.stiffness, joint.rotor_inertia) = (Some(stiffness), 0.1);
    }
    robot
}

#[test]
fn problem_3_joint_springs_make_this_cartesian_compliance_and_stiffness() {
    // Powers of two: every entry is exact.
    let (k1, k2) = (256.0, 64.0);
    let robot = folded_arm([k1, k2]);
    let J = jacobian(&robot.model, &[0.0, 0.0], robot.tool, Axes::WorldAligned);
    assert_eq!([J[(1, 0)], J[(1, 1)], J[(5, 0)], J[(5, 1)]], [-1.0, -1.0, 0.0, -1.0]);
    let springs = ElasticJoints::new(&robot).unwrap().stiffness();
    let C = compliance(&J, &springs.try_inverse().unwrap());
    let (turn, both, rise) = (C[(1, 1)], C[(1, 5)], C[(5, 5)]);
    assert_eq!([turn, both, rise], [1.0 / k1 + 1.0 / k2, 1.0 / k2, 1.0 / k2]);
    // C_x⁻¹ of the two directions
    let determinant = turn * rise - both * both;
    assert_eq!(determinant, 1.0 / (k1 * k2));
    let stiffness = [rise, -both, turn].map(|entry| entry / determinant);
    assert_eq!(stiffness, [k1, -k1, k1 + k2]);
    // Two joints give way in two directions of six: there is no stiffness matrix, only this compliance.
    assert_eq!(C.rank(1e-12), 2);
}

#[test]
fn section_3_stiff_joints_give_back_the_rigid_robot_to_first_order_in_1_over_k() {
    // ω² = m g ℓ/(J_ℓ + J_m)
    let rigid = (WEIGHT / (J_L + J_M)).sqrt();
    near(modes_of(&lossless(None, J_M), 0.0)[0].omega, rigid, SPECTRUM);
    let error = |k: f64| (modes_of(&lossless(Some(k), J_M), 0.0)[0].omega - rigid).abs();
    for k in [1e3, 1e4] {
        let order = (error(k) / error(10.0 * k)).log10();
        near(order, 1.0, 0.01);
    }
}

#[test]
fn section_6_the_run_has_these_values() {
    let plant = plant(&example());
    let options = Options::new(&plant, 2.0, 0.5);
    let mut torque = Torques::constant(&[TAU_0]);
    let run = simulate(&plant, &plant.parameters(), &mut torque, &options).unwrap().run;
    // An 8th-order Runge–Kutta method at tolerance 1e-12.
    let q = [0.0, 0.16596843, 0.23097613, 0.03023677, 0.08695858];
    let theta = [0.0, 0.17314864, 0.23812532, 0.03645862, 0.09340352];
    for (quantity, expected) in [(Quantity::JointPosition, q), (Quantity::MotorPosition, theta)] {
        let values = &run.signal(quantity, "joint").unwrap().values;
        for (value, expected) in values.iter().zip(expected) {
            near(*value, expected, 1e-7);
        }
    }
}

#[test]
fn section_6_2_explicit_euler_makes_energy_from_nothing() {
    // Weightless and from rest, only the flexible mode moves; each Euler step multiplies its energy by 1 + ω² h².
    let (h, steps) = (0.5e-3, 4000);
    let joint = ElasticJoints::new(&weightless(lossless(Some(K), J_M))).unwrap();
    let (mut q, mut qd, mut theta, mut thetad) = ([0.0], [0.0], [0.1], [0.0]);
    let energy =
        |q: [f64; 1], qd: [f64; 1], theta: [f64; 1], thetad: [f64; 1]| joint.energy(&q, &qd, &theta, &thetad);
    let start = energy(q, qd, theta, thetad);
    for _ in 0..steps {
        let (qdd, thetadd) = joint.forward_dynamics(&q, &qd, &theta, &thetad, &[0.0]);
        (q[0], theta[0]) = (q[0] + h * qd[0], theta[0] + h * thetad[0]);
        (qd[0], thetad[0]) = (qd[0] + h * qdd[0], thetad[0] + h * thetadd[0]);
    }
    let growth = energy(q, qd, theta, thetad) / start;
    let omega_squared = K * (1.0 / J_L + 1.0 / J_M);
    let expected = (1.0 + omega_squared * h * h).powi(steps);
    assert!(growth > 20.0);
    near(growth, expected, 1e-9 * expected);
}

#[test]
fn section_6_2_the_loop_takes_one_step_too_many() {
    let (mut t, mut steps) = (0.0, 0);
    while t <= 2.0 {
        t += 0.0005;
        steps += 1;
    }
    assert_eq!(steps, 4001);
    near(t, 2.0005, 1e-9);
}
