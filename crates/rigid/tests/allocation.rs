//! The forms for loops do not allocate.
#![allow(non_snake_case)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sinew_kinematics::{
    Axes, difference_into, hessian_into, integrate_into, jacobian_into, jacobian_rate_into, joint_axes_into,
    link_poses_into,
};
use sinew_model::samples::{Random, random_tree};
use sinew_model::{Dual, Pose, Scalar};
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
            mass_matrix_into(&model, &mut ws, &q, &mut M);
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
    let (mut J, mut moved) = (vec![0.0; 6 * nv], vec![0.0; model.nq]);
    let (mut batch, mut ws) = (BatchWorkspace::new(&model), sinew_kinematics::Workspace::new(&model));
    let tip = model.last_link();
    let (mut H, mut poses) = (vec![0.0; 6 * nv * nv], vec![Pose::identity(); model.links.len()]);
    let mut axes = vec![0.0; 6 * sinew_model::Mechanism::new(&model).axes()];
    let count = allocations(|| {
        inverse_dynamics_batch_into(&model, &mut batch, &q, &qd, &qd, &mut out);
        forward_dynamics_batch_into(&model, &mut batch, &q, &qd, &qd, &mut out);
        mass_matrix_batch_into(&model, &mut batch, &q, &mut M);
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

#[test]
fn hybrid_dynamics_of_dual_numbers_does_not_allocate() {
    let model = random_tree(12, 5);
    let inertia = inertias(&model);
    let b = Bodies::new(&model, &inertia);
    let mut ws = Scratch::new(&model);
    let q: Vec<_> = Random::new(5).position(&model).into_iter().map(Dual::<3>::constant).collect();
    let qd = vec![Dual::ONE; model.nv];
    let imposed: Vec<bool> = (0..model.nv).map(|i| i % 2 == 0).collect();
    let (mut qdd, mut tau) = (qd.clone(), qd.clone());
    let count = allocations(|| hybrid_dynamics_with(&b, &mut ws, &q, &qd, &imposed, &mut qdd, &mut tau));
    assert_eq!(count, 0);
}
