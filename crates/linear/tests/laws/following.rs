//! Links that follow their load at once: no states of their own, and their compliance in every mode.

use sinew_linear::{LinearError, Linearizer, Nonlinear, Options, linearize, linearize_with, modes};
use sinew_model::{BeamSection, Bending, EffectSpec, LinkId, Place, Robot, Vector3, samples};
use sinew_plant::{Dynamics, Plant, Rates, State};

use crate::robots::plant;

const STIFFNESS: f64 = 150.0;
const BASE_SPRING: f64 = 400.0;
const J: f64 = 0.5;
const B: f64 = 0.05;

// One elastic joint and a spring at the foot of its link, in a row about one axis.
fn row() -> Robot {
    let mut robot = Robot::rigid(samples::hanging_link(J, 2.0, 0.4).with_gravity(Vector3::ZERO));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (Some(STIFFNESS), B);
    robot.bending.push(Bending::base_spring(LinkId(1), &['y'], BASE_SPRING));
    robot
}

// Two rods with elastic joints; the first bends, with or without inertia of its own.
fn arm(stiffer: f64, quasi_static: bool) -> Robot {
    let mut robot = Robot::rigid(samples::planar_arm(2, 1.68, 0.8));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(2000.0), 1.5, 0.3);
    }
    let beam = BeamSection {
        length: 0.8,
        flexural_rigidity: 300.0 * stiffer,
        torsional_rigidity: None,
        mass_per_length: 2.1,
        polar_inertia_per_length: 0.0,
    };
    let bending = Bending::beam(LinkId(1), &['y'], 2, &[beam]);
    robot.bending.push(Bending { damping_ratio: 0.02, quasi_static, ..bending });
    robot
}

// ω² = k (1/J + 1/B),  1/k = 1/K + 1/k_φ,  and each spring has its share of the compliance.
#[test]
fn a_joint_and_a_base_spring_in_a_row_swing_as_one_spring() {
    let plant = plant(&row());
    let modes = modes(&plant, &plant.parameters(), &[0.0]).unwrap();
    assert_eq!(modes.len(), 2);
    assert_eq!(modes[0].omega_squared, 0.0);
    let k = 1.0 / (1.0 / STIFFNESS + 1.0 / BASE_SPRING);
    let exact = k * (1.0 / J + 1.0 / B);
    assert!((modes[1].omega_squared / exact - 1.0).abs() < 1e-12, "{} {exact}", modes[1].omega_squared);
    let share = |part: &str| modes[1].participation.iter().find(|s| s.part == part).unwrap().share;
    assert!((share("joint spring") - k / STIFFNESS).abs() < 1e-12, "{:?}", modes[1].participation);
    assert!((share("link bending") - k / BASE_SPRING).abs() < 1e-12, "{:?}", modes[1].participation);
    // The coordinate of the link counts with what it bends; the joint's encoder does not.
    let linear = linearize(&plant, &plant.parameters(), &[0.0]).unwrap();
    assert_eq!(linear.states, ["q.joint", "theta.joint", "qd.joint", "thetad.joint"]);
    let row = linear.outputs.iter().position(|o| o == "joint_position.joint").unwrap();
    assert!((linear.C[(row, 0)] - k / STIFFNESS).abs() < 1e-12);
    assert!((linear.C[(row, 1)] - k / BASE_SPRING).abs() < 1e-12);
}

#[test]
fn models_with_followers_are_the_derivatives_of_the_equations() {
    let plant = plant(&arm(10.0, true));
    let p = plant.parameters();
    assert_eq!((plant.moving().len(), plant.model().nv), (2, 4));
    let joints = plant.joints().to_vec();
    let mut x = State::zero(&plant);
    for (k, &dof) in joints.iter().enumerate() {
        (x.q[dof], x.qd[dof]) = (0.4 - 0.7 * k as f64, 0.3 + k as f64);
        (x.theta[dof], x.thetad[dof]) = (x.q[dof] + 0.01, x.qd[dof] - 0.2);
    }
    let tau = vec![3.0; plant.model().nv];
    let model = Linearizer::new(&plant, &p).at(&x, &tau).clone();
    assert_eq!(model.A.nrows(), 8);
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    // Accelerations, then where the joints stand and how fast.
    let mut answer = |x: &State<f64>| -> Vec<f64> {
        dynamics.forward(x, &tau, &mut rates);
        let stands = dynamics.settled().unwrap();
        let of = |values: &[f64]| joints.iter().map(|&j| values[j]).collect::<Vec<_>>();
        [of(&rates.qdd), of(&rates.thetadd), of(&stands.q), of(&stands.qd)].concat()
    };
    let h = 1e-6;
    for column in 0..8 {
        let mut moved = |sign: f64| {
            let mut x = x.clone();
            let numbers = [&mut x.q, &mut x.theta, &mut x.qd, &mut x.thetad];
            let side = numbers.into_iter().nth(column / 2).unwrap();
            side[joints[column % 2]] += sign * h;
            answer(&x)
        };
        let (plus, minus) = (moved(1.0), moved(-1.0));
        for row in 0..8 {
            let difference = (plus[row] - minus[row]) / (2.0 * h);
            // Rows of A for accelerations, rows of C for joint_position and joint_velocity.
            let exact = if row < 4 { model.A[(4 + row, column)] } else { model.C[(row, column)] };
            let size = if row < 4 { model.A.norm_max() } else { 1.0 };
            assert!((exact - difference).abs() < 1e-8 * size, "[{row}, {column}]: {exact} {difference}");
        }
    }
}

#[test]
fn a_link_that_follows_has_the_slow_modes_of_one_that_swings() {
    let slow = |robot: &Robot| -> Vec<f64> {
        let plant = plant(robot);
        let at = [-1.2, -0.3];
        modes(&plant, &plant.parameters(), &at).unwrap().iter().map(|m| m.omega).take(4).collect()
    };
    let gap = |stiffer: f64| {
        let (swings, follows) = (slow(&arm(stiffer, false)), slow(&arm(stiffer, true)));
        swings.iter().zip(&follows).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max)
    };
    let (soft, hard) = (gap(30.0), gap(300.0));
    println!("frequencies off by {soft:e}, ten times as stiff {hard:e}");
    // (ω/ω_s)², of first order in 1/EI, and less in modes that hardly bend it
    assert!(hard < soft / 5.0 && soft < 0.02, "{soft:e} {hard:e}");
}

#[test]
fn a_link_that_follows_takes_part_in_every_mode_that_bends_something() {
    let plant = plant(&arm(3.0, true));
    for mode in modes(&plant, &plant.parameters(), &[-1.2, -0.3]).unwrap() {
        let parts: f64 = mode.participation.iter().map(|s| s.share.abs()).sum();
        assert!(mode.stable && (parts - 1.0).abs() < 1e-3, "{mode:?}");
        // The slow two are held by gravity alone.
        let bends = mode.participation.iter().any(|s| s.part == "link_1 bending" && s.share > 0.0);
        assert!(bends || mode.omega < 10.0, "{mode:?}");
        assert!(mode.shape.iter().all(|(name, _)| !name.starts_with("v.")));
    }
}

#[test]
fn what_acts_behind_the_gear_beside_a_follower_is_linear_or_refused_by_name() {
    let with = |kind: &str, key: &str, value: f64| {
        let mut robot = arm(10.0, true);
        let effect = EffectSpec::new(kind, Place::Joint("joint_2".into()));
        robot.effects.push(effect.with(key, value));
        robot
    };
    let at = [-1.2, -0.3];
    let model = |robot: &Robot, options: &Options| {
        let plant: Plant = plant(robot);
        linearize_with(&plant, &plant.parameters(), &at, options)
    };
    let described = Options::default();
    // Friction of the motor is described, and damps the motor as if no link followed.
    let linear = model(&with("coulomb_friction", "coulomb", 2.0), &described).unwrap();
    assert_eq!(linear.described.len(), 1);
    let without = model(&arm(10.0, true), &described).unwrap();
    let (n, motor) = (linear.A.nrows() / 2, 3);
    let damped = linear.A[(n + motor, n + motor)] - without.A[(n + motor, n + motor)];
    let (a, w) = (0.01, core::f64::consts::TAU * 10.0);
    let exact = -4.0 * 2.0 / (core::f64::consts::PI * a * w) / 0.3;
    assert!((damped / exact - 1.0).abs() < 0.02, "{damped} {exact}");
    // Friction of the link is not.
    let robot = with("link_coulomb_friction", "coulomb", 2.0);
    let error = model(&robot, &described).unwrap_err();
    assert!(matches!(error, LinearError::BesideFollower { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("link_coulomb_friction@joint_2") && text.contains("\"link_1\""), "{text}");
    assert!(model(&robot, &Options { nonlinear: Nonlinear::Slope }).is_ok());
}
