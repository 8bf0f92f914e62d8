//! The axes and the origin in which a link's motion is told.

use sinew_model::{Motion, Pose, Scalar, Vector3};

/// The axes and the origin in which a link's velocity, acceleration or Jacobian is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axes {
    /// World axes, velocity of the body's point that passes the world's origin (spatial velocity).
    World,
    /// The link's own axes, velocity of its origin.
    Local,
    /// World axes, velocity of the link's origin: what a camera in the world sees.
    WorldAligned,
}

impl Axes {
    /// A spatial motion about the world's origin, told in these axes of the link at `world_from_link`.
    #[inline(always)]
    pub(crate) fn tell<S: Scalar>(self, world_from_link: &Pose<S>, m: Motion<S>) -> Motion<S> {
        match self {
            Axes::World => m,
            Axes::Local => world_from_link.motion_to_child(m),
            // v' = v + ω × p
            Axes::WorldAligned => {
                Motion::new(m.angular, m.linear + m.angular.cross(world_from_link.translation))
            }
        }
    }

    /// The rate of [`Axes::tell`]`(m)` when m changes at `rate` and the link moves at `v`, both about the
    /// world's origin.
    #[inline(always)]
    pub(crate) fn tell_rate<S: Scalar>(
        self,
        world_from_link: &Pose<S>,
        v: Motion<S>,
        m: Motion<S>,
        rate: Motion<S>,
    ) -> Motion<S> {
        match self {
            Axes::World => rate,
            // d/dt (X m) = X (ṁ − v × m)
            Axes::Local => world_from_link.motion_to_child(rate - v.cross_motion(m)),
            // d/dt (v + ω × p) = v̇ + ω̇ × p + ω × ṗ
            Axes::WorldAligned => {
                let p_rate = v.linear + v.angular.cross(world_from_link.translation);
                let moved = Axes::WorldAligned.tell(world_from_link, rate);
                moved + Motion::new(Vector3::ZERO, m.angular.cross(p_rate))
            }
        }
    }
}
