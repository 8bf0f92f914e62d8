//! Many configurations at once, in vector registers.

mod derivatives;
mod matrices;
mod regressor;
mod vectors;

pub use derivatives::{inverse_dynamics_derivatives_batch, inverse_dynamics_derivatives_batch_into};
pub use matrices::{
    inverse_mass_matrix_batch, inverse_mass_matrix_batch_into, mass_matrix_batch, mass_matrix_batch_into,
    mass_matrix_upper_batch_into,
};
pub use regressor::{regressor_batch, regressor_batch_into};
pub use vectors::{
    forward_dynamics_batch, forward_dynamics_batch_into, inverse_dynamics_batch, inverse_dynamics_batch_into,
};

use alloc::vec::Vec;

use sinew_model::side_by_side::zeros;
use sinew_model::{Lanes, Model, Vector3, side_by_side};

use crate::scratch::Conditions;
use crate::{PARAMETERS, Scratch, Workspace};

/// Scratch space of the batch forms; nothing is allocated after `new`.
///
/// Belongs to the model it was made of, whose inertias it keeps; gravity is read from the model at each call.
#[derive(Debug, Clone)]
pub struct BatchWorkspace {
    room: Room,
}

type Room = side_by_side::Room<Lane<8>, Lane<4>, Workspace>;

/// Configurations that go side by side: what a register of AVX-512 holds, or one of AVX2.
#[derive(Debug, Clone)]
struct Lane<const N: usize> {
    scratch: Scratch<Lanes<N>>,
    q: Vec<Lanes<N>>,
    // nv numbers each.
    qd: Vec<Lanes<N>>,
    x: Vec<Lanes<N>>,
    // nv × nv numbers each.
    matrices: [Vec<Lanes<N>>; 3],
    // nv × 10 numbers.
    block: Vec<Lanes<N>>,
}

impl BatchWorkspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        Self { room: Room::new(|| Lane::new(model), || Lane::new(model), || Workspace::new(model)) }
    }
}

impl<const N: usize> Lane<N> {
    fn new(model: &Model) -> Self {
        let nv = model.nv;
        Self {
            scratch: Scratch::new(model),
            q: zeros(model.nq),
            qd: zeros(nv),
            x: zeros(nv),
            matrices: [zeros(nv * nv), zeros(nv * nv), zeros(nv * nv)],
            block: zeros(nv * PARAMETERS),
        }
    }

    /// The model's gravity, once the model is known to be that of the workspace.
    #[inline(always)]
    fn conditions(&self, model: &Model) -> Conditions<'static, Lanes<N>> {
        self.scratch.mechanism.check(model);
        debug_assert!(self.scratch.has_inertias_of(model), "workspace of another model");
        Conditions { gravity: Vector3::constant(model.gravity), armature: &[] }
    }
}
