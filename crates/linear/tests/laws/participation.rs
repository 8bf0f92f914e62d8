//! What bends and what moves in a mode.

use sinew_linear::{Mode, Nonlinear, Options, modes_with};
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};

use crate::robots::{modes_of, planar_2r, plant};
use crate::symmetric::fingers;

fn share(shares: &[sinew_linear::Share], part: &str) -> f64 {
    shares.iter().find(|s| s.part == part).map_or(0.0, |s| s.share)
}

fn sums_to_one(mode: &Mode) {
    for shares in [&mode.participation, &mode.motion] {
        let sum: f64 = shares.iter().map(|s| s.share.abs()).sum();
        assert!(shares.is_empty() || (sum - 1.0).abs() < 1e-3, "{mode:?}");
    }
}

// A spring between J and B: energies go as the squares of the amplitudes, by J and by B.
#[test]
fn shares_of_two_masses_on_a_spring_are_those_of_the_closed_form() {
    let (J, B, K) = (0.5, 0.05, 150.0);
    let mut robot = Robot::rigid(samples::hanging_link(J, 2.0, 0.4).with_gravity(Vector3::ZERO));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (Some(K), B);
    let modes = modes_of(&robot, &[0.0]);
    modes.iter().for_each(sums_to_one);
    assert!(modes[0].participation.is_empty(), "a free motion bends nothing");
    assert!((share(&modes[0].motion, "joint motor") - B / (J + B)).abs() < 1e-12);
    assert_eq!(modes[1].participation.len(), 1);
    assert!((share(&modes[1].participation, "joint spring") - 1.0).abs() < 1e-12);
    // J q = −B θ, so the motor has ½ B θ² of ½ B θ² (1 + B/J).
    assert!((share(&modes[1].motion, "joint motor") - J / (J + B)).abs() < 1e-12);
}

#[test]
fn gravity_pushes_over_what_stands_and_holds_what_hangs() {
    let standing = &modes_of(&planar_2r(), &[core::f64::consts::FRAC_PI_2, 0.0]);
    assert!(share(&standing[0].participation, "gravity") < -0.9, "{:?}", standing[0]);
    let hanging = &modes_of(&planar_2r(), &[-core::f64::consts::FRAC_PI_2, 0.0]);
    assert!(share(&hanging[0].participation, "gravity") > 0.9);
    assert!(share(&hanging[3].participation, "shoulder spring") > 0.01);
    standing.iter().chain(hanging).for_each(sums_to_one);
}

#[test]
fn a_spring_that_is_an_effect_takes_part_by_its_name() {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO));
    let place = Place::Joint("joint".into());
    robot.effects.push(EffectSpec::new("balancer_spring", place).with("stiffness", 30.0));
    let mode = &modes_of(&robot, &[0.0])[0];
    assert!(mode.omega > 0.0);
    assert!((share(&mode.participation, "balancer_spring@joint") - 1.0).abs() < 1e-12, "{mode:?}");
}

#[test]
fn fingers_of_another_stiffness_take_part_one_by_one() {
    let mut robot = fingers(3);
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        joint.stiffness = Some(150.0 * (1.0 + k as f64));
    }
    let modes = modes_of(&robot, &[0.0; 3]);
    for (k, mode) in modes[3..].iter().enumerate() {
        assert!(share(&mode.participation, &format!("joint_{k} spring")) > 0.9, "{mode:?}");
        assert!(share(&mode.motion, &format!("joint_{k} motor")) > 0.5, "{mode:?}");
    }
}

#[test]
fn springs_keep_their_share_beside_a_friction_that_depends_on_the_load_of_a_rigid_joint() {
    let mut robot = planar_2r();
    robot.joints[1].stiffness = None;
    let place = Place::Joint("elbow".into());
    let friction = EffectSpec::new("load_dependent_friction", place).with("load_coefficient", 0.02);
    let with_slopes = |robot: &Robot| {
        let plant = plant(robot);
        let options = Options { nonlinear: Nonlinear::Slope };
        modes_with(&plant, &plant.parameters(), &[-0.3, 0.4], &options).unwrap().modes
    };
    let without = with_slopes(&robot);
    robot.effects.push(friction);
    let with = with_slopes(&robot);
    let fast = |modes: &[Mode]| share(&modes[2].participation, "shoulder spring");
    assert!(fast(&without) > 0.9 && (fast(&with) - fast(&without)).abs() < 1e-3, "{:?}", with[2]);
}
