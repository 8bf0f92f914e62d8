//! Laws of dynamics that hold for every tree.
#![allow(non_snake_case)]

use nalgebra::{DMatrix, DVector};
use sinew_kinematics::{Axes, integrate, jacobian, link_velocity, position_rate};
use sinew_model::samples::{Random, planar_arm, random_tree};
use sinew_model::{Dual, Force, Inertia, Lanes, LinkId, Model, Scalar};
use sinew_rigid::{
    Bodies, Scratch, bias, coriolis_matrix, forward_dynamics, forward_dynamics_with, gravity,
    hybrid_dynamics_with, hybrid_response_with, inertias, inverse_dynamics, inverse_dynamics_with,
    inverse_mass_matrix, kinetic_energy, kinetic_energy_with, mass_matrix, mass_matrix_with,
    potential_energy_with, regressor, tool_wrench_with,
};

/// Rounding of sums along forty joints.
const ALGEBRA: f64 = 1e-11;
/// Rounding of the central differences of numbers of order one with a step of 1e-6.
const DIFFERENCES: f64 = 1e-7;

struct Case {
    model: Model,
    inertia: Vec<Inertia<f64>>,
    armature: Vec<f64>,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

impl Case {
    fn bodies(&self) -> Bodies<'_, f64> {
        Bodies { armature: &self.armature, ..Bodies::new(&self.model, &self.inertia) }
    }

    /// M's condition: what solving with it costs in digits.
    fn condition(&self) -> f64 {
        let values = mass_matrix(&self.model, &self.q).symmetric_eigenvalues();
        values.max() / values.min()
    }
}

fn cases() -> impl Iterator<Item = Case> {
    (0..80).map(|seed| {
        let model = random_tree(1 + seed as usize % 40, seed);
        let mut random = Random::new(seed + 1000);
        let (q, qd, qdd) = (random.position(&model), random.vector(model.nv), random.vector(model.nv));
        let armature = random.vector(model.nv).iter().map(|x| x.abs()).collect();
        Case { inertia: inertias(&model), armature, model, q, qd, qdd }
    })
}

fn assert_close(got: &[f64], want: &[f64], tolerance: f64) {
    let scale = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() <= tolerance * scale, "got {got}, want {want}");
    }
}

fn columns(M: &DMatrix<f64>) -> &[f64] {
    M.as_slice()
}

fn dual(x: &[f64], rate: &[f64]) -> Vec<Dual<1>> {
    x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
}

fn position_in_motion(case: &Case) -> Vec<Dual<1>> {
    dual(&case.q, &position_rate(&case.model, &case.q, &case.qd))
}

#[test]
fn mass_matrix_is_symmetric_positive_definite() {
    for case in cases() {
        let M = mass_matrix(&case.model, &case.q);
        assert_eq!(M, M.transpose());
        assert!(M.cholesky().is_some());
    }
}

#[test]
fn kinetic_energy_is_half_qd_m_qd() {
    for case in cases() {
        let qd = DVector::from_row_slice(&case.qd);
        let mut M = DMatrix::zeros(case.model.nv, case.model.nv);
        let mut ws = Scratch::new(&case.model);
        mass_matrix_with(&case.bodies(), &mut ws, &case.q, M.as_mut_slice());
        let energy = kinetic_energy_with(&case.bodies(), &mut ws, &case.q, &case.qd);
        assert_close(&[energy], &[0.5 * qd.dot(&(M * &qd))], ALGEBRA);
        assert!(energy > kinetic_energy(&case.model, &case.q, &case.qd));
    }
}

#[test]
fn m_dot_minus_2c_is_skew() {
    for case in cases() {
        let (inertia, nv) = (inertias(&case.model), case.model.nv);
        let mut M = vec![Dual::<1>::ZERO; nv * nv];
        let bodies = Bodies::new(&case.model, &inertia);
        mass_matrix_with(&bodies, &mut Scratch::new(&case.model), &position_in_motion(&case), &mut M);
        let M_rate = DMatrix::from_iterator(nv, nv, M.iter().map(|x| x.derivative[0]));
        let C = coriolis_matrix(&case.model, &case.q, &case.qd);
        let skew = &M_rate - &C * 2.0;
        assert!((&skew + skew.transpose()).amax() < ALGEBRA * (1.0 + M_rate.amax()));
    }
}

#[test]
fn coriolis_matrix_times_rates_is_bias_without_gravity() {
    for case in cases() {
        let C = coriolis_matrix(&case.model, &case.q, &case.qd);
        let got = C * DVector::from_row_slice(&case.qd) + gravity(&case.model, &case.q);
        assert_close(got.as_slice(), bias(&case.model, &case.q, &case.qd).as_slice(), ALGEBRA);
    }
}

#[test]
fn coriolis_matrix_of_single_axis_joints_is_christoffels() {
    let model = planar_arm(2, 3.0, 0.7);
    let (q, qd) = ([0.4, 1.1], [0.8, -1.7]);
    // h = −m l²/2 sin q₂:  C = [h q̇₂, h (q̇₁ + q̇₂); −h q̇₁, 0]
    let h = -3.0 * 0.7 * 0.7 / 2.0 * q[1].sin();
    let want = [h * qd[1], -h * qd[0], h * (qd[0] + qd[1]), 0.0];
    assert_close(columns(&coriolis_matrix(&model, &q, &qd)), &want, ALGEBRA);
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for case in cases() {
        let tau = inverse_dynamics(&case.model, &case.q, &case.qd, &case.qdd);
        let qdd = forward_dynamics(&case.model, &case.q, &case.qd, tau.as_slice());
        assert_close(qdd.as_slice(), &case.qdd, 1e-14 * case.condition().max(1e3));
    }
}

#[test]
fn hybrid_dynamics_solves_the_equations_of_motion_whatever_is_imposed() {
    for (seed, case) in cases().enumerate() {
        let (b, nv) = (case.bodies(), case.model.nv);
        let mut ws = Scratch::new(&case.model);
        let mut want = vec![0.0; nv];
        inverse_dynamics_with(&b, &mut ws, &case.q, &case.qd, &case.qdd, &mut want);
        for share in [-2.0, -0.5, 0.0, 0.5, 2.0] {
            let imposed: Vec<bool> = Random::new(seed as u64).vector(nv).iter().map(|&x| x < share).collect();
            let given = |x: &[f64], is: bool| -> Vec<f64> {
                (0..nv).map(|i| if imposed[i] == is { x[i] } else { f64::NAN }).collect()
            };
            let (mut qdd, mut tau) = (given(&case.qdd, true), given(&want, false));
            hybrid_dynamics_with(&b, &mut ws, &case.q, &case.qd, &imposed, &mut qdd, &mut tau);
            assert_close(&qdd, &case.qdd, 1e-14 * case.condition().max(1e3));
            assert_close(&tau, &want, 1e-14 * case.condition().max(1e3));
        }
        let mut qdd = vec![0.0; nv];
        forward_dynamics_with(&b, &mut ws, &case.q, &case.qd, &want, &mut qdd);
        assert_close(&qdd, &case.qdd, 1e-14 * case.condition().max(1e3));
    }
}

#[test]
fn the_response_of_a_hybrid_motion_is_the_difference_of_two_motions() {
    for (seed, case) in cases().enumerate() {
        let (b, nv) = (case.bodies(), case.model.nv);
        let rounding = 1e-14 * case.condition().max(1e3);
        let mut ws = Scratch::new(&case.model);
        let mut response = vec![0.0; nv * nv];
        for share in [-2.0, 0.0, 2.0] {
            let imposed: Vec<bool> = Random::new(seed as u64).vector(nv).iter().map(|&x| x < share).collect();
            hybrid_response_with(&b, &mut ws, &case.q, &imposed, &mut response);
            // Linear in τ: one unit more at each free joint in turn.
            let mut answer = |j: Option<usize>| -> Vec<f64> {
                let mut tau = vec![0.0; nv];
                if let Some(j) = j {
                    tau[j] = 1.0;
                }
                let mut qdd = vec![0.0; nv];
                hybrid_dynamics_with(&b, &mut ws, &case.q, &case.qd, &imposed, &mut qdd, &mut tau);
                (0..nv).map(|i| if imposed[i] { tau[i] } else { qdd[i] }).collect()
            };
            let without = answer(None);
            for j in 0..nv {
                let column = &response[nv * j..nv * (j + 1)];
                if imposed[j] {
                    assert!(column.iter().all(|x| *x == 0.0));
                    continue;
                }
                let change: Vec<f64> = answer(Some(j)).iter().zip(&without).map(|(a, b)| a - b).collect();
                let size = without.iter().chain(column).fold(1.0f64, |m, x| m.max(x.abs()));
                for (a, b) in change.iter().zip(column) {
                    assert!((a - b).abs() < rounding * size, "{a} {b}");
                }
            }
        }
    }
}

#[test]
fn mass_matrix_times_its_inverse_is_one() {
    for case in cases() {
        let inverse = inverse_mass_matrix(&case.model, &case.q);
        let one = mass_matrix(&case.model, &case.q) * &inverse;
        let nv = case.model.nv;
        assert_close(columns(&one), columns(&DMatrix::identity(nv, nv)), 1e-14 * case.condition().max(1e3));
        assert_eq!(inverse, inverse.transpose());
    }
}

#[test]
fn power_in_equals_energy_rate() {
    for case in cases() {
        let (q, qd) = (position_in_motion(&case), dual(&case.qd, &case.qdd));
        let inertia = inertias(&case.model);
        let armature: Vec<_> = case.armature.iter().map(|&x| Dual::<1>::constant(x)).collect();
        let b = Bodies { armature: &armature, ..Bodies::new(&case.model, &inertia) };
        let mut ws = Scratch::new(&case.model);
        let energy = kinetic_energy_with(&b, &mut ws, &q, &qd) + potential_energy_with(&b, &mut ws, &q);
        let mut tau = vec![0.0; case.model.nv];
        let scratch = &mut Scratch::new(&case.model);
        inverse_dynamics_with(&case.bodies(), scratch, &case.q, &case.qd, &case.qdd, &mut tau);
        let power: f64 = tau.iter().zip(&case.qd).map(|(tau, qd)| tau * qd).sum();
        assert_close(&[power], &energy.derivative, ALGEBRA);
    }
}

#[test]
fn gravity_torque_is_the_slope_of_potential_energy() {
    for case in cases() {
        let inertia = inertias(&case.model);
        let b = Bodies::new(&case.model, &inertia);
        let q = position_in_motion(&case);
        let energy = potential_energy_with(&b, &mut Scratch::new(&case.model), &q);
        let power = gravity(&case.model, &case.q).dot(&DVector::from_row_slice(&case.qd));
        assert_close(&[power], &energy.derivative, ALGEBRA);
    }
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    for case in cases() {
        let parameters: Vec<f64> = case
            .inertia
            .iter()
            .flat_map(|i| {
                let (h, I) = (i.first_moment, i.second_moment);
                [i.mass, h.x, h.y, h.z, I.xx, I.xy, I.yy, I.xz, I.yz, I.zz]
            })
            .collect();
        let got = regressor(&case.model, &case.q, &case.qd, &case.qdd) * DVector::from_vec(parameters);
        let want = inverse_dynamics(&case.model, &case.q, &case.qd, &case.qdd);
        assert_close(got.as_slice(), want.as_slice(), ALGEBRA);
    }
}

#[test]
fn force_and_motion_through_j_have_equal_power() {
    for (seed, case) in cases().enumerate() {
        let link = LinkId(case.model.links.len() - 1);
        let w: [f64; 6] = Random::new(seed as u64).vector(6).try_into().unwrap();
        let wrench = Force::new([w[0], w[1], w[2]].into(), [w[3], w[4], w[5]].into());
        let mut tau = vec![1.0; case.model.nv];
        tool_wrench_with(&case.bodies(), &mut Scratch::new(&case.model), &case.q, link, wrench, &mut tau);
        let J = jacobian(&case.model, &case.q, link, Axes::WorldAligned);
        let want = J.transpose() * nalgebra::Vector6::from(w);
        let added: Vec<f64> = tau.iter().map(|tau| tau - 1.0).collect();
        assert_close(&added, want.as_slice(), ALGEBRA);
        let v = link_velocity(&case.model, &case.q, &case.qd, link, Axes::WorldAligned);
        let power: f64 = added.iter().zip(&case.qd).map(|(tau, qd)| tau * qd).sum();
        assert_close(&[power], &[wrench.dot(v)], ALGEBRA);
    }
}

#[test]
fn derivatives_by_dual_numbers_are_central_differences() {
    for (seed, case) in cases().enumerate() {
        let (m, nv) = (&case.model, case.model.nv);
        let d = Random::new(seed as u64).vector(nv);
        let inertia = inertias(m);
        let b = Bodies::new(m, &inertia);
        let q = dual(&case.q, &position_rate(m, &case.q, &d));
        let (qd, qdd) = (dual(&case.qd, &d), dual(&case.qdd, &vec![0.0; nv]));
        let mut tau = vec![Dual::<1>::ZERO; nv];
        inverse_dynamics_with(&b, &mut Scratch::new(m), &q, &qd, &qdd, &mut tau);
        let at = |h: f64| {
            let step = |x: &[f64]| -> Vec<f64> { x.iter().zip(&d).map(|(x, d)| x + h * d).collect() };
            let there = integrate(m, &case.q, &d.iter().map(|d| h * d).collect::<Vec<_>>());
            inverse_dynamics(m, &there, &step(&case.qd), &case.qdd)
        };
        let want = (at(1e-6) - at(-1e-6)) / 2e-6;
        let got: Vec<f64> = tau.iter().map(|x| x.derivative[0]).collect();
        assert_close(&got, want.as_slice(), DIFFERENCES);
    }
}

#[test]
fn lanes_give_what_plain_numbers_give() {
    for case in cases() {
        let (m, nv) = (&case.model, case.model.nv);
        let lanes = |x: &[f64]| x.iter().map(|&x| Lanes([-x, x])).collect::<Vec<_>>();
        let inertia = inertias(m);
        let b = Bodies::new(m, &inertia);
        let (q, qd, qdd) = (lanes(&case.q), lanes(&case.qd), lanes(&case.qdd));
        let ws = &mut Scratch::new(m);
        let (mut tau, mut back) = (vec![Lanes::ZERO; nv], vec![Lanes::ZERO; nv]);
        inverse_dynamics_with(&b, ws, &q, &qd, &qdd, &mut tau);
        let second = |x: &[Lanes<2>]| x.iter().map(|x| x.0[1]).collect::<Vec<_>>();
        let want = inverse_dynamics(m, &case.q, &case.qd, &case.qdd);
        assert_close(&second(&tau), want.as_slice(), ALGEBRA);
        forward_dynamics_with(&b, ws, &q, &qd, &tau, &mut back);
        assert_close(&second(&back), &case.qdd, 1e-14 * case.condition().max(1e3));
    }
}

#[test]
fn torques_do_not_depend_on_where_the_world_is() {
    for (seed, case) in cases().enumerate() {
        let new_from_old = Random::new(seed as u64).pose();
        let mut moved = case.model.clone().with_gravity(new_from_old.rotation * case.model.gravity);
        for joint in moved.joints.iter_mut().filter(|j| j.parent.is_none()) {
            joint.placement = new_from_old * joint.placement;
        }
        let want = inverse_dynamics(&case.model, &case.q, &case.qd, &case.qdd);
        let got = inverse_dynamics(&moved, &case.q, &case.qd, &case.qdd);
        assert_close(got.as_slice(), want.as_slice(), ALGEBRA);
        let C = coriolis_matrix(&case.model, &case.q, &case.qd);
        assert_close(columns(&coriolis_matrix(&moved, &case.q, &case.qd)), columns(&C), ALGEBRA);
    }
}

#[test]
fn a_planar_double_pendulum_has_its_textbook_mass_matrix_and_torque() {
    let (m, l, g) = (3.0, 0.7, 9.81);
    let model = planar_arm(2, m, l);
    let (q, qd, qdd) = ([0.4, 1.1], [0.8, -1.7], [2.0, -3.0]);
    let (s2, c2) = q[1].sin_cos();
    let ml2 = m * l * l;
    let (m22, m12) = (ml2 / 3.0, ml2 / 3.0 + ml2 / 2.0 * c2);
    let m11 = ml2 / 3.0 + ml2 / 3.0 + ml2 + ml2 * c2;
    assert_close(columns(&mass_matrix(&model, &q)), &[m11, m12, m12, m22], ALGEBRA);
    let h = ml2 / 2.0 * s2;
    let (g1, g2) = (m * g * l * 1.5 * q[0].cos(), m * g * l / 2.0 * (q[0] + q[1]).cos());
    let want = [
        m11 * qdd[0] + m12 * qdd[1] - h * qd[1] * (2.0 * qd[0] + qd[1]) + g1 + g2,
        m12 * qdd[0] + m22 * qdd[1] + h * qd[0] * qd[0] + g2,
    ];
    assert_close(inverse_dynamics(&model, &q, &qd, &qdd).as_slice(), &want, ALGEBRA);
}
