//! The algorithms on a seven-joint arm and a humanoid-sized tree that need no file: `cargo bench -p sinew-bench`.
#![allow(non_snake_case)]

use divan::{Bencher, black_box};
use sinew_kinematics::{Axes, hessian_into, jacobian_into, joint_axes_into};
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Inertia, JointShape, JointSpec, Model, ModelBuilder};
use sinew_rigid::*;

const ROBOTS: [&str; 2] = ["arm of 7", "humanoid of 35"];
/// Configurations of a batch.
const COUNT: usize = 128;

fn main() {
    divan::main();
}

/// A chain of seven rods, or a floating body with two legs of six joints, a waist of three and two arms of seven.
fn robot(name: &str) -> Model {
    if name == ROBOTS[0] {
        return planar_arm(7, 2.0, 0.3);
    }
    let (mut builder, mut random) = (ModelBuilder::new("humanoid"), Random::new(1));
    builder.link("world", Inertia::default()).link("pelvis", random.inertia());
    builder.joint(JointSpec::new("base", JointShape::Floating, "world", "pelvis"));
    let mut limb = |name: &str, root: &str, joints: usize| {
        for k in 1..=joints {
            let parent = if k == 1 { root.to_owned() } else { format!("{name}_{}", k - 1) };
            let child = format!("{name}_{k}");
            builder.link(&child, random.inertia());
            let mut axis = [0.0; 3];
            axis[k % 3] = 1.0;
            let joint = JointSpec::new(&format!("{child}_joint"), JointShape::Revolute, &parent, &child);
            builder.joint(joint.about(axis).at(random.pose()));
        }
    };
    limb("left_leg", "pelvis", 6);
    limb("right_leg", "pelvis", 6);
    limb("waist", "pelvis", 3);
    limb("left_arm", "waist_3", 7);
    limb("right_arm", "waist_3", 7);
    builder.build().expect("limbs make a tree")
}

struct Setting {
    model: Model,
    ws: Workspace,
    q: Vec<f64>,
    qd: Vec<f64>,
    x: Vec<f64>,
    matrices: [Vec<f64>; 3],
}

impl Setting {
    fn new(name: &str) -> Self {
        let (model, mut random) = (robot(name), Random::new(2));
        let (q, nv) = (random.position(&model), model.nv);
        let (qd, x) = (random.vector(nv), random.vector(nv));
        let matrix = || vec![0.0; nv * nv];
        Self { ws: Workspace::new(&model), q, qd, x, matrices: [matrix(), matrix(), matrix()], model }
    }
}

#[divan::bench(args = ROBOTS)]
fn inverse_dynamics(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, mut x, .. } = Setting::new(name);
    let qdd = x.clone();
    bencher.bench_local(|| inverse_dynamics_into(&model, &mut ws, black_box(&q), &qd, &qdd, &mut x));
}

#[divan::bench(args = ROBOTS)]
fn forward_dynamics(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, mut x, .. } = Setting::new(name);
    let tau = x.clone();
    bencher.bench_local(|| forward_dynamics_into(&model, &mut ws, black_box(&q), &qd, &tau, &mut x));
}

#[divan::bench(args = ROBOTS)]
fn mass_matrix(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, matrices: [mut M, ..], .. } = Setting::new(name);
    bencher.bench_local(|| mass_matrix_into(&model, &mut ws, black_box(&q), &mut M));
}

#[divan::bench(args = ROBOTS)]
fn inverse_mass_matrix(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, matrices: [mut M, ..], .. } = Setting::new(name);
    bencher.bench_local(|| inverse_mass_matrix_into(&model, &mut ws, black_box(&q), &mut M));
}

#[divan::bench(args = ROBOTS)]
fn coriolis_matrix(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, matrices: [mut C, ..], .. } = Setting::new(name);
    bencher.bench_local(|| coriolis_matrix_into(&model, &mut ws, black_box(&q), &qd, &mut C));
}

#[divan::bench(args = ROBOTS)]
fn regressor(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, x, .. } = Setting::new(name);
    let mut Y = vec![0.0; model.nv * PARAMETERS * model.joints.len()];
    bencher.bench_local(|| regressor_into(&model, &mut ws, black_box(&q), &qd, &x, &mut Y));
}

#[divan::bench(args = ROBOTS)]
fn inverse_dynamics_derivatives(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, x, matrices: [mut A, mut B, mut C] } = Setting::new(name);
    bencher.bench_local(|| {
        let q = black_box(&q);
        inverse_dynamics_derivatives_into(&model, &mut ws, q, &qd, &x, &mut A, &mut B, &mut C);
    });
}

#[divan::bench(args = ROBOTS)]
fn forward_dynamics_derivatives(bencher: Bencher, name: &str) {
    let Setting { model, mut ws, q, qd, x, matrices: [mut A, mut B, mut C] } = Setting::new(name);
    bencher.bench_local(|| {
        let q = black_box(&q);
        forward_dynamics_derivatives_into(&model, &mut ws, q, &qd, &x, &mut A, &mut B, &mut C);
    });
}

#[divan::bench(args = ROBOTS)]
fn jacobians(bencher: Bencher, name: &str) {
    let Setting { model, q, .. } = Setting::new(name);
    let (mut ws, mut J) = (sinew_kinematics::Workspace::new(&model), vec![0.0; 6 * model.nv]);
    bencher.bench_local(|| joint_axes_into(&model, &mut ws, black_box(&q), &mut J));
}

#[divan::bench(args = ROBOTS)]
fn tool_jacobian(bencher: Bencher, name: &str) {
    let Setting { model, q, .. } = Setting::new(name);
    let (mut ws, mut J) = (sinew_kinematics::Workspace::new(&model), vec![0.0; 6 * model.nv]);
    let tool = model.last_link();
    bencher.bench_local(|| jacobian_into(&model, &mut ws, black_box(&q), tool, Axes::Local, &mut J));
}

#[divan::bench(args = ROBOTS)]
fn tool_hessian(bencher: Bencher, name: &str) {
    let Setting { model, q, .. } = Setting::new(name);
    let mut ws = sinew_kinematics::Workspace::new(&model);
    let (mut H, tool) = (vec![0.0; 6 * model.nv * model.nv], model.last_link());
    bencher.bench_local(|| hessian_into(&model, &mut ws, black_box(&q), tool, Axes::Local, &mut H));
}

/// The time of a call is that of `COUNT` configurations.
#[divan::bench(args = ROBOTS)]
fn inverse_dynamics_batch_of_128(bencher: Bencher, name: &str) {
    let Setting { model, q, qd, x, .. } = Setting::new(name);
    let (q, qd, qdd) = (q.repeat(COUNT), qd.repeat(COUNT), x.repeat(COUNT));
    let (mut ws, mut tau) = (BatchWorkspace::new(&model), vec![0.0; COUNT * model.nv]);
    bencher
        .counter(divan::counter::ItemsCount::new(COUNT))
        .bench_local(|| inverse_dynamics_batch_into(&model, &mut ws, black_box(&q), &qd, &qdd, &mut tau));
}

#[divan::bench(args = ROBOTS)]
fn forward_dynamics_batch_of_128(bencher: Bencher, name: &str) {
    let Setting { model, q, qd, x, .. } = Setting::new(name);
    let (q, qd, tau) = (q.repeat(COUNT), qd.repeat(COUNT), x.repeat(COUNT));
    let (mut ws, mut qdd) = (BatchWorkspace::new(&model), vec![0.0; COUNT * model.nv]);
    bencher
        .counter(divan::counter::ItemsCount::new(COUNT))
        .bench_local(|| forward_dynamics_batch_into(&model, &mut ws, black_box(&q), &qd, &tau, &mut qdd));
}
