//! Springs that are too fast for the rate of the log.

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, Verdict, fit};
use sinew_tests::{Conditions, measure, null_case, two_joints};

// At 250 Hz each link by itself turns by 1.4 in a sample, both together by more than any step of a Runge–Kutta method
// follows: the prediction was no number, and with links that follow their load there instead the rotors are off by 3 and
// 10 % and the model, which is right, is `unexplained`. They swing in steps of a millisecond.
#[test]
fn springs_that_are_too_fast_for_a_sample_swing_in_parts_of_it() {
    let mut arm = two_joints();
    for (joint, (stiffness, damping)) in arm.robot.joints.iter_mut().zip([(4e5, 100.0), (3.8e4, 20.0)]) {
        (joint.stiffness, joint.damping) = (Some(stiffness), damping);
    }
    let case = null_case(&arm, Conditions { period: 4e-3, ..Conditions::FULL }, 300_010);
    let runs = measure(&arm, &case).unwrap();
    let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[], &Options::default()).unwrap();
    println!("{}", fitted.verdict);
    assert_eq!(fitted.verdict, Verdict::Adequate);
    for channel in &fitted.diagnosis.channels {
        println!("{} {}: {}", channel.signal, channel.joint, channel.unseen_error);
        assert!(channel.unseen_error < 0.2, "{channel:?}");
    }
    for (parameter, dof, most) in [("elbow.inertia", 1, 0.03), ("shoulder.inertia", 0, 0.03)] {
        let found = fitted.parameters.iter().find(|p| p.name == parameter).unwrap();
        let truth = case.truth.joints[dof].rotor_inertia;
        println!("{parameter}: {} ± {} of {truth}", found.value, found.std);
        assert!((found.value / truth - 1.0).abs() < most, "{found:?}");
    }
}
