//! The bodies in the middle of an algorithm: how they move, and what pushes them.

use sinew_model::{Force, JointId, Motion, Scalar};

use crate::scratch::Body;

/// The bodies once their velocities are known. Everything is told in the frame of the body's segment
/// ([`sinew_model::Segment`]).
#[derive(Debug)]
pub struct MovingBodies<'a, S>(pub(crate) &'a mut [Body<S>]);

impl<S: Scalar> MovingBodies<'_, S> {
    /// Angular and linear velocity, rad/s, m/s.
    #[inline(always)]
    pub fn velocity(&self, joint: JointId) -> Motion<S> {
        self.0[joint.0 + 1].velocity
    }
    /// Pushes the body of a joint with a moment and a force, N·m, N.
    #[inline(always)]
    pub fn push(&mut self, joint: JointId, force: Force<S>) {
        let body = &mut self.0[joint.0 + 1];
        body.force -= force;
    }
}

/// The accelerations of the bodies.
#[derive(Debug)]
pub struct BodyAccelerations<'a, S>(pub(crate) &'a [Body<S>]);

impl<S: Scalar> BodyAccelerations<'_, S> {
    /// Spatial acceleration in the frame of the body's segment, beside a fall with gravity: angular, rad/s², and linear,
    /// m/s².
    #[inline(always)]
    pub fn of(&self, joint: JointId) -> Motion<S> {
        self.0[joint.0 + 1].acceleration
    }
}
