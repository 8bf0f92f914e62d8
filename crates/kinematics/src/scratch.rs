//! Scratch space of the algorithms.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::{Coordinates, LinkId, Mechanism, Model, Motion, Pose, Scalar};

/// One workspace for all algorithms of the crate over numbers of one kind; nothing is allocated after `new`.
///
/// Belongs to the model it was made of. Holds no result from one call to the next.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    pub(crate) mechanism: Mechanism,
    // Of each link: the row of its segment and its frame there.
    links: Vec<(usize, Pose<f64>)>,
    at: Coordinates<S>,
    // Of the world and of each segment.
    pub(crate) world: Vec<Pose<S>>,
    pub(crate) velocity: Vec<Motion<S>>,
    pub(crate) acceleration: Vec<Motion<S>>,
}

/// The workspace of the plain forms.
pub type Workspace = Scratch<f64>;

impl<S: Scalar> Scratch<S> {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        let mechanism = Mechanism::new(model);
        let links = model.links.iter().map(|link| match link.body {
            None => (0, link.body_from_link),
            Some(id) => (id.0 + 1, mechanism.segments()[id.0].segment_from_link() * link.body_from_link),
        });
        let rows = model.joints.len() + 1;
        Self {
            links: links.collect(),
            at: Coordinates::new(&mechanism),
            world: vec![Pose::identity(); rows],
            velocity: vec![Motion::ZERO; rows],
            acceleration: vec![Motion::ZERO; rows],
            mechanism,
        }
    }

    /// Poses of all segments in the world.
    #[inline(always)]
    pub(crate) fn poses(&mut self, model: &Model, q: &[S]) {
        self.mechanism.check(model);
        self.mechanism.world_poses(q, &mut self.at, &mut self.world);
    }

    /// The same and spatial velocities about the world's origin.
    #[inline(always)]
    pub(crate) fn velocities(&mut self, model: &Model, q: &[S], qd: &[S]) {
        assert_eq!(qd.len(), model.nv, "qd");
        self.poses(model, q);
        for (k, segment) in self.mechanism.segments().iter().enumerate() {
            // v = v_parent + S q̇
            let moved = self.world[k + 1].motion_to_parent(segment.rate(qd));
            self.velocity[k + 1] = self.velocity[segment.parent] + moved;
        }
    }

    /// The same and spatial accelerations.
    #[inline(always)]
    pub(crate) fn accelerations(&mut self, model: &Model, q: &[S], qd: &[S], qdd: &[S]) {
        assert_eq!(qdd.len(), model.nv, "qdd");
        self.velocities(model, q, qd);
        for (k, segment) in self.mechanism.segments().iter().enumerate() {
            let pose = &self.world[k + 1];
            // a = a_parent + S q̈ + v × S q̇
            let moved = pose.motion_to_parent(segment.rate(qd));
            let c = self.velocity[k + 1].cross_motion(moved);
            let a_parent = self.acceleration[segment.parent];
            self.acceleration[k + 1] = a_parent + pose.motion_to_parent(segment.rate(qdd)) + c;
        }
    }

    /// The row of a link's segment, 0 for the world's.
    #[inline(always)]
    pub(crate) fn row(&self, link: LinkId) -> usize {
        self.links[link.0].0
    }

    /// The pose of a link in the world, once those of the segments are known.
    #[inline(always)]
    pub(crate) fn link_in_world(&self, link: LinkId) -> Pose<S> {
        let (row, frame) = &self.links[link.0];
        self.world[*row] * Pose::constant(frame)
    }
}
