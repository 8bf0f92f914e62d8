//! The motor torques that make the links follow a motion: what they must be, and that the links then follow.

use sinew_flex_joint::{Deflection, ElasticJoints, FlexJointError, InverseScratch, MotorMotion, SpinInertia};
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Dual, Lanes, Robot, Scalar};

use crate::trees::{Case, Mounting, assert_close, cases};

/// Rounding of solutions with the mass matrix.
const SOLUTION: f64 = 1e-8;
/// Terms that any tree of the tests is satisfied with.
const MANY: usize = 33;

/// q and its first `count` derivatives: the state of the case, and random numbers of size one.
fn motion(case: &Case, count: usize) -> Vec<Vec<f64>> {
    let mut random = Random::new(7);
    let first = [&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m].map(Clone::clone);
    first.into_iter().chain((4..count).map(|_| random.vector(case.qd.len()))).collect()
}

fn follow<const M: usize>(
    joints: &ElasticJoints,
    motion: &[Vec<f64>],
    deflection: Deflection<f64>,
) -> Result<MotorMotion<f64>, FlexJointError> {
    let (parts, mut out) = (motion.iter().map(Vec::as_slice).collect::<Vec<_>>(), MotorMotion::new(joints));
    joints.inverse_dynamics_with(&mut InverseScratch::<f64, M>::new(joints), &parts, deflection, &mut out)?;
    Ok(out)
}

/// Forward dynamics under the torques found gives the accelerations wanted.
fn assert_follows(joints: &ElasticJoints, motion: &[Vec<f64>], motor: &MotorMotion<f64>) {
    let (q, qd, qdd) = (&motion[0], &motion[1], &motion[2]);
    let (got, thetadd) = joints.forward_dynamics(q, qd, &motor.theta, &motor.thetad, &motor.tau_m);
    assert_close("q̈", got.as_slice(), qdd, SOLUTION);
    assert_close("θ̈", thetadd.as_slice(), &motor.thetadd, SOLUTION);
}

/// The robot without dampers.
fn undamped(mut robot: Robot) -> Robot {
    robot.joints.iter_mut().for_each(|joint| joint.damping = 0.0);
    robot.couplings.iter_mut().for_each(|coupling| coupling.damping.fill(0.0));
    robot
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for case in cases(Mounting::Anywhere) {
        let motion = motion(&case, 4);
        let plain = ElasticJoints::new(&undamped(case.robot.clone())).unwrap();
        let motor = follow::<3>(&plain, &motion, Deflection::Settled).unwrap();
        assert_follows(&plain, &motion, &motor);
        // with dampers: any deflection, and the fourth derivative does not enter
        let damped = ElasticJoints::new(&case.robot).unwrap();
        let given = Random::new(3).vector(case.qd.len());
        let motor = follow::<3>(&damped, &motion, Deflection::At(&given)).unwrap();
        assert_follows(&damped, &motion, &motor);
        let mut rough = motion.clone();
        rough[4].fill(1e3);
        assert_eq!(damped.derivatives_needed(Deflection::At(&given)).unwrap(), 3.min(2 + elastic(&damped)));
        assert_eq!(follow::<3>(&damped, &rough, Deflection::At(&given)).unwrap(), motor);
    }
}

fn elastic(joints: &ElasticJoints) -> usize {
    joints.elastic().iter().filter(|&&elastic| elastic).count()
}

#[test]
fn the_complete_model_follows_with_enough_derivatives() {
    // with a mimic joint in another branch a rotor may ride ahead of the torque it adds to
    for case in cases(Mounting::Usual).filter(|case| !case.robot.model.has_mimic()) {
        let complete = |robot: &Robot| ElasticJoints::complete(robot, SpinInertia::BesideLinks).unwrap();
        let motion = motion(&case, MANY + 1);
        let plain = complete(&undamped(case.robot.clone()));
        let needed = plain.derivatives_needed::<f64>(Deflection::Settled).unwrap();
        assert!(needed <= 2 * (1 + elastic(&plain)), "{needed}");
        let motor = follow::<MANY>(&plain, &motion, Deflection::Settled).unwrap();
        assert_follows(&plain, &motion, &motor);
        // what is beyond the derivatives needed has no influence
        let mut rough = motion.clone();
        rough[needed + 1..].iter_mut().for_each(|x| x.fill(1e3));
        let again = follow::<MANY>(&plain, &rough, Deflection::Settled).unwrap();
        assert_close("τ_m", &again.tau_m, &motor.tau_m, 1e-14);
        // with dampers, from any deflection
        let (damped, given) = (case.complete(), Random::new(3).vector(case.qd.len()));
        let motor = follow::<MANY>(&damped, &motion, Deflection::At(&given)).unwrap();
        assert_follows(&damped, &motion, &motor);
    }
}

#[test]
fn an_arm_of_n_joints_asks_for_two_more_derivatives_each() {
    // De Luca and Lucibello: order 2 (n + 1) if every rotor rides on the link before its joint, the first on the base
    for n in 1..6 {
        let mut robot = Robot::rigid(planar_arm(n, 1.5, 0.4));
        for joint in &mut robot.joints {
            (joint.stiffness, joint.rotor_inertia, joint.gear_ratio) = (Some(80.0), 0.05, Some(10.0));
        }
        let arm = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
        assert_eq!(arm.derivatives_needed::<f64>(Deflection::Settled).unwrap(), 2 * (n + 1));
        assert_eq!(ElasticJoints::new(&robot).unwrap().derivatives_needed::<f64>(Deflection::Settled), Ok(4));
        let x = vec![0.1; n];
        let got = arm.inverse_dynamics([&x[..]; 5], Deflection::Settled);
        let needed = 2 * (n + 1);
        if n == 1 {
            assert!(got.is_ok());
        } else {
            assert_eq!(got, Err(FlexJointError::TooFewDerivatives { got: 4, needed }));
        }
    }
}

#[test]
fn a_rotor_on_a_later_link_is_refused_by_name() {
    let mut robot = Robot::rigid(planar_arm(2, 1.5, 0.4));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.rotor_inertia, joint.gear_ratio) = (Some(80.0), 0.05, Some(10.0));
    }
    robot.joints[0].carried_by = robot.model.link("link_2");
    robot.joints[0].rotor_axis = Some([0.0, 0.0, 1.0]);
    let arm = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).unwrap();
    let x = [0.1; 2];
    let text = arm.inverse_dynamics([&x; 5], Deflection::Settled).unwrap_err().to_string();
    assert!(text.starts_with("joint \"joint_1\": its rotor pushes on its own joint"), "{text}");
}

#[test]
fn stiff_joints_ask_for_the_torques_of_the_rigid_robot_to_first_order_in_1_over_k() {
    for case in cases(Mounting::Usual) {
        let motion = motion(&case, 4);
        let stiffened = |times: f64| {
            let mut robot = undamped(case.robot.clone());
            robot.joints.iter_mut().for_each(|joint| joint.stiffness = joint.stiffness.map(|K| K * times));
            ElasticJoints::new(&robot).unwrap()
        };
        let mut rigid = case.robot.clone();
        rigid.joints.iter_mut().for_each(|joint| joint.stiffness = None);
        let rigid = ElasticJoints::new(&rigid).unwrap();
        let want = follow::<3>(&rigid, &motion, Deflection::Settled).unwrap();
        let error = |times: f64| {
            let got = follow::<3>(&stiffened(times), &motion, Deflection::Settled).unwrap();
            got.tau_m.iter().zip(&want.tau_m).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
        };
        let ratio = error(1.0) / error(10.0);
        assert!(elastic(&stiffened(1.0)) == 0 || (ratio - 10.0).abs() < 1e-4, "{ratio}");
    }
}

#[test]
fn settled_springs_are_right_to_third_order_in_the_damping() {
    // one joint, link torque J q̈ along q = sin t without weight: K δ + D δ̇ = −J sin t has this periodic solution
    let (K, J, t) = (150.0, 0.5, 0.7_f64);
    let deflection = |D: f64| {
        let mut robot = Robot::rigid(sinew_model::samples::hanging_link(J, 2.0, 0.4));
        robot.model = robot.model.with_gravity([0.0; 3].into());
        let joint = &mut robot.joints[0];
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(K), D, 0.05);
        let arm = ElasticJoints::new(&robot).unwrap();
        let (s, c) = t.sin_cos();
        let motor = arm.inverse_dynamics([&[s], &[c], &[-s], &[-c], &[s]], Deflection::Settled).unwrap();
        motor.theta[0] - s
    };
    let exact = |D: f64| -J * (K * t.sin() - D * t.cos()) / (K * K + D * D);
    let error = |D: f64| (deflection(D) - exact(D)).abs();
    assert!(error(0.0) < 1e-15);
    for D in [1.0, 4.0] {
        assert!((error(2.0 * D) / error(D) - 8.0).abs() < 0.3, "{} {}", error(D), error(2.0 * D));
    }
}

#[test]
fn links_follow_a_swing_that_the_motor_is_driven_along() {
    // two elastic joints with dampers, fed forward from the deflection's own equation: RK4 of all together
    let mut robot = Robot::rigid(planar_arm(2, 1.5, 0.4));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(120.0), 3.0, 0.04);
    }
    let arm = ElasticJoints::new(&robot).unwrap();
    let wanted = |t: f64| -> [[f64; 2]; 5] {
        core::array::from_fn(|order| {
            let turn = order as f64 * core::f64::consts::FRAC_PI_2;
            [0.5 * 3.0_f64.powi(order as i32) * (3.0 * t + turn).sin(), 0.7 * (t + 0.4 + turn).sin()]
        })
    };
    let motor = |t: f64, deflection: &[f64]| {
        let w = wanted(t);
        let motion: [&[f64]; 5] = core::array::from_fn(|k| &w[k][..]);
        arm.inverse_dynamics(motion, Deflection::At(deflection)).unwrap()
    };
    let settled = {
        let w = wanted(0.0);
        let motion: [&[f64]; 5] = core::array::from_fn(|k| &w[k][..]);
        arm.inverse_dynamics(motion, Deflection::Settled).unwrap()
    };
    // x = (deflection of the feed-forward, state of the robot)
    let bent: Vec<f64> = (0..2).map(|k| settled.theta[k] - wanted(0.0)[0][k]).collect();
    let first = motor(0.0, &bent);
    let mut x = [&bent[..], &wanted(0.0)[0], &first.theta, &wanted(0.0)[1], &first.thetad].concat();
    let rate = |t: f64, x: &[f64]| -> Vec<f64> {
        let motor = motor(t, &x[..2]);
        let run = arm.state_rate(&x[2..], &motor.tau_m);
        motor.deflection_rate.iter().chain(run.iter()).copied().collect()
    };
    let plus =
        |x: &[f64], k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + h * k).collect() };
    let (h, mut t) = (5e-4, 0.0);
    for _ in 0..2000 {
        let a = rate(t, &x);
        let b = rate(t + h / 2.0, &plus(&x, &a, h / 2.0));
        let c = rate(t + h / 2.0, &plus(&x, &b, h / 2.0));
        let d = rate(t + h, &plus(&x, &c, h));
        for i in 0..x.len() {
            x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
        t += h;
    }
    assert_close("q", &x[2..4], &wanted(t)[0], 1e-7);
}

#[test]
fn lanes_and_dual_numbers_go_through_the_same_lines() {
    for case in cases(Mounting::Usual).step_by(4) {
        let joints = ElasticJoints::new(&case.robot).unwrap();
        let motion = motion(&case, 4);
        let plain = follow::<3>(&joints, &motion, Deflection::Settled).unwrap();
        let lanes: Vec<Vec<Lanes<4>>> =
            motion.iter().map(|x| x.iter().map(|&x| Lanes::constant(x)).collect()).collect();
        let parts: Vec<&[Lanes<4>]> = lanes.iter().map(Vec::as_slice).collect();
        let mut out = MotorMotion::new(&joints);
        let mut ws = InverseScratch::<Lanes<4>, 3>::new(&joints);
        joints.inverse_dynamics_with(&mut ws, &parts, Deflection::Settled, &mut out).unwrap();
        let got: Vec<f64> = out.tau_m.iter().map(|x| x.0[2]).collect();
        assert_close("lanes", &got, &plain.tau_m, SOLUTION);
        // ∂τ_m/∂q⃜ = B K⁻¹ M
        let Some(dof) = (0..case.qd.len()).find(|&dof| joints.elastic()[dof]) else { continue };
        let duals: Vec<Vec<Dual<1>>> =
            motion.iter().map(|x| x.iter().map(|&x| Dual::constant(x)).collect()).collect();
        let mut duals = duals;
        duals[4][dof].derivative = [1.0];
        let parts: Vec<&[Dual<1>]> = duals.iter().map(Vec::as_slice).collect();
        let mut out = MotorMotion::new(&joints);
        let plain = ElasticJoints::new(&undamped(case.robot.clone())).unwrap();
        let mut ws = InverseScratch::<Dual<1>, 3>::new(&plain);
        plain.inverse_dynamics_with(&mut ws, &parts, Deflection::Settled, &mut out).unwrap();
        let M = plain.link_mass_matrix(&case.q);
        let want = plain.rotor_inertia()[dof] / plain.stiffness()[(dof, dof)] * M[(dof, dof)];
        assert!((out.tau_m[dof].derivative[0] - want).abs() < SOLUTION * want);
    }
}
