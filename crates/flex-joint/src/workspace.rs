//! Scratch space.

use sinew_model::{Inertia, Scalar, Vector3};
use sinew_rigid::{Bodies, Scratch, inertias};

use crate::ElasticJoints;

/// Scratch space of the forms ending in `_with`; nothing is allocated after `new`.
#[derive(Debug, Clone)]
pub struct Workspace<S> {
    pub(crate) scratch: Scratch<S>,
    pub(crate) inertia: Vec<Inertia<S>>,
    // B in rigid joints, zero in elastic ones.
    pub(crate) armature: Vec<S>,
    pub(crate) tau: Vec<S>,
    pub(crate) zeros: Vec<S>,
}

impl<S: Scalar> Workspace<S> {
    /// Room for these joints, with the inertias of their model.
    pub fn new(joints: &ElasticJoints) -> Self {
        let zeros = vec![S::ZERO; joints.model.nv];
        let armature = |(&elastic, &B): (&bool, &f64)| if elastic { S::ZERO } else { S::constant(B) };
        Self {
            scratch: Scratch::new(&joints.model),
            inertia: inertias(&joints.model),
            armature: joints.elastic.iter().zip(&joints.rotor).map(armature).collect(),
            tau: zeros.clone(),
            zeros,
        }
    }

    /// The links with the rotors of rigid joints.
    pub(crate) fn bodies<'a>(
        joints: &'a ElasticJoints,
        inertia: &'a [Inertia<S>],
        armature: &'a [S],
    ) -> Bodies<'a, S> {
        let gravity = Vector3::constant(joints.model.gravity);
        Bodies { model: &joints.model, inertia, gravity, armature }
    }
}
