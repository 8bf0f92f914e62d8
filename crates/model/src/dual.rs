//! Dual numbers: a value and its exact derivatives along N directions.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::scalar::group_of_one;
use crate::scalar::sealed::Sealed;
use crate::{Scalar, math};

/// A value and its derivatives along `N` directions, carried through every operation by the chain rule.
///
/// ```text
/// (a + a'ε)(b + b'ε) = ab + (a'b + ab')ε,   ε² = 0
/// ```
///
/// Source: Griewank & Walther, *Evaluating Derivatives*, 2nd ed., SIAM 2008, chapter 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// The derivatives along the `N` directions.
    pub derivative: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The variable of direction `direction` at `value`: derivative one along it, zero along the others.
    ///
    /// # Panics
    /// If `direction >= N`.
    #[inline(always)]
    pub fn variable(value: f64, direction: usize) -> Self {
        let mut derivative = [0.0; N];
        derivative[direction] = 1.0;
        Self { value, derivative }
    }

    // f(a + a'ε) = f(a) + f'(a) a'ε
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        let mut derivative = self.derivative;
        for d in &mut derivative {
            *d *= slope;
        }
        Self { value, derivative }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Sealed for Dual<N> {}

impl<const N: usize> Scalar for Dual<N> {
    group_of_one!();

    const ZERO: Self = Self { value: 0.0, derivative: [0.0; N] };
    const ONE: Self = Self { value: 1.0, derivative: [0.0; N] };
    type Mask = bool;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self { value: x, derivative: [0.0; N] }
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.value);
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let r = math::sqrt(self.value);
        self.chain(r, 0.5 / r)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let e = math::exp(self.value);
        self.chain(e, e)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let t = math::tanh(self.value);
        self.chain(t, 1.0 - t * t)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(math::ln(self.value), 1.0 / self.value)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let sign = if self.value > 0.0 {
            1.0
        } else if self.value < 0.0 {
            -1.0
        } else {
            0.0
        };
        self.chain(self.value.abs(), sign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.value < other.value
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    // (ab)' = a'b + ab'
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut derivative = [0.0; N];
        for k in 0..N {
            derivative[k] = self.derivative[k] * other.value + self.value * other.derivative[k];
        }
        Self { value: self.value * other.value, derivative }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    // (a/b)' = (a' − (a/b) b')/b
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value * inverse;
        let mut derivative = [0.0; N];
        for k in 0..N {
            derivative[k] = (self.derivative[k] - value * other.derivative[k]) * inverse;
        }
        Self { value, derivative }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: f64) -> Self {
        self.value += other;
        self
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: f64) -> Self {
        self.value -= other;
        self
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        self.chain(self.value / other, 1.0 / other)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        for k in 0..N {
            self.derivative[k] += other.derivative[k];
        }
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        self.value -= other.value;
        for k in 0..N {
            self.derivative[k] -= other.derivative[k];
        }
    }
}

impl<const N: usize> MulAssign for Dual<N> {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law<S: Scalar>(x: S, y: S) -> S {
        let (s, c) = (x * y).sin_cos();
        (s / (c + 2.0) + y.tanh() * x.exp() - (x * x + 1.0).sqrt()).abs() * (y + 3.0).ln()
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let (x, y, h) = (0.7, -0.4, 1e-6);
        let exact = law(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        let by_x = (law(x + h, y) - law(x - h, y)) / (2.0 * h);
        let by_y = (law(x, y + h) - law(x, y - h)) / (2.0 * h);
        assert_eq!(exact.value, law(x, y));
        assert!((exact.derivative[0] - by_x).abs() < 1e-9);
        assert!((exact.derivative[1] - by_y).abs() < 1e-9);
    }

    #[test]
    fn the_size_of_zero_has_no_slope() {
        assert_eq!(Dual::<1>::variable(0.0, 0).abs().derivative[0], 0.0);
    }
}
