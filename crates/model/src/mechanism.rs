//! A model as the recursions want it: one record a joint, every axis along z.

use alloc::vec;
use alloc::vec::Vec;

use crate::scalar::MOST_SINES;
use crate::{Inertia, Joint, JointKind, Matrix3, Model, Motion, Pose, Scalar, Symmetric3, Vector3};

/// How a segment moves against its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SegmentKind {
    /// Turns about its z axis.
    Turning,
    /// Slides along its z axis.
    Sliding,
    /// Moves freely.
    Free,
}

/// A movable joint and its body in a frame whose z axis is the joint's.
///
/// The frame has the link's origin. Its rate along or about z is `ratio` times that of its degree of freedom: a mimic
/// joint's multiplier, with the other sign for an axis that points backwards.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// How it moves.
    pub kind: SegmentKind,
    /// 0 for the world, k + 1 for segment k: its place in tables whose first row is the world's.
    pub parent: usize,
    /// Where its position starts in q.
    pub first_q: usize,
    /// Where its velocity starts in q̇.
    pub first_dof: usize,
    /// Where it starts in a table of all axes of all joints, mimic joints included.
    pub first_axis: usize,
    /// Rate about z by rate of the degree of freedom.
    pub ratio: f64,
    /// Coordinate where the degree of freedom is at zero.
    pub offset: f64,
    /// The segment's frame at zero coordinate in its parent's.
    pub placement: Pose<f64>,
    axes: FrameAxes,
}

/// How the axes of a segment's frame stand in the link's.
#[derive(Debug, Clone, Copy, PartialEq)]
enum FrameAxes {
    /// The same.
    Link,
    /// x, y, z are the link's y, z, x.
    AlongX,
    /// x, y, z are the link's z, x, y.
    AlongY,
    /// link_from_segment.
    Turned(Matrix3<f64>),
}

/// A model's joints as segments, in the same order.
///
/// Frames along the joints' axes make a turn cost one sine, one cosine and the rotation of two columns, and an axis's
/// torque a component of a moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    segments: Vec<Segment>,
    // Where each coordinate is in q, its ratio and offset; filled up to whole groups.
    reads: Vec<(usize, f64, f64)>,
    nq: usize,
    nv: usize,
    axes: usize,
    mimic: bool,
}

/// Room for the coordinates of a mechanism's segments with their sines and cosines.
#[derive(Debug, Clone)]
pub struct Coordinates<S> {
    x: Vec<S>,
    sine: Vec<S>,
    cosine: Vec<S>,
}

impl<S: Scalar> Coordinates<S> {
    /// Room for the segments of this mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let n = mechanism.reads.len();
        Self { x: vec![S::ZERO; n], sine: vec![S::ZERO; n], cosine: vec![S::ONE; n] }
    }
}

impl Mechanism {
    /// The mechanism of a model.
    pub fn new(model: &Model) -> Self {
        let mut segments: Vec<Segment> = Vec::with_capacity(model.joints.len());
        let mut axes = 0;
        for joint in &model.joints {
            let parent = joint.parent.map(|p| segments[p.0].axes);
            segments.push(Segment::new(joint, parent.unwrap_or(FrameAxes::Link), axes));
            axes += joint.kind.nv();
        }
        let mut reads: Vec<_> = segments.iter().map(|s| (s.first_q, s.ratio, s.offset)).collect();
        reads.resize(segments.len().next_multiple_of(MOST_SINES), (0, 0.0, 0.0));
        Self { segments, reads, nq: model.nq, nv: model.nv, axes, mimic: model.has_mimic() }
    }

    /// One record a joint, parents first.
    #[inline(always)]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }
    /// Numbers in a position.
    #[inline(always)]
    pub fn nq(&self) -> usize {
        self.nq
    }
    /// Degrees of freedom.
    #[inline(always)]
    pub fn nv(&self) -> usize {
        self.nv
    }
    /// Axes of all joints: nv and those of mimic joints.
    #[inline(always)]
    pub fn axes(&self) -> usize {
        self.axes
    }
    /// True if some joints share a degree of freedom.
    #[inline(always)]
    pub fn has_mimic(&self) -> bool {
        self.mimic
    }

    /// Asserts that this is the mechanism of `model`: its size always, all of it in builds with debug assertions.
    ///
    /// # Panics
    /// If it is not.
    #[inline(always)]
    pub fn check(&self, model: &Model) {
        let own = (self.segments.len(), self.nq, self.nv);
        assert_eq!(own, (model.joints.len(), model.nq, model.nv), "workspace of another model");
        debug_assert!(self.is_of(model), "workspace of another model");
    }

    fn is_of(&self, model: &Model) -> bool {
        self.segments.iter().zip(&model.joints).all(|(segment, joint)| {
            let parent = joint.parent.map_or(FrameAxes::Link, |p| self.segments[p.0].axes);
            *segment == Segment::new(joint, parent, segment.first_axis)
        })
    }

    /// Reads the coordinates of all segments from `q`, and takes their sines and cosines side by side.
    ///
    /// # Panics
    /// If `q` has not nq numbers.
    #[inline(always)]
    pub fn read<S: Scalar>(&self, q: &[S], at: &mut Coordinates<S>) {
        assert_eq!(q.len(), self.nq, "q");
        let count = self.segments.len().next_multiple_of(S::SINES);
        let sines = at.sine.chunks_exact_mut(S::SINES).zip(at.cosine.chunks_exact_mut(S::SINES));
        let sines = sines.zip(at.x.chunks_exact_mut(S::SINES));
        for (((sine, cosine), x), reads) in sines.zip(self.reads[..count].chunks_exact(S::SINES)) {
            // from registers: what was just written singly is slow to read in groups
            let mut own = [S::ZERO; MOST_SINES];
            for (own, &(place, ratio, offset)) in own.iter_mut().zip(reads) {
                *own = q[place] * ratio + offset;
            }
            x.copy_from_slice(&own[..S::SINES]);
            S::sines_and_cosines(&own, sine, cosine);
        }
    }

    /// The pose of segment `k` in its parent, once its coordinates are read from `q`.
    #[inline(always)]
    pub fn pose<S: Scalar>(&self, k: usize, q: &[S], at: &Coordinates<S>) -> Pose<S> {
        self.segments[k].pose(q, at.x[k], at.sine[k], at.cosine[k])
    }

    /// Poses of all segments in the world, row k + 1 for segment k; row 0, the world itself, must be the identity.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn world_poses<S: Scalar>(&self, q: &[S], at: &mut Coordinates<S>, world: &mut [Pose<S>]) {
        self.read(q, at);
        let rows = self.segments.len() + 1;
        assert_eq!(world.len(), rows, "world");
        let mut last = Pose::identity();
        for (k, segment) in self.segments.iter().enumerate() {
            let pose = segment.pose(q, at.x[k], at.sine[k], at.cosine[k]);
            // along a chain the parent is the body before, and stays in registers
            last = match segment.parent {
                0 => pose,
                parent if S::FITS_REGISTERS && parent == k => last * pose,
                parent => world[parent] * pose,
            };
            world[k + 1] = last;
        }
    }
}

impl Segment {
    fn new(joint: &Joint, parent: FrameAxes, first_axis: usize) -> Self {
        let (kind, axes, sign) = match joint.kind {
            JointKind::Revolute { axis } => {
                let (axes, sign) = FrameAxes::along(axis);
                (SegmentKind::Turning, axes, sign)
            }
            JointKind::Prismatic { axis } => {
                let (axes, sign) = FrameAxes::along(axis);
                (SegmentKind::Sliding, axes, sign)
            }
            JointKind::Floating => (SegmentKind::Free, FrameAxes::Link, 1.0),
        };
        let (multiplier, offset) = joint.mimic.map_or((1.0, 0.0), |m| (m.multiplier, m.offset));
        let parent_from_link = parent.matrix().transpose();
        let placement = Pose::new(
            parent_from_link * joint.placement.rotation * axes.matrix(),
            parent_from_link * joint.placement.translation,
        );
        Self {
            kind,
            parent: joint.parent.map_or(0, |p| p.0 + 1),
            first_q: joint.first_q,
            first_dof: joint.first_dof,
            first_axis,
            ratio: sign * multiplier,
            offset: sign * offset,
            placement,
            axes,
        }
    }

    /// Degrees of freedom of the joint.
    #[inline(always)]
    pub fn nv(&self) -> usize {
        if self.kind == SegmentKind::Free { 6 } else { 1 }
    }

    /// `parent_from_segment` at coordinate `x` with its sine and cosine; of a free segment at its place in `q`.
    #[inline(always)]
    pub fn pose<S: Scalar>(&self, q: &[S], x: S, sine: S, cosine: S) -> Pose<S> {
        let Pose { rotation, translation } = &self.placement;
        match self.kind {
            SegmentKind::Turning => {
                // R = P R_z(x): two columns turned
                let [a, b, c] = rotation.rows;
                let rows = [turned(a, sine, cosine), turned(b, sine, cosine), turned(c, sine, cosine)];
                Pose::new(Matrix3 { rows }, Vector3::constant(*translation))
            }
            SegmentKind::Sliding => {
                let [a, b, c] = rotation.rows;
                let p = translation;
                let shift = Vector3::new(x * a.z + p.x, x * b.z + p.y, x * c.z + p.z);
                Pose::new(Matrix3::constant(rotation), shift)
            }
            SegmentKind::Free => {
                let p = &q[self.first_q..self.first_q + 7];
                let turn = Matrix3::from_quaternion(p[3], p[4], p[5], p[6]);
                Pose::constant(&self.placement) * Pose::new(turn, Vector3::new(p[0], p[1], p[2]))
            }
        }
    }

    /// The motion `S x` of the segment against its parent that the rates `x` of the whole robot give.
    #[inline(always)]
    pub fn rate<S: Scalar>(&self, x: &[S]) -> Motion<S> {
        match self.kind {
            SegmentKind::Turning => {
                let z = x[self.first_dof] * self.ratio;
                Motion::new(Vector3::new(S::ZERO, S::ZERO, z), Vector3::ZERO)
            }
            SegmentKind::Sliding => {
                let z = x[self.first_dof] * self.ratio;
                Motion::new(Vector3::ZERO, Vector3::new(S::ZERO, S::ZERO, z))
            }
            SegmentKind::Free => {
                let x = &x[self.first_dof..self.first_dof + 6];
                Motion::new([x[0], x[1], x[2]].into(), [x[3], x[4], x[5]].into())
            }
        }
    }

    /// Axis `k` of a segment at the pose given, about the origin of the frame in which the pose is told.
    #[inline(always)]
    pub fn axis<S: Scalar>(&self, k: usize, pose: &Pose<S>) -> Motion<S> {
        let [a, b, c] = pose.rotation.rows;
        match self.kind {
            SegmentKind::Turning => {
                let z = Vector3::new(a.z, b.z, c.z) * S::constant(self.ratio);
                Motion::new(z, pose.translation.cross(z))
            }
            SegmentKind::Sliding => {
                Motion::new(Vector3::ZERO, Vector3::new(a.z, b.z, c.z) * S::constant(self.ratio))
            }
            SegmentKind::Free => {
                let column = match k % 3 {
                    0 => Vector3::new(a.x, b.x, c.x),
                    1 => Vector3::new(a.y, b.y, c.y),
                    _ => Vector3::new(a.z, b.z, c.z),
                };
                if k < 3 {
                    Motion::new(column, pose.translation.cross(column))
                } else {
                    Motion::new(Vector3::ZERO, column)
                }
            }
        }
    }

    /// A vector in the link's axes, in the segment's.
    #[inline(always)]
    pub fn vector_from_link<S: Scalar>(&self, v: Vector3<S>) -> Vector3<S> {
        match &self.axes {
            FrameAxes::Link => v,
            FrameAxes::AlongX => Vector3::new(v.y, v.z, v.x),
            FrameAxes::AlongY => Vector3::new(v.z, v.x, v.y),
            FrameAxes::Turned(link_from_segment) => {
                let [a, b, c] = link_from_segment.rows;
                Vector3::on_axis(a, v.x) + Vector3::on_axis(b, v.y) + Vector3::on_axis(c, v.z)
            }
        }
    }

    /// An inertia in the link's frame, in the segment's.
    #[inline(always)]
    pub fn inertia_from_link<S: Scalar>(&self, i: &Inertia<S>) -> Inertia<S> {
        let s = &i.second_moment;
        let second_moment = match &self.axes {
            FrameAxes::Link => *s,
            FrameAxes::AlongX => Symmetric3 { xx: s.yy, yy: s.zz, zz: s.xx, xy: s.yz, xz: s.xy, yz: s.xz },
            FrameAxes::AlongY => Symmetric3 { xx: s.zz, yy: s.xx, zz: s.yy, xy: s.xz, xz: s.yz, yz: s.xy },
            FrameAxes::Turned(turn) => s.rotated(&Matrix3::constant(&turn.transpose())),
        };
        Inertia { mass: i.mass, first_moment: self.vector_from_link(i.first_moment), second_moment }
    }

    /// The axes of the link, given those of the segment as columns.
    #[inline(always)]
    pub fn link_axes<S: Scalar>(&self, segment: &Matrix3<S>) -> Matrix3<S> {
        let [a, b, c] = segment.rows;
        let rows = match &self.axes {
            FrameAxes::Link => [a, b, c],
            FrameAxes::AlongX => [[a.z, a.x, a.y].into(), [b.z, b.x, b.y].into(), [c.z, c.x, c.y].into()],
            FrameAxes::AlongY => [[a.y, a.z, a.x].into(), [b.y, b.z, b.x].into(), [c.y, c.z, c.x].into()],
            FrameAxes::Turned(turn) => return *segment * Matrix3::constant(&turn.transpose()),
        };
        Matrix3 { rows }
    }

    /// The pose of the link's frame in the segment's: a turn only.
    pub fn segment_from_link(&self) -> Pose<f64> {
        Pose::new(self.axes.matrix().transpose(), Vector3::ZERO)
    }
}

// A row of P R_z(x).
#[inline(always)]
fn turned<S: Scalar>(r: Vector3<f64>, sine: S, cosine: S) -> Vector3<S> {
    Vector3::new(cosine * r.x + sine * r.y, cosine * r.y - sine * r.x, S::constant(r.z))
}

impl FrameAxes {
    // Axes whose z is the unit vector `axis` or, with sign −1, its opposite.
    fn along(axis: Vector3<f64>) -> (Self, f64) {
        match axis.to_array() {
            [0.0, 0.0, z] => (Self::Link, z),
            [x, 0.0, 0.0] => (Self::AlongX, x),
            [0.0, y, 0.0] => (Self::AlongY, y),
            _ => {
                let (x, y) = axis.normals();
                let columns = Matrix3 { rows: [x, y, axis] };
                (Self::Turned(columns.transpose()), 1.0)
            }
        }
    }

    // link_from_segment.
    fn matrix(&self) -> Matrix3<f64> {
        let rows = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| Matrix3 { rows: [a.into(), b.into(), c.into()] };
        match self {
            Self::Link => Matrix3::identity(),
            Self::AlongX => rows([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            Self::AlongY => rows([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
            Self::Turned(turn) => *turn,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{Random, random_tree};

    /// Rounding of products along twenty joints.
    const ALGEBRA: f64 = 1e-12;

    fn trees() -> impl Iterator<Item = Model> {
        (0..40).map(|seed| {
            let mut model = random_tree(1 + seed as usize % 20, seed);
            // axes along and against each direction too
            for (k, joint) in model.joints.iter_mut().enumerate() {
                let mut along = [0.0; 3];
                along[k % 3] = if k % 2 == 0 { 1.0 } else { -1.0 };
                match &mut joint.kind {
                    JointKind::Revolute { axis } | JointKind::Prismatic { axis } if seed % 2 == 0 => {
                        *axis = along.into();
                    }
                    _ => {}
                }
            }
            model
        })
    }

    #[test]
    fn segments_stand_where_the_links_do() {
        for (seed, model) in trees().enumerate() {
            let mechanism = Mechanism::new(&model);
            mechanism.check(&model);
            let q = Random::new(seed as u64).position(&model);
            let mut world = vec![Pose::identity(); model.joints.len() + 1];
            mechanism.world_poses(&q, &mut Coordinates::new(&mechanism), &mut world);
            let mut links = vec![Pose::identity(); model.joints.len() + 1];
            for (k, joint) in model.joints.iter().enumerate() {
                links[k + 1] = links[joint.parent.map_or(0, |p| p.0 + 1)] * joint.pose(&q);
                let segment = &mechanism.segments()[k];
                let got = world[k + 1] * segment.segment_from_link();
                let link_axes = segment.link_axes(&world[k + 1].rotation);
                for (a, b) in link_axes.rows.iter().zip(got.rotation.rows) {
                    assert!((*a - b).norm() < ALGEBRA);
                }
                assert!((got.translation - links[k + 1].translation).norm() < ALGEBRA);
                for (a, b) in got.rotation.rows.iter().zip(links[k + 1].rotation.rows) {
                    assert!((*a - b).norm() < ALGEBRA);
                }
                for axis in 0..segment.nv() {
                    let unit = joint.kind.motion(axis, joint.multiplier());
                    let difference = segment.axis(axis, &world[k + 1]) - links[k + 1].motion_to_parent(unit);
                    assert!(difference.angular.norm() + difference.linear.norm() < ALGEBRA);
                }
                let v = Motion::new([0.1, 0.7, -0.3].into(), [1.0, -2.0, 0.4].into());
                let pose = segment.segment_from_link();
                let here = segment.inertia_from_link(&joint.inertia);
                let there = pose.motion_to_child(v);
                let energy = joint.inertia.times(there).dot(there);
                assert!((here.times(v).dot(v) - energy).abs() < ALGEBRA);
            }
        }
    }

    #[test]
    #[should_panic(expected = "workspace of another model")]
    fn a_mechanism_knows_another_model() {
        Mechanism::new(&random_tree(5, 1)).check(&random_tree(6, 2));
    }
}
