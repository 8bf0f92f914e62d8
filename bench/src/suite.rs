//! What is timed, and on which states.

use std::hint::black_box;

use sinew_kinematics::{Axes, jacobian_batch_into, jacobian_into, joint_axes_into, link_poses_into};
use sinew_model::samples::Random;
use sinew_model::{Model, Pose};
use sinew_rigid::*;

use crate::timer::time;

/// States that every measurement visits in turn.
pub const STATES: usize = 128;

/// States of a robot, one after the other.
pub struct States {
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub x: Vec<f64>,
}

impl States {
    fn new(model: &Model) -> Self {
        let mut random = Random::new(1);
        let q = (0..STATES).flat_map(|_| random.position(model)).collect();
        Self { q, qd: random.vector(STATES * model.nv), x: random.vector(STATES * model.nv) }
    }
}

/// Times every algorithm in both forms.
pub fn time_all(model: &Model) {
    let states = States::new(model);
    kinematics(model, &states);
    vectors(model, &states);
    matrices(model, &states);
    batches(model, &states);
    crate::elastic::time_all(model, &states);
}

fn kinematics(model: &Model, states: &States) {
    let mut ws = sinew_kinematics::Workspace::new(model);
    let mut poses = vec![Pose::identity(); model.links.len()];
    let mut axes = vec![0.0; 6 * model.nv];
    let q = |i: usize| &states.q[i * model.nq..][..model.nq];
    let run = |name: &str, f: &mut dyn FnMut(usize)| time(&model.name, name, "sinew", STATES, 1, f);
    run("fk_q", &mut |i| link_poses_into(model, &mut ws, q(i), black_box(&mut poses)));
    let (tip, mut J) = (model.last_link(), vec![0.0; 6 * model.nv]);
    run("jacobian_frame_tip", &mut |i| {
        jacobian_into(model, &mut ws, q(i), tip, Axes::Local, black_box(&mut J));
    });
    if !model.has_mimic() {
        run("jacobians", &mut |i| joint_axes_into(model, &mut ws, q(i), black_box(&mut axes)));
    }
}

fn vectors(model: &Model, states: &States) {
    let (mut ws, nv) = (Workspace::new(model), model.nv);
    let mut out = vec![0.0; nv];
    let q = |i: usize| &states.q[i * model.nq..][..model.nq];
    let of = |x: &'static str, i: usize| -> &[f64] {
        let all = if x == "qd" { &states.qd } else { &states.x };
        &all[i * nv..][..nv]
    };
    let run = |name: &str, f: &mut dyn FnMut(usize)| time(&model.name, name, "sinew", STATES, 1, f);
    run("gravity", &mut |i| gravity_into(model, &mut ws, q(i), black_box(&mut out)));
    run("nle", &mut |i| bias_into(model, &mut ws, q(i), of("qd", i), black_box(&mut out)));
    run("rnea", &mut |i| {
        inverse_dynamics_into(model, &mut ws, q(i), of("qd", i), of("x", i), black_box(&mut out));
    });
    run("aba_local", &mut |i| {
        forward_dynamics_into(model, &mut ws, q(i), of("qd", i), of("x", i), black_box(&mut out));
    });
}

fn matrices(model: &Model, states: &States) {
    let (mut ws, nv) = (Workspace::new(model), model.nv);
    let room = || vec![0.0; nv * nv];
    let (mut A, mut B, mut C) = (room(), room(), room());
    let mut Y = vec![0.0; nv * PARAMETERS * model.joints.len()];
    let q = |i: usize| &states.q[i * model.nq..][..model.nq];
    let (qd, x) = (|i: usize| &states.qd[i * nv..][..nv], |i: usize| &states.x[i * nv..][..nv]);
    let run = |name: &str, f: &mut dyn FnMut(usize)| time(&model.name, name, "sinew", STATES, 1, f);
    // the peers write the upper triangle only
    run("crba_local", &mut |i| mass_matrix_upper_into(model, &mut ws, q(i), black_box(&mut A)));
    run("crba_full", &mut |i| mass_matrix_into(model, &mut ws, q(i), black_box(&mut A)));
    run("minv", &mut |i| inverse_mass_matrix_into(model, &mut ws, q(i), black_box(&mut A)));
    run("coriolis", &mut |i| coriolis_matrix_into(model, &mut ws, q(i), qd(i), black_box(&mut A)));
    run("regressor", &mut |i| regressor_into(model, &mut ws, q(i), qd(i), x(i), black_box(&mut Y)));
    run("rnea_derivatives", &mut |i| {
        let (A, B, C) = (black_box(&mut A), black_box(&mut B), black_box(&mut C));
        inverse_dynamics_derivatives_into(model, &mut ws, q(i), qd(i), x(i), A, B, C);
    });
    run("aba_derivatives", &mut |i| {
        let (A, B, C) = (black_box(&mut A), black_box(&mut B), black_box(&mut C));
        forward_dynamics_derivatives_into(model, &mut ws, q(i), qd(i), x(i), A, B, C);
    });
}

/// All states in one call, so a call counts as many configurations.
fn batches(model: &Model, States { q, qd, x }: &States) {
    let (mut ws, nv) = (BatchWorkspace::new(model), model.nv);
    let (mut out, mut M) = (vec![0.0; STATES * nv], vec![0.0; STATES * nv * nv]);
    let run = |name: &str, f: &mut dyn FnMut(usize)| time(&model.name, name, "sinew-batch", 4, STATES, f);
    run("rnea", &mut |_| inverse_dynamics_batch_into(model, &mut ws, q, qd, x, black_box(&mut out)));
    run("aba_local", &mut |_| forward_dynamics_batch_into(model, &mut ws, q, qd, x, black_box(&mut out)));
    run("crba_local", &mut |_| mass_matrix_upper_batch_into(model, &mut ws, q, black_box(&mut M)));
    run("crba_full", &mut |_| mass_matrix_batch_into(model, &mut ws, q, black_box(&mut M)));
    run("minv", &mut |_| inverse_mass_matrix_batch_into(model, &mut ws, q, black_box(&mut M)));
    let (mut A, mut B) = (M.clone(), M.clone());
    run("rnea_derivatives", &mut |_| {
        let (A, B, M) = (black_box(&mut A), black_box(&mut B), black_box(&mut M));
        inverse_dynamics_derivatives_batch_into(model, &mut ws, q, qd, x, A, B, M);
    });
    let mut Y = vec![0.0; STATES * nv * PARAMETERS * model.joints.len()];
    run("regressor", &mut |_| regressor_batch_into(model, &mut ws, q, qd, x, black_box(&mut Y)));
    let (tip, mut J) = (model.last_link(), vec![0.0; STATES * 6 * nv]);
    let mut ws = sinew_kinematics::BatchWorkspace::new(model);
    run("jacobian_frame_tip", &mut |_| {
        jacobian_batch_into(model, &mut ws, q, tip, Axes::Local, black_box(&mut J));
    });
}
