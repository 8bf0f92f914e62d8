//! Logs so long that a part of them is searched first.

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, diagnose};
use sinew_tests::{Case, Conditions, hidden_effects, measure_for, one_joint};

// What is named along a log of so many seconds with an effect hidden in it, the scope of the diagnosis, and how many candidates
// are left out by what a part of the log says.
fn named(effect: &str, seconds: f64) -> (Vec<String>, String, usize) {
    let arm = one_joint();
    let all = hidden_effects(&arm, 0, 1.0);
    let hidden: Vec<_> = all.iter().filter(|h| h.effect == effect).collect();
    assert!(!hidden.is_empty(), "{effect}: not in the suite");
    let case = Case::new(&arm, &hidden, Conditions::FULL, 901);
    let runs = measure_for(&arm, &case, seconds).unwrap();
    let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
    let names = diagnosis.accepted.iter().map(|a| format!("{}@{}", a.effect, a.place)).collect();
    let left_out = diagnosis.refusals.iter().filter(|r| r.reason.contains("in a part of the log")).count();
    (names, diagnosis.scope, left_out)
}

// Presliding needs a prediction of its own along the log, a cogging torque a derivative.
#[test]
fn what_a_part_shows_is_named_from_the_whole() {
    for effect in ["presliding_friction", "cogging_torque"] {
        let (names, scope, left_out) = named(effect, 26.0);
        assert_eq!(names, [format!("{effect}@joint_1")]);
        assert!(scope.contains("a part of 12000 samples was searched first"), "{scope}");
        assert!(left_out > 0);
    }
}

#[test]
fn a_short_log_is_searched_as_it_is() {
    let (names, scope, left_out) = named("cogging_torque", 12.0);
    assert_eq!(names, ["cogging_torque@joint_1"]);
    assert!(!scope.contains("searched first") && left_out == 0, "{scope}");
}
