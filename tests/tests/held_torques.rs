//! Torques that are held from sample to sample, seen at the rate of the log.

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, Verdict, compare, diagnose, fit};
use sinew_model::{EffectSpec, Place};
use sinew_tests::{Conditions, Data, measure, null_case, one_joint};

// (ωh)²/24 of 16 Hz in holds of 1 ms is 4e-4: what a spring is off by if the middle of a hold is taken for its mean, or if a
// smooth motion is taken for one that steps from hold to hold.
const A_HOLD: f64 = 4e-4;

#[test]
fn a_spring_near_its_resonance_is_not_bent_by_the_holds() {
    let mut arm = one_joint();
    arm.torque_noise = vec![0.02];
    arm.robot.effects.retain(|e| e.kind != "coulomb_friction");
    for seed in [300_000, 300_001] {
        let case = null_case(&arm, Conditions::FULL, seed);
        let runs = measure(&arm, &case).unwrap();
        let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[], &Options::default()).unwrap();
        let off = |key: &str, truth: f64| {
            let name = format!("joint_1.{key}");
            let found = fitted.parameters.iter().find(|p| p.name == name).map_or(f64::NAN, |p| p.value);
            println!("{name}: {found} of {truth}");
            (found / truth - 1.0).abs()
        };
        let truth = &case.truth.joints[0];
        assert!(off("stiffness", truth.stiffness.unwrap()) < 0.25 * A_HOLD);
        assert!(off("damping", truth.damping) < 0.5 * A_HOLD);
        assert!(off("inertia", truth.rotor_inertia) < 0.5 * A_HOLD);
    }
}

// Friction near rest takes a motor to its velocity within a fifth of a hold. Asked at a velocity that is off by what this leaves of
// the hold, it comes out 3 to 6 % too wide.
#[test]
fn friction_is_as_wide_as_it_is_where_torques_step_in_its_width() {
    let arm = one_joint();
    let coarse = Conditions::named("full", "coarse").unwrap();
    let off = [300_002, 300_003, 300_004].map(|seed| {
        let case = null_case(&arm, coarse, seed);
        let runs = measure(&arm, &case).unwrap();
        let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[], &Options::default()).unwrap();
        let width = fitted.parameters.iter().find(|p| p.name == "joint_1.smoothing_velocity").unwrap();
        let truth = case.truth.effects.iter().find_map(|e| e.number("smoothing_velocity")).unwrap();
        println!("{seed}: {} ± {} of {truth}", width.value, width.std);
        width.value / truth - 1.0
    });
    assert!((off.iter().sum::<f64>() / 3.0).abs() < 0.02, "{off:?}");
}

// Where every m-th command is logged, it acts (m − 1)/2 of its periods before the middle of the row.
#[test]
fn a_log_that_keeps_one_of_several_torques_tells_of_which_moment() {
    let arm = one_joint();
    for (period, every, moment) in [(1e-3, 1, None), (1e-3, 2, Some("0.50 ms")), (2.5e-4, 8, Some("0.88 ms"))]
    {
        let case = null_case(&arm, Conditions { period, every, ..Conditions::FULL }, 300_005);
        let runs = measure(&arm, &case).unwrap();
        let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
        println!("every {every}: {}, {}", diagnosis.verdict, diagnosis.scope);
        let told = diagnosis.scope.split_once("those of moments, ").map(|(_, rest)| rest);
        assert_eq!(told.is_some(), moment.is_some());
        assert!(moment.is_none_or(|moment| told.is_some_and(|told| told.starts_with(moment))));
        assert_eq!(diagnosis.verdict, Verdict::Adequate);
        // The true arm is as far from the measurement as noise is.
        let compared = compare(&case.truth, &CATALOGUE, &runs, &Options::default()).unwrap();
        let told = compared.findings.iter().find(|f| f.statement.contains("those of moments"));
        println!("true arm: {:.2} floors, {told:?}", compared.rms_error);
        assert_eq!(told.is_some(), moment.is_some());
        assert!(compared.rms_error < 1.6);
    }
}

// A lag that is not known of yet takes the moments for later ones.
#[test]
fn a_lag_behind_a_fast_drive_is_as_long_as_it_is() {
    const LAG: f64 = 6e-3;
    let arm = one_joint();
    let conditions = Conditions { period: 2.5e-4, every: 8, ..Conditions::FULL };
    let mut case = null_case(&arm, conditions, 300_007);
    let lag = EffectSpec::new("actuator_lag", Place::Joint("joint_1".to_owned()));
    case.truth.effects.push(lag.clone().with("time", LAG));
    let runs = measure(&arm, &case).unwrap();
    let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[lag], &Options::default()).unwrap();
    let time = fitted.parameters.iter().find(|p| p.name == "joint_1.time").unwrap();
    let left = fitted.steps.last().map_or(f64::NAN, |step| step.rms_error);
    println!("{} ± {} of {LAG}, {left:.2} floors left", time.value, time.std);
    assert!((time.value - LAG).abs() < (4.0 * time.std).max(2e-5));
    assert!(left < 1.2);
}

// At 125 Hz a rigid joint turns round within a sample, and its friction with it.
#[test]
fn a_slow_log_of_a_rigid_joint_shows_where_it_turns_round() {
    let mut arm = one_joint();
    arm.robot.joints[0].stiffness = None;
    let conditions = Conditions { every: 8, ..Conditions::named("motor", "fine").unwrap() };
    for seed in [300_008, 300_009] {
        let case = null_case(&arm, conditions, seed);
        let runs = measure(&arm, &case).unwrap();
        let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
        println!("{seed}: {}, {:?}", diagnosis.verdict, diagnosis.channels);
        assert_eq!(diagnosis.verdict, Verdict::Adequate);
        assert!(diagnosis.channels.iter().all(|c| c.distance_to_floor < 1.5));
    }
}

// At 250, 100 and 50 Hz springs of 12 Hz swing between the samples. A run of waves alone: a chirp of 20 Hz is beyond the slowest.
#[test]
fn a_slow_log_of_springs_tells_them_as_exactly_as_it_can() {
    let arm = one_joint();
    for every in [4, 10, 20] {
        let conditions = Conditions { every, data: Data::Excitation, ..Conditions::FULL };
        let case = null_case(&arm, conditions, 300_006);
        let runs = measure(&arm, &case).unwrap();
        let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
        let spring = diagnosis.channels.iter().find(|c| c.signal == "joint_position").unwrap();
        println!("every {every}: {}, {:?}", diagnosis.verdict, diagnosis.channels);
        // How a joint turns round between two samples of the slowest is not known: something is left, and no name is likely.
        assert!(diagnosis.verdict == Verdict::Adequate || every == 20);
        assert!(diagnosis.candidates.iter().all(|c| c.probability < 0.5), "{:?}", diagnosis.candidates);
        assert!(spring.distance_to_floor < 1.5);
    }
}

// A controller of 250 Hz holds each torque that it logs; of a fast one that logs every fourth nobody knows those between.
#[test]
fn a_slow_log_is_taken_for_held_if_no_more_than_noise_is_left() {
    let arm = one_joint();
    for (period, every, residual) in [(4e-3, 1, "innovation"), (1e-3, 4, "imposed")] {
        let case = null_case(&arm, Conditions { period, every, ..Conditions::FULL }, 300_010);
        let runs = measure(&arm, &case).unwrap();
        let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
        println!("every {every}: {}, {}", diagnosis.verdict, diagnosis.scope);
        assert!(diagnosis.scope.contains(&format!("residual: {residual}")));
        assert_eq!(diagnosis.verdict, Verdict::Adequate);
    }
}
