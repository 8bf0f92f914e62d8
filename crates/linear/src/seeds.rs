//! Variables handed to dual numbers, as many at a time as one pass carries.

use core::ops::Range;

use sinew_effect::{DIRECTIONS, Derivative};
use sinew_model::Scalar;
use sinew_plant::LinkState;

/// 0 … n in pieces of one pass each.
pub(crate) fn chunks(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n).step_by(DIRECTIONS).map(move |start| start..n.min(start + DIRECTIONS))
}

/// Numbers without derivatives.
pub(crate) fn constants(x: &[f64]) -> Vec<Derivative> {
    x.iter().map(|&x| Derivative::constant(x)).collect()
}

/// A state as numbers without derivatives.
pub(crate) fn lift(x: &LinkState<f64>) -> LinkState<Derivative> {
    LinkState {
        q: constants(&x.q),
        qd: constants(&x.qd),
        theta: constants(&x.theta),
        thetad: constants(&x.thetad),
        thetad_sweep: x.thetad_sweep.clone(),
        qd_sweep: x.qd_sweep.clone(),
        temperature: x.temperature.clone(),
        z: constants(&x.z),
    }
}
