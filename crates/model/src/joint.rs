//! Joints: how one body moves against another.

use alloc::string::String;

use crate::{Force, Inertia, Matrix3, Motion, Pose, Scalar, Vector3};

/// The place of a joint, and of the body it moves, in [`Model::joints`](crate::Model::joints).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointId(pub usize);

/// How a joint moves. Fixed joints do not appear: their links are merged into the body that carries them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// Turns about a unit axis of the child frame; one coordinate, rad.
    Revolute {
        /// Unit axis in the child frame.
        axis: Vector3<f64>,
    },
    /// Slides along a unit axis of the child frame; one coordinate, m.
    Prismatic {
        /// Unit axis in the child frame.
        axis: Vector3<f64>,
    },
    /// Moves freely. Position x, y, z, quaternion x, y, z, w (seven numbers); velocity `[ω; v]` in the child's axes.
    Floating,
}

impl JointKind {
    /// Numbers in a position.
    pub fn nq(self) -> usize {
        if self == JointKind::Floating { 7 } else { 1 }
    }
    /// Numbers in a velocity: the degrees of freedom.
    pub fn nv(self) -> usize {
        if self == JointKind::Floating { 6 } else { 1 }
    }
    /// The motion `S_k x` of the child that the rate `x` of axis `k` gives, in the child frame.
    #[inline(always)]
    pub fn motion<S: Scalar>(self, k: usize, rate: S) -> Motion<S> {
        match self {
            JointKind::Revolute { axis } => Motion::new(Vector3::on_axis(axis, rate), Vector3::ZERO),
            JointKind::Prismatic { axis } => Motion::new(Vector3::ZERO, Vector3::on_axis(axis, rate)),
            JointKind::Floating => {
                let mut m = [S::ZERO; 6];
                m[k] = rate;
                Motion::new([m[0], m[1], m[2]].into(), [m[3], m[4], m[5]].into())
            }
        }
    }
    /// The component `S_k · f` of a force in the child frame along axis `k`: the torque of that axis.
    #[inline(always)]
    pub fn along<S: Scalar>(self, k: usize, f: Force<S>) -> S {
        match self {
            JointKind::Revolute { axis } => f.angular.along(axis),
            JointKind::Prismatic { axis } => f.linear.along(axis),
            JointKind::Floating => f.to_array()[k],
        }
    }
    /// True for a sliding joint, whose coordinate is in m and whose torque is in N.
    pub fn slides(self) -> bool {
        matches!(self, JointKind::Prismatic { .. })
    }
}

/// What the URDF says of a joint's range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest position, rad (m).
    pub lower: f64,
    /// Largest position, rad (m).
    pub upper: f64,
    /// Largest speed, rad/s (m/s).
    pub velocity: f64,
    /// Largest torque, N·m (N).
    pub effort: f64,
}

impl Limits {
    /// No limit at all.
    pub const NONE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        effort: f64::INFINITY,
    };
}

/// A joint that follows another: q = multiplier · q_leader + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// The joint that leads.
    pub leader: JointId,
    /// Ratio of the rates.
    pub multiplier: f64,
    /// Position at the leader's zero, rad (m).
    pub offset: f64,
}

/// A movable joint and the body it carries.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name in the URDF.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// The joint whose body it stands on; none for the world.
    pub parent: Option<JointId>,
    /// The joint's frame at zero position, in the parent body's frame.
    pub placement: Pose<f64>,
    /// The moving body, fixed links merged, in the child frame.
    pub inertia: Inertia<f64>,
    /// Its range.
    pub limits: Limits,
    /// The joint it follows, if any; it then has no coordinate of its own.
    pub mimic: Option<Mimic>,
    /// Where its position starts in q.
    pub first_q: usize,
    /// Where its velocity starts in q̇.
    pub first_dof: usize,
}

impl Joint {
    /// dq/dq_leader: one except for mimic joints.
    #[inline(always)]
    pub fn multiplier(&self) -> f64 {
        self.mimic.map_or(1.0, |m| m.multiplier)
    }

    /// The coordinate of a joint with one: its own, or the one its leader gives.
    #[inline(always)]
    pub fn coordinate<S: Scalar>(&self, q: &[S]) -> S {
        match self.mimic {
            None => q[self.first_q],
            Some(m) => q[self.first_q] * m.multiplier + m.offset,
        }
    }

    /// `parent_from_child` at position `q` (all of the robot's q).
    #[inline(always)]
    pub fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        let placement = Pose::constant(&self.placement);
        let moved = match self.kind {
            JointKind::Revolute { axis } => {
                let turn = Matrix3::rotation(axis, self.coordinate(q));
                return Pose::new(placement.rotation * turn, placement.translation);
            }
            JointKind::Prismatic { axis } => {
                let shift = Vector3::constant(axis) * self.coordinate(q);
                return Pose::new(placement.rotation, placement.transform_point(shift));
            }
            JointKind::Floating => {
                let p = &q[self.first_q..self.first_q + 7];
                let turn = Matrix3::from_quaternion(p[3], p[4], p[5], p[6]);
                Pose::new(turn, Vector3::new(p[0], p[1], p[2]))
            }
        };
        placement * moved
    }

    /// The joint's axis as a motion in the child frame, for joints with one degree of freedom.
    ///
    /// # Panics
    /// For a floating joint.
    #[inline(always)]
    pub fn axis<S: Scalar>(&self) -> Motion<S> {
        match self.kind {
            JointKind::Revolute { axis } => Motion::new(Vector3::constant(axis), Vector3::ZERO),
            JointKind::Prismatic { axis } => Motion::new(Vector3::ZERO, Vector3::constant(axis)),
            JointKind::Floating => panic!("joint \"{}\": a floating joint has six axes", self.name),
        }
    }
}
