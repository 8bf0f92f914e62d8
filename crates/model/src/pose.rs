//! The pose of one frame in another, and what it does to motions, forces and inertias.

use core::ops::Mul;

use crate::{Force, Inertia, Matrix3, Motion, Scalar, Vector3};

/// Where a child frame is in its parent: `parent_from_child`.
///
/// `rotation` turns components in child axes into components in parent axes; `translation` is the child's origin
/// in the parent. Poses compose right to left: `a_from_c = a_from_b * b_from_c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose<S> {
    /// Columns are the child's axes in the parent's.
    pub rotation: Matrix3<S>,
    /// The child's origin in the parent, m.
    pub translation: Vector3<S>,
}

impl<S: Scalar> Pose<S> {
    /// Both frames coincide.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::ZERO }
    }
    /// The pose with this rotation and translation.
    #[inline(always)]
    pub fn new(rotation: Matrix3<S>, translation: Vector3<S>) -> Self {
        Self { rotation, translation }
    }
    /// The same pose in a richer kind of number.
    #[inline(always)]
    pub fn constant(p: &Pose<f64>) -> Self {
        Self::new(Matrix3::constant(&p.rotation), Vector3::constant(p.translation))
    }
    /// The same pose for each number of a group.
    #[inline(always)]
    pub fn repeated(&self) -> Pose<S::Group> {
        let [a, b, c] = self.rotation.rows;
        let rows = [a.repeated(), b.repeated(), c.repeated()];
        Pose::new(Matrix3 { rows }, self.translation.repeated())
    }
    /// `child_from_parent`.
    pub fn inverse(&self) -> Self {
        let r = self.rotation.transpose();
        Self::new(r, -(r * self.translation))
    }
    /// A point given in the child, in the parent.
    #[inline(always)]
    pub fn transform_point(&self, p: Vector3<S>) -> Vector3<S> {
        self.rotation * p + self.translation
    }
    /// A motion given in the parent, in the child.
    ///
    /// ```text
    /// ω' = Rᵀ ω,   v' = Rᵀ (v + ω × p)
    /// ```
    #[inline(always)]
    pub fn motion_to_child(&self, m: Motion<S>) -> Motion<S> {
        Motion::new(
            self.rotation.transpose_mul(m.angular),
            self.rotation.transpose_mul(m.linear + m.angular.cross(self.translation)),
        )
    }
    /// A motion given in the child, in the parent.
    #[inline(always)]
    pub fn motion_to_parent(&self, m: Motion<S>) -> Motion<S> {
        let angular = self.rotation * m.angular;
        Motion::new(angular, self.rotation * m.linear - angular.cross(self.translation))
    }
    /// A force given in the child, in the parent.
    ///
    /// ```text
    /// f = R f',   n = R n' + p × f
    /// ```
    #[inline(always)]
    pub fn force_to_parent(&self, f: Force<S>) -> Force<S> {
        let linear = self.rotation * f.linear;
        Force::new(self.rotation * f.angular + self.translation.cross(linear), linear)
    }
    /// A force given in the parent, in the child.
    #[inline(always)]
    pub fn force_to_child(&self, f: Force<S>) -> Force<S> {
        Force::new(
            self.rotation.transpose_mul(f.angular - self.translation.cross(f.linear)),
            self.rotation.transpose_mul(f.linear),
        )
    }
    /// An inertia given in the child, in the parent.
    #[inline(always)]
    pub fn inertia_to_parent(&self, i: &Inertia<S>) -> Inertia<S> {
        i.rotated(&self.rotation).shifted(self.translation)
    }
}

impl Pose<f64> {
    /// A pose from a translation and URDF's fixed-axis roll, pitch, yaw in rad: R = R_z(yaw) R_y(pitch) R_x(roll).
    pub fn from_xyz_rpy(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        let axis = |x, y, z| Vector3 { x, y, z };
        let r = Matrix3::rotation(axis(0.0, 0.0, 1.0), rpy[2])
            * Matrix3::rotation(axis(0.0, 1.0, 0.0), rpy[1])
            * Matrix3::rotation(axis(1.0, 0.0, 0.0), rpy[0]);
        Self::new(r, xyz.into())
    }
}

impl<S: Scalar> Mul for Pose<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::new(self.rotation * o.rotation, self.transform_point(o.translation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_pose() -> Pose<f64> {
        Pose::from_xyz_rpy([0.3, -0.2, 0.5], [0.4, -1.1, 2.0])
    }

    #[test]
    fn force_and_motion_keep_their_power_in_every_frame() {
        let v = Motion::new([0.1, 0.7, -0.3].into(), [1.0, -2.0, 0.4].into());
        let f = Force::new([3.0, -1.0, 0.2].into(), [0.5, 0.6, -7.0].into());
        let pose = some_pose();
        let in_child = pose.force_to_child(f).dot(pose.motion_to_child(v));
        assert!((in_child - f.dot(v)).abs() < 1e-12);
        assert!((pose.force_to_parent(pose.force_to_child(f)) - f).dot(v).abs() < 1e-12);
        assert!(f.dot(pose.motion_to_parent(pose.motion_to_child(v)) - v).abs() < 1e-12);
    }

    #[test]
    fn a_pose_and_its_inverse_cancel() {
        let p = some_pose() * some_pose().inverse();
        assert!(p.translation.norm() < 1e-15);
        assert!((p.rotation.rows[0].x - 1.0).abs() < 1e-15);
    }

    #[test]
    fn kinetic_energy_is_the_same_in_every_frame() {
        let i = Inertia::at_centre_of_mass(2.0, [0.1, 0.2, -0.3].into(), [0.3, 0.2, 0.4, 0.01, 0.02, -0.03]);
        let pose = some_pose();
        let v = Motion::new([0.1, 0.7, -0.3].into(), [1.0, -2.0, 0.4].into());
        let there = pose.motion_to_child(v);
        let here = pose.inertia_to_parent(&i);
        assert!((here.times(v).dot(v) - i.times(there).dot(there)).abs() < 1e-12);
    }
}
