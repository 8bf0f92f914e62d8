//! Elastic joints on a seven-joint arm that needs no file: `cargo bench -p sinew-bench --bench elastic`.
#![allow(non_snake_case)]

use divan::{Bencher, black_box};
use sinew_flex_joint::{Deflection, ElasticJoints, InverseScratch, MotorMotion, SpinInertia, Workspace};
use sinew_model::Robot;
use sinew_model::samples::{Random, planar_arm};

const MODELS: [&str; 2] = ["reduced", "complete"];

fn main() {
    divan::main();
}

/// A chain of seven rods with a spring, a damper and a geared rotor in every joint, and five random vectors.
fn arm(name: &str) -> (ElasticJoints, [Vec<f64>; 5]) {
    let mut robot = Robot::rigid(planar_arm(7, 2.0, 0.3));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.damping) = (Some(1e4), 10.0);
        (joint.rotor_inertia, joint.gear_ratio) = (0.5, Some(100.0));
    }
    let joints = match name {
        "complete" => ElasticJoints::complete(&robot, SpinInertia::BesideLinks),
        _ => ElasticJoints::new(&robot),
    };
    let mut random = Random::new(2);
    (joints.expect("springs and gears are sound"), [(); 5].map(|()| random.vector(7)))
}

#[divan::bench]
fn rigid_forward_dynamics(bencher: Bencher) {
    let (joints, [q, qd, tau, ..]) = arm(MODELS[0]);
    let (model, mut qdd) = (joints.model(), vec![0.0; 7]);
    let mut ws = sinew_rigid::Workspace::new(model);
    bencher.bench_local(|| {
        sinew_rigid::forward_dynamics_into(model, &mut ws, black_box(&q), &qd, &tau, &mut qdd);
    });
}

#[divan::bench(args = MODELS)]
fn forward_dynamics(bencher: Bencher, name: &str) {
    let (joints, [q, qd, theta, thetad, tau_m]) = arm(name);
    let (mut ws, mut qdd, mut thetadd) = (Workspace::new(&joints), vec![0.0; 7], vec![0.0; 7]);
    bencher.bench_local(|| {
        let q = black_box(&q);
        joints.forward_dynamics_into(&mut ws, q, &qd, &theta, &thetad, &tau_m, &mut qdd, &mut thetadd);
    });
}

#[divan::bench(args = MODELS)]
fn linearize(bencher: Bencher, name: &str) {
    let (joints, [q, theta, qd, thetad, tau_m]) = arm(name);
    let x = [q, theta, qd, thetad].concat();
    let (mut ws, mut A, mut B) = (Workspace::new(&joints), vec![0.0; 28 * 28], vec![0.0; 28 * 7]);
    bencher.bench_local(|| joints.linearize_into(&mut ws, black_box(&x), &tau_m, &mut A, &mut B));
}

#[divan::bench]
fn inverse_dynamics(bencher: Bencher) {
    let (joints, motion) = arm(MODELS[0]);
    let (mut ws, mut out) = (InverseScratch::<f64, 3>::new(&joints), MotorMotion::new(&joints));
    let motion = motion.each_ref().map(Vec::as_slice);
    bencher.bench_local(|| {
        let motion = black_box(&motion);
        joints
            .inverse_dynamics_with(&mut ws, motion, Deflection::Settled, &mut out)
            .expect("four derivatives")
    });
}
