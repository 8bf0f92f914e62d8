//! The forms for loops do not allocate.
#![allow(non_snake_case)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sinew_kinematics::{
    Axes, body_poses_with, centre_of_mass_jacobian_with, centre_of_mass_with, classical_acceleration_with,
    difference_into, hessian_into, hessian_with, integrate_into, jacobian_batch_into, jacobian_into,
    jacobian_rate_into, jacobian_rate_with, jacobian_with, joint_axes_into, joint_axes_with,
    link_acceleration_with, link_pose_with, link_poses_into, link_poses_with, link_velocity_with,
    position_rate_with,
};
use sinew_model::samples::{Random, random_tree};
use sinew_model::{Force, Mechanism, Model, Pose};
use sinew_rigid::*;

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(f: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    f();
    COUNT.with(Cell::get) - before
}

#[test]
fn forms_with_a_workspace_do_not_allocate() {
    for seed in 0..10 {
        let model = random_tree(12, seed);
        let nv = model.nv;
        let mut random = Random::new(seed);
        let (q, qd, qdd) = (random.position(&model), random.vector(nv), random.vector(nv));
        let (mut tau, mut M) = (vec![0.0; nv], vec![0.0; nv * nv]);
        let (mut A, mut B, mut J) = (M.clone(), M.clone(), vec![0.0; 6 * nv]);
        let mut y = vec![0.0; PARAMETERS * model.joints.len()];
        let mut Y = vec![0.0; nv * PARAMETERS * model.joints.len()];
        let mut ws = Workspace::new(&model);
        let count = allocations(|| {
            inverse_dynamics_into(&model, &mut ws, &q, &qd, &qdd, &mut tau);
            bias_into(&model, &mut ws, &q, &qd, &mut tau);
            gravity_into(&model, &mut ws, &q, &mut tau);
            forward_dynamics_into(&model, &mut ws, &q, &qd, &qdd, &mut tau);
            forward_dynamics_under_into(&model, &mut ws, &q, &qd, &qdd, |_| {}, &mut tau);
            mass_matrix_into(&model, &mut ws, &q, &mut M);
            mass_matrix_upper_into(&model, &mut ws, &q, &mut M);
            inverse_mass_matrix_into(&model, &mut ws, &q, &mut M);
            coriolis_matrix_into(&model, &mut ws, &q, &qd, &mut M);
            regressor_into(&model, &mut ws, &q, &qd, &qdd, &mut Y);
            inverse_dynamics_derivatives_into(&model, &mut ws, &q, &qd, &qdd, &mut M, &mut A, &mut B);
            forward_dynamics_derivatives_into(&model, &mut ws, &q, &qd, &qdd, &mut M, &mut A, &mut B);
            kinetic_energy_into(&model, &mut ws, &q, &qd);
            potential_energy_into(&model, &mut ws, &q);
            kinetic_energy_regressor_into(&model, &mut ws, &q, &qd, &mut y);
            potential_energy_regressor_into(&model, &mut ws, &q, &mut y);
            centroidal_momentum_into(&model, &mut ws, &q, &qd);
            centroidal_momentum_rate_into(&model, &mut ws, &q, &qd, &qdd);
            centroidal_momentum_matrix_into(&model, &mut ws, &q, &mut J);
        });
        assert_eq!(count, 0);
    }
}

#[test]
fn batches_and_kinematics_with_a_workspace_do_not_allocate() {
    let model = random_tree(12, 3);
    let nv = model.nv;
    let mut random = Random::new(3);
    let q = [random.position(&model), random.position(&model)].concat();
    let qd = random.vector(2 * nv);
    let (one, rate) = (&q[..model.nq], &qd[..nv]);
    let (mut out, mut M) = (vec![0.0; 2 * nv], vec![0.0; 2 * nv * nv]);
    let (mut A, mut B) = (M.clone(), M.clone());
    let mut Y = vec![0.0; 2 * nv * PARAMETERS * model.joints.len()];
    let (mut J, mut moved) = (vec![0.0; 6 * nv], vec![0.0; model.nq]);
    let (mut Js, mut js) = (vec![0.0; 12 * nv], sinew_kinematics::BatchWorkspace::new(&model));
    let (mut batch, mut ws) = (BatchWorkspace::new(&model), sinew_kinematics::Workspace::new(&model));
    let tip = model.last_link();
    let (mut H, mut poses) = (vec![0.0; 6 * nv * nv], vec![Pose::identity(); model.links.len()]);
    let mut axes = vec![0.0; 6 * sinew_model::Mechanism::new(&model).axes()];
    let count = allocations(|| {
        inverse_dynamics_batch_into(&model, &mut batch, &q, &qd, &qd, &mut out);
        forward_dynamics_batch_into(&model, &mut batch, &q, &qd, &qd, &mut out);
        mass_matrix_batch_into(&model, &mut batch, &q, &mut M);
        mass_matrix_upper_batch_into(&model, &mut batch, &q, &mut M);
        inverse_mass_matrix_batch_into(&model, &mut batch, &q, &mut M);
        regressor_batch_into(&model, &mut batch, &q, &qd, &qd, &mut Y);
        inverse_dynamics_derivatives_batch_into(&model, &mut batch, &q, &qd, &qd, &mut M, &mut A, &mut B);
        jacobian_batch_into(&model, &mut js, &q, tip, Axes::World, &mut Js);
        jacobian_into(&model, &mut ws, one, tip, Axes::Local, &mut J);
        jacobian_rate_into(&model, &mut ws, one, rate, tip, Axes::World, &mut J);
        hessian_into(&model, &mut ws, one, tip, Axes::World, &mut H);
        joint_axes_into(&model, &mut ws, one, &mut axes);
        link_poses_into(&model, &mut ws, one, &mut poses);
        integrate_into(&model, one, rate, &mut moved);
        difference_into(&model, one, &moved, &mut out[..nv]);
    });
    assert_eq!(count, 0);
}

/// Every form for any kind of number, once with plain ones: a `Scalar` is `Copy` and so has no memory of its own, and each kind
/// takes long to compile.
fn allocations_of_forms_with_scratch(model: &Model) -> usize {
    let (nv, bodies) = (model.nv, model.joints.len());
    let mut random = Random::new(5);
    let (q, qd, qdd) = (random.position(model), random.vector(nv), random.vector(nv));
    let inertia = inertias(model);
    let armature = vec![0.1; nv];
    let b = Bodies { armature: &armature, ..Bodies::new(model, &inertia) };
    let imposed: Vec<bool> = (0..nv).map(|i| i % 2 == 0).collect();
    let zeros = |n: usize| vec![0.0; n];
    let (mut x, mut tau) = (qdd.clone(), qdd.clone());
    let (mut A, mut B, mut C) = (zeros(nv * nv), zeros(nv * nv), zeros(nv * nv));
    let (mut y, mut Y) = (zeros(PARAMETERS * bodies), zeros(nv * PARAMETERS * bodies));
    let (mut J, mut H, mut j) = (zeros(6 * nv), zeros(6 * nv * nv), zeros(3 * nv));
    let mut axes = zeros(6 * Mechanism::new(model).axes());
    let mut poses = vec![Pose::identity(); model.links.len()];
    let mut body_poses = vec![Pose::identity(); bodies];
    let mut rate = zeros(model.nq);
    let (mut ws, mut places) = (Scratch::new(model), sinew_kinematics::Scratch::new(model));
    let tip = model.last_link();
    allocations(|| {
        inverse_dynamics_with(&b, &mut ws, &q, &qd, &qdd, &mut tau);
        forward_dynamics_with(&b, &mut ws, &q, &qd, &qdd, &mut x);
        hybrid_dynamics_with(&b, &mut ws, &q, &qd, &imposed, &mut x, &mut tau);
        hybrid_response_with(&b, &mut ws, &q, &imposed, &mut A);
        mass_matrix_with(&b, &mut ws, &q, &mut A);
        inverse_mass_matrix_with(&b, &mut ws, &q, &mut A);
        coriolis_matrix_with(&b, &mut ws, &q, &qd, &mut A);
        regressor_with(&b, &mut ws, &q, &qd, &qdd, &mut Y);
        inverse_dynamics_derivatives_with(&b, &mut ws, &q, &qd, &qdd, &mut A, &mut B, &mut C);
        forward_dynamics_derivatives_with(&b, &mut ws, &q, &qd, &qdd, &mut A, &mut B, &mut C);
        kinetic_energy_with(&b, &mut ws, &q, &qd);
        potential_energy_with(&b, &mut ws, &q);
        kinetic_energy_regressor_with(&b, &mut ws, &q, &qd, &mut y);
        potential_energy_regressor_with(&b, &mut ws, &q, &mut y);
        centroidal_momentum_with(&b, &mut ws, &q, &qd, &qdd);
        centroidal_momentum_matrix_with(&b, &mut ws, &q, &mut J);
        tool_wrench_with(&b, &mut ws, &q, tip, Force::ZERO, &mut tau);
        body_poses_with(model, &q, &mut body_poses);
        link_pose_with(model, &q, tip);
        link_poses_with(model, &mut places, &q, &mut poses);
        link_velocity_with(model, &mut places, &q, &qd, tip, Axes::World);
        link_acceleration_with(model, &mut places, &q, &qd, &qdd, tip, Axes::Local);
        classical_acceleration_with(model, &mut places, &q, &qd, &qdd, tip, Axes::Local);
        jacobian_with(model, &mut places, &q, tip, Axes::Local, &mut J);
        jacobian_rate_with(model, &mut places, &q, &qd, tip, Axes::World, &mut J);
        joint_axes_with(model, &mut places, &q, &mut axes);
        hessian_with(model, &mut places, &q, tip, Axes::World, &mut H);
        centre_of_mass_with(model, &inertia, &mut places, &q);
        centre_of_mass_jacobian_with(model, &inertia, &mut places, &q, &mut j);
        position_rate_with(model, &q, &qd, &mut rate);
    })
}

#[test]
fn forms_with_scratch_do_not_allocate() {
    for seed in 0..6 {
        let model = random_tree(12, seed);
        assert_eq!(allocations_of_forms_with_scratch(&model), 0);
    }
}
