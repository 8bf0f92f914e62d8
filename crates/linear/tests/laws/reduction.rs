//! Models of lower order: the bound of their error holds.

use sinew_linear::{
    LinearError, Options, Reduced, StateSpace, Transfer, balanced_truncation, linearize, modal_truncation,
    modes, poles,
};

use crate::robots::{planar_2r, plant};

const HANGING: [f64; 2] = [-core::f64::consts::FRAC_PI_2, 0.0];

// Two hanging rods with friction, so that everything dies out.
fn damped() -> StateSpace {
    let mut robot = planar_2r();
    for joint in ["shoulder", "elbow"] {
        let place = sinew_model::Place::Joint(joint.into());
        robot.effects.push(sinew_model::EffectSpec::new("viscous_friction", place).with("viscous", 0.4));
    }
    let plant = plant(&robot);
    linearize(&plant, &plant.parameters(), &HANGING).unwrap()
}

// The largest gain of a difference over a dense grid, by the Frobenius norm, which no gain exceeds.
fn error(a: &StateSpace, b: &StateSpace) -> f64 {
    let (mut worst, mut grid) = (0.0f64, Vec::new());
    for k in 0..600 {
        grid.push(0.05 * 1.018f64.powi(k));
    }
    let transfer = |s: &StateSpace, i: &String, o: &String| Transfer::new(s, i, o).ok();
    let mut squares = vec![0.0; grid.len()];
    for input in &a.inputs {
        for output in &a.outputs {
            let (full, small) = (transfer(a, input, output), transfer(b, input, output));
            for (k, omega) in grid.iter().enumerate() {
                let of = |t: &Option<Transfer>| t.as_ref().map_or(faer::c64::new(0.0, 0.0), |t| t.at(*omega));
                squares[k] += (of(&full) - of(&small)).norm_sqr();
            }
        }
    }
    for s in squares {
        worst = worst.max(s.sqrt());
    }
    worst
}

#[test]
fn the_error_of_balanced_truncation_is_below_its_bound() {
    let full = damped();
    let part = full.part(&[], &["motor_velocity.shoulder".into(), "joint_position.elbow".into()]).unwrap();
    for order in [2, 4, 5, 6, 7] {
        let Reduced { model, hankel, kept, bound } = balanced_truncation(&part, order).unwrap();
        assert_eq!((model.A.nrows(), kept, hankel.len()), (order, 0, 8));
        assert!(hankel.windows(2).all(|w| w[0] >= w[1]));
        // The Frobenius norm of two outputs by two inputs is at most √2 times the largest gain.
        let error = error(&part, &model);
        assert!(error <= 2f64.sqrt() * bound, "{order}: {error} {bound}");
        // And it is no empty bound: the first value dropped is a lower one of any model of this order.
        assert!(error >= 0.2 * hankel[order], "{order}: {error} {}", hankel[order]);
        assert!(poles(&model.A).unwrap().iter().all(|l| l.re < 0.0));
    }
}

#[test]
fn what_does_not_die_out_is_kept() {
    let mut robot = planar_2r();
    robot.model = robot.model.with_gravity(sinew_model::Vector3::ZERO);
    let plant = plant(&robot);
    let full = linearize(&plant, &plant.parameters(), &[0.3, 0.9]).unwrap();
    // Two free motions of two states each.
    let refused = balanced_truncation(&full, 3).unwrap_err();
    assert!(matches!(refused, LinearError::Order { least: 4, states: 8, .. }), "{refused}");
    let reduced = balanced_truncation(&full, 6).unwrap();
    assert_eq!((reduced.kept, reduced.hankel.len()), (4, 4));
    let (a, b) = (
        Transfer::new(&full, "motor_torque.elbow", "joint_position.shoulder").unwrap(),
        Transfer::new(&reduced.model, "motor_torque.elbow", "joint_position.shoulder").unwrap(),
    );
    for omega in [0.3, 3.0, 30.0, 80.0, 300.0] {
        let error = (a.at(omega) - b.at(omega)).norm();
        assert!(error <= reduced.bound * (1.0 + 1e-6) + 1e-9 * a.at(omega).norm(), "{omega}: {error}");
    }
}

#[test]
fn slow_modes_and_gain_at_rest_survive_modal_truncation() {
    let mut robot = planar_2r();
    for joint in ["shoulder", "elbow"] {
        let place = sinew_model::Place::Joint(joint.into());
        robot.effects.push(sinew_model::EffectSpec::new("viscous_friction", place).with("viscous", 0.4));
    }
    let plant = plant(&robot);
    let p = plant.parameters();
    let full = linearize(&plant, &p, &HANGING).unwrap();
    let small = modal_truncation(&plant, &p, &HANGING, &Options::default(), 2).unwrap();
    assert_eq!(small.states, ["mode.1", "mode.2", "moded.1", "moded.2"]);
    let slow = modes(&plant, &p, &HANGING).unwrap();
    for (pole, mode) in poles(&small.A).unwrap().chunks(2).zip(&slow) {
        assert!((pole[0].norm() / mode.omega - 1.0).abs() < 0.02, "{pole:?} {mode:?}");
    }
    for input in &full.inputs {
        for output in full.outputs.iter().filter(|o| !o.contains("velocity")) {
            let at_rest = |s: &StateSpace| Transfer::new(s, input, output).unwrap().at(0.0).re;
            let (a, b) = (at_rest(&full), at_rest(&small));
            assert!((a - b).abs() < 1e-9 * a.abs().max(1e-3), "{input} {output}: {a} {b}");
        }
    }
    assert!(modal_truncation(&plant, &p, &HANGING, &Options::default(), 4).is_err());
}
