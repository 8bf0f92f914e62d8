//! Lanes: N numbers at once, for SIMD registers.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::scalar::group_of_one;
use crate::scalar::sealed::Sealed;
use crate::{Scalar, elementary, math};

/// `N` numbers that go through the same operations side by side: one for each configuration of a batch.
///
/// Operators are inlined loops over `[f64; N]`; inside a function compiled for AVX2 or AVX-512 they become
/// full-width instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Lanes<N> {
    /// True if every lane answers yes.
    #[inline(always)]
    pub(crate) fn all(self, f: impl Fn(f64) -> bool) -> bool {
        // no early exit: one test of all lanes
        let mut all = true;
        for x in self.0 {
            all &= f(x);
        }
        all
    }

    /// Each lane through `f`.
    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self.0;
        for x in &mut out {
            *x = f(*x);
        }
        Self(out)
    }

    /// Each pair of lanes through `f`.
    #[inline(always)]
    pub(crate) fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self.0;
        for k in 0..N {
            out[k] = f(out[k], other.0[k]);
        }
        Self(out)
    }
}

impl<const N: usize> Default for Lanes<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Sealed for Lanes<N> {}

impl<const N: usize> Scalar for Lanes<N> {
    group_of_one!();

    const ZERO: Self = Self([0.0; N]);
    const ONE: Self = Self([1.0; N]);
    type Mask = [bool; N];

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.0[0]
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(math::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        elementary::tanh(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> [bool; N] {
        let mut mask = [false; N];
        for k in 0..N {
            mask[k] = self.0[k] < other.0[k];
        }
        mask
    }
    #[inline(always)]
    fn select(mask: [bool; N], a: Self, b: Self) -> Self {
        let mut out = b.0;
        for k in 0..N {
            if mask[k] {
                out[k] = a.0[k];
            }
        }
        Self(out)
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
        impl<const N: usize> $trait<f64> for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                self.map(|a| a $op other)
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl<const N: usize> MulAssign for Lanes<N> {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lane_takes_its_own_side_of_a_comparison() {
        let x = Lanes([-1.0, 2.0]);
        assert_eq!(Lanes::select(x.lt(Lanes::ZERO), -x, x), Lanes([1.0, 2.0]));
    }
}
