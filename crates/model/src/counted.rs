//! Numbers that count what is done with them.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use std::cell::Cell;

use crate::Scalar;
use crate::scalar::group_of_one;
use crate::scalar::sealed::Sealed;

/// Operations on [`Counted`] numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Operations {
    /// Multiplications.
    pub multiplications: usize,
    /// Additions and subtractions.
    pub additions: usize,
    /// Divisions.
    pub divisions: usize,
    /// Sines with their cosines, roots and other functions.
    pub functions: usize,
}

/// A number that counts the operations on it, for bounds on what an algorithm can cost.
///
/// Signs, comparisons and choices are free.
///
/// # Example
/// ```
/// use sinew_model::{Counted, Scalar};
/// fn law<S: Scalar>(x: S) -> S { x * x + x.sin() / 2.0 }
/// let (value, done) = Counted::operations(|| law(Counted(0.5)).value());
/// assert_eq!(value, law(0.5));
/// assert_eq!((done.multiplications, done.additions, done.divisions, done.functions), (1, 1, 1, 1));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counted(pub f64);

std::thread_local! {
    static DONE: Cell<Operations> = const { Cell::new(Operations {
        multiplications: 0,
        additions: 0,
        divisions: 0,
        functions: 0,
    }) };
}

fn count(which: impl FnOnce(&mut Operations) -> &mut usize) {
    let mut done = DONE.get();
    *which(&mut done) += 1;
    DONE.set(done);
}

impl Counted {
    /// What `work` gives, and the operations that it does in this thread.
    pub fn operations<T>(work: impl FnOnce() -> T) -> (T, Operations) {
        let before = DONE.replace(Operations::default());
        let result = work();
        (result, DONE.replace(before))
    }

    fn function(value: f64) -> Self {
        count(|done| &mut done.functions);
        Self(value)
    }
}

impl Sealed for Counted {}

impl Scalar for Counted {
    group_of_one!();

    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    type Mask = bool;

    fn constant(x: f64) -> Self {
        Self(x)
    }
    fn value(self) -> f64 {
        self.0
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.0);
        (Self::function(s), Self(c))
    }
    fn sqrt(self) -> Self {
        Self::function(Scalar::sqrt(self.0))
    }
    fn exp(self) -> Self {
        Self::function(Scalar::exp(self.0))
    }
    fn tanh(self) -> Self {
        Self::function(Scalar::tanh(self.0))
    }
    fn ln(self) -> Self {
        Self::function(Scalar::ln(self.0))
    }
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    fn lt(self, other: Self) -> bool {
        self.0 < other.0
    }
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

macro_rules! counted {
    ($($name:ident $method:ident $operation:tt $counter:ident)*) => {$(
        impl $name for Counted {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self $operation other.0
            }
        }
        impl $name<f64> for Counted {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                count(|done| &mut done.$counter);
                Self(self.0 $operation other)
            }
        }
    )*};
}

counted! {
    Add add + additions
    Sub sub - additions
    Mul mul * multiplications
    Div div / divisions
}

impl AddAssign for Counted {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Counted {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl MulAssign for Counted {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}
