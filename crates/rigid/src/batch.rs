//! Many configurations at once, in vector registers.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::DMatrix;
use sinew_model::{Lanes, Model, Scalar, Vector3, wide, wide_forms};

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
    let inputs = [(q, model.nq), (qd, model.nv), (qdd, model.nv)];
    run_inverse_dynamics(ws, Job { model, inputs, output: (tau, model.nv) });
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
    let inputs = [(q, model.nq), (qd, model.nv), (tau, model.nv)];
    run_forward_dynamics(ws, Job { model, inputs, output: (qdd, model.nv) });
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
    let inputs: [(&[f64], usize); 3] = [(q, model.nq), (&[], 0), (&[], 0)];
    run_mass_matrix(ws, Job { model, inputs, output: (M, model.nv * model.nv) });
}

struct Job<'a> {
    model: &'a Model,
    // Numbers of all configurations, and of one.
    inputs: [(&'a [f64], usize); 3],
    output: (&'a mut [f64], usize),
}

impl Job<'_> {
    /// The count of configurations.
    fn count(&self) -> usize {
        let count = self.inputs[0].0.len() / self.inputs[0].1.max(1);
        for (input, size) in self.inputs {
            assert_eq!(input.len(), size * count, "q, qd, qdd, tau");
        }
        assert_eq!(self.output.0.len(), self.output.1 * count, "output");
        count
    }
}

/// One function for each algorithm and width: a compiler's time grows faster than a function's length.
macro_rules! algorithm {
    ($run:ident, $eight:ident, $four:ident, $algorithm:expr) => {
        fn $run(ws: &mut BatchWorkspace, job: Job) {
            match &mut ws.room {
                Room::Eight(lane) => $eight(lane, job),
                Room::Four(lane) => $four(lane, job),
            }
        }
        wide_forms! {
            avx512, fn $eight(lane: &mut Lane<8>, job: Job) {
                sweep(lane, job, $algorithm)
            }
        }
        wide_forms! {
            avx2, fn $four(lane: &mut Lane<4>, job: Job) {
                sweep(lane, job, $algorithm)
            }
        }
    };
}
algorithm!(run_inverse_dynamics, inverse_dynamics_eight, inverse_dynamics_four, InverseDynamics);
algorithm!(run_forward_dynamics, forward_dynamics_eight, forward_dynamics_four, ForwardDynamics);
algorithm!(run_mass_matrix, mass_matrix_eight, mass_matrix_four, MassMatrix);

trait Algorithm {
    fn run<S: Scalar>(&self, ws: &mut Scratch<S>, c: &Conditions<S>, inputs: [&[S]; 3], output: &mut [S]);
}
struct InverseDynamics;
struct ForwardDynamics;
struct MassMatrix;

impl Algorithm for InverseDynamics {
    #[inline(always)]
    fn run<S: Scalar>(&self, ws: &mut Scratch<S>, c: &Conditions<S>, [q, qd, qdd]: [&[S]; 3], tau: &mut [S]) {
        rnea::inverse_dynamics(ws, c, q, qd, qdd, tau);
    }
}
impl Algorithm for ForwardDynamics {
    #[inline(always)]
    fn run<S: Scalar>(&self, ws: &mut Scratch<S>, c: &Conditions<S>, [q, qd, tau]: [&[S]; 3], qdd: &mut [S]) {
        hybrid_dynamics::forward_dynamics(ws, c, q, qd, tau, qdd);
    }
}
impl Algorithm for MassMatrix {
    #[inline(always)]
    fn run<S: Scalar>(&self, ws: &mut Scratch<S>, c: &Conditions<S>, [q, ..]: [&[S]; 3], M: &mut [S]) {
        composite_bodies(ws, c, q, M);
    }
}

// Inlined into its callers, so that each compiles the algorithm for its own instructions.
#[inline(always)]
fn sweep<const N: usize>(lane: &mut Lane<N>, job: Job, algorithm: impl Algorithm) {
    let count = job.count();
    let Lane { scratch, inputs, output } = lane;
    scratch.mechanism.check(job.model);
    debug_assert!(scratch.has_inertias_of(job.model), "workspace of another model");
    let conditions = Conditions { gravity: Vector3::constant(job.model.gravity), armature: &[] };
    let (all, size) = job.output;
    let output = &mut output[..size];
    for first in (0..count).step_by(N) {
        for (lanes, (input, n)) in inputs.iter_mut().zip(job.inputs) {
            gather(input, n, first, count, lanes);
        }
        let [a, b, c] = &*inputs;
        algorithm.run(scratch, &conditions, [a, b, c], output);
        scatter(output, &mut all[first * size..(first + N).min(count) * size]);
    }
}

/// Numbers moved at a time between lanes and configurations: what lies in the nearest cache.
const TILE: usize = 8;

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

/// The lanes of `output` to as many configurations as `all` holds.
#[inline(always)]
fn scatter<const N: usize>(output: &[Lanes<N>], all: &mut [f64]) {
    let size = output.len();
    for (tile, numbers) in output.chunks(TILE).enumerate() {
        for (lane, own) in all.chunks_exact_mut(size.max(1)).enumerate() {
            for (number, lanes) in own[tile * TILE..].iter_mut().zip(numbers) {
                *number = lanes.0[lane];
            }
        }
    }
}
