//! Torque noise that moves a joint, and torque noise of the log alone: an inertia is the same by either.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, fit};
use sinew_model::Trust;
use sinew_simulate::Stream;
use sinew_tests::{Arm, Case, Conditions, measure_for, null_case, one_joint};

// A third of the torque that accelerates the joint, N·m a sample.
const NOISE: f64 = 6.0;

// One joint without a spring; its link is known.
fn stiff_joint(noise: f64) -> (Arm, Case) {
    let mut arm = one_joint();
    arm.robot.joints[0].stiffness = None;
    arm.robot.trust = Trust::Exact;
    arm.torque_noise = vec![noise];
    let mut case = null_case(&arm, Conditions::FULL, 7);
    case.truth.model = case.model.model.clone();
    (arm, case)
}

// Inertia of link and rotor, fitted by true.
fn inertia_found(case: &Case, runs: &[Run]) -> f64 {
    let fitted = fit(&case.model, &CATALOGUE, runs, &[], &[], &Options::default()).unwrap();
    let rotor = fitted.parameters.iter().find(|p| p.name.ends_with(".inertia")).unwrap().value;
    let link = case.model.model.joints[0].inertia.second_moment.yy;
    let found = (link + rotor) / (link + case.truth.joints[0].rotor_inertia);
    println!("inertia found by the true one: {found:.4}");
    found
}

#[test]
fn noise_that_moves_the_joint_takes_nothing_from_its_inertia() {
    let (arm, case) = stiff_joint(NOISE);
    let found = inertia_found(&case, &measure_for(&arm, &case, 30.0).unwrap());
    assert!((found - 1.0).abs() < 0.015, "{found}");
}

#[test]
fn noise_of_the_log_adds_nothing_to_it() {
    let (arm, case) = stiff_joint(1e-3);
    let mut runs = measure_for(&arm, &case, 30.0).unwrap();
    let noise = Stream::new(7, "log");
    for signal in runs.iter_mut().flat_map(|run| &mut run.signals) {
        if signal.quantity == Quantity::MotorTorque {
            signal.values.iter_mut().enumerate().for_each(|(k, x)| *x += NOISE * noise.normal(k as u64));
            signal.std = Some(NOISE);
        }
    }
    let found = inertia_found(&case, &runs);
    assert!((found - 1.0).abs() < 0.015, "{found}");
}
