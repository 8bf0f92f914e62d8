//! Frequency responses against closed forms.

use core::f64::consts::{PI, TAU};

use faer::c64;
use sinew_linear::{LinearError, Transfer, linearize};
use sinew_model::{EffectSpec, Place, Robot, samples};

use crate::robots::{planar_2r, plant};

const J: f64 = 0.5;
const B: f64 = 0.05;
const K: f64 = 150.0;
const D: f64 = 0.5;
const LINK: f64 = 0.02;
const MOTOR: f64 = 0.01;
const GRAVITY: f64 = 2.0 * 9.81 * 0.4;

// The lesson's joint with damping.
fn lesson() -> Robot {
    let mut robot = Robot::rigid(samples::hanging_link(J, 2.0, 0.4));
    let joint = &mut robot.joints[0];
    (joint.stiffness, joint.rotor_inertia, joint.damping) = (Some(K), B, D);
    for (kind, value) in [("link_viscous_friction", LINK), ("viscous_friction", MOTOR)] {
        robot.effects.push(EffectSpec::new(kind, Place::Joint("joint".into())).with("viscous", value));
    }
    robot
}

fn transfer(robot: &Robot, q: &[f64], from: &str, to: &str) -> Result<Transfer, LinearError> {
    let plant = plant(robot);
    Transfer::new(&linearize(&plant, &plant.parameters(), q).unwrap(), from, to)
}

// Link alone on its spring, and the determinant of the whole.
fn link(s: c64) -> c64 {
    s * s * J + s * (D + LINK) + (K + GRAVITY)
}
fn spring(s: c64) -> c64 {
    s * D + K
}
fn whole(s: c64) -> c64 {
    link(s) * (s * s * B + s * (D + MOTOR) + K) - spring(s) * spring(s)
}

#[test]
fn responses_are_the_lessons_in_closed_form() {
    type Law = fn(c64) -> c64;
    let laws: [(&str, Law); 5] = [
        ("motor_position.joint", |s| link(s) / whole(s)),
        ("motor_velocity.joint", |s| s * link(s) / whole(s)),
        ("joint_position.joint", |s| spring(s) / whole(s)),
        ("joint_velocity.joint", |s| s * spring(s) / whole(s)),
        ("joint_torque.joint", |s| spring(s) * (link(s) - spring(s)) / whole(s)),
    ];
    for (to, law) in laws {
        let g = transfer(&lesson(), &[0.0], "motor_torque.joint", to).unwrap();
        for omega in [0.1, 1.0, 3.7766, 17.0, 17.6, 57.2, 400.0] {
            let exact = law(c64::new(0.0, omega));
            assert!((g.at(omega) - exact).norm() < 1e-10 * exact.norm(), "{to} at {omega}");
        }
        // k Π(s − z)/Π(s − p) is the same function.
        let s = c64::new(0.3, 21.0);
        let product = |roots: &[c64]| roots.iter().fold(c64::new(1.0, 0.0), |p, r| p * (s - r));
        let rational = product(&g.zeros) / product(&g.poles) * g.gain;
        assert!((rational - law(s)).norm() < 1e-9 * law(s).norm(), "{to}: {rational} {}", law(s));
    }
}

#[test]
fn an_antiresonance_is_the_resonance_of_the_arm_with_the_motor_held() {
    let g = transfer(&lesson(), &[0.0], "motor_torque.joint", "motor_velocity.joint").unwrap();
    let [dip] = g.antiresonances()[..] else { panic!("{:?}", g.antiresonances()) };
    // J s² + (D + b) s + K + m g l = 0
    assert!((dip.omega - ((K + GRAVITY) / J).sqrt()).abs() < 1e-11 * dip.omega);
    assert!((dip.damping_ratio - (D + LINK) / (2.0 * J * dip.omega)).abs() < 1e-11);
    let peaks = g.resonances();
    assert_eq!(peaks.len(), 2);
    assert!((peaks[0].omega - 3.77662727).abs() < 1e-3 && (peaks[1].omega - 57.458).abs() < 0.01);
    assert!((peaks[0].frequency - peaks[0].omega / TAU).abs() < 1e-15);
    // The same by imposing the motor's motion: its poles are that zero.
    let held = transfer(&lesson(), &[0.0], "motor_position.joint", "joint_position.joint").unwrap();
    let [peak] = held.resonances()[..] else { panic!("{:?}", held.resonances()) };
    assert!((peak.omega - dip.omega).abs() < 1e-9 * dip.omega);
    let s = c64::new(0.0, 9.0);
    assert!((held.at(9.0) - spring(s) / link(s)).norm() < 1e-10);
}

#[test]
fn every_antiresonance_of_an_arm_is_a_resonance_with_that_motor_held() {
    let q = [-1.2, 0.4];
    let g = transfer(&planar_2r(), &q, "motor_torque.shoulder", "motor_position.shoulder").unwrap();
    let mut held = planar_2r();
    // A motor that nothing moves.
    held.joints[0].rotor_inertia = 1e12;
    let plant = plant(&held);
    let linear = linearize(&plant, &plant.parameters(), &q).unwrap();
    let resonances = sinew_linear::poles(&linear.A).unwrap();
    let dips = g.antiresonances();
    assert_eq!(dips.len(), 3);
    for dip in dips {
        let near = |p: &c64| (p.norm() - dip.omega).abs() < 1e-8 * dip.omega;
        assert!(resonances.iter().any(near), "{dip:?}: {resonances:?}");
    }
}

#[test]
fn the_phase_of_a_drive_stays_between_zero_and_minus_a_half_turn_and_falls_on_for_the_link() {
    let omega: Vec<f64> = (1..4000).map(|k| 0.05 * f64::from(k)).collect();
    let frequency: Vec<f64> = omega.iter().map(|w| w / TAU).collect();
    let phase =
        |to: &str| transfer(&lesson(), &[0.0], "motor_torque.joint", to).unwrap().bode(&frequency).phase;
    // Torque and motion at one place: poles and zeros alternate.
    assert!(phase("motor_position.joint").iter().all(|p| (-PI..=0.0).contains(p)));
    // Across the spring both resonances turn it by half, and the spring's damper gives a quarter back.
    let link = phase("joint_position.joint");
    assert!(link.windows(2).all(|w| (w[1] - w[0]).abs() < 0.5 * PI), "no jumps");
    let last = *link.last().unwrap();
    assert!(last < -1.5 * PI && last > -2.0 * PI, "{last}");
    // However coarse the grid.
    let coarse = transfer(&lesson(), &[0.0], "motor_torque.joint", "joint_position.joint").unwrap();
    let end = *frequency.last().unwrap();
    assert!((coarse.bode(&[end]).phase[0] - last).abs() < 1e-12);
}

#[test]
fn a_dead_time_turns_the_phase_and_nothing_else() {
    let mut late = lesson();
    late.effects.push(EffectSpec::new("actuator_delay", Place::Joint("joint".into())).with("time", 3e-3));
    let plain = transfer(&lesson(), &[0.0], "motor_torque.joint", "joint_velocity.joint").unwrap();
    let late = transfer(&late, &[0.0], "motor_torque.joint", "joint_velocity.joint").unwrap();
    assert_eq!(late.delay, 3e-3);
    let at = [1.0, 9.0, 40.0];
    let (a, b) = (plain.bode(&at), late.bode(&at));
    for k in 0..at.len() {
        assert!((a.magnitude[k] - b.magnitude[k]).abs() < 1e-12 * a.magnitude[k]);
        assert!((a.phase[k] - b.phase[k] - TAU * at[k] * 3e-3).abs() < 1e-10);
    }
}

#[test]
fn the_lag_of_a_drive_is_a_pole() {
    let mut lagging = lesson();
    lagging.effects.push(EffectSpec::new("actuator_lag", Place::Joint("joint".into())).with("time", 4e-3));
    let plain = transfer(&lesson(), &[0.0], "motor_torque.joint", "motor_velocity.joint").unwrap();
    let lagging = transfer(&lagging, &[0.0], "motor_torque.joint", "motor_velocity.joint").unwrap();
    for omega in [1.0, 57.0, 300.0] {
        let exact = plain.at(omega) / c64::new(1.0, omega * 4e-3);
        assert!((lagging.at(omega) - exact).norm() < 1e-12 * exact.norm().max(1e-3), "{omega}");
    }
}

#[test]
fn a_rigid_joint_that_gravity_does_not_hold_is_its_inertia_and_its_friction() {
    // Level, where the slope of gravity is the rounding of cos π/2.
    let level = [0.5 * PI];
    let mut robot = Robot::rigid(samples::hanging_link(J, 2.0, 0.4));
    for damping in [0.0, LINK] {
        if damping > 0.0 {
            let friction = EffectSpec::new("viscous_friction", Place::Joint("joint".into()));
            robot.effects.push(friction.with("viscous", damping));
        }
        let g = transfer(&robot, &level, "motor_torque.joint", "motor_velocity.joint").unwrap();
        for omega in [0.1, 1.0, 30.0] {
            let exact = c64::new(1.0, 0.0) / c64::new(damping, J * omega);
            assert!((g.at(omega) - exact).norm() < 1e-10 * exact.norm(), "{omega}");
        }
        assert_eq!((g.poles.len(), g.zeros.len()), (1, 0), "{g:?}");
        assert!((g.poles[0].re + damping / J).abs() < 1e-12 && g.poles[0].im == 0.0, "{g:?}");
        assert!(g.resonances().is_empty() && g.antiresonances().is_empty());
        let grid = g.grid();
        assert!(grid[0] > 1e-4 && *grid.last().unwrap() < 1e3, "{} to {:?}", grid[0], grid.last());
    }
}

#[test]
fn the_phase_of_an_arm_without_damping_does_not_depend_on_the_sign_of_rounding() {
    let robot = Robot::rigid(samples::planar_arm(2, 0.45, 3.0));
    let hanging = [-0.5 * PI, 0.0];
    for joint in ["joint_1", "joint_2"] {
        let (from, to) = (format!("motor_torque.{joint}"), format!("motor_velocity.{joint}"));
        let g = transfer(&robot, &hanging, &from, &to).unwrap();
        assert_eq!((g.resonances().len(), g.antiresonances().len()), (2, 1), "{g:?}");
        assert!(g.resonances().iter().all(|peak| peak.damping_ratio == 0.0), "{g:?}");
        // Torque and velocity at one place: between a quarter turn before and behind.
        let phase = g.bode(&g.grid()).phase;
        assert!(phase.iter().all(|p| p.abs() < 0.5 * PI + 1e-6), "{phase:?}");
    }
}

#[test]
fn the_free_motions_of_an_elastic_arm_are_no_resonances() {
    let mut robot = planar_2r();
    robot.model.gravity = sinew_model::Vector3::ZERO;
    let g = transfer(&robot, &[0.3, 0.5], "motor_torque.shoulder", "motor_velocity.shoulder").unwrap();
    assert!(g.resonances().iter().chain(&g.antiresonances()).all(|p| p.frequency > 0.1), "{g:?}");
    assert!(g.grid()[0] > 0.01, "{}", g.grid()[0]);
}

#[test]
fn signals_that_are_not_there_are_answered_with_those_that_are() {
    let wrong =
        transfer(&planar_2r(), &[0.0, 0.0], "motor_torque.sholder", "joint_position.elbow").unwrap_err();
    let text = wrong.to_string();
    assert!(text.contains("did you mean \"motor_torque.shoulder\"?"), "{text}");
    let wrong = transfer(&planar_2r(), &[0.0, 0.0], "motor_torque.shoulder", "position").unwrap_err();
    assert!(wrong.to_string().contains("allowed motor_position.shoulder"), "{wrong}");
}

#[test]
fn what_does_not_move_each_other_has_no_response() {
    // Two fingers on one base.
    let robot = crate::symmetric::fingers(2);
    let refused =
        transfer(&robot, &[0.0, 0.0], "motor_torque.joint_0", "joint_position.joint_1").unwrap_err();
    assert!(matches!(refused, LinearError::NotReached { .. }), "{refused}");
    // What the other finger does cancels from its neighbour's response.
    let own = transfer(&robot, &[0.0, 0.0], "motor_torque.joint_0", "joint_position.joint_0").unwrap();
    assert_eq!(own.poles.len(), 4, "{:?}", own.poles);
}
