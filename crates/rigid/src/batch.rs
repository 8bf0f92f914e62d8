//! Many configurations at once, in vector registers.

use nalgebra::DMatrix;
use sinew_model::{Lanes, Model, Vector3, wide, wide_forms};

use crate::mass_matrix::composite_bodies;
use crate::scratch::Conditions;
use crate::{Scratch, hybrid_dynamics, rnea};

/// Scratch space of the batch forms; nothing is allocated after `new`.
///
/// Belongs to the model it was made of, whose inertias it keeps; gravity is read from the model at each call.
#[derive(Debug, Clone)]
pub struct BatchWorkspace {
    room: Room,
}

/// Configurations that go side by side: what a register of AVX-512 holds, or one of AVX2.
#[derive(Debug, Clone)]
enum Room {
    Eight(Lane<8>),
    Four(Lane<4>),
}

#[derive(Debug, Clone)]
struct Lane<const N: usize> {
    scratch: Scratch<Lanes<N>>,
    inputs: [Vec<Lanes<N>>; 3],
    output: Vec<Lanes<N>>,
}

impl BatchWorkspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        Self {
            room: if wide::eight() { Room::Eight(Lane::new(model)) } else { Room::Four(Lane::new(model)) },
        }
    }
}

impl<const N: usize> Lane<N> {
    fn new(model: &Model) -> Self {
        let zeros = |n| vec![Lanes::default(); n];
        Self {
            scratch: Scratch::new(model),
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
    run(ws, Job { algorithm: Algorithm::InverseDynamics, model, inputs: [q, qd, qdd], output: tau });
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
    run(ws, Job { algorithm: Algorithm::ForwardDynamics, model, inputs: [q, qd, tau], output: qdd });
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
    run(ws, Job { algorithm: Algorithm::MassMatrix, model, inputs: [q, &[], &[]], output: M });
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

fn run(ws: &mut BatchWorkspace, job: Job) {
    let (sizes, size) = job.sizes();
    let count = job.inputs[0].len() / sizes[0].max(1);
    let lengths = job.inputs.map(<[f64]>::len);
    assert_eq!((lengths, job.output.len()), (sizes.map(|n| n * count), size * count), "inputs, output");
    match &mut ws.room {
        Room::Eight(lane) => sweep_eight(lane, job, count),
        Room::Four(lane) => sweep_four(lane, job, count),
    }
}

wide_forms! {
    avx512, fn sweep_eight(lane: &mut Lane<8>, job: Job, count: usize) {
        sweep(lane, job, count)
    }
}
wide_forms! {
    avx2, fn sweep_four(lane: &mut Lane<4>, job: Job, count: usize) {
        sweep(lane, job, count)
    }
}

// Inlined into its callers, so that each compiles the algorithms for its own instructions.
#[inline(always)]
fn sweep<const N: usize>(lane: &mut Lane<N>, job: Job, count: usize) {
    let (sizes, size) = job.sizes();
    let Lane { scratch, inputs, output } = lane;
    scratch.mechanism.check(job.model);
    debug_assert!(scratch.has_inertias_of(job.model), "workspace of another model");
    let conditions = Conditions { gravity: Vector3::constant(job.model.gravity), armature: &[] };
    let output = &mut output[..size];
    for first in (0..count).step_by(N) {
        for (lanes, (input, n)) in inputs.iter_mut().zip(job.inputs.iter().zip(sizes)) {
            gather(input, n, first, count, lanes);
        }
        let [q, qd, x] = &*inputs;
        match job.algorithm {
            Algorithm::InverseDynamics => rnea::inverse_dynamics(scratch, &conditions, q, qd, x, output),
            Algorithm::ForwardDynamics => {
                hybrid_dynamics::forward_dynamics(scratch, &conditions, q, qd, x, output);
            }
            Algorithm::MassMatrix => composite_bodies(scratch, &conditions, q, output),
        }
        for lane in 0..N.min(count - first) {
            let own = &mut job.output[(first + lane) * size..][..size];
            for (number, lanes) in own.iter_mut().zip(&*output) {
                *number = lanes.0[lane];
            }
        }
    }
}

/// The numbers of configurations `first` … side by side; past the end the last one is repeated.
#[inline(always)]
fn gather<const N: usize>(input: &[f64], n: usize, first: usize, count: usize, lanes: &mut [Lanes<N>]) {
    for lane in 0..N {
        let own = &input[(first + lane).min(count - 1) * n..][..n];
        for (lanes, &number) in lanes.iter_mut().zip(own) {
            lanes.0[lane] = number;
        }
    }
}
