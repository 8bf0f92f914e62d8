//! Many configurations at once, in vector registers.

use nalgebra::DMatrix;
use sinew_model::{Inertia, Lanes, Model};

use crate::{Bodies, Scratch, forward_dynamics_with, inertias, inverse_dynamics_with, mass_matrix_with};

/// Configurations that go side by side: what a register of AVX2 holds.
const WIDTH: usize = 4;
type Number = Lanes<WIDTH>;

/// Scratch space of the batch forms; nothing is allocated after `new`.
#[derive(Debug, Clone)]
pub struct BatchWorkspace {
    scratch: Scratch<Number>,
    inertia: Vec<Inertia<Number>>,
    inputs: [Vec<Number>; 3],
    output: Vec<Number>,
}

impl BatchWorkspace {
    /// Room for robots of this model, whose inertias it keeps.
    pub fn new(model: &Model) -> Self {
        let zeros = |n| vec![Number::default(); n];
        Self {
            scratch: Scratch::new(model),
            inertia: inertias(model),
            inputs: [zeros(model.nq), zeros(model.nv), zeros(model.nv)],
            output: zeros(model.nv * model.nv),
        }
    }
}

/// [`inverse_dynamics`](crate::inverse_dynamics) of many configurations.
///
/// ```text
/// τ_k = M(q_k) q̈_k + C(q_k, q̇_k) q̇_k + g(q_k)
/// ```
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `qdd`: count × nv likewise. Returns nv × count.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A pendulum held level and upright:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let q = [0.0, std::f64::consts::FRAC_PI_2];
/// let tau = sinew_rigid::inverse_dynamics_batch(&pendulum, &q, &[0.0; 2], &[0.0; 2]);
/// approx::assert_relative_eq!(tau[(0, 0)], 9.81, max_relative = 1e-12);
/// approx::assert_abs_diff_eq!(tau[(0, 1)], 0.0, epsilon = 1e-12);
/// ```
pub fn inverse_dynamics_batch(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> DMatrix<f64> {
    let mut tau = DMatrix::zeros(model.nv, q.len() / model.nq.max(1));
    inverse_dynamics_batch_into(model, &mut BatchWorkspace::new(model), q, qd, qdd, tau.as_mut_slice());
    tau
}

/// [`inverse_dynamics_batch`] without allocation, into the count × nv numbers of `tau`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn inverse_dynamics_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    run(Job { algorithm: Algorithm::InverseDynamics, model, ws, inputs: [q, qd, qdd], output: tau });
}

/// [`forward_dynamics`](crate::forward_dynamics) of many configurations.
///
/// ```text
/// q̈_k = M(q_k)⁻¹ (τ_k − C(q_k, q̇_k) q̇_k − g(q_k))
/// ```
///
/// `q`: count × nq numbers, one configuration after the other; `qd`, `tau`: count × nv likewise. Returns nv × count.
///
/// # Panics
/// If a slice has the wrong length.
pub fn forward_dynamics_batch(model: &Model, q: &[f64], qd: &[f64], tau: &[f64]) -> DMatrix<f64> {
    let mut qdd = DMatrix::zeros(model.nv, q.len() / model.nq.max(1));
    forward_dynamics_batch_into(model, &mut BatchWorkspace::new(model), q, qd, tau, qdd.as_mut_slice());
    qdd
}

/// [`forward_dynamics_batch`] without allocation, into the count × nv numbers of `qdd`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn forward_dynamics_batch_into(
    model: &Model,
    ws: &mut BatchWorkspace,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) {
    run(Job { algorithm: Algorithm::ForwardDynamics, model, ws, inputs: [q, qd, tau], output: qdd });
}

/// [`mass_matrix`](crate::mass_matrix) of many configurations.
///
/// `q`: count × nq numbers, one configuration after the other. Returns nv² × count: each column is one M by columns.
///
/// # Panics
/// If `q` is not a whole number of configurations.
pub fn mass_matrix_batch(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let mut M = DMatrix::zeros(model.nv * model.nv, q.len() / model.nq.max(1));
    mass_matrix_batch_into(model, &mut BatchWorkspace::new(model), q, M.as_mut_slice());
    M
}

/// [`mass_matrix_batch`] without allocation, into the count × nv² numbers of `M`.
///
/// # Panics
/// If a slice has the wrong length.
pub fn mass_matrix_batch_into(model: &Model, ws: &mut BatchWorkspace, q: &[f64], M: &mut [f64]) {
    run(Job { algorithm: Algorithm::MassMatrix, model, ws, inputs: [q, &[], &[]], output: M });
}

#[derive(Clone, Copy, PartialEq)]
enum Algorithm {
    InverseDynamics,
    ForwardDynamics,
    MassMatrix,
}

struct Job<'a> {
    algorithm: Algorithm,
    model: &'a Model,
    ws: &'a mut BatchWorkspace,
    inputs: [&'a [f64]; 3],
    output: &'a mut [f64],
}

impl Job<'_> {
    /// Numbers of one configuration in the three inputs and the output.
    fn sizes(&self) -> ([usize; 3], usize) {
        let Model { nq, nv, .. } = *self.model;
        match self.algorithm {
            Algorithm::MassMatrix => ([nq, 0, 0], nv * nv),
            Algorithm::InverseDynamics | Algorithm::ForwardDynamics => ([nq, nv, nv], nv),
        }
    }
}

fn run(job: Job) {
    let (sizes, size) = job.sizes();
    let count = job.inputs[0].len() / sizes[0].max(1);
    let lengths = job.inputs.map(<[f64]>::len);
    assert_eq!((lengths, job.output.len()), (sizes.map(|n| n * count), size * count), "inputs, output");
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the machine has the instructions that the function is compiled for.
        unsafe { sweep_avx2(job, count) };
        return;
    }
    sweep(job, count);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn sweep_avx2(job: Job, count: usize) {
    sweep(job, count);
}

// Inlined into its callers, so that each compiles the algorithms for its own instructions.
#[inline(always)]
fn sweep(job: Job, count: usize) {
    let (sizes, size) = job.sizes();
    let BatchWorkspace { scratch, inertia, inputs, output } = job.ws;
    let output = &mut output[..size];
    let bodies = Bodies::new(job.model, inertia);
    for first in (0..count).step_by(WIDTH) {
        for (lanes, (input, n)) in inputs.iter_mut().zip(job.inputs.iter().zip(sizes)) {
            gather(input, n, first, count, lanes);
        }
        let [q, qd, x] = &*inputs;
        match job.algorithm {
            Algorithm::InverseDynamics => inverse_dynamics_with(&bodies, scratch, q, qd, x, output),
            Algorithm::ForwardDynamics => forward_dynamics_with(&bodies, scratch, q, qd, x, output),
            Algorithm::MassMatrix => mass_matrix_with(&bodies, scratch, q, output),
        }
        for lane in 0..WIDTH.min(count - first) {
            let own = &mut job.output[(first + lane) * size..][..size];
            for (number, lanes) in own.iter_mut().zip(&*output) {
                *number = lanes.0[lane];
            }
        }
    }
}

/// The numbers of configurations `first` … side by side; past the end the last one is repeated.
#[inline(always)]
fn gather(input: &[f64], n: usize, first: usize, count: usize, lanes: &mut [Number]) {
    for lane in 0..WIDTH {
        let own = &input[(first + lane).min(count - 1) * n..][..n];
        for (lanes, &number) in lanes.iter_mut().zip(own) {
            lanes.0[lane] = number;
        }
    }
}
