//! The workspace of the plain forms.

use sinew_model::{Inertia, Model};

use crate::{Bodies, Scratch};

/// Scratch space of the plain forms: one for all algorithms, nothing is allocated after `new`.
///
/// Holds no result from one call to the next: any workspace of a model of the same size will do.
#[derive(Debug, Clone)]
pub struct Workspace {
    scratch: Scratch<f64>,
    inertia: Vec<Inertia<f64>>,
    zeros: Vec<f64>,
}

impl Workspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        Self {
            scratch: Scratch::new(model),
            inertia: vec![Inertia::default(); model.joints.len()],
            zeros: vec![0.0; model.nv],
        }
    }

    /// The model's bodies with its own inertias and gravity, without armature; the scratch space; nv zeros.
    #[inline]
    pub(crate) fn split<'a>(
        &'a mut self,
        model: &'a Model,
    ) -> (Bodies<'a, f64>, &'a mut Scratch<f64>, &'a [f64]) {
        for (own, joint) in self.inertia.iter_mut().zip(&model.joints) {
            *own = joint.inertia;
        }
        (Bodies::new(model, &self.inertia), &mut self.scratch, &self.zeros)
    }
}
