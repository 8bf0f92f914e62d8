//! Momentum, and what is linear in the inertial parameters, over random trees.
#![allow(non_snake_case)]

#[path = "support/cases.rs"]
mod support;

use nalgebra::{DMatrix, DVector};
use sinew_kinematics::{centre_of_mass, centre_of_mass_jacobian, position_rate};
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Dual, Model};
use sinew_rigid::*;

use support::{Case, assert_close, cases};

/// Rounding of sums along forty joints.
const ALGEBRA: f64 = 1e-11;

fn random_cases() -> impl Iterator<Item = Case> {
    cases(400, 5000)
}

fn parameters(model: &Model) -> DVector<f64> {
    let ten = |joint: &sinew_model::Joint| {
        let (i, h, I) = (joint.inertia, joint.inertia.first_moment, joint.inertia.second_moment);
        [i.mass, h.x, h.y, h.z, I.xx, I.xy, I.yy, I.xz, I.yz, I.zz]
    };
    DVector::from_iterator(PARAMETERS * model.joints.len(), model.joints.iter().flat_map(ten))
}

#[test]
fn energies_are_linear_in_the_parameters() {
    for Case { model, q, qd, .. } in random_cases() {
        let pi = parameters(&model);
        let T = kinetic_energy_regressor(&model, &q, &qd).dot(&pi);
        assert_close(&[T], &[kinetic_energy(&model, &q, &qd)], ALGEBRA);
        let U = potential_energy_regressor(&model, &q).dot(&pi);
        assert_close(&[U], &[potential_energy(&model, &q)], ALGEBRA);
    }
}

#[test]
fn linear_momentum_is_mass_times_the_velocity_of_the_centre() {
    for Case { model, q, qd, .. } in random_cases() {
        let h = centroidal_momentum(&model, &q, &qd);
        let mass = model.moving_mass();
        let v = centre_of_mass_jacobian(&model, &q) * DVector::from_row_slice(&qd) * mass;
        assert_close(&h.linear.to_array(), v.as_slice(), ALGEBRA);
    }
}

#[test]
fn momentum_is_its_matrix_times_the_rates_and_its_rate_is_its_derivative() {
    for Case { model, q, qd, qdd } in random_cases() {
        let A = centroidal_momentum_matrix(&model, &q);
        let h = centroidal_momentum(&model, &q, &qd);
        assert_close(&h.to_array(), (&A * DVector::from_row_slice(&qd)).as_slice(), ALGEBRA);
        let dual = |x: &[f64], rate: &[f64]| -> Vec<Dual<1>> {
            x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
        };
        let inertia = inertias(&model);
        let (b, mut ws) = (Bodies::new(&model, &inertia), Scratch::new(&model));
        let (q_dual, qd_dual) = (dual(&q, &position_rate(&model, &q, &qd)), dual(&qd, &qdd));
        let moving = centroidal_momentum_with(&b, &mut ws, &q_dual, &qd_dual, &qd_dual).0;
        let want = moving.to_array().map(|x| x.derivative[0]);
        assert_close(&centroidal_momentum_rate(&model, &q, &qd, &qdd).to_array(), &want, ALGEBRA);
    }
}

#[test]
fn a_free_robot_changes_its_momentum_by_its_weight_alone() {
    for Case { model, q, qd, .. } in random_cases() {
        let free = model.joints.iter().any(|j| j.parent.is_none() && j.kind.nv() == 1);
        if free || model.has_mimic() {
            continue;
        }
        let qdd = forward_dynamics(&model, &q, &qd, &vec![0.0; model.nv]);
        let rate = centroidal_momentum_rate(&model, &q, &qd, qdd.as_slice());
        let mass = model.moving_mass();
        let scale = mass * 9.81 + qdd.amax();
        let error = rate.linear - model.gravity * mass;
        assert!(error.norm() < 1e-9 * scale && rate.angular.norm() < 1e-9 * scale);
        assert!(centre_of_mass(&model, &q).norm().is_finite());
    }
}

#[test]
fn base_parameters_say_all_that_torques_say() {
    for Case { model, q, qd, qdd } in random_cases().take(14) {
        let base = base_parameters(&model);
        let Y = regressor(&model, &q, &qd, &qdd);
        let leaders: Vec<usize> = base.groups.iter().map(|group| group.leader).collect();
        let own = Y.select_columns(&leaders);
        let values = base.matrix() * parameters(&model);
        let tau = inverse_dynamics(&model, &q, &qd, &qdd);
        assert_close((own * values).as_slice(), tau.as_slice(), 1e-8);
        for &column in &base.unfelt {
            assert!(Y.column(column).amax() < 1e-8 * Y.amax());
        }
    }
}

#[test]
fn base_parameters_are_as_many_as_the_rank_of_many_regressors() {
    for Case { model, .. } in random_cases().take(10) {
        let (mut random, nv) = (Random::new(77), model.nv);
        let rows: Vec<DMatrix<f64>> = (0..20 * model.joints.len())
            .map(|_| regressor(&model, &random.position(&model), &random.vector(nv), &random.vector(nv)))
            .collect();
        let mut W = DMatrix::zeros(nv * rows.len(), rows[0].ncols());
        for (k, Y) in rows.iter().enumerate() {
            W.rows_mut(nv * k, nv).copy_from(Y);
        }
        let values = W.singular_values();
        let rank = values.iter().filter(|x| **x > 1e-9 * values.max()).count();
        assert_eq!(base_parameters(&model).groups.len(), rank);
    }
}

#[test]
fn a_planar_arm_has_its_textbook_groups() {
    // vertical plane: the first link takes up the second's mass at its own length
    let base = base_parameters(&planar_arm(2, 1.0, 0.5));
    assert_eq!(
        base.in_words(),
        [
            "first moment x of link_1 + 0.5 mass of link_2",
            "first moment z of link_1",
            "inertia yy of link_1 + 0.25 mass of link_2",
            "first moment x of link_2",
            "first moment z of link_2",
            "inertia yy of link_2",
        ]
    );
}
