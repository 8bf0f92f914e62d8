//! Derivatives of the dynamics against dual numbers and differences, over random trees.
#![allow(non_snake_case)]

#[path = "support/cases.rs"]
mod support;

use nalgebra::{DMatrix, DVector};
use sinew_kinematics::{integrate, position_rate};
use sinew_model::samples::Random;
use sinew_model::{Dual, Inertia, Lanes, Scalar};
use sinew_rigid::{
    Bodies, Scratch, forward_dynamics, forward_dynamics_derivatives, forward_dynamics_derivatives_with,
    inertias, inverse_dynamics, inverse_dynamics_derivatives, inverse_dynamics_derivatives_with,
    inverse_dynamics_with, mass_matrix,
};

use support::{Case, assert_close, cases};

/// Rounding of sums along forty joints.
const ALGEBRA: f64 = 1e-11;
/// A sixth-order difference with this step errs by rounding and truncation of about 1e-11 of the largest torque.
const STEP: f64 = 2e-3;
const DIFFERENCES: f64 = 2e-9;
/// M⁻¹ bends more sharply with the position than M: what truncation costs more.
const BY_POSITION: f64 = 100.0;

fn random_cases() -> impl Iterator<Item = Case> {
    cases(200, 3000)
}

fn dual(x: &[f64], rate: &[f64]) -> Vec<Dual<1>> {
    x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect()
}

/// f'(0) to sixth order.
fn slope(f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let pair = |k: f64| f(k * STEP) - f(-k * STEP);
    (pair(1.0) * 45.0 - pair(2.0) * 9.0 + pair(3.0)) / (60.0 * STEP)
}

fn moved(x: &[f64], d: &[f64], h: f64) -> Vec<f64> {
    x.iter().zip(d).map(|(x, d)| x + h * d).collect()
}

#[test]
fn derivatives_of_inverse_dynamics_are_those_of_dual_numbers() {
    for Case { model, q, qd, qdd } in random_cases() {
        let (nv, inertia) = (model.nv, inertias(&model));
        let (b, mut ws) = (Bodies::new(&model, &inertia), Scratch::new(&model));
        let d = inverse_dynamics_derivatives(&model, &q, &qd, &qdd);
        let (still, rest) = (vec![0.0; model.nq], vec![0.0; nv]);
        for k in 0..nv {
            let e = unit(nv, k);
            let mut slopes = |of_q: &[f64], of_qd: &[f64], of_qdd: &[f64]| {
                let mut tau = vec![Dual::ZERO; nv];
                let (q, qd, qdd) = (dual(&q, of_q), dual(&qd, of_qd), dual(&qdd, of_qdd));
                inverse_dynamics_with(&b, &mut ws, &q, &qd, &qdd, &mut tau);
                tau.iter().map(|x| x.derivative[0]).collect::<Vec<_>>()
            };
            let along = position_rate(&model, &q, &e);
            assert_close(d.by_position.column(k).as_slice(), &slopes(&along, &rest, &rest), ALGEBRA);
            assert_close(d.by_velocity.column(k).as_slice(), &slopes(&still, &e, &rest), ALGEBRA);
            assert_close(d.by_acceleration.column(k).as_slice(), &slopes(&still, &rest, &e), ALGEBRA);
        }
    }
}

#[test]
fn derivatives_of_inverse_dynamics_are_central_differences() {
    for (seed, Case { model, q, qd, qdd }) in random_cases().enumerate() {
        let d = inverse_dynamics_derivatives(&model, &q, &qd, &qdd);
        let e = Random::new(seed as u64).vector(model.nv);
        let along = DVector::from_row_slice(&e);
        let there = |h: f64| integrate(&model, &q, &moved(&vec![0.0; model.nv], &e, h));
        let want = slope(|h| inverse_dynamics(&model, &there(h), &qd, &qdd));
        assert_close((&d.by_position * &along).as_slice(), want.as_slice(), DIFFERENCES);
        let want = slope(|h| inverse_dynamics(&model, &q, &moved(&qd, &e, h), &qdd));
        assert_close((&d.by_velocity * &along).as_slice(), want.as_slice(), DIFFERENCES);
    }
}

#[test]
fn derivatives_of_forward_dynamics_are_central_differences() {
    for (seed, Case { model, q, qd, qdd }) in random_cases().enumerate() {
        let values = mass_matrix(&model, &q).symmetric_eigenvalues();
        let tolerance = DIFFERENCES.max(1e-13 * values.max() / values.min());
        let tau = inverse_dynamics(&model, &q, &qd, &qdd);
        let tau = tau.as_slice();
        let d = forward_dynamics_derivatives(&model, &q, &qd, tau);
        let e = Random::new(seed as u64).vector(model.nv);
        let along = DVector::from_row_slice(&e);
        let there = |h: f64| integrate(&model, &q, &moved(&vec![0.0; model.nv], &e, h));
        let want = slope(|h| forward_dynamics(&model, &there(h), &qd, tau));
        assert_close((&d.by_position * &along).as_slice(), want.as_slice(), BY_POSITION * tolerance);
        let want = slope(|h| forward_dynamics(&model, &q, &moved(&qd, &e, h), tau));
        assert_close((&d.by_velocity * &along).as_slice(), want.as_slice(), tolerance);
        let want = slope(|h| forward_dynamics(&model, &q, &qd, &moved(tau, &e, h)));
        assert_close((&d.by_torque * &along).as_slice(), want.as_slice(), tolerance);
    }
}

#[test]
fn both_dynamics_undo_each_other_to_first_order() {
    for Case { model, q, qd, qdd } in random_cases() {
        let tau = inverse_dynamics(&model, &q, &qd, &qdd);
        let there = inverse_dynamics_derivatives(&model, &q, &qd, &qdd);
        let back = forward_dynamics_derivatives(&model, &q, &qd, tau.as_slice());
        let M = &there.by_acceleration;
        let values = M.clone().symmetric_eigenvalues();
        let tolerance = 1e-14 * (values.max() / values.min()).max(1e3);
        let one = M * &back.by_torque;
        assert_close(one.as_slice(), DMatrix::identity(model.nv, model.nv).as_slice(), tolerance);
        assert_close((M * &back.by_position).as_slice(), (-there.by_position).as_slice(), tolerance);
        assert_close((M * &back.by_velocity).as_slice(), (-there.by_velocity).as_slice(), tolerance);
    }
}

#[test]
fn lanes_with_their_own_inertias_and_armature_give_what_plain_numbers_give() {
    for Case { model, q, qd, qdd } in random_cases().take(12) {
        let nv = model.nv;
        let lanes = |x: &[f64]| x.iter().map(|&x| Lanes([-x, x])).collect::<Vec<_>>();
        let heavier = |i: &Inertia<f64>| {
            let (plain, lanes) = (*i + *i, Inertia::constant(i));
            (plain, lanes + lanes)
        };
        let (plain, wide): (Vec<_>, Vec<_>) = model.joints.iter().map(|j| heavier(&j.inertia)).unzip();
        let (armature, rotors) = (vec![0.3; nv], vec![Lanes::constant(0.3); nv]);
        let b = Bodies { armature: &armature, ..Bodies::new(&model, &plain) };
        let wide = Bodies { armature: &rotors, ..Bodies::new(&model, &wide) };
        let room = || [vec![0.0; nv * nv], vec![0.0; nv * nv], vec![0.0; nv * nv]];
        let (mut want, mut want_back) = (room(), room());
        let zeros = || vec![Lanes::<2>::ZERO; nv * nv];
        let (mut got, mut got_back) = ([zeros(), zeros(), zeros()], [zeros(), zeros(), zeros()]);
        let (mut ws, mut wide_ws) = (Scratch::new(&model), Scratch::new(&model));
        {
            let [x, y, z] = &mut want;
            inverse_dynamics_derivatives_with(&b, &mut ws, &q, &qd, &qdd, x, y, z);
            let [x, y, z] = &mut want_back;
            forward_dynamics_derivatives_with(&b, &mut ws, &q, &qd, &qdd, x, y, z);
            let (q, qd, qdd) = (lanes(&q), lanes(&qd), lanes(&qdd));
            let [x, y, z] = &mut got;
            inverse_dynamics_derivatives_with(&wide, &mut wide_ws, &q, &qd, &qdd, x, y, z);
            let [x, y, z] = &mut got_back;
            forward_dynamics_derivatives_with(&wide, &mut wide_ws, &q, &qd, &qdd, x, y, z);
        }
        for (got, want) in got.iter().chain(&got_back).zip(want.iter().chain(&want_back)) {
            let second: Vec<f64> = got.iter().map(|x| x.0[1]).collect();
            assert_close(&second, want, 1e-9);
        }
    }
}
