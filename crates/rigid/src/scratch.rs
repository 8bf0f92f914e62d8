//! Scratch space of the algorithms.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::{
    ArticulatedInertia, Coordinates, Force, Inertia, Mechanism, Model, Motion, Pose, Scalar, Vector3,
};

use crate::Bodies;
use crate::coriolis::Transport;
use crate::inverse_dynamics_derivatives::Axis;
use crate::ltdl::Grouped;
use crate::places::Places;
use crate::support::Support;

/// One workspace for all algorithms over numbers of one kind; nothing is allocated after `new`.
///
/// Belongs to the model it was made of. Holds no result from one call to the next.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    pub(crate) mechanism: Mechanism,
    pub(crate) support: Support,
    pub(crate) at: Coordinates<S>,
    // Of each segment, in its frame.
    pub(crate) inertia: Vec<Inertia<S>>,
    // Of the world and of each segment: row k + 1 for segment k.
    pub(crate) body: Vec<Body<S>>,
    pub(crate) world: Vec<Pose<S>>,
    pub(crate) placed: Vec<Inertia<S>>,
    pub(crate) composite: Vec<Inertia<S>>,
    pub(crate) subtree_force: Vec<Force<S>>,
    pub(crate) articulated: Vec<ArticulatedInertia<S>>,
    pub(crate) transport: Vec<Transport<S>>,
    pub(crate) places: Places<S>,
    // Of each axis of each segment.
    pub(crate) axis: Vec<Axis<S>>,
    pub(crate) pivot: Vec<Pivot<S>>,
    // nv numbers each.
    pub(crate) torque: Vec<S>,
    pub(crate) solution: Vec<S>,
    pub(crate) column: Vec<S>,
    // nv × nv numbers each.
    pub(crate) matrix: Vec<S>,
    pub(crate) grouped: Grouped<S>,
}

/// A moving body in its own frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body<S> {
    /// parent_from_body.
    pub(crate) pose: Pose<S>,
    pub(crate) velocity: Motion<S>,
    pub(crate) acceleration: Motion<S>,
    pub(crate) force: Force<S>,
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

/// What a robot moves under, beside its inertias.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions<'a, S> {
    /// Acceleration of gravity in the world.
    pub(crate) gravity: Vector3<S>,
    /// Rotor inertia by degree of freedom; empty for none.
    pub(crate) armature: &'a [S],
}

impl<S: Scalar> Conditions<'_, S> {
    #[inline(always)]
    pub(crate) fn armature(&self, dof: usize) -> S {
        if self.armature.is_empty() { S::ZERO } else { self.armature[dof] }
    }

    /// The world accelerates against gravity: a fall that nobody sees.
    #[inline(always)]
    pub(crate) fn ground(&self) -> Motion<S> {
        Motion::new(Vector3::ZERO, -self.gravity)
    }
}

impl<S: Scalar> Body<S> {
    /// At rest at its parent.
    pub(crate) fn resting() -> Self {
        Self {
            pose: Pose::identity(),
            velocity: Motion::ZERO,
            acceleration: Motion::ZERO,
            force: Force::ZERO,
        }
    }
}

impl<S: Scalar> Scratch<S> {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        let mechanism = Mechanism::new(model);
        let (rows, nv, axes) = (model.joints.len() + 1, model.nv, mechanism.axes());
        let of_segment = |(segment, joint): (&sinew_model::Segment, &sinew_model::Joint)| -> Inertia<S> {
            segment.inertia_from_link(&Inertia::constant(&joint.inertia))
        };
        let inertia: Vec<_> = mechanism.segments().iter().zip(&model.joints).map(of_segment).collect();
        let mut places = Places::new(&mechanism);
        places.load(&inertia);
        let support = Support::new(&mechanism);
        Self {
            places,
            at: Coordinates::new(&mechanism),
            inertia,
            body: vec![Body::resting(); rows],
            world: vec![Pose::identity(); rows],
            placed: vec![Inertia::default(); rows],
            subtree_force: vec![Force::ZERO; rows],
            composite: vec![Inertia::default(); rows],
            articulated: vec![ArticulatedInertia::default(); rows],
            transport: vec![Transport::ZERO; rows],
            axis: vec![Axis::ZERO; axes],
            pivot: vec![Pivot { U: Force::ZERO, d_inverse: S::ZERO, u: S::ZERO }; axes],
            torque: vec![S::ZERO; nv],
            solution: vec![S::ZERO; nv],
            column: vec![S::ZERO; nv],
            matrix: vec![S::ZERO; nv * nv],
            grouped: Grouped::new(nv, &support),
            support,
            mechanism,
        }
    }

    /// Takes the inertias of the bodies.
    ///
    /// # Panics
    /// If the bodies are of another model or their slices have the wrong length.
    #[inline(always)]
    pub(crate) fn take<'a>(&mut self, b: &Bodies<'a, S>) -> Conditions<'a, S> {
        self.mechanism.check(b.model);
        assert_eq!(b.inertia.len(), b.model.joints.len(), "inertia");
        assert!(b.armature.is_empty() || b.armature.len() == b.model.nv, "armature");
        for ((own, segment), given) in self.inertia.iter_mut().zip(self.mechanism.segments()).zip(b.inertia) {
            *own = segment.inertia_from_link(given);
        }
        Conditions { gravity: b.gravity, armature: b.armature }
    }

    /// The same for algorithms that add composite bodies up.
    #[inline(always)]
    pub(crate) fn take_composites<'a>(&mut self, b: &Bodies<'a, S>) -> Conditions<'a, S> {
        let conditions = self.take(b);
        self.places.load(&self.inertia);
        conditions
    }

    /// True if the inertias are those of the model.
    pub(crate) fn has_inertias_of(&self, model: &Model) -> bool {
        let pairs = self.mechanism.segments().iter().zip(&model.joints);
        let of_model =
            pairs.map(|(segment, joint)| segment.inertia_from_link(&Inertia::<S>::constant(&joint.inertia)));
        self.inertia.iter().copied().eq(of_model)
    }

    /// Poses of all segments in the world. A free segment that stands on the world counts as at the world's origin:
    /// its place changes neither torques nor inertias, and far away it would cost digits.
    #[inline(always)]
    pub(crate) fn poses_about_roots(&mut self, q: &[S]) {
        let Self { mechanism, at, world, .. } = self;
        mechanism.read(q, at);
        let mut last = Pose::identity();
        for (k, segment) in mechanism.segments().iter().enumerate() {
            let mut pose = mechanism.pose(k, q, at);
            if segment.parent == 0 && segment.nv() == 6 {
                pose.translation = Vector3::ZERO;
            }
            last = match segment.parent {
                0 => pose,
                parent if S::FITS_REGISTERS && parent == k => last * pose,
                parent => world[parent] * pose,
            };
            world[k + 1] = last;
        }
    }
}
