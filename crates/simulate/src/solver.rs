//! Solving ẋ = f(t, x) from one instant to the next, whatever library does it.

use crate::explicit::Explicit;
use crate::stiff::Stiff;
use crate::{SimulateError, StepFailure};

/// A system of first-order differential equations.
pub trait System {
    /// Number of states.
    fn len(&self) -> usize;
    /// True if there is no state.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Writes the rate f(t, x) to `dx`.
    fn rate(&mut self, t: f64, x: &[f64], dx: &mut [f64]);
}

/// How a system is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Explicit as long as that is the cheaper of the two, by counted evaluations.
    #[default]
    Auto,
    /// Dormand and Prince's 8(5,3): cheapest unless a fast motion is over-damped.
    Explicit,
    /// Radau IIA of order 5: for fast over-damped motions.
    Stiff,
}

/// Error allowed in a step: |error| ≤ absolute + relative·|x|, in the mean square of all states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative to the state.
    pub relative: f64,
    /// In the units of the states.
    pub absolute: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { relative: 1e-9, absolute: 1e-10 }
    }
}

/// What an integration cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Evaluations of the rate, those for Jacobians included.
    pub evaluations: usize,
    /// Steps computed in vain.
    pub rejected: usize,
}

impl core::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.evaluations += other.evaluations;
        self.rejected += other.rejected;
    }
}

/// A solver that goes from hold to hold and remembers its last step as the next first guess.
#[derive(Debug)]
pub struct Solver {
    method: Method,
    explicit: Explicit,
    stiff: Stiff,
    // Automatic choice: intervals left before the stiff method is asked to prove itself again.
    stiff_for: usize,
    explicit_for: usize,
}

// Shorter than this, s, an interval is a rounding error of the clock; nothing moves in it.
pub(crate) const INSTANT: f64 = 1e-12;
// What a step may be longer than planned to end with its interval; a sliver left over would stop both methods.
pub(crate) const STRETCH: f64 = 1.01;
// An explicit interval of at most so many steps is not worth a trial of the stiff method: one stiff step costs
// about as much as two explicit ones.
const EASY_STEPS: usize = 16;
// Intervals for which the outcome of a trial holds.
const HOLD: usize = 50;

impl Solver {
    /// A solver that has not seen any system yet.
    pub fn new(method: Method, tolerance: Tolerance) -> Self {
        Self {
            method,
            explicit: Explicit::new(tolerance),
            stiff: Stiff::new(tolerance),
            stiff_for: 0,
            explicit_for: 0,
        }
    }

    /// Moves `x` from `t0` to `t1`.
    ///
    /// # Errors
    /// If the method cannot meet the tolerance; says when.
    ///
    /// # Panics
    /// If `x` has not the length of the system, or `t1 < t0`.
    pub fn advance(
        &mut self,
        system: &mut dyn System,
        t0: f64,
        x: &mut [f64],
        t1: f64,
    ) -> Result<Work, SimulateError> {
        assert_eq!(x.len(), system.len(), "x");
        assert!(t1 >= t0, "t1: time runs forwards");
        if t1 - t0 <= INSTANT + 8.0 * f64::EPSILON * t1.abs() {
            return Ok(Work::default());
        }
        let mut work = Work::default();
        let result = match self.method {
            Method::Explicit => self.explicit.advance(system, t0, x, t1, usize::MAX, &mut work).map(drop),
            Method::Stiff => self.stiff.advance(system, t0, x, t1, &mut work),
            Method::Auto => self.advance_cheaply(system, t0, x, t1, &mut work),
        };
        result.map_err(|f| SimulateError::Step { time: f.time, reason: f.reason })?;
        Ok(work)
    }

    fn advance_cheaply(
        &mut self,
        system: &mut dyn System,
        t0: f64,
        x: &mut [f64],
        t1: f64,
        work: &mut Work,
    ) -> Result<(), StepFailure> {
        if self.stiff_for > 0 {
            self.stiff_for -= 1;
            let before = x.to_vec();
            if self.stiff.advance(system, t0, x, t1, work).is_ok() {
                return Ok(());
            }
            x.copy_from_slice(&before);
            self.stiff_for = 0;
        }
        let budget = if self.explicit_for > 0 { usize::MAX } else { EASY_STEPS };
        self.explicit_for = self.explicit_for.saturating_sub(1);
        let before = work.evaluations;
        let t = self.explicit.advance(system, t0, x, t1, budget, work)?;
        if t >= t1 {
            return Ok(());
        }
        // Too many steps: the rest of the interval by the stiff method, and whoever was faster goes on.
        let explicit_cost = (work.evaluations - before) as f64 / (t - t0);
        let (start, before) = (x.to_vec(), work.evaluations);
        let stiff = self.stiff.advance(system, t, x, t1, work);
        let stiff_cost = (work.evaluations - before) as f64 / (t1 - t);
        if stiff.is_ok() && stiff_cost < explicit_cost {
            self.stiff_for = HOLD;
            return Ok(());
        }
        self.explicit_for = HOLD;
        if stiff.is_ok() {
            return Ok(());
        }
        x.copy_from_slice(&start);
        self.explicit.advance(system, t, x, t1, usize::MAX, work).map(drop)
    }
}

/// Moves `x` from `t0` to `t1` with a fresh solver.
///
/// # Errors
/// As [`Solver::advance`].
///
/// # Example
/// Exponential decay, e⁻¹ after one time constant:
/// ```
/// use sinew_simulate::{Method, System, Tolerance, integrate};
/// struct Decay;
/// impl System for Decay {
///     fn len(&self) -> usize { 1 }
///     fn rate(&mut self, _t: f64, x: &[f64], dx: &mut [f64]) { dx[0] = -x[0]; }
/// }
/// let mut x = [1.0];
/// integrate(&mut Decay, Method::Auto, Tolerance::default(), 0.0, &mut x, 1.0).unwrap();
/// assert!((x[0] - (-1f64).exp()).abs() < 1e-9);
/// ```
pub fn integrate(
    system: &mut dyn System,
    method: Method,
    tolerance: Tolerance,
    t0: f64,
    x: &mut [f64],
    t1: f64,
) -> Result<Work, SimulateError> {
    Solver::new(method, tolerance).advance(system, t0, x, t1)
}

#[cfg(test)]
mod tests {
    use super::*;

    // n equal oscillators of 1 rad/s with damping ratio ζ, side by side.
    struct Oscillators(usize, f64);

    impl System for Oscillators {
        fn len(&self) -> usize {
            2 * self.0
        }
        fn rate(&mut self, _t: f64, x: &[f64], dx: &mut [f64]) {
            for (x, dx) in x.chunks_exact(2).zip(dx.chunks_exact_mut(2)) {
                (dx[0], dx[1]) = (x[1], -x[0] - 2.0 * self.1 * x[1]);
            }
        }
    }

    fn at_three(n: usize, damping: f64, method: Method) -> Result<f64, SimulateError> {
        let mut x: Vec<f64> = [1.0, 0.0].repeat(n);
        let mut solver = Solver::new(method, Tolerance::default());
        for t in 0..3 {
            let t = f64::from(t);
            solver.advance(&mut Oscillators(n, damping), t, &mut x, t + 1.0)?;
        }
        Ok(x[2 * n - 2])
    }

    #[test]
    fn every_method_solves_oscillators_of_every_size() {
        for n in [1, 2, 3, 6, 15, 30] {
            for method in [Method::Auto, Method::Explicit, Method::Stiff] {
                let error = at_three(n, 0.0, method).unwrap() - 3f64.cos();
                assert!(error.abs() < 1e-7, "{n} {method:?}: {error:e}");
            }
        }
    }

    #[test]
    fn a_fast_decay_beside_a_slow_one_goes_to_the_stiff_method() {
        // Poles −2ζ and −1/2ζ: the slow one has lost 3/2ζ after three seconds.
        let error = at_three(1, 1e5, Method::Auto).unwrap() - (-3.0f64 / 2e5).exp();
        assert!(error.abs() < 1e-7, "{error:e}");
    }

    #[test]
    fn more_states_than_the_stiff_method_takes_are_refused() {
        let text = at_three(33, 0.0, Method::Stiff).unwrap_err().to_string();
        assert!(text.contains("up to 64 states (got 66)") && text.contains("help:"), "{text}");
    }
}
