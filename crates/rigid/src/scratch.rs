//! Scratch space of the algorithms.

use sinew_model::{ArticulatedInertia, Force, Inertia, Model, Motion, Pose, Scalar};

use crate::coriolis::Transport;
use crate::inverse_dynamics_derivatives::Axis;

/// One workspace for all algorithms over numbers of one kind; nothing is allocated after `new`.
///
/// Holds no result from one call to the next: any workspace of the same model will do.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    // Of each body: parent_from_body, or world_from_body where an algorithm works in the world.
    pub(crate) pose: Vec<Pose<S>>,
    pub(crate) velocity: Vec<Motion<S>>,
    pub(crate) acceleration: Vec<Motion<S>>,
    pub(crate) force: Vec<Force<S>>,
    pub(crate) composite: Vec<Inertia<S>>,
    pub(crate) articulated: Vec<ArticulatedInertia<S>>,
    pub(crate) transport: Vec<Transport<S>>,
    // Of each axis of each joint, and where those of a joint begin.
    pub(crate) axis: Vec<Axis<S>>,
    pub(crate) first_axis: Vec<usize>,
    // Of each degree of freedom.
    pub(crate) pivot: Vec<Pivot<S>>,
    pub(crate) torque: Vec<S>,
    // For M q̈ = τ − h, only where joints mimic others: nv × nv and nv.
    pub(crate) matrix: Vec<S>,
    pub(crate) solution: Vec<S>,
    // For the response of a hybrid motion: M, its factor, one column.
    pub(crate) response: (Vec<S>, Vec<S>, Vec<S>),
}

/// One axis taken out of an articulated inertia.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pivot<S> {
    /// U = I s.
    pub(crate) U: Force<S>,
    /// 1/(s·U).
    pub(crate) d_inverse: S,
    /// u = τ − s·p.
    pub(crate) u: S,
}

impl<S: Scalar> Scratch<S> {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        let (n, nv) = (model.joints.len(), model.nv);
        let mut axes = 0;
        let first_axis = model.joints.iter().map(|joint| {
            axes += joint.kind.nv();
            axes - joint.kind.nv()
        });
        let first_axis: Vec<usize> = first_axis.collect();
        let size = if model.has_mimic() { nv } else { 0 };
        Self {
            pose: vec![Pose::identity(); n],
            velocity: vec![Motion::ZERO; n],
            acceleration: vec![Motion::ZERO; n],
            force: vec![Force::ZERO; n],
            composite: vec![Inertia::default(); n],
            articulated: vec![ArticulatedInertia::default(); n],
            transport: vec![Transport::ZERO; n],
            axis: vec![Axis::ZERO; axes],
            first_axis,
            pivot: vec![Pivot { U: Force::ZERO, d_inverse: S::ZERO, u: S::ZERO }; nv],
            torque: vec![S::ZERO; nv],
            matrix: vec![S::ZERO; size * size],
            solution: vec![S::ZERO; size],
            response: (vec![S::ZERO; nv * nv], vec![S::ZERO; nv * nv], vec![S::ZERO; nv]),
        }
    }
}
