//! Somebody leans on the arm once: the diagnosis asks for the run again, and with it says when, leaves that time out, and
//! names what else is missing.

use sinew_data::Run;
use sinew_effects::CATALOGUE;
use sinew_identify::{Diagnosis, Options, Verdict, diagnose};
use sinew_tests::{Arm, Case, Conditions, Hidden, PUSHED, hidden_effects, measure, one_joint, push};

const EPISODE: &str = "external_force_episode";
// Torque of the push, N·m; Coulomb friction is 5.
const PUSH: f64 = 2.5;

// Two runs, in the first of which the link is pushed, and the first once more.
fn runs(arm: &Arm, hidden: &[&Hidden], seed: u64) -> (Case, Vec<Run>) {
    let case = Case::new(arm, hidden, Conditions::FULL, seed);
    let mut pushed = Case::new(arm, hidden, Conditions::FULL, seed);
    pushed.truth.effects.push(push(arm, 0, PUSH));
    let [mut again, other] = <[Run; 2]>::try_from(measure(arm, &case).unwrap()).unwrap();
    again.name = "again".to_owned();
    (case, vec![measure(arm, &pushed).unwrap().swap_remove(0), other, again])
}

fn value(diagnosis: &Diagnosis, name: &str) -> f64 {
    let episode = diagnosis.candidates.iter().find(|c| c.effect == EPISODE).expect("it is a candidate");
    episode.values.iter().find(|v| v.name == name).unwrap().value
}

#[track_caller]
fn assert_episode(diagnosis: &Diagnosis, run: &str) {
    // Filters see it a little before and remember it for a while.
    let [from, to] = [value(diagnosis, "from"), value(diagnosis, "to")];
    assert!(from < PUSHED[0] && from > PUSHED[0] - 0.8, "from {from}");
    assert!(to > PUSHED[1] && to < PUSHED[1] + 0.8, "to {to}");
    let torque = value(diagnosis, "torque");
    assert!((torque - PUSH).abs() < 0.1 * PUSH, "torque {torque}");
    let first = &diagnosis.findings[0];
    assert!(first.statement.starts_with(&format!("{run}: between")), "{}", first.statement);
}

#[test]
fn a_push_is_named_once_the_run_was_repeated() {
    let arm = one_joint();
    let (case, runs) = runs(&arm, &[], 31);
    let of = |runs: &[Run]| diagnose(&case.model, &CATALOGUE, runs, &Options::default()).unwrap();
    // Of one run it might be a law that shows in this motion only.
    let before = of(&runs[..2]);
    assert_eq!(before.verdict, Verdict::Unexplained, "{:?}", before.accepted);
    let says = before.findings.iter().any(|f| f.statement.contains("once more would tell"));
    assert!(says, "{:?}", before.findings);
    let after = of(&runs);
    assert_eq!(after.verdict, Verdict::Missing, "{:?}", after.channels);
    let [only] = &after.accepted[..] else { panic!("{:?}", after.accepted) };
    assert_eq!((only.effect.as_str(), only.place.as_str()), (EPISODE, "joint_1"));
    assert_episode(&after, &runs[0].name);
}

#[test]
fn what_hides_behind_a_push_is_found() {
    let arm = one_joint();
    let all = hidden_effects(&arm, 0, 1.0);
    let cogging = all.iter().find(|h| h.effect == "cogging_torque").unwrap();
    let (case, runs) = runs(&arm, &[cogging], 32);
    let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, &Options::default()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Missing, "{:?}", diagnosis.channels);
    let named: Vec<&str> = diagnosis.accepted.iter().map(|a| a.effect.as_str()).collect();
    assert_eq!(named, ["cogging_torque", EPISODE]);
    assert!(diagnosis.candidates[0].probability > 0.8, "{}", diagnosis.candidates[0].probability);
    assert_episode(&diagnosis, &runs[0].name);
}
