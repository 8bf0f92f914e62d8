//! Laws of motion that hold for every tree.
#![allow(non_snake_case)]

use nalgebra::{DMatrix, DVector, Matrix6xX};
use sinew_kinematics::{
    Axes, Scratch, centre_of_mass, centre_of_mass_jacobian, centre_of_mass_with, classical_acceleration,
    compliance, difference, hessian, integrate, jacobian, jacobian_batch, jacobian_rate, jacobian_with,
    joint_axes, link_acceleration, link_pose, link_pose_with, link_poses, link_velocity, link_velocity_with,
    position_rate,
};
use sinew_model::samples::{Random, random_tree};
use sinew_model::{Dual, Inertia, Lanes, LinkId, Model, Motion, Scalar};

/// Rounding of products along twenty joints.
const ALGEBRA: f64 = 1e-11;
const AXES: [Axes; 3] = [Axes::World, Axes::Local, Axes::WorldAligned];

struct Case {
    model: Model,
    link: LinkId,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

fn cases() -> impl Iterator<Item = Case> {
    (0..80).map(|seed| {
        let model = random_tree(1 + seed as usize % 40, seed);
        let mut random = Random::new(seed + 1000);
        let (q, qd, qdd) = (random.position(&model), random.vector(model.nv), random.vector(model.nv));
        Case { link: LinkId(model.links.len() - 1), model, q, qd, qdd }
    })
}

/// q as dual numbers that move at qd.
fn moving(case: &Case) -> Vec<Dual<1>> {
    let rate = position_rate(&case.model, &case.q, &case.qd);
    case.q.iter().zip(rate).map(|(&value, rate)| Dual { value, derivative: [rate] }).collect()
}

fn vector(m: Motion<f64>) -> DVector<f64> {
    DVector::from_row_slice(&m.to_array())
}

fn assert_close(got: &DVector<f64>, want: &DVector<f64>) {
    assert!((got - want).amax() < ALGEBRA * (1.0 + want.amax()), "got {got}, want {want}");
}

#[test]
fn the_jacobian_is_the_derivative_of_the_pose() {
    for case in cases() {
        let pose = link_pose_with(&case.model, &moving(&case), case.link);
        let v = link_velocity(&case.model, &case.q, &case.qd, case.link, Axes::WorldAligned);
        let rate = pose.translation.to_array().map(|x| x.derivative[0]);
        assert_close(&DVector::from_row_slice(&rate), &DVector::from_row_slice(&v.linear.to_array()));
        // [ω]× = Ṙ Rᵀ
        let of =
            |f: fn(Dual<1>) -> f64| DMatrix::from_fn(3, 3, |i, j| f(pose.rotation.rows[i].to_array()[j]));
        let spin = of(|x| x.derivative[0]) * of(|x| x.value).transpose();
        let omega = DVector::from_row_slice(&[spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]]);
        assert_close(&omega, &DVector::from_row_slice(&v.angular.to_array()));
    }
}

#[test]
fn velocity_is_the_jacobian_times_the_rates() {
    for case in cases() {
        let qd = DVector::from_row_slice(&case.qd);
        for axes in AXES {
            let J = jacobian(&case.model, &case.q, case.link, axes);
            let v = link_velocity(&case.model, &case.q, &case.qd, case.link, axes);
            assert_close(&DVector::from_row_slice((J * &qd).as_slice()), &vector(v));
        }
    }
}

#[test]
fn the_jacobian_rate_is_the_derivative_of_the_jacobian() {
    for case in cases() {
        let q = moving(&case);
        for axes in AXES {
            let mut J = vec![Dual::<1>::ZERO; 6 * case.model.nv];
            jacobian_with(&case.model, &mut Scratch::new(&case.model), &q, case.link, axes, &mut J);
            let want = DVector::from_iterator(J.len(), J.iter().map(|x| x.derivative[0]));
            let got = jacobian_rate(&case.model, &case.q, &case.qd, case.link, axes);
            assert_close(&DVector::from_row_slice(got.as_slice()), &want);
        }
    }
}

#[test]
fn acceleration_is_j_qdd_plus_j_rate_qd() {
    for case in cases() {
        let (qd, qdd) = (DVector::from_row_slice(&case.qd), DVector::from_row_slice(&case.qdd));
        for axes in AXES {
            let J = jacobian(&case.model, &case.q, case.link, axes);
            let rate = jacobian_rate(&case.model, &case.q, &case.qd, case.link, axes);
            let want = J * &qdd + rate * &qd;
            let acceleration =
                if axes == Axes::WorldAligned { classical_acceleration } else { link_acceleration };
            let got = acceleration(&case.model, &case.q, &case.qd, &case.qdd, case.link, axes);
            assert_close(&vector(got), &DVector::from_row_slice(want.as_slice()));
        }
    }
}

#[test]
fn the_centre_of_mass_moves_as_its_jacobian_says() {
    for case in cases() {
        let inertia: Vec<_> = case.model.joints.iter().map(|j| Inertia::constant(&j.inertia)).collect();
        let mut ws = Scratch::new(&case.model);
        let c = centre_of_mass_with(&case.model, &inertia, &mut ws, &moving(&case)).to_array();
        let J = centre_of_mass_jacobian(&case.model, &case.q);
        let got = J * DVector::from_row_slice(&case.qd);
        let want = DVector::from_row_slice(&c.map(|x| x.derivative[0]));
        assert_close(&DVector::from_row_slice(got.as_slice()), &want);
        assert!((centre_of_mass(&case.model, &case.q).x - c[0].value).abs() < ALGEBRA);
    }
}

#[test]
fn difference_undoes_integrate() {
    for (case, scale) in cases().zip([1.0, 1e-3, 1e-5, 1e-9].into_iter().cycle()) {
        let d: Vec<f64> = case.qd.iter().map(|x| x * scale).collect();
        let there = integrate(&case.model, &case.q, &d);
        let got = DVector::from_vec(difference(&case.model, &case.q, &there)) / scale;
        // positions of order one hold a displacement to 1e-16 / scale
        let rounding = ALGEBRA * (1e-4 / scale).max(1.0);
        assert!((got - DVector::from_vec(case.qd)).amax() < rounding);
    }
}

#[test]
fn integrate_moves_at_the_position_rate() {
    for case in cases() {
        let h = 1e-5;
        let step: Vec<f64> = case.qd.iter().map(|x| x * h).collect();
        let back: Vec<f64> = step.iter().map(|x| -x).collect();
        let forth = DVector::from_vec(integrate(&case.model, &case.q, &step));
        let back = DVector::from_vec(integrate(&case.model, &case.q, &back));
        let rate = DVector::from_vec(position_rate(&case.model, &case.q, &case.qd));
        assert!(((forth - back) / (2.0 * h) - rate).amax() < 1e-9);
    }
}

#[test]
fn moving_the_world_moves_every_link_with_it() {
    for (seed, case) in cases().enumerate() {
        let new_from_old = Random::new(seed as u64).pose();
        let mut moved = case.model.clone();
        for joint in moved.joints.iter_mut().filter(|j| j.parent.is_none()) {
            joint.placement = new_from_old * joint.placement;
        }
        let (here, there) =
            (link_pose(&case.model, &case.q, case.link), link_pose(&moved, &case.q, case.link));
        if case.model.links[case.link.0].body.is_some() {
            assert!(((new_from_old * here).translation - there.translation).norm() < ALGEBRA);
            let local = |m| vector(link_velocity(m, &case.q, &case.qd, case.link, Axes::Local));
            assert_close(&local(&moved), &local(&case.model));
        }
    }
}

#[test]
fn lanes_give_what_plain_numbers_give() {
    for case in cases() {
        let lanes = |x: &[f64]| x.iter().map(|&x| Lanes([x, -x])).collect::<Vec<_>>();
        let mut ws = Scratch::new(&case.model);
        let (q, qd) = (lanes(&case.q), lanes(&case.qd));
        let got = link_velocity_with(&case.model, &mut ws, &q, &qd, case.link, Axes::World).to_array();
        let want = link_velocity(&case.model, &case.q, &case.qd, case.link, Axes::World);
        assert_close(&DVector::from_row_slice(&got.map(|x| x.0[0])), &vector(want));
    }
}

#[test]
fn compliance_is_what_a_wrench_stores_in_the_springs() {
    for case in cases() {
        let (J, n) = (jacobian(&case.model, &case.q, case.link, Axes::WorldAligned), case.model.nv);
        let root = DMatrix::from_vec(n, n, Random::new(7).vector(n * n));
        let K_inverse = &root * root.transpose();
        let w = DVector::from_vec(Random::new(8).vector(6));
        let tau = J.transpose() * &w;
        let twice = (tau.transpose() * &K_inverse * &tau)[(0, 0)];
        let C = compliance(&J, &K_inverse);
        assert!(((w.transpose() * C * &w)[(0, 0)] - twice).abs() < ALGEBRA * (1.0 + twice));
    }
}

#[test]
fn a_link_fixed_to_the_world_does_not_move() {
    let model = random_tree(4, 2);
    let J = jacobian(&model, &Random::new(1).position(&model), LinkId(0), Axes::World);
    assert_eq!(J, Matrix6xX::zeros(model.nv));
}

#[test]
fn the_hessian_is_the_derivative_of_the_jacobian() {
    for case in cases() {
        for axes in AXES {
            let H = hessian(&case.model, &case.q, case.link, axes);
            for (k, got) in H.iter().enumerate() {
                let unit: Vec<f64> = (0..case.model.nv).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
                let along = position_rate(&case.model, &case.q, &unit);
                let q = case.q.iter().zip(along);
                let q: Vec<_> = q.map(|(&value, rate)| Dual { value, derivative: [rate] }).collect();
                let mut J = vec![Dual::<1>::ZERO; 6 * case.model.nv];
                jacobian_with(&case.model, &mut Scratch::new(&case.model), &q, case.link, axes, &mut J);
                let want = DVector::from_iterator(J.len(), J.iter().map(|x| x.derivative[0]));
                assert_close(&DVector::from_row_slice(got.as_slice()), &want);
            }
        }
    }
}

#[test]
fn the_hessian_along_the_rates_is_the_jacobian_rate() {
    for case in cases() {
        for axes in AXES {
            let H = hessian(&case.model, &case.q, case.link, axes);
            let along =
                H.iter().zip(&case.qd).fold(Matrix6xX::zeros(case.model.nv), |sum, (H, x)| sum + H * *x);
            let want = jacobian_rate(&case.model, &case.q, &case.qd, case.link, axes);
            assert_close(
                &DVector::from_row_slice(along.as_slice()),
                &DVector::from_row_slice(want.as_slice()),
            );
        }
    }
}

#[test]
fn the_axes_of_the_joints_that_carry_a_link_are_its_jacobian() {
    for case in cases().filter(|case| !case.model.has_mimic()) {
        let mut want = joint_axes(&case.model, &case.q);
        let mut carries = vec![false; case.model.nv];
        let mut body = case.model.links[case.link.0].body;
        while let Some(id) = body {
            let joint = &case.model.joints[id.0];
            carries[joint.first_dof..joint.first_dof + joint.kind.nv()].fill(true);
            body = joint.parent;
        }
        for (dof, _) in carries.iter().enumerate().filter(|(_, carries)| !**carries) {
            want.column_mut(dof).fill(0.0);
        }
        let J = jacobian(&case.model, &case.q, case.link, Axes::World);
        assert_close(&DVector::from_row_slice(J.as_slice()), &DVector::from_row_slice(want.as_slice()));
    }
}

#[test]
fn all_links_at_once_stand_where_each_one_does() {
    for case in cases() {
        for (k, pose) in link_poses(&case.model, &case.q).iter().enumerate() {
            let alone = link_pose(&case.model, &case.q, LinkId(k));
            assert!((pose.translation - alone.translation).norm() < ALGEBRA);
            assert!((pose.rotation.rows[0] - alone.rotation.rows[0]).norm() < ALGEBRA);
        }
    }
}

#[test]
fn a_batch_of_jacobians_is_the_jacobians_one_by_one() {
    for (seed, case) in cases().enumerate() {
        let mut random = Random::new(seed as u64);
        let q: Vec<Vec<f64>> = (0..seed % 20).map(|_| random.position(&case.model)).collect();
        let axes = AXES[seed % 3];
        let got = jacobian_batch(&case.model, &q.concat(), case.link, axes);
        assert_eq!(got.ncols(), q.len());
        for (got, q) in got.column_iter().zip(&q) {
            let want = jacobian(&case.model, q, case.link, axes);
            assert_close(&got.into_owned(), &DVector::from_column_slice(want.as_slice()));
        }
    }
}
