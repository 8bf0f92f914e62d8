//! The kinds of number over which every algorithm and every law is written once.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::{Lanes, elementary, math};

/// The most angles whose sines any kind of number takes at a time.
pub(crate) const MOST_SINES: usize = 8;

pub(crate) mod sealed {
    /// Keeps [`super::Scalar`] closed: its kinds are part of the design, not an extension point.
    pub trait Sealed {}
    impl Sealed for f64 {}
}

/// A real number of one of the workspace's kinds: `f64`, [`Lanes`](crate::Lanes), [`Dual`](crate::Dual) or
/// [`Taylor`](crate::Taylor).
///
/// Laws have no branch on a number: they compare with [`Scalar::lt`] and choose with [`Scalar::select`], so that
/// the lanes of one evaluation may take different sides.
///
/// # Example
/// The derivative of x² at 3 is 6, from the law alone:
/// ```
/// use sinew_model::{Dual, Scalar};
/// fn square<S: Scalar>(x: S) -> S { x * x }
/// assert_eq!(square(3.0), 9.0);
/// assert_eq!(square(Dual::<1>::variable(3.0, 0)).derivative[0], 6.0);
/// ```
pub trait Scalar:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The result of a comparison, one truth value for each lane.
    type Mask: Copy;

    /// Numbers that go side by side within one configuration: what the inner loops over columns take at a time.
    type Group: Scalar;
    /// How many numbers a group holds.
    const GROUP: usize;
    /// True if the motion of a body fits into registers from one step of a recursion to the next.
    const FITS_REGISTERS: bool;

    /// The group of up to [`Scalar::GROUP`] numbers; the rest is zero.
    fn group(numbers: &[Self]) -> Self::Group;
    /// A group of equal numbers.
    fn repeated(self) -> Self::Group;
    /// Writes the first numbers of a group.
    fn ungroup(group: Self::Group, numbers: &mut [Self]);

    /// How many angles [`Scalar::sines_and_cosines`] takes at a time.
    #[doc(hidden)]
    const SINES: usize = 1;
    /// Sines and cosines of the first angles, as many as there is room for.
    #[doc(hidden)]
    #[inline(always)]
    fn sines_and_cosines(x: &[Self; MOST_SINES], sine: &mut [Self], cosine: &mut [Self]) {
        for ((s, c), x) in sine.iter_mut().zip(cosine).zip(x) {
            (*s, *c) = x.sin_cos();
        }
    }

    /// The number `x`, the same in every lane and without derivatives.
    fn constant(x: f64) -> Self;
    /// The plain value: the number itself, the value part, or that of the first lane.
    fn value(self) -> f64;
    /// Sine and cosine of an angle in rad.
    fn sin_cos(self) -> (Self, Self);
    /// √x.
    fn sqrt(self) -> Self;
    /// eˣ.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// |x|, with derivative sgn x and 0 at 0.
    fn abs(self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `a` where the mask holds, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;

    /// Sine of an angle in rad.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine of an angle in rad.
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// 1/x.
    #[inline(always)]
    fn recip(self) -> Self {
        Self::ONE / self
    }
    /// The larger of the two.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }
    /// The smaller of the two.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
}

/// A kind of number whose groups are single numbers.
macro_rules! group_of_one {
    () => {
        type Group = Self;
        const GROUP: usize = 1;
        const FITS_REGISTERS: bool = false;

        #[inline(always)]
        fn group(numbers: &[Self]) -> Self {
            numbers[0]
        }
        #[inline(always)]
        fn repeated(self) -> Self {
            self
        }
        #[inline(always)]
        fn ungroup(group: Self, numbers: &mut [Self]) {
            numbers[0] = group;
        }
    };
}
pub(crate) use group_of_one;

impl Scalar for f64 {
    const SINES: usize = MOST_SINES;

    #[inline(always)]
    fn sines_and_cosines(x: &[f64; MOST_SINES], sine: &mut [f64], cosine: &mut [f64]) {
        let (s, c) = elementary::sin_cos(Lanes(*x));
        sine.copy_from_slice(&s.0);
        cosine.copy_from_slice(&c.0);
    }

    type Group = Lanes<4>;
    const GROUP: usize = 4;
    const FITS_REGISTERS: bool = true;

    #[inline(always)]
    fn group(numbers: &[f64]) -> Lanes<4> {
        match *numbers {
            [a, b, c, d, ..] => Lanes([a, b, c, d]),
            [a, b, c] => Lanes([a, b, c, 0.0]),
            [a, b] => Lanes([a, b, 0.0, 0.0]),
            [a] => Lanes([a, 0.0, 0.0, 0.0]),
            [] => Lanes::ZERO,
        }
    }
    #[inline(always)]
    fn repeated(self) -> Lanes<4> {
        Lanes([self; 4])
    }
    #[inline(always)]
    fn ungroup(group: Lanes<4>, numbers: &mut [f64]) {
        let [a, b, c, d] = group.0;
        match numbers {
            [w, x, y, z, ..] => (*w, *x, *y, *z) = (a, b, c, d),
            [w, x, y] => (*w, *x, *y) = (a, b, c),
            [w, x] => (*w, *x) = (a, b),
            [w] => *w = a,
            [] => {}
        }
    }

    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    type Mask = bool;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (math::sin(self), math::cos(self))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        math::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        math::exp(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        math::tanh(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        math::ln(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}
