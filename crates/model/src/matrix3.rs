//! 3×3 matrices, general and symmetric.

use core::ops::{Add, Mul, Sub};

use crate::{Scalar, Vector3};

/// A 3×3 matrix by rows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Matrix3<S> {
    /// The rows.
    pub rows: [Vector3<S>; 3],
}

impl<S: Scalar> Matrix3<S> {
    /// The identity.
    pub fn identity() -> Self {
        let (o, i) = (S::ZERO, S::ONE);
        Self { rows: [Vector3::new(i, o, o), Vector3::new(o, i, o), Vector3::new(o, o, i)] }
    }
    /// The same matrix in a richer kind of number.
    #[inline(always)]
    pub fn constant(m: &Matrix3<f64>) -> Self {
        let [a, b, c] = m.rows;
        Self { rows: [Vector3::constant(a), Vector3::constant(b), Vector3::constant(c)] }
    }
    /// `[v]×`, so that `[v]× w = v × w`.
    #[inline(always)]
    pub fn skew(v: Vector3<S>) -> Self {
        let o = S::ZERO;
        Self { rows: [Vector3::new(o, -v.z, v.y), Vector3::new(v.z, o, -v.x), Vector3::new(-v.y, v.x, o)] }
    }
    /// Rotation by `angle` rad about the unit vector `axis` (Rodrigues).
    ///
    /// ```text
    /// R = cos α 1 + sin α [a]× + (1 − cos α) a aᵀ
    /// ```
    #[inline(always)]
    pub fn rotation(axis: Vector3<f64>, angle: S) -> Self {
        let (s, c) = angle.sin_cos();
        let v = S::ONE - c;
        let (x, y, z) = (axis.x, axis.y, axis.z);
        Self {
            rows: [
                Vector3::new(c + v * (x * x), v * (x * y) - s * z, v * (x * z) + s * y),
                Vector3::new(v * (x * y) + s * z, c + v * (y * y), v * (y * z) - s * x),
                Vector3::new(v * (x * z) - s * y, v * (y * z) + s * x, c + v * (z * z)),
            ],
        }
    }
    /// `[v]× M`: every column crossed.
    #[inline(always)]
    pub fn crossed_by(&self, v: Vector3<S>) -> Self {
        let [a, b, c] = self.rows;
        Self { rows: [c * v.y - b * v.z, a * v.z - c * v.x, b * v.x - a * v.y] }
    }
    /// Rotation of the unit quaternion (x, y, z, w).
    #[inline(always)]
    pub fn from_quaternion(x: S, y: S, z: S, w: S) -> Self {
        let one = S::ONE;
        let two = |a: S| a + a;
        Self {
            rows: [
                Vector3::new(one - two(y * y + z * z), two(x * y - z * w), two(x * z + y * w)),
                Vector3::new(two(x * y + z * w), one - two(x * x + z * z), two(y * z - x * w)),
                Vector3::new(two(x * z - y * w), two(y * z + x * w), one - two(x * x + y * y)),
            ],
        }
    }
    /// Mᵀ.
    #[inline(always)]
    pub fn transpose(&self) -> Self {
        let [a, b, c] = self.rows;
        Self { rows: [Vector3::new(a.x, b.x, c.x), Vector3::new(a.y, b.y, c.y), Vector3::new(a.z, b.z, c.z)] }
    }
    /// Mᵀ v.
    #[inline(always)]
    pub fn transpose_mul(&self, v: Vector3<S>) -> Vector3<S> {
        self.rows[0] * v.x + self.rows[1] * v.y + self.rows[2] * v.z
    }
}

impl<S: Scalar> Mul<Vector3<S>> for Matrix3<S> {
    type Output = Vector3<S>;
    #[inline(always)]
    fn mul(self, v: Vector3<S>) -> Vector3<S> {
        Vector3::new(self.rows[0].dot(v), self.rows[1].dot(v), self.rows[2].dot(v))
    }
}
impl<S: Scalar> Mul for Matrix3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let [a, b, c] = self.rows;
        Self { rows: [o.transpose_mul(a), o.transpose_mul(b), o.transpose_mul(c)] }
    }
}
impl<S: Scalar> Add for Matrix3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { rows: [self.rows[0] + o.rows[0], self.rows[1] + o.rows[1], self.rows[2] + o.rows[2]] }
    }
}
impl<S: Scalar> Sub for Matrix3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { rows: [self.rows[0] - o.rows[0], self.rows[1] - o.rows[1], self.rows[2] - o.rows[2]] }
    }
}

/// A symmetric 3×3 matrix: six numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Symmetric3<S> {
    /// Element xx.
    pub xx: S,
    /// Element yy.
    pub yy: S,
    /// Element zz.
    pub zz: S,
    /// Elements xy and yx.
    pub xy: S,
    /// Elements xz and zx.
    pub xz: S,
    /// Elements yz and zy.
    pub yz: S,
}

impl<S: Scalar> Symmetric3<S> {
    /// The same matrix in a richer kind of number.
    #[inline(always)]
    pub fn constant(m: &Symmetric3<f64>) -> Self {
        let c = S::constant;
        Self { xx: c(m.xx), yy: c(m.yy), zz: c(m.zz), xy: c(m.xy), xz: c(m.xz), yz: c(m.yz) }
    }
    /// The symmetric part (M + Mᵀ)/2 of a general matrix.
    #[inline(always)]
    pub fn part_of(m: &Matrix3<S>) -> Self {
        let [a, b, c] = m.rows;
        Self {
            xx: a.x,
            yy: b.y,
            zz: c.z,
            xy: (a.y + b.x) * 0.5,
            xz: (a.z + c.x) * 0.5,
            yz: (b.z + c.y) * 0.5,
        }
    }
    /// As a general matrix.
    #[inline(always)]
    pub fn to_matrix(&self) -> Matrix3<S> {
        Matrix3 {
            rows: [
                Vector3::new(self.xx, self.xy, self.xz),
                Vector3::new(self.xy, self.yy, self.yz),
                Vector3::new(self.xz, self.yz, self.zz),
            ],
        }
    }
    /// R M Rᵀ.
    #[inline(always)]
    pub fn rotated(&self, r: &Matrix3<S>) -> Self {
        let rm = *r * self.to_matrix();
        let [a, b, c] = rm.rows;
        let [u, v, w] = r.rows;
        Self { xx: a.dot(u), yy: b.dot(v), zz: c.dot(w), xy: a.dot(v), xz: a.dot(w), yz: b.dot(w) }
    }
    /// 2(a·b) 1 − a bᵀ − b aᵀ, the shift term of an inertia.
    #[inline(always)]
    pub fn shift(a: Vector3<S>, b: Vector3<S>) -> Self {
        let (x, y, z) = (a.x * b.x, a.y * b.y, a.z * b.z);
        Self {
            xx: (y + z) * 2.0,
            yy: (x + z) * 2.0,
            zz: (x + y) * 2.0,
            xy: -(a.x * b.y + a.y * b.x),
            xz: -(a.x * b.z + a.z * b.x),
            yz: -(a.y * b.z + a.z * b.y),
        }
    }
    /// k M.
    #[inline(always)]
    pub fn scaled(&self, k: S) -> Self {
        Self {
            xx: self.xx * k,
            yy: self.yy * k,
            zz: self.zz * k,
            xy: self.xy * k,
            xz: self.xz * k,
            yz: self.yz * k,
        }
    }
}

impl<S: Scalar> Add for Symmetric3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            yy: self.yy + o.yy,
            zz: self.zz + o.zz,
            xy: self.xy + o.xy,
            xz: self.xz + o.xz,
            yz: self.yz + o.yz,
        }
    }
}
impl<S: Scalar> Mul<Vector3<S>> for Symmetric3<S> {
    type Output = Vector3<S>;
    #[inline(always)]
    fn mul(self, v: Vector3<S>) -> Vector3<S> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Random;

    #[test]
    fn crossing_every_column_is_the_product_with_the_skew_matrix() {
        let (M, v) = (Random::new(1).pose().rotation, Random::new(2).direction());
        assert_eq!(M.crossed_by(v), Matrix3::skew(v) * M);
    }
}
