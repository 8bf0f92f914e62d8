//! Batches and what they hold, over random trees.
#![allow(non_snake_case)]

#[path = "support/cases.rs"]
mod support;

use sinew_model::Model;
use sinew_model::samples::Random;
use sinew_rigid::*;

use support::{Case, assert_close, cases};

/// Rounding of sums along forty joints.
const ALGEBRA: f64 = 1e-11;

/// Configurations of a tree: none, fewer and more than go side by side.
struct Batch {
    model: Model,
    count: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

fn batches() -> impl Iterator<Item = Batch> {
    cases(900, 9000).enumerate().map(|(seed, Case { model, .. })| {
        let (count, mut random) = (seed % 19, Random::new(seed as u64));
        let q = (0..count).flat_map(|_| random.position(&model)).collect();
        let (qd, qdd) = (random.vector(count * model.nv), random.vector(count * model.nv));
        Batch { model, count, q, qd, qdd }
    })
}

impl Batch {
    /// Each configuration in turn.
    fn each(&self) -> impl Iterator<Item = (usize, &[f64], &[f64], &[f64])> {
        let (nq, nv) = (self.model.nq, self.model.nv);
        (0..self.count)
            .map(move |k| (k, &self.q[k * nq..][..nq], &self.qd[k * nv..][..nv], &self.qdd[k * nv..][..nv]))
    }
}

/// M's condition: what solving with it costs in digits.
fn condition(model: &Model, q: &[f64]) -> f64 {
    let values = mass_matrix(model, q).symmetric_eigenvalues();
    (values.max() / values.min()).max(1e3)
}

#[test]
fn a_batch_of_motions_is_its_motions_one_by_one() {
    for b in batches() {
        let m = &b.model;
        let tau = inverse_dynamics_batch(m, &b.q, &b.qd, &b.qdd);
        let back = forward_dynamics_batch(m, &b.q, &b.qd, tau.as_slice());
        for (k, q, qd, qdd) in b.each() {
            assert_close(tau.column(k).as_slice(), inverse_dynamics(m, q, qd, qdd).as_slice(), ALGEBRA);
            let want = forward_dynamics(m, q, qd, tau.column(k).as_slice());
            assert_close(back.column(k).as_slice(), want.as_slice(), 1e-14 * condition(m, q));
        }
    }
}

#[test]
fn a_batch_of_mass_matrices_is_its_matrices_one_by_one() {
    for b in batches() {
        let m = &b.model;
        let (M, inverse) = (mass_matrix_batch(m, &b.q), inverse_mass_matrix_batch(m, &b.q));
        let mut upper = vec![0.0; M.len()];
        mass_matrix_upper_batch_into(m, &mut BatchWorkspace::new(m), &b.q, &mut upper);
        for (k, q, ..) in b.each() {
            let want = mass_matrix(m, q);
            assert_close(M.column(k).as_slice(), want.as_slice(), ALGEBRA);
            let own = &upper[k * want.len()..][..want.len()];
            assert_close(own, want.upper_triangle().as_slice(), ALGEBRA);
            let want = inverse_mass_matrix(m, q);
            assert_close(inverse.column(k).as_slice(), want.as_slice(), 1e-14 * condition(m, q));
        }
    }
}

#[test]
fn a_batch_of_derivatives_and_regressors_is_theirs_one_by_one() {
    for b in batches() {
        let m = &b.model;
        let slopes = inverse_dynamics_derivatives_batch(m, &b.q, &b.qd, &b.qdd);
        let Y = regressor_batch(m, &b.q, &b.qd, &b.qdd);
        for (k, q, qd, qdd) in b.each() {
            let want = inverse_dynamics_derivatives(m, q, qd, qdd);
            assert_close(slopes.by_position.column(k).as_slice(), want.by_position.as_slice(), ALGEBRA);
            assert_close(slopes.by_velocity.column(k).as_slice(), want.by_velocity.as_slice(), ALGEBRA);
            let M = slopes.by_acceleration.column(k);
            assert_close(M.as_slice(), want.by_acceleration.as_slice(), ALGEBRA);
            assert_close(Y.column(k).as_slice(), regressor(m, q, qd, qdd).as_slice(), ALGEBRA);
        }
    }
}

#[test]
fn the_upper_triangle_is_that_of_the_mass_matrix_and_nothing_below_is_written() {
    for Case { model, q, .. } in cases(900, 9000) {
        let want = mass_matrix(&model, &q);
        let mut got = want.map(|_| 0.0);
        let mut ws = Workspace::new(&model);
        // twice: a workspace holds no result
        for _ in 0..2 {
            mass_matrix_upper_into(&model, &mut ws, &q, got.as_mut_slice());
        }
        assert_eq!(got, if model.has_mimic() { want } else { want.upper_triangle() });
    }
}

#[test]
fn an_inverse_does_not_depend_on_what_the_workspace_did_before() {
    for Case { model, q, qd, qdd } in cases(900, 9000) {
        let mut ws = Workspace::new(&model);
        let size = model.nv * model.nv;
        let (mut first, mut again, mut other) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
        inverse_mass_matrix_into(&model, &mut ws, &q, &mut first);
        let elsewhere = Random::new(5).position(&model);
        inverse_mass_matrix_into(&model, &mut ws, &elsewhere, &mut other);
        let (mut A, mut B) = (other.clone(), other.clone());
        forward_dynamics_derivatives_into(&model, &mut ws, &q, &qd, &qdd, &mut A, &mut B, &mut other);
        inverse_mass_matrix_into(&model, &mut ws, &q, &mut again);
        assert_eq!(first, again);
    }
}
