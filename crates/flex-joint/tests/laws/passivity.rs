//! Laws of elastic joints: energy, passivity, the rigid limit, and the closed form of one joint.

use sinew_flex_joint::{Deflection, ElasticJoints, PassivityAudit, Sample, Scratch};
use sinew_model::{Coupling, Dual, Robot, Scalar, samples};

/// Rounding of sums along four joints.
const ALGEBRA: f64 = 1e-11;

/// Four joints: two coupled elastic ones, one rigid, one elastic.
fn mixed_arm(damping: f64) -> ElasticJoints {
    let mut robot = Robot::rigid(samples::planar_arm(4, 1.5, 0.4));
    robot.joints.iter_mut().enumerate().for_each(|(k, j)| j.rotor_inertia = 0.05 + 0.01 * k as f64);
    robot.couplings.push(Coupling {
        dofs: vec![0, 2],
        stiffness: vec![300.0, 60.0, 60.0, 200.0],
        damping: [0.5, 0.1, 0.1, 0.3].map(|d| d * damping).to_vec(),
    });
    robot.joints[3].stiffness = Some(100.0);
    robot.joints[3].damping = 0.2 * damping;
    ElasticJoints::new(&robot).expect("the springs are sound")
}

/// The lesson's joint with a spring of `stiffness` N·m/rad.
fn hanging_link(stiffness: f64, damping: f64) -> ElasticJoints {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(stiffness);
    robot.joints[0].damping = damping;
    robot.joints[0].rotor_inertia = 0.05;
    ElasticJoints::new(&robot).expect("the spring is sound")
}

// A few states without chance: numbers of size one.
fn state(seed: usize) -> [[f64; 4]; 5] {
    let number = |k: usize| (1.7 * (1 + 20 * seed + k) as f64).sin();
    core::array::from_fn(|row| core::array::from_fn(|k| number(4 * row + k)))
}

// dH/dt along the motion that the joints make by themselves.
fn energy_rate(arm: &ElasticJoints, [q, qd, theta, thetad, tau_m]: &[[f64; 4]; 5]) -> f64 {
    let (qdd, thetadd) = arm.forward_dynamics(q, qd, theta, thetad, tau_m);
    let moving = |x: &[f64], rate: &[f64]| -> Vec<Dual<1>> {
        x.iter().zip(rate).map(|(&value, &rate)| Dual { value, derivative: [rate] }).collect()
    };
    let (q, theta) = (moving(q, qd), moving(theta, thetad));
    let (qd, thetad) = (moving(qd, qdd.as_slice()), moving(thetad, thetadd.as_slice()));
    arm.energy_with(&mut Scratch::new(arm), &q, &qd, &theta, &thetad).derivative[0]
}

#[test]
fn power_in_equals_energy_rate_plus_power_lost() {
    for seed in 0..20 {
        let arm = mixed_arm(1.0);
        let x = state(seed);
        let [_, qd, _, thetad, tau_m] = &x;
        let motor = |dof: usize| if arm.elastic()[dof] { thetad[dof] } else { qd[dof] };
        let power_in: f64 = (0..4).map(|dof| tau_m[dof] * motor(dof)).sum();
        let lost = arm.power_lost(qd, thetad);
        assert!((energy_rate(&arm, &x) - power_in + lost).abs() < ALGEBRA * (1.0 + power_in.abs() + lost));
    }
}

#[test]
fn nothing_is_lost_without_damping_and_motor_torque() {
    for seed in 0..20 {
        let mut x = state(seed);
        x[4] = [0.0; 4];
        assert!(energy_rate(&mixed_arm(0.0), &x).abs() < ALGEBRA);
    }
}

#[test]
fn energy_never_grows_without_motor_torque() {
    for seed in 0..20 {
        let mut x = state(seed);
        x[4] = [0.0; 4];
        assert!(energy_rate(&mixed_arm(1.0), &x) < 0.0);
    }
}

#[test]
fn joints_at_equilibrium_stay() {
    let arm = mixed_arm(1.0);
    for seed in 0..20 {
        let [q, ..] = state(seed);
        let (theta, tau_m) = arm.equilibrium(&q);
        let still = [0.0; 4];
        let (qdd, thetadd) = arm.forward_dynamics(&q, &still, theta.as_slice(), &still, tau_m.as_slice());
        assert!(qdd.amax().max(thetadd.amax()) < 1e-9, "{qdd} {thetadd}");
    }
}

#[test]
fn a_robot_without_springs_is_the_rigid_robot_with_its_rotors() {
    let mut robot = Robot::rigid(samples::planar_arm(4, 1.5, 0.4));
    robot.joints.iter_mut().for_each(|j| j.rotor_inertia = 0.05);
    let arm = ElasticJoints::new(&robot).expect("rigid joints need no spring");
    let [q, qd, theta, thetad, tau_m] = state(3);
    let (qdd, thetadd) = arm.forward_dynamics(&q, &qd, &theta, &thetad, &tau_m);
    // (M + B) q̈ + C q̇ + g = τ_m
    let torque = sinew_rigid::inverse_dynamics(&robot.model, &q, &qd, qdd.as_slice());
    for dof in 0..4 {
        assert!((torque[dof] + 0.05 * qdd[dof] - tau_m[dof]).abs() < ALGEBRA);
        assert_eq!(qdd[dof], thetadd[dof]);
    }
}

// ∂(q̈, θ̈)/∂(q, θ, q̇, θ̇) of one joint, hanging at rest.
fn linearised(arm: &ElasticJoints) -> [[f64; 4]; 2] {
    let ws = &mut Scratch::new(arm);
    let columns: [[f64; 2]; 4] = core::array::from_fn(|column| {
        let moved = |k: usize| [if k == column { Dual::<1>::variable(0.0, 0) } else { Dual::ZERO }];
        let (mut qdd, mut thetadd) = ([Dual::ZERO], [Dual::ZERO]);
        let (q, theta, qd, thetad) = (&moved(0), &moved(1), &moved(2), &moved(3));
        arm.forward_dynamics_with(ws, q, qd, theta, thetad, &[Dual::ZERO], &mut qdd, &mut thetadd);
        [qdd[0].derivative[0], thetadd[0].derivative[0]]
    });
    core::array::from_fn(|row| columns.map(|column| column[row]))
}

// Undamped frequencies, slow and fast: roots of ω⁴ + tr ω² + det = 0.
fn frequencies(arm: &ElasticJoints) -> [f64; 2] {
    let [[a, b, ..], [c, d, ..]] = linearised(arm);
    let (half, det) = (-(a + d) / 2.0, a * d - b * c);
    let fast = half + (half * half - det).sqrt();
    [(det / fast).sqrt(), fast.sqrt()]
}

#[test]
fn the_lessons_joint_has_its_closed_form_frequencies() {
    let [slow, fast] = frequencies(&hanging_link(150.0, 0.5));
    assert!((slow - 3.77662507).abs() < 5e-9 && (fast - 57.45809867).abs() < 5e-9, "{slow} {fast}");
}

#[test]
fn stiff_joints_give_back_the_rigid_robot() {
    // ω² = m g ℓ/(J + B); the error is of order one in 1/K
    let rigid = (2.0 * 9.81 * 0.4 / 0.55_f64).sqrt();
    let error = |K: f64| (frequencies(&hanging_link(K, 0.0))[0] - rigid).abs();
    for K in [1e3, 1e4, 1e5] {
        let ratio = error(K) / error(10.0 * K);
        assert!((ratio - 10.0).abs() < 0.1, "at {K}: {ratio}");
    }
    assert!(error(1e6) < 1e-4);
}

#[test]
fn the_lessons_joint_moves_as_computed() {
    let arm = hanging_link(150.0, 0.5);
    // The lesson's bearings drag: −b_ℓ q̇ on the link of 0.5 kg·m², −b_m θ̇ on the motor.
    let rate = |x: [f64; 4]| {
        let [q, theta, qd, thetad] = x;
        let (qdd, thetadd) = arm.forward_dynamics(&[q], &[qd], &[theta], &[thetad], &[1.0 - 0.01 * thetad]);
        [qd, thetad, qdd[0] - 0.02 * qd / 0.5, thetadd[0]]
    };
    let plus = |x: [f64; 4], k: [f64; 4], h: f64| core::array::from_fn(|i| x[i] + h * k[i]);
    let h = 2.5e-4;
    let mut x = [0.0; 4];
    for [q, theta] in [
        [0.16596843, 0.17314864],
        [0.23097613, 0.23812532],
        [0.03023677, 0.03645862],
        [0.08695858, 0.09340352],
    ] {
        for _ in 0..2000 {
            // Runge–Kutta of order four
            let a = rate(x);
            let b = rate(plus(x, a, h / 2.0));
            let c = rate(plus(x, b, h / 2.0));
            let d = rate(plus(x, c, h));
            x = core::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        assert!((x[0] - q).abs() < 1e-8 && (x[1] - theta).abs() < 1e-8, "{x:?}, want {q} {theta}");
    }
}

#[test]
fn links_rest_where_springs_carry_gravity() {
    for seed in 0..20 {
        let (arm, [q, ..]) = (mixed_arm(1.0), state(seed));
        let (theta, tau_m) = arm.equilibrium(&q);
        // from 0.2 rad away in the elastic joints
        let start: Vec<f64> = (0..4).map(|k| q[k] + if arm.elastic()[k] { 0.2 } else { 0.0 }).collect();
        let rest = arm.rest_position(theta.as_slice(), &start).expect("stiff springs");
        assert!(rest.is_stable() && rest.steps < 10, "{rest:?}");
        for k in 0..4 {
            assert!((rest.q[k] - q[k]).abs() < ALGEBRA && (rest.tau_m[k] - tau_m[k]).abs() < 1e-9);
        }
    }
}

#[test]
fn a_soft_spring_lets_an_upright_link_fall_to_where_it_rests() {
    // m g ℓ = 7.848 N·m against 5 N·m/rad: upright is a balance that does not hold
    let arm = hanging_link(5.0, 0.0);
    let upright = core::f64::consts::PI;
    let balance = arm.rest_position(&[upright], &[upright]).expect("it is a balance");
    assert!(!balance.is_stable() && (balance.smallest_stiffness - (5.0 - 2.0 * 9.81 * 0.4)).abs() < ALGEBRA);
    let rest = arm.rest_position(&[upright], &[upright + 0.01]).expect("it comes to rest");
    assert!(rest.is_stable() && rest.q[0] > upright + 0.5);
    let left = 5.0 * (upright - rest.q[0]) - 2.0 * 9.81 * 0.4 * rest.q[0].sin();
    assert!(left.abs() < ALGEBRA, "{left}");
}

#[test]
fn stiff_joints_move_as_the_rigid_robot_does_to_first_order_in_1_over_k() {
    // Where motors lead by what carries the torque of the rigid robot, (θ − q) = K⁻¹ (M q̈ + C q̇ + g), accelerations of
    // links are the rigid robot's; rotors then ask for B (q̈ + K⁻¹ τ̈_j), which is B q̈ but for 1/K.
    let [q, qd, _, _, tau_m] = state(5);
    let arm = |times: f64| {
        let mut robot = Robot::rigid(samples::planar_arm(4, 1.5, 0.4));
        for (k, joint) in robot.joints.iter_mut().enumerate() {
            joint.rotor_inertia = 0.05 + 0.01 * k as f64;
            joint.stiffness = (times > 0.0).then_some(100.0 * times);
        }
        ElasticJoints::new(&robot).expect("the springs are sound")
    };
    let (rigid, _) = arm(0.0).forward_dynamics(&q, &qd, &q, &qd, &tau_m);
    let error = |times: f64| {
        let (arm, zero) = (arm(times), [0.0; 4]);
        let motion: [&[f64]; 5] = [&q, &qd, rigid.as_slice(), &zero, &zero];
        let motor = arm.inverse_dynamics(motion, Deflection::Settled).expect("the reduced model");
        (0..4).map(|k| (motor.tau_m[k] - tau_m[k]).abs()).fold(0.0, f64::max)
    };
    for times in [1.0, 10.0, 100.0] {
        let ratio = error(times) / error(10.0 * times);
        assert!((ratio - 10.0).abs() < 1e-3, "{ratio}");
    }
}

#[test]
fn one_rigid_joint_is_a_stiff_spring_to_first_order_in_1_over_k() {
    // slow modes of the linear model: joint 1 of the mixed arm made stiff against rigid
    let arm = |stiffness: Option<f64>| {
        let mut robot = Robot::rigid(samples::planar_arm(2, 1.5, 0.4));
        robot.joints.iter_mut().for_each(|joint| (joint.rotor_inertia, joint.stiffness) = (0.05, Some(80.0)));
        robot.joints[1].stiffness = stiffness;
        ElasticJoints::new(&robot).expect("the springs are sound")
    };
    // motors of what is elastic, both at rest below
    let slowest = |arm: &ElasticJoints| {
        let down = [-core::f64::consts::FRAC_PI_2, 0.0];
        let (theta, tau_m) = arm.equilibrium(&down);
        let motors: Vec<f64> = (0..2).filter(|&k| arm.elastic()[k]).map(|k| theta[k]).collect();
        let n = arm.displacement_len() / 2;
        let (A, _) = arm.linearize(&[&down[..], &motors, &vec![0.0; n]].concat(), tau_m.as_slice());
        let K = -A.view((n, 0), (n, n)).into_owned();
        K.complex_eigenvalues().iter().map(|square| square.re).fold(f64::INFINITY, f64::min)
    };
    let rigid = slowest(&arm(None));
    let error = |K: f64| (slowest(&arm(Some(K))) - rigid).abs();
    for K in [1e3, 1e4] {
        let ratio = error(K) / error(10.0 * K);
        assert!((ratio - 10.0).abs() < 0.3, "at {K}: {ratio}");
    }
}

#[test]
fn the_books_of_an_undamped_run_show_its_integrator() {
    // a held torque: work is exact, so what is left is the error of the midpoint steps, of order two or better
    let defect = |steps: usize| {
        let (arm, h) = (hanging_link(150.0, 0.0), 0.2 / steps as f64);
        let mut ws = sinew_flex_joint::Workspace::new(&arm);
        let tau_m = [1.0];
        let mut x = [[0.0], [0.0], [0.0], [0.0]];
        fn sample<'a>([q, theta, qd, thetad]: &'a [[f64; 1]; 4], tau_m: &'a [f64]) -> Sample<'a> {
            Sample { q, qd, theta, thetad, tau_m }
        }
        let mut audit = PassivityAudit::new(&arm, &sample(&x, &tau_m));
        for _ in 0..steps {
            let rate = |x: &[[f64; 1]; 4]| arm.state_rate(&x.concat(), &tau_m);
            let moved = |by: &dyn Fn(usize) -> f64| core::array::from_fn(|k| [x[k][0] + by(k)]);
            let a = rate(&x);
            let b = rate(&moved(&|k| h / 2.0 * a[k]));
            let next = moved(&|k| h * b[k]);
            audit.advance(&arm, &mut ws, h, &sample(&x, &tau_m), &sample(&next, &tau_m));
            x = next;
        }
        audit.worst_defect
    };
    let ratio = defect(400) / defect(800);
    assert!((3.5..9.0).contains(&ratio), "{ratio}");
}
