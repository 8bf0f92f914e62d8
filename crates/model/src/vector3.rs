//! Three numbers: a direction, a position, a moment.

use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use crate::Scalar;

/// A vector in space, in the axes of some frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Vector3<S> {
    /// Component along x.
    pub x: S,
    /// Component along y.
    pub y: S,
    /// Component along z.
    pub z: S,
}

impl<S: Scalar> Vector3<S> {
    /// The null vector.
    pub const ZERO: Self = Self { x: S::ZERO, y: S::ZERO, z: S::ZERO };

    /// The vector (x, y, z).
    #[inline(always)]
    pub fn new(x: S, y: S, z: S) -> Self {
        Self { x, y, z }
    }
    /// The same vector in a richer kind of number.
    #[inline(always)]
    pub fn constant(v: Vector3<f64>) -> Self {
        Self::new(S::constant(v.x), S::constant(v.y), S::constant(v.z))
    }
    /// The same vector for each number of a group.
    #[inline(always)]
    pub fn repeated(self) -> Vector3<S::Group> {
        Vector3::new(self.x.repeated(), self.y.repeated(), self.z.repeated())
    }
    /// a · b.
    #[inline(always)]
    pub fn dot(self, o: Self) -> S {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// a × b.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }
    /// The component along a constant axis.
    #[inline(always)]
    pub fn along(self, axis: Vector3<f64>) -> S {
        self.x * axis.x + self.y * axis.y + self.z * axis.z
    }
    /// A constant axis times `k`.
    #[inline(always)]
    pub fn on_axis(axis: Vector3<f64>, k: S) -> Self {
        Self::new(k * axis.x, k * axis.y, k * axis.z)
    }
    /// |a|.
    #[inline(always)]
    pub fn norm(self) -> S {
        self.dot(self).sqrt()
    }
    /// The components in order.
    #[inline(always)]
    pub fn to_array(self) -> [S; 3] {
        [self.x, self.y, self.z]
    }
}

impl Vector3<f64> {
    /// Two unit vectors that make a right-handed frame with this one as the third.
    pub(crate) fn normals(self) -> (Self, Self) {
        let start = if self.x.abs() < 0.9 { Self::new(1.0, 0.0, 0.0) } else { Self::new(0.0, 1.0, 0.0) };
        let x = start - self * self.dot(start);
        let x = x * (1.0 / x.norm());
        (x, self.cross(x))
    }
}

impl<S> From<[S; 3]> for Vector3<S> {
    #[inline(always)]
    fn from([x, y, z]: [S; 3]) -> Self {
        Self { x, y, z }
    }
}

impl<S: Scalar> Add for Vector3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}
impl<S: Scalar> Sub for Vector3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}
impl<S: Scalar> Neg for Vector3<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
impl<S: Scalar> Mul<S> for Vector3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: S) -> Self {
        Self::new(self.x * k, self.y * k, self.z * k)
    }
}
impl<S: Scalar> AddAssign for Vector3<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<S: Scalar> SubAssign for Vector3<S> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
