//! What the algorithms need to know of a robot beside its geometry.

use alloc::vec::Vec;

use sinew_model::{Inertia, Model, Scalar, Vector3};

/// A model with inertias, gravity and armature as numbers of any kind.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<'a, S> {
    /// The mechanism; its own inertias and gravity are not looked at.
    pub model: &'a Model,
    /// One inertia a joint, in the frame of the body that the joint moves.
    pub inertia: &'a [Inertia<S>],
    /// Acceleration of gravity in the world, m/s².
    pub gravity: Vector3<S>,
    /// Rotor inertia on M's diagonal, nv numbers, kg·m² (kg); empty for none.
    pub armature: &'a [S],
}

impl<'a, S: Scalar> Bodies<'a, S> {
    /// The model under its own gravity, without armature, with the inertias given (see [`inertias`]).
    pub fn new(model: &'a Model, inertia: &'a [Inertia<S>]) -> Self {
        Self { model, inertia, gravity: Vector3::constant(model.gravity), armature: &[] }
    }
}

/// The inertias of a model as numbers of another kind, one a joint.
pub fn inertias<S: Scalar>(model: &Model) -> Vec<Inertia<S>> {
    model.joints.iter().map(|joint| Inertia::constant(&joint.inertia)).collect()
}
