//! The articulated-body inertia: what a subtree that may move feels like at its root.

use crate::{Force, Inertia, Matrix3, Motion, Pose, Scalar, Symmetric3, Vector3};

/// A symmetric 6×6 inertia in blocks, 21 numbers.
///
/// ```text
/// [n; f] = [A H; Hᵀ M] [ω; v]
/// ```
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, chapter 7.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ArticulatedInertia<S> {
    /// A: moment by angular acceleration.
    pub angular: Symmetric3<S>,
    /// H: moment by linear acceleration.
    pub mixed: Matrix3<S>,
    /// M: force by linear acceleration.
    pub linear: Symmetric3<S>,
}

impl<S: Scalar> ArticulatedInertia<S> {
    /// The inertia of one rigid body.
    #[inline(always)]
    pub fn rigid(i: &Inertia<S>) -> Self {
        let m = i.mass;
        Self {
            angular: i.second_moment,
            mixed: Matrix3::skew(i.first_moment),
            linear: Symmetric3 { xx: m, yy: m, zz: m, ..Symmetric3::default() },
        }
    }
    /// The force that the acceleration `a` takes.
    #[inline(always)]
    pub fn times(&self, a: Motion<S>) -> Force<S> {
        Force::new(
            self.angular * a.angular + self.mixed * a.linear,
            self.mixed.transpose_mul(a.angular) + self.linear * a.linear,
        )
    }
    /// I − u uᵀ d⁻¹: takes out the direction in which a joint gives way.
    #[inline(always)]
    pub fn without(&self, u: Force<S>, d_inverse: S) -> Self {
        let (a, l) = (u.angular * d_inverse, u.linear * d_inverse);
        let outer = |x: Vector3<S>, y: Vector3<S>| Symmetric3 {
            xx: x.x * y.x,
            yy: x.y * y.y,
            zz: x.z * y.z,
            xy: x.x * y.y,
            xz: x.x * y.z,
            yz: x.y * y.z,
        };
        let minus = S::constant(-1.0);
        let mixed = Matrix3 { rows: [u.linear * a.x, u.linear * a.y, u.linear * a.z] };
        Self {
            angular: self.angular + outer(a, u.angular).scaled(minus),
            mixed: self.mixed - mixed,
            linear: self.linear + outer(l, u.linear).scaled(minus),
        }
    }
    /// An articulated inertia given in the child of `pose`, in its parent.
    ///
    /// ```text
    /// M' = R M Rᵀ,   H' = R H Rᵀ + [p]× M',   A' = R A Rᵀ − R H Rᵀ [p]× + [p]× H'ᵀ
    /// ```
    #[inline(always)]
    pub fn to_parent(&self, pose: &Pose<S>) -> Self {
        let r = &pose.rotation;
        let p = pose.translation;
        let linear = self.linear.rotated(r);
        let turned = *r * self.mixed * r.transpose();
        let mixed = turned + linear.to_matrix().crossed_by(p);
        // R H Rᵀ [p]× = −([p]× R Hᵀ Rᵀ)ᵀ, and only symmetric parts count
        let shift = (mixed + turned).transpose().crossed_by(p);
        Self { angular: self.angular.rotated(r) + Symmetric3::part_of(&shift), mixed, linear }
    }
    /// The sum of two.
    #[inline(always)]
    pub fn plus(&self, o: &Self) -> Self {
        Self {
            angular: self.angular + o.angular,
            mixed: self.mixed + o.mixed,
            linear: self.linear + o.linear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_body_moves_to_the_parent_like_its_ten_numbers() {
        let i = Inertia::at_centre_of_mass(2.0, [0.1, 0.2, -0.3].into(), [0.3, 0.2, 0.4, 0.01, 0.02, -0.03]);
        let pose = Pose::from_xyz_rpy([0.3, -0.2, 0.5], [0.4, -1.1, 2.0]);
        let a = Motion::new([0.1, 0.7, -0.3].into(), [1.0, -2.0, 0.4].into());
        let by_blocks = ArticulatedInertia::rigid(&i).to_parent(&pose).times(a);
        let by_numbers = pose.inertia_to_parent(&i).times(a);
        let difference = by_blocks - by_numbers;
        assert!(difference.angular.norm() < 1e-12 && difference.linear.norm() < 1e-12);
    }
}
