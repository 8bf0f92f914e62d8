//! Signs, swapped joints and exchanged encoders are found before any physics.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, compare, fit, torque_checks};
use sinew_tests::{Conditions, measure, null_case, two_joints};

#[test]
fn a_right_log_raises_no_suspicion_and_a_wrong_one_names_the_joint() {
    let arm = two_joints();
    let runs = measure(&arm, &null_case(&arm, Conditions::FULL, 100_001)).expect("the arm can be simulated");
    let said = |runs: &[Run]| {
        let notes = torque_checks(&arm.robot, &CATALOGUE, runs, &Options::default());
        notes.iter().map(|n| format!("{}: {}", n.place, n.statement)).collect::<Vec<_>>()
    };
    assert_eq!(said(&runs), Vec::<String>::new());

    let mut flipped = runs.clone();
    for signal in flipped.iter_mut().flat_map(|r| &mut r.signals) {
        if signal.quantity == Quantity::MotorTorque && signal.place == "elbow" {
            signal.values.iter_mut().for_each(|x| *x = -*x);
        }
    }
    let notes = said(&flipped);
    assert!(
        notes.len() == 1 && notes[0].starts_with("motor_torque.elbow: the torque has the opposite sign"),
        "{notes:?}"
    );
    // No verdict is given on it, unless the user insists; then it is the first finding.
    let refused = compare(&arm.robot, &CATALOGUE, &flipped, &Options::default()).unwrap_err().to_string();
    assert!(refused.contains("opposite sign") && refused.contains("--force"), "{refused}");
    let forced = Options { force: true, ..Options::default() };
    let findings = compare(&arm.robot, &CATALOGUE, &flipped, &forced).unwrap().findings;
    assert!(findings[0].joint == "elbow" && findings[0].statement.contains("opposite sign"), "{findings:?}");

    // Turned about in one run of several, or in one that nothing is fitted to.
    let mixed = [runs[0].clone(), flipped[1].clone()];
    let notes = said(&mixed);
    let told = format!("{}: motor_torque.elbow: the torque has the opposite sign", runs[1].name);
    assert!(notes.len() == 1 && notes[0].starts_with(&told), "{notes:?}");
    let refused = fit(&arm.robot, &CATALOGUE, &runs[..1], &flipped[1..], &[], &Options::default())
        .unwrap_err()
        .to_string();
    assert!(refused.contains("motor_torque.elbow: the torque has the opposite sign"), "{refused}");

    let mut exchanged = runs.clone();
    for signal in exchanged.iter_mut().flat_map(|r| &mut r.signals).filter(|s| s.place == "elbow") {
        signal.quantity = match signal.quantity {
            Quantity::MotorPosition => Quantity::JointPosition,
            Quantity::JointPosition => Quantity::MotorPosition,
            other => other,
        };
    }
    let notes = said(&exchanged);
    let told = "joint_position.elbow: the spring of \"elbow\" bends backwards";
    assert!(notes.len() == 1 && notes[0].starts_with(told), "{notes:?}");

    let mut large = runs.clone();
    for signal in large.iter_mut().flat_map(|r| &mut r.signals) {
        if signal.quantity == Quantity::MotorTorque && signal.place == "shoulder" {
            signal.values.iter_mut().for_each(|x| *x *= 0.02);
        }
    }
    let notes = said(&large);
    assert!(notes.len() == 1 && notes[0].contains("times the model's"), "{notes:?}");
}
