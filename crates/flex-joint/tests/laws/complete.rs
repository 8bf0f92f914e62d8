//! Laws of the complete model on random trees: rotors as bodies, energy, limits, derivatives.

use nalgebra::{DMatrix, DVector};
use sinew_flex_joint::{ElasticJoints, FlexJointError, Scratch, SpinInertia};
use sinew_kinematics::{difference, integrate, position_rate};
use sinew_model::samples::planar_arm;
use sinew_model::{
    Dual, Inertia, Joint, JointId, JointKind, Lanes, Limits, Model, Pose, Robot, Scalar, Symmetric3, Vector3,
};
use sinew_rigid::{Bodies, forward_dynamics_with, inertias};

use crate::trees::{Case, Mounting, assert_close, cases};

/// Rounding of solutions with the mass matrix of trees whose links are a thousand times lighter than others.
const SOLUTION: f64 = 1e-8;
/// Rounding of derivatives of such solutions.
const DERIVATIVES: f64 = 1e-8;
/// Error of central differences of the fourth order.
const DIFFERENCES: f64 = 1e-5;

/// The unit axis of a rotor in the body that carries it; none where that is the world.
fn mount(robot: &Robot, dof: usize) -> Option<(JointId, Vector3<f64>)> {
    let joint = &robot.model.joints[robot.model.joint_of_dof(dof).0];
    let settings = &robot.joints[dof];
    let (body, axis) = match (settings.carried_by, settings.rotor_axis) {
        (Some(link), Some(axis)) => {
            let link = &robot.model.links[link.0];
            (link.body?, link.body_from_link.rotation * Vector3::from(axis))
        }
        _ => match joint.kind {
            JointKind::Revolute { axis } | JointKind::Prismatic { axis } => {
                (joint.parent?, joint.placement.rotation * axis)
            }
            JointKind::Floating => return None,
        },
    };
    Some((body, axis * (1.0 / axis.norm())))
}

/// The robot with one more joint and body for each rotor of an elastic joint; which degree of freedom it drives.
fn with_rotor_bodies(robot: &Robot) -> (Model, Vec<usize>) {
    let (mut model, mut driven) = (robot.model.clone(), Vec::new());
    for dof in (0..robot.model.nv).filter(|&dof| robot.joints[dof].stiffness.is_some()) {
        let mounted = mount(robot, dof);
        let axis = mounted.map_or(Vector3::new(1.0, 0.0, 0.0), |(_, axis)| axis);
        let N = robot.joints[dof].gear_ratio.expect("a gear");
        let spin = robot.joints[dof].rotor_inertia / (N * N);
        let (x, y, z) = (axis.x, axis.y, axis.z);
        let second_moment =
            Symmetric3 { xx: x * x, yy: y * y, zz: z * z, xy: x * y, xz: x * z, yz: y * z }.scaled(spin);
        model.joints.push(Joint {
            name: format!("rotor of {dof}"),
            kind: JointKind::Revolute { axis },
            parent: mounted.map(|(body, _)| body),
            placement: Pose::identity(),
            inertia: Inertia { second_moment, ..Inertia::default() },
            limits: Limits::NONE,
            mimic: None,
            first_q: model.nq,
            first_dof: model.nv,
        });
        (model.nq, model.nv) = (model.nq + 1, model.nv + 1);
        driven.push(dof);
    }
    (model, driven)
}

fn forward(case: &Case, joints: &ElasticJoints) -> (DVector<f64>, DVector<f64>) {
    joints.forward_dynamics(&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m)
}

#[test]
fn rotors_move_as_bodies_of_their_own_do() {
    for case in cases(Mounting::Anywhere) {
        let joints = case.complete();
        let nv = case.robot.model.nv;
        let tau_j = joints.spring_torque(&case.q, &case.qd, &case.theta, &case.thetad);
        let (model, driven) = with_rotor_bodies(&case.robot);
        let (mut q, mut qd) = (case.q.clone(), case.qd.clone());
        let mut tau: Vec<f64> =
            (0..nv).map(|dof| if joints.elastic()[dof] { tau_j[dof] } else { case.tau_m[dof] }).collect();
        for &dof in &driven {
            let N = case.robot.joints[dof].gear_ratio.unwrap();
            q.push(N * case.theta[dof]);
            qd.push(N * case.thetad[dof]);
            tau.push((case.tau_m[dof] - tau_j[dof]) / N);
        }
        let mut armature = vec![0.0; model.nv];
        for dof in (0..nv).filter(|&dof| !joints.elastic()[dof]) {
            armature[dof] = case.robot.joints[dof].rotor_inertia;
        }
        let inertia = inertias(&model);
        let bodies = Bodies { armature: &armature, ..Bodies::new(&model, &inertia) };
        let mut want = vec![0.0; model.nv];
        forward_dynamics_with(&bodies, &mut sinew_rigid::Scratch::new(&model), &q, &qd, &tau, &mut want);
        let (qdd, thetadd) = forward(&case, &joints);
        assert_close("q̈", qdd.as_slice(), &want[..nv], SOLUTION);
        let motors: Vec<f64> = driven.iter().map(|&dof| thetadd[dof]).collect();
        let gear = |(want, &dof): (&f64, &usize)| want / case.robot.joints[dof].gear_ratio.unwrap();
        let wanted: Vec<f64> = want[nv..].iter().zip(&driven).map(gear).collect();
        assert_close("θ̈", &motors, &wanted, SOLUTION);
    }
}

#[test]
fn energy_is_that_of_the_coupled_mass_matrix() {
    for case in cases(Mounting::Anywhere) {
        let joints = case.complete();
        let (qd, thetad) = (DVector::from_column_slice(&case.qd), DVector::from_column_slice(&case.thetad));
        let (Mc, S) = (joints.link_mass_matrix(&case.q), joints.rotor_coupling(&case.q));
        let still = vec![0.0; case.qd.len()];
        let moving = joints.energy(&case.q, &case.qd, &case.theta, &case.thetad);
        let kinetic = moving - joints.energy(&case.q, &still, &case.theta, &still);
        // T = ½ q̇ᵀ Mc q̇ + q̇ᵀ S θ̇ + ½ θ̇ᵀ B θ̇
        let elastic = (0..qd.len()).filter(|&dof| joints.elastic()[dof]);
        let rotors: f64 = elastic.map(|dof| 0.5 * joints.rotor_inertia()[dof] * thetad[dof].powi(2)).sum();
        let want = 0.5 * qd.dot(&(&Mc * &qd)) + qd.dot(&(&S * &thetad)) + rotors;
        assert!((kinetic - want).abs() < 1e-10 * (1.0 + moving.abs()), "{kinetic} {want}");
    }
}

// dH/dt along the motion that the joints make by themselves.
fn energy_rate(case: &Case, joints: &ElasticJoints) -> f64 {
    let (qdd, thetadd) = forward(case, joints);
    let moving = |x: &[f64], rate: &[f64]| -> Vec<Dual<1>> {
        x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
    };
    let q = moving(&case.q, &position_rate(joints.model(), &case.q, &case.qd));
    let theta = moving(&case.theta, &case.thetad);
    let (qd, thetad) = (moving(&case.qd, qdd.as_slice()), moving(&case.thetad, thetadd.as_slice()));
    joints.energy_with(&mut Scratch::new(joints), &q, &qd, &theta, &thetad).derivative[0]
}

#[test]
fn power_in_equals_energy_rate_plus_power_lost_with_rotors_anywhere() {
    for case in cases(Mounting::Anywhere) {
        for joints in [case.complete(), ElasticJoints::new(&case.robot).unwrap()] {
            let power = joints.power_in(&case.qd, &case.thetad, &case.tau_m);
            let lost = joints.power_lost(&case.qd, &case.thetad);
            let size = joints.energy(&case.q, &case.qd, &case.theta, &case.thetad).abs() + power.abs() + lost;
            assert!((energy_rate(&case, &joints) - power + lost).abs() < 1e-9 * (1.0 + size));
        }
    }
}

#[test]
fn fast_light_rotors_give_back_the_reduced_model_to_first_order_in_their_ratio() {
    for case in cases(Mounting::Usual) {
        let reduced = ElasticJoints::new(&case.robot).unwrap();
        let error = |times: f64| {
            let mut robot = case.robot.clone();
            robot.joints.iter_mut().for_each(|joint| joint.gear_ratio = joint.gear_ratio.map(|N| N * times));
            let complete = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
            let ((a, b), (c, d)) = (forward(&case, &complete), forward(&case, &reduced));
            ((a - &c).amax() / c.amax().max(1.0)).max((b - &d).amax() / d.amax().max(1.0))
        };
        let (far, near) = (error(1e3), error(1e4));
        assert!(far < 1e-1, "{far}");
        if far > 1e-6 {
            assert!((far / near - 10.0).abs() < 0.5, "{far} {near}");
        }
    }
}

#[test]
fn rotors_on_the_base_alone_change_nothing() {
    let mut robot = Robot::rigid(planar_arm(1, 1.5, 0.4));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (Some(80.0), 0.05);
    let complete = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
    let reduced = ElasticJoints::new(&robot).unwrap();
    let x = [&[0.3][..], &[0.4], &[0.5], &[0.6], &[0.7]];
    let of = |joints: &ElasticJoints| joints.forward_dynamics(x[0], x[1], x[2], x[3], x[4]);
    assert_eq!(of(&complete), of(&reduced));
}

#[test]
fn a_rotor_said_to_be_in_its_link_is_taken_out_of_it() {
    // Two parallel links: taking the spin B/N² of the elbow's rotor from the first link's inertia is all there is to it.
    let mut robot = Robot::rigid(planar_arm(2, 1.5, 0.4));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.rotor_inertia, joint.gear_ratio) = (Some(80.0), 0.05, Some(10.0));
    }
    let q = [0.3, -0.7];
    let complete = |robot: &Robot, spin| ElasticJoints::complete(robot, spin).unwrap();
    let held = complete(&robot, SpinInertia::InLinks);
    let beside = complete(&robot, SpinInertia::BesideLinks);
    let mut bare = sinew_rigid::mass_matrix(&robot.model, &q);
    assert!((held.link_mass_matrix(&q) - &bare).amax() < 1e-14);
    bare[(0, 0)] += 0.05 / 100.0;
    assert!((beside.link_mass_matrix(&q) - &bare).amax() < 1e-14);
    assert_eq!(held.rotor_coupling(&q), beside.rotor_coupling(&q));
}

#[test]
fn what_the_complete_model_lacks_is_named() {
    let mut robot = Robot::rigid(planar_arm(3, 1.5, 0.4));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.rotor_inertia) = (Some(80.0), 0.05);
    }
    let error = |robot: &Robot, spin| ElasticJoints::complete(robot, spin).unwrap_err();
    let text = error(&robot, SpinInertia::BesideLinks).to_string();
    assert!(text.starts_with("joint \"joint_2\": its rotor rides on link \"link_1\""), "{text}");
    assert!(text.contains("gear_ratio"));
    robot.joints.iter_mut().for_each(|joint| joint.gear_ratio = Some(0.1));
    let text = error(&robot, SpinInertia::InLinks).to_string();
    assert!(text.starts_with("link \"link_1\": its moments of inertia are smaller"), "{text}");
    robot.joints[2].carried_by = robot.model.link("link_1");
    let got = error(&robot, SpinInertia::BesideLinks);
    assert!(matches!(got, FlexJointError::NoRotorAxis { .. }), "{got}");
    robot.joints[2].rotor_axis = Some([0.0; 3]);
    let text = error(&robot, SpinInertia::BesideLinks).to_string();
    assert!(text.contains("no direction"), "{text}");
    robot.joints[2].rotor_axis = Some([0.0, 2.0, 0.0]);
    assert!(ElasticJoints::complete(&robot, SpinInertia::BesideLinks).is_ok());
}

/// One number of a state moved: 0 … 4 for q, q̇, θ, θ̇, τ_m.
fn moved(case: &Case, kind: usize, dof: usize, by: f64) -> [Vec<f64>; 5] {
    let mut x = [&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m].map(Clone::clone);
    let mut step = vec![0.0; case.qd.len()];
    step[dof] = by;
    match kind {
        0 => x[0] = integrate(&case.robot.model, &case.q, &step),
        _ => x[kind][dof] += by,
    }
    x
}

fn stacked((qdd, thetadd): (DVector<f64>, DVector<f64>)) -> DVector<f64> {
    let all = qdd.iter().chain(thetadd.iter()).copied().collect::<Vec<_>>();
    DVector::from_vec(all)
}

fn derivatives(joints: &ElasticJoints, case: &Case) -> [DMatrix<f64>; 5] {
    let d = joints.forward_dynamics_derivatives(&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m);
    [d.by_position, d.by_velocity, d.by_motor_position, d.by_motor_velocity, d.by_motor_torque]
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    for case in cases(Mounting::Anywhere) {
        let nv = case.qd.len();
        for joints in [case.complete(), ElasticJoints::new(&case.robot).unwrap()] {
            let analytic = derivatives(&joints, &case);
            let mut ws = Scratch::<Dual<1>>::new(&joints);
            for (kind, analytic) in analytic.iter().enumerate() {
                let mut exact = DMatrix::zeros(2 * nv, nv);
                for dof in 0..nv {
                    let mut step = vec![0.0; nv];
                    step[dof] = 1.0;
                    let along = if kind == 0 { position_rate(joints.model(), &case.q, &step) } else { step };
                    let all = [&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m];
                    let x: [Vec<Dual<1>>; 5] = core::array::from_fn(|k| {
                        let slope = |i: usize| if k == kind { along[i] } else { 0.0 };
                        let values = all[k].iter().enumerate();
                        values.map(|(i, &value)| Dual { value, derivative: [slope(i)] }).collect()
                    });
                    let (mut qdd, mut thetadd) = (vec![Dual::ZERO; nv], vec![Dual::ZERO; nv]);
                    let [q, qd, theta, thetad, tau_m] = &x;
                    joints.forward_dynamics_with(
                        &mut ws,
                        q,
                        qd,
                        theta,
                        thetad,
                        tau_m,
                        &mut qdd,
                        &mut thetadd,
                    );
                    for (row, x) in qdd.iter().chain(&thetadd).enumerate() {
                        exact[(row, dof)] = x.derivative[0];
                    }
                }
                assert_close(&format!("{kind}"), analytic.as_slice(), exact.as_slice(), DERIVATIVES);
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_central_differences() {
    for case in cases(Mounting::Usual).step_by(5) {
        let (joints, h) = (case.complete(), 1e-3);
        for (kind, analytic) in derivatives(&joints, &case).iter().enumerate() {
            for dof in 0..case.qd.len() {
                let at = |by: f64| {
                    let [q, qd, theta, thetad, tau_m] = moved(&case, kind, dof, by);
                    stacked(joints.forward_dynamics(&q, &qd, &theta, &thetad, &tau_m))
                };
                // fourth order
                let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let column = analytic.column(dof).into_owned();
                let scale = analytic.amax().max(1.0);
                assert!((column - slope).amax() < DIFFERENCES * scale, "{kind} {dof}");
            }
        }
    }
}

#[test]
fn derivatives_of_any_kind_of_number_are_those_of_plain_numbers() {
    for case in cases(Mounting::Usual).step_by(4) {
        let joints = case.complete();
        let lanes = |x: &[f64]| x.iter().map(|&x| Lanes::<4>::constant(x)).collect::<Vec<_>>();
        let [q, qd, theta, thetad, tau_m] =
            [&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m].map(|x| lanes(x));
        let nv = case.qd.len();
        let mut by: [Vec<Lanes<4>>; 5] = core::array::from_fn(|_| vec![Lanes::ZERO; 2 * nv * nv]);
        let [a, b, c, d, e] = &mut by;
        let ws = &mut Scratch::new(&joints);
        joints.forward_dynamics_derivatives_with(ws, &q, &qd, &theta, &thetad, &tau_m, a, b, c, d, e);
        for (plain, lanes) in derivatives(&joints, &case).iter().zip(&by) {
            let last: Vec<f64> = lanes.iter().map(|x| x.0[3]).collect();
            assert_close("lanes", &last, plain.as_slice(), DERIVATIVES);
        }
    }
}

/// The state of the joints as one vector.
fn packed(joints: &ElasticJoints, x: [&[f64]; 4]) -> Vec<f64> {
    let motors = |x: &[f64]| -> Vec<f64> {
        (0..x.len()).filter(|&dof| joints.elastic()[dof]).map(|dof| x[dof]).collect()
    };
    [x[0], &motors(x[2]), x[1], &motors(x[3])].concat()
}

#[test]
fn the_linear_model_is_the_slope_of_the_state_rate() {
    for case in cases(Mounting::Usual).step_by(3) {
        let joints = case.complete();
        let (model, nv, nq) = (&case.robot.model, case.qd.len(), case.q.len());
        let x = packed(&joints, [&case.q, &case.qd, &case.theta, &case.thetad]);
        let (A, B) = joints.linearize(&x, &case.tau_m);
        let (n, h) = (joints.displacement_len(), 1e-3);
        assert_eq!((A.nrows(), B.ncols(), x.len()), (n, nv, joints.state_len()));
        // the state a displacement away, and the rate of that displacement
        let place = |d: &[f64]| {
            let q = integrate(model, &x[..nq], &d[..nv]);
            let rest = x[nq..].iter().zip(&d[nv..]).map(|(x, d)| x + d);
            q.into_iter().chain(rest).collect::<Vec<f64>>()
        };
        // displacement between two motions after a short time, by the time
        let rate = |d: &[f64], tau_m: &[f64]| {
            let f = joints.state_rate(&place(d), tau_m);
            let at = place(d);
            let dt = 1e-4;
            let after = |s: f64, from: &[f64], qd: &[f64]| {
                integrate(model, from, &qd.iter().map(|v| v * s).collect::<Vec<_>>())
            };
            let (qd, still) = (&at[nq + n / 2 - nv..][..nv], &x[nq + n / 2 - nv..][..nv]);
            let apart = |s: f64| difference(model, &after(s, &x[..nq], still), &after(s, &at[..nq], qd));
            let (ahead, behind) = (apart(dt), apart(-dt));
            let links = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * dt));
            links.chain(f.iter().skip(nq).copied()).collect::<Vec<f64>>()
        };
        for column in 0..n {
            let at = |by: f64| {
                let mut d = vec![0.0; n];
                d[column] = by;
                DVector::from_vec(rate(&d, &case.tau_m))
            };
            let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            let error = (A.column(column) - slope).amax();
            assert!(error < DIFFERENCES * A.amax().max(1.0), "{column} of {n}: {error}");
        }
        for column in 0..nv {
            let mut tau_m = case.tau_m.clone();
            tau_m[column] += 1.0;
            let change = joints.state_rate(&x, &tau_m) - joints.state_rate(&x, &case.tau_m);
            let want = DVector::from_iterator(n, (0..nv).map(|_| 0.0).chain(change.iter().skip(nq).copied()));
            assert!((B.column(column) - want).amax() < SOLUTION * B.amax().max(1.0));
        }
    }
}
