//! Spatial vectors: motions and forces, `[angular; linear]`.

use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use crate::{Scalar, Vector3};

/// A velocity or acceleration of a body, seen at a frame's origin in its axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion<S> {
    /// Angular part, rad/s (rad/s²).
    pub angular: Vector3<S>,
    /// Linear part, m/s (m/s²).
    pub linear: Vector3<S>,
}

/// A force on a body: its moment about a frame's origin and its resultant, in its axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Force<S> {
    /// Moment, N·m.
    pub angular: Vector3<S>,
    /// Resultant, N.
    pub linear: Vector3<S>,
}

impl<S: Scalar> Motion<S> {
    /// No motion.
    pub const ZERO: Self = Self { angular: Vector3::ZERO, linear: Vector3::ZERO };

    /// The motion `[angular; linear]`.
    #[inline(always)]
    pub fn new(angular: Vector3<S>, linear: Vector3<S>) -> Self {
        Self { angular, linear }
    }
    /// Turns a `[linear; angular]` array round.
    #[inline(always)]
    pub fn from_linear_angular([a, b, c, d, e, f]: [S; 6]) -> Self {
        Self::new(Vector3::new(d, e, f), Vector3::new(a, b, c))
    }
    /// v × w, the rate of a motion carried along with v.
    ///
    /// ```text
    /// [ω × w_ω; ω × w_v + v × w_ω]
    /// ```
    #[inline(always)]
    pub fn cross_motion(self, w: Self) -> Self {
        Self::new(self.angular.cross(w.angular), self.angular.cross(w.linear) + self.linear.cross(w.angular))
    }
    /// v ×* f, the rate of a force carried along with v.
    ///
    /// ```text
    /// [ω × n + v × f; ω × f]
    /// ```
    #[inline(always)]
    pub fn cross_force(self, f: Force<S>) -> Force<S> {
        Force::new(self.angular.cross(f.angular) + self.linear.cross(f.linear), self.angular.cross(f.linear))
    }
    /// The six components, `[angular; linear]`.
    #[inline(always)]
    pub fn to_array(self) -> [S; 6] {
        let (a, l) = (self.angular, self.linear);
        [a.x, a.y, a.z, l.x, l.y, l.z]
    }
}

impl<S: Scalar> Force<S> {
    /// No force.
    pub const ZERO: Self = Self { angular: Vector3::ZERO, linear: Vector3::ZERO };

    /// The force `[moment; resultant]`.
    #[inline(always)]
    pub fn new(angular: Vector3<S>, linear: Vector3<S>) -> Self {
        Self { angular, linear }
    }
    /// Turns a `[force; moment]` array round.
    #[inline(always)]
    pub fn from_linear_angular([a, b, c, d, e, f]: [S; 6]) -> Self {
        Self::new(Vector3::new(d, e, f), Vector3::new(a, b, c))
    }
    /// The power n·ω + f·v, W.
    #[inline(always)]
    pub fn dot(self, v: Motion<S>) -> S {
        self.angular.dot(v.angular) + self.linear.dot(v.linear)
    }
    /// The six components, `[moment; resultant]`.
    #[inline(always)]
    pub fn to_array(self) -> [S; 6] {
        let (a, l) = (self.angular, self.linear);
        [a.x, a.y, a.z, l.x, l.y, l.z]
    }
}

macro_rules! linear_space {
    ($type:ident) => {
        impl<S: Scalar> Add for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                Self::new(self.angular + o.angular, self.linear + o.linear)
            }
        }
        impl<S: Scalar> Sub for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                Self::new(self.angular - o.angular, self.linear - o.linear)
            }
        }
        impl<S: Scalar> Neg for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self::new(-self.angular, -self.linear)
            }
        }
        impl<S: Scalar> Mul<S> for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, k: S) -> Self {
                Self::new(self.angular * k, self.linear * k)
            }
        }
        impl<S: Scalar> AddAssign for $type<S> {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl<S: Scalar> SubAssign for $type<S> {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o;
            }
        }
    };
}
linear_space!(Motion);
linear_space!(Force);
