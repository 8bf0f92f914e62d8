//! Variables handed to dual numbers, as many at a time as one pass carries.

use core::ops::Range;

use sinew_effect::{DIRECTIONS, Derivative};
use sinew_model::Scalar;

/// 0 … n in pieces of one pass each.
pub(crate) fn chunks(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n).step_by(DIRECTIONS).map(move |start| start..n.min(start + DIRECTIONS))
}

/// Numbers without derivatives.
pub(crate) fn constants(x: &[f64]) -> Vec<Derivative> {
    x.iter().map(|&x| Derivative::constant(x)).collect()
}
