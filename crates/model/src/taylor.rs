//! Taylor numbers: a quantity and its derivatives along one path, of any order.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::Scalar;
use crate::scalar::group_of_one;
use crate::scalar::sealed::Sealed;

/// A quantity along a path: the first `N` coefficients of its Taylor series, whatever kind of number they are.
///
/// ```text
/// x(t + ε) = x₀ + x₁ ε + … + x_{N−1} ε^{N−1},   x_k = x⁽ᵏ⁾/k!
/// ```
///
/// Coefficients depend on those of the same and of lower orders only. So what is not known of the highest ones does
/// not touch the rest.
///
/// # Example
/// Rates of a torque m g l sin q along q(t) = 3 t, from the law alone:
/// ```
/// use sinew_model::{Scalar, Taylor};
/// let q = Taylor::from_derivatives([0.0, 3.0, 0.0, 0.0]);
/// let torque = q.sin() * 2.0;
/// let rates: Vec<f64> = (0..4).map(|k| torque.derivative(k)).collect();
/// assert_eq!(rates, [0.0, 2.0 * 3.0, 0.0, -2.0 * 27.0]);
/// ```
/// Source: Griewank & Walther, *Evaluating Derivatives*, 2nd ed., SIAM 2008, chapter 13.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taylor<S, const N: usize> {
    /// x₀ … x_{N−1}.
    pub coefficients: [S; N],
}

impl<S: Scalar, const N: usize> Taylor<S, N> {
    /// The quantity with the derivatives x, ẋ, ẍ, … given.
    #[inline(always)]
    pub fn from_derivatives(derivatives: [S; N]) -> Self {
        let mut factorial = 1.0;
        Self::build(|k, _| {
            factorial *= if k == 0 { 1.0 } else { k as f64 };
            derivatives[k] / factorial
        })
    }

    /// The derivative of order `order`.
    ///
    /// # Panics
    /// If `order >= N`.
    #[inline(always)]
    pub fn derivative(&self, order: usize) -> S {
        (1..=order).fold(self.coefficients[order], |x, k| x * k as f64)
    }

    /// Its rate along the path; the last coefficient, which is not known, is zero.
    #[inline(always)]
    pub fn rate(&self) -> Self {
        Self::build(|k, _| if k + 1 < N { self.coefficients[k + 1] * (k + 1) as f64 } else { S::ZERO })
    }

    // Coefficient by coefficient, each from those before it.
    #[inline(always)]
    fn build(mut coefficient: impl FnMut(usize, &[S; N]) -> S) -> Self {
        let mut coefficients = [S::ZERO; N];
        for k in 0..N {
            coefficients[k] = coefficient(k, &coefficients);
        }
        Self { coefficients }
    }

    #[inline(always)]
    fn each(self, f: impl Fn(S) -> S) -> Self {
        Self { coefficients: self.coefficients.map(f) }
    }
}

// Σ_{i = first}^{k} weight(i) a_i b_{k−i}
#[inline(always)]
fn convolve<S: Scalar>(first: usize, k: usize, a: impl Fn(usize) -> S, b: impl Fn(usize) -> S) -> S {
    (first..=k).fold(S::ZERO, |sum, i| sum + a(i) * b(k - i))
}

impl<S: Scalar, const N: usize> Default for Taylor<S, N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<S: Scalar, const N: usize> Sealed for Taylor<S, N> {}

impl<S: Scalar, const N: usize> Scalar for Taylor<S, N> {
    group_of_one!();

    const ZERO: Self = Self { coefficients: [S::ZERO; N] };
    const ONE: Self = {
        let mut coefficients = [S::ZERO; N];
        coefficients[0] = S::ONE;
        Self { coefficients }
    };
    type Mask = S::Mask;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self::build(|k, _| if k == 0 { S::constant(x) } else { S::ZERO })
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.coefficients[0].value()
    }
    // s' = c x',   c' = −s x'
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let x = &self.coefficients;
        let (mut s, mut c) = ([S::ZERO; N], [S::ZERO; N]);
        (s[0], c[0]) = x[0].sin_cos();
        for k in 1..N {
            let slope = |i: usize| x[i] * (i as f64 / k as f64);
            (s[k], c[k]) = (convolve(1, k, slope, |j| c[j]), -convolve(1, k, slope, |j| s[j]));
        }
        (Self { coefficients: s }, Self { coefficients: c })
    }
    // r r = x
    #[inline(always)]
    fn sqrt(self) -> Self {
        let x = &self.coefficients;
        Self::build(|k, r| match k {
            0 => x[0].sqrt(),
            _ => (x[k] - convolve(1, k - 1, |i| r[i], |j| r[j + 1])) / (r[0] * 2.0),
        })
    }
    // e' = e x'
    #[inline(always)]
    fn exp(self) -> Self {
        let x = &self.coefficients;
        Self::build(|k, e| match k {
            0 => x[0].exp(),
            _ => convolve(1, k, |i| x[i] * (i as f64 / k as f64), |j| e[j]),
        })
    }
    // t' = (1 − t²) x'
    #[inline(always)]
    fn tanh(self) -> Self {
        let x = &self.coefficients;
        Self::build(|k, t| {
            let rest = |j: usize| {
                let square = convolve(0, j, |i| t[i], |i| t[i]);
                if j == 0 { S::ONE - square } else { -square }
            };
            match k {
                0 => x[0].tanh(),
                _ => convolve(1, k, |i| x[i] * (i as f64 / k as f64), rest),
            }
        })
    }
    // x l' = x'
    #[inline(always)]
    fn ln(self) -> Self {
        let x = &self.coefficients;
        Self::build(|k, l| match k {
            0 => x[0].ln(),
            _ => {
                let known = convolve(1, k - 1, |i| l[i] * (i as f64 / k as f64), |j| x[j + 1]);
                (x[k] - known) / x[0]
            }
        })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let (below, above) = (self.coefficients[0].lt(S::ZERO), S::ZERO.lt(self.coefficients[0]));
        let sign = S::select(below, S::constant(-1.0), S::select(above, S::ONE, S::ZERO));
        self.each(|x| x * sign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> S::Mask {
        self.coefficients[0].lt(other.coefficients[0])
    }
    #[inline(always)]
    fn select(mask: S::Mask, a: Self, b: Self) -> Self {
        Self::build(|k, _| S::select(mask, a.coefficients[k], b.coefficients[k]))
    }
}

impl<S: Scalar, const N: usize> Neg for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}

impl<S: Scalar, const N: usize> Add for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<S: Scalar, const N: usize> Sub for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<S: Scalar, const N: usize> Mul for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::build(|k, _| convolve(0, k, |i| self.coefficients[i], |j| other.coefficients[j]))
    }
}

impl<S: Scalar, const N: usize> Div for Taylor<S, N> {
    type Output = Self;
    // y (x/y) = x
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (x, y) = (&self.coefficients, &other.coefficients);
        Self::build(|k, r| match k {
            0 => x[0] / y[0],
            _ => (x[k] - convolve(0, k - 1, |i| r[i], |j| y[j + 1])) / y[0],
        })
    }
}

impl<S: Scalar, const N: usize> Add<f64> for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: f64) -> Self {
        self.coefficients[0] = self.coefficients[0] + other;
        self
    }
}

impl<S: Scalar, const N: usize> Sub<f64> for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        self + -other
    }
}

impl<S: Scalar, const N: usize> Mul<f64> for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.each(|x| x * other)
    }
}

impl<S: Scalar, const N: usize> Div<f64> for Taylor<S, N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        self.each(|x| x / other)
    }
}

impl<S: Scalar, const N: usize> AddAssign for Taylor<S, N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for k in 0..N {
            self.coefficients[k] += other.coefficients[k];
        }
    }
}

impl<S: Scalar, const N: usize> SubAssign for Taylor<S, N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        for k in 0..N {
            self.coefficients[k] -= other.coefficients[k];
        }
    }
}

impl<S: Scalar, const N: usize> MulAssign for Taylor<S, N> {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    // Every operation that a kind of number has.
    fn law<S: Scalar>(x: S) -> S {
        let (s, c) = (x * x * 0.3 + 0.2).sin_cos();
        let y = (s / (c + 2.0) + x.tanh() * x.exp() - (x * x + 1.0).sqrt()).abs() * (x + 3.0).ln();
        S::select(x.lt(S::ONE), y / 2.0 - 1.0, x)
    }

    #[test]
    fn coefficients_are_those_of_the_function() {
        // A series of twelve terms against the function itself, closer than the term left out.
        let x = Taylor::<f64, 12>::from_derivatives(core::array::from_fn(|k| {
            [0.4, 1.0][k.min(1)] * f64::from(k < 2)
        }));
        let series = law(x).coefficients;
        for step in [-0.05, 0.02, 0.05_f64] {
            let sum = series.iter().rev().fold(0.0, |sum, c| sum * step + c);
            assert!((sum - law(0.4 + step)).abs() < 1e-13, "{sum} {}", law(0.4 + step));
        }
    }

    #[test]
    fn the_first_derivative_is_that_of_dual_numbers() {
        for x in [-1.3, -0.2, 0.7] {
            let taylor = law(Taylor::from_derivatives([x, 2.0, 5.0]));
            let dual = law(Dual { value: x, derivative: [2.0] });
            assert!((taylor.derivative(0) - dual.value).abs() < 1e-14);
            assert!((taylor.derivative(1) - dual.derivative[0]).abs() < 1e-14);
        }
    }

    #[test]
    fn the_second_derivative_of_a_dual_coefficient_is_the_third_direction() {
        // ∂/∂a of d²/dt² (a t)³ at t = 1 is d²/dt² 3 a² t³ = 18 a² t
        let a = Dual::<1>::variable(2.0, 0);
        let t = Taylor::from_derivatives([a, a, Dual::ZERO]);
        assert_eq!((t * t * t).derivative(2).derivative[0], 18.0 * 4.0);
    }

    #[test]
    fn the_rate_moves_every_coefficient_one_place() {
        let x = Taylor::from_derivatives([1.0, 2.0, 3.0]);
        assert_eq!([0, 1, 2].map(|k| x.rate().derivative(k)), [2.0, 3.0, 0.0]);
    }
}
