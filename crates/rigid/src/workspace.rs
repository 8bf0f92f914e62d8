//! The workspace of the plain forms.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::Model;

use crate::Scratch;
use crate::scratch::Conditions;

/// Scratch space of the plain forms: one for all algorithms, nothing is allocated after `new`.
///
/// Belongs to the model it was made of, whose inertias it keeps; gravity is read from the model at each call. Holds no
/// result from one call to the next.
#[derive(Debug, Clone)]
pub struct Workspace {
    scratch: Scratch<f64>,
    zeros: Vec<f64>,
}

impl Workspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        Self { scratch: Scratch::new(model), zeros: vec![0.0; model.nv] }
    }

    /// The model's gravity, the scratch space with its inertias, nv zeros.
    #[inline(always)]
    pub(crate) fn open(&mut self, model: &Model) -> (Conditions<'static, f64>, &mut Scratch<f64>, &[f64]) {
        self.scratch.mechanism.check(model);
        debug_assert!(self.scratch.has_inertias_of(model), "workspace of another model");
        (Conditions { gravity: model.gravity, armature: &[] }, &mut self.scratch, &self.zeros)
    }
}
