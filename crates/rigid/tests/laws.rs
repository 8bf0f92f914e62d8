//! Laws that hold for every robot.

#![allow(non_snake_case)]

use sinew_model::{Dual, Lanes, Scalar, samples};
use sinew_rigid::{
    Bodies, Scratch, forward_dynamics_with, hybrid_dynamics_with, inertias, inverse_dynamics_with,
    kinetic_energy_with, mass_matrix_with, potential_energy_with,
};

/// Rounding of sums of a few hundred terms.
const ALGEBRA: f64 = 1e-12;

fn torque<S: Scalar>(q: &[S]) -> Vec<S> {
    let model = samples::planar_arm(3, 2.0, 0.5);
    let inertia = inertias(&model);
    let b = Bodies::new(&model, &inertia);
    let mut ws = Scratch::new(&model);
    let qd = [0.3, -0.7, 1.1].map(S::constant);
    let qdd = [1.0, 2.0, -3.0].map(S::constant);
    let mut tau = vec![S::ZERO; 3];
    inverse_dynamics_with(&b, &mut ws, q, &qd, &qdd, &mut tau);
    let mut back = vec![S::ZERO; 3];
    forward_dynamics_with(&b, &mut ws, q, &qd, &tau, &mut back);
    for (got, want) in back.iter().zip(qdd) {
        assert!((got.value() - want.value()).abs() < ALGEBRA);
    }
    let mut hybrid = [qdd[0], S::ZERO, S::ZERO];
    let mut torques = [S::ZERO, tau[1], tau[2]];
    hybrid_dynamics_with(&b, &mut ws, q, &qd, &[true, false, false], &mut hybrid, &mut torques);
    assert!((torques[0] - tau[0]).value().abs() < ALGEBRA);
    assert!((hybrid[2] - qdd[2]).value().abs() < ALGEBRA);
    let mut M = vec![S::ZERO; 9];
    mass_matrix_with(&b, &mut ws, q, &mut M);
    let mut twice = S::ZERO;
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        twice += qd[i] * M[i + 3 * j] * qd[j];
    }
    assert!((twice * 0.5 - kinetic_energy_with(&b, &mut ws, q, &qd)).value().abs() < ALGEBRA);
    assert!(potential_energy_with(&b, &mut ws, q).value().is_finite());
    tau
}

#[test]
fn every_kind_of_number_gives_the_same_torque() {
    let q = [0.4, -1.0, 2.0];
    let plain = torque(&q);
    let dual = torque(&q.map(Dual::<2>::constant));
    let lanes = torque(&q.map(Lanes::<4>::constant));
    for i in 0..3 {
        assert_eq!(plain[i], dual[i].value);
        assert!((plain[i] - lanes[i].0[3]).abs() < ALGEBRA);
    }
}
