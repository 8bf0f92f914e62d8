//! Springs that are too fast for the rate of the log.

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, fit};
use sinew_tests::{Conditions, measure, null_case, two_joints};

// At 250 Hz each link by itself turns by 1.4 in a sample, both together by more than any step of a Runge–Kutta method
// follows: the prediction was no number. The elbow's rotor, which the fit sees well beside a link that follows its load,
// is found to 3.3 %; that of the shoulder, whose spring rings with every hold, to 10 %.
#[test]
fn springs_that_are_too_fast_together_follow_their_load() {
    let mut arm = two_joints();
    for (joint, (stiffness, damping)) in arm.robot.joints.iter_mut().zip([(4e5, 100.0), (3.8e4, 20.0)]) {
        (joint.stiffness, joint.damping) = (Some(stiffness), damping);
    }
    let case = null_case(&arm, Conditions { period: 4e-3, ..Conditions::FULL }, 300_010);
    let runs = measure(&arm, &case).unwrap();
    let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[], &Options::default()).unwrap();
    println!("{}", fitted.verdict);
    for channel in &fitted.diagnosis.channels {
        println!("{} {}: {}", channel.signal, channel.joint, channel.unseen_error);
        assert!(channel.unseen_error < 0.2, "{channel:?}");
    }
    for (parameter, dof, most) in [("elbow.inertia", 1, 0.04), ("shoulder.inertia", 0, 0.12)] {
        let found = fitted.parameters.iter().find(|p| p.name == parameter).unwrap();
        let truth = case.truth.joints[dof].rotor_inertia;
        println!("{parameter}: {} ± {} of {truth}", found.value, found.std);
        assert!((found.value / truth - 1.0).abs() < most, "{found:?}");
    }
}
