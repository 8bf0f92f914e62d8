//! Describing functions against their closed forms (Gelb, Vander Velde 1968).

use core::f64::consts::{PI, TAU};

use sinew_linear::{Amplitude, Described, LinearError, Nonlinear, Options, StateSpace, linearize_with};
use sinew_model::{EffectSpec, Place, Robot, Vector3};

use crate::robots::{planar_2r, plant};

const OVER: Amplitude = Amplitude { size: 0.02, frequency: 3.0 };

fn with(kind: &str, values: &[(&str, f64)]) -> Robot {
    let mut robot = planar_2r();
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    let spec = EffectSpec::new(kind, Place::Joint("elbow".into()));
    robot.effects.push(values.iter().fold(spec, |s, (key, v)| s.with(key, *v)));
    robot
}

fn linear(robot: &Robot, nonlinear: Nonlinear) -> Result<StateSpace, LinearError> {
    let plant = plant(robot);
    linearize_with(&plant, &plant.parameters(), &[0.0, 0.0], &Options { nonlinear })
}

fn described(robot: &Robot) -> Vec<Described> {
    linear(robot, Nonlinear::Describe(OVER)).unwrap().described
}

fn only_gain(robot: &Robot) -> (f64, f64) {
    let found = described(robot);
    assert_eq!(found.len(), 1, "{found:?}");
    let [gain] = found[0].gains[..] else { panic!("{found:?}") };
    (gain.position, gain.rate)
}

#[test]
fn dry_friction_is_a_damping_of_four_by_pi() {
    let (position, rate) =
        only_gain(&with("coulomb_friction", &[("coulomb", 1.5), ("smoothing_velocity", 1e-5)]));
    let speed = OVER.size * TAU * OVER.frequency;
    assert_eq!(position, 0.0);
    assert!((rate + 4.0 * 1.5 / (PI * speed)).abs() < 1e-3 * rate.abs(), "{rate}");
}

#[test]
fn quadratic_friction_is_a_damping_of_eight_by_three_pi() {
    let (_, rate) = only_gain(&with("quadratic_viscous_friction", &[("quadratic", 0.7)]));
    let speed = OVER.size * TAU * OVER.frequency;
    assert!((rate + 8.0 / (3.0 * PI) * 0.7 * speed).abs() < 1e-4 * rate.abs(), "{rate}");
}

#[test]
fn a_hardening_spring_is_stiffer_by_three_quarters_of_its_cubic_term() {
    let (position, rate) = only_gain(&with("stiffness_hardening", &[("cubic", 4e5)]));
    assert!((position - 0.75 * 4e5 * OVER.size * OVER.size).abs() < 1e-9 * position, "{position}");
    assert!(rate.abs() < 1e-9);
}

#[test]
fn play_is_a_dead_zone() {
    let (gap, a, stiffness) = (5e-3, OVER.size, 100.0);
    let (position, _) = only_gain(&with("backlash", &[("half_width", gap)]));
    // K N(a) = K (1 − 2/π (asin(g/a) + g/a √(1 − g²/a²))), less the K that stands in the model
    let r: f64 = gap / a;
    let removed = 2.0 / PI * (r.asin() + r * (1.0 - r * r).sqrt());
    assert!((position + stiffness * removed).abs() < 1e-3 * stiffness * removed, "{position}");
}

#[test]
fn hysteresis_stores_and_loses() {
    let found =
        described(&with("transmission_hysteresis", &[("stiffness", 2.0), ("yield_deflection", 1e-3)]));
    let gain = found[0].gains[0];
    // Far beyond its yield it is almost dry friction in the deflection: the loop loses 4 A a.
    let speed = OVER.size * TAU * OVER.frequency;
    assert!(gain.position > 0.0, "it stores: {gain:?}");
    assert!((gain.rate / (4.0 * 2.0 / (PI * speed)) - 1.0).abs() < 0.1, "{gain:?}");
}

#[test]
fn linear_effects_are_taken_as_they_are() {
    let robot = with("viscous_friction", &[("viscous", 0.4)]);
    assert!(described(&robot).is_empty());
    assert!(linear(&robot, Nonlinear::Refuse(OVER)).is_ok());
    let (a, b) =
        (linear(&robot, Nonlinear::Slope).unwrap(), linear(&robot, Nonlinear::Refuse(OVER)).unwrap());
    assert_eq!(a.A, b.A);
}

#[test]
fn a_described_friction_is_the_viscous_friction_of_its_gain() {
    let dry = with("coulomb_friction", &[("coulomb", 1.5)]);
    let (_, rate) = only_gain(&dry);
    let wet = with("viscous_friction", &[("viscous", -rate)]);
    let (a, b) = (linear(&dry, Nonlinear::Describe(OVER)).unwrap(), linear(&wet, Nonlinear::Slope).unwrap());
    for (x, y) in [(&a.A, &b.A), (&a.B, &b.B), (&a.C, &b.C), (&a.D, &b.D)] {
        assert!((x - y).norm_max() < 1e-12 * y.norm_max().max(1.0));
    }
    // In a rigid joint too, where motor and link are one.
    let rigid = |mut robot: Robot| {
        robot.joints[1].stiffness = None;
        robot
    };
    let a = linear(&rigid(dry), Nonlinear::Describe(OVER)).unwrap();
    let b = linear(&rigid(wet), Nonlinear::Slope).unwrap();
    for (x, y) in [(&a.A, &b.A), (&a.C, &b.C)] {
        assert!((x - y).norm_max() < 1e-12 * y.norm_max().max(1.0));
    }
}

#[test]
fn a_refusal_names_the_effect_and_the_amplitude() {
    let robot = with("backlash", &[("half_width", 5e-3)]);
    let text = linear(&robot, Nonlinear::Refuse(OVER)).unwrap_err().to_string();
    assert!(text.contains("backlash@elbow") && text.contains("0.02 rad") && text.contains("help:"), "{text}");
}
