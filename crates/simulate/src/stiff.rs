//! The stiff method: Radau IIA of order 5, from the library `differential-equations`.

use differential_equations::error::Error;
use differential_equations::methods::{ImplicitRungeKutta, Ordinary, Radau};
use differential_equations::ode::OrdinaryNumericalMethod;
use differential_equations::status::Status;
use differential_equations::traits::State;

use crate::counted::Counted;
use crate::solver::STRETCH;
use crate::{StepFailure, System, Tolerance, Work};

/// Radau5 with a first guess that outlives the interval.
///
/// Three habits of the library (0.7) shape this file. It sizes its work space by the type of the state, so states
/// are arrays of the next length. It rescales its tolerances at every start, a scalar one once for each state, so
/// every start is a new object with vectors of tolerances. It keeps the factors of its Newton matrix when a step
/// is rejected or cut short, so both are starts too. Its own Newton tolerance stays as it is.
#[derive(Debug)]
pub(crate) struct Stiff {
    tolerance: Tolerance,
    guess: f64,
}

// Steps in one interval, and rejections in a row, after which the method has failed.
const MAX_STEPS: usize = 200_000;
const MAX_REJECTED: usize = 60;

impl Stiff {
    pub fn new(tolerance: Tolerance) -> Self {
        Self { tolerance, guess: 0.0 }
    }

    /// Moves `x` from `t0` to `t1`; on failure `x` is where it came to.
    pub fn advance(
        &mut self,
        system: &mut dyn System,
        t0: f64,
        x: &mut [f64],
        t1: f64,
        work: &mut Work,
    ) -> Result<(), StepFailure> {
        match system.len() {
            0..=4 => self.padded::<4>(system, t0, x, t1, work),
            5..=8 => self.padded::<8>(system, t0, x, t1, work),
            9..=16 => self.padded::<16>(system, t0, x, t1, work),
            17..=32 => self.padded::<32>(system, t0, x, t1, work),
            33..=64 => self.padded::<64>(system, t0, x, t1, work),
            n => {
                let reason = format!("the stiff method takes up to 64 states (got {n})");
                Err(StepFailure { time: t0, reason })
            }
        }
    }

    fn padded<const N: usize>(
        &mut self,
        system: &mut dyn System,
        t0: f64,
        x: &mut [f64],
        t1: f64,
        work: &mut Work,
    ) -> Result<(), StepFailure> {
        let n = x.len();
        let mut state = [0.0; N];
        state[..n].copy_from_slice(x);
        let system = Counted::new(system);
        let result = self.starts(&system, t0, &mut state, t1, work);
        work.evaluations += system.evaluations.get();
        x.copy_from_slice(&state[..n]);
        result
    }

    fn starts<const N: usize>(
        &mut self,
        system: &Counted,
        t0: f64,
        x: &mut [f64; N],
        t1: f64,
        work: &mut Work,
    ) -> Result<(), StepFailure> {
        let (mut t, mut rejected, first_step) = (t0, 0, work.steps);
        while t < t1 {
            let left = t1 - t;
            let mut radau = ImplicitRungeKutta::<Ordinary, Radau, f64, [f64; N], 5, 3, 3>::radau5()
                .rtol(vec![self.tolerance.relative; N])
                .atol(vec![self.tolerance.absolute; N])
                // Zero asks the library for a guess of its own.
                .h0(if self.guess * STRETCH >= left { left } else { self.guess });
            radau.init(system, t, t1, x).map_err(|e| failure(t, &e))?;
            radau.set_status(Status::Solving);
            let cut = self.guess * STRETCH >= left;
            let passed = steps(&mut radau, system, t1)?;
            work.steps += passed.accepted;
            if passed.accepted > 0 {
                rejected = 0;
            }
            if passed.rejected {
                (work.rejected, rejected) = (work.rejected + 1, rejected + 1);
            }
            // A step cut short by the interval says little about the next.
            self.guess = if cut && !passed.rejected { self.guess.max(radau.h()) } else { radau.h() };
            (t, *x) = (radau.t(), *radau.y());
            if t1 - t <= 4.0 * f64::EPSILON * t1.abs().max(left) {
                return Ok(());
            }
            if rejected == MAX_REJECTED || work.steps - first_step > MAX_STEPS {
                let reason = "no step meets the tolerance".to_owned();
                return Err(StepFailure { time: t, reason });
            }
        }
        Ok(())
    }
}

struct Passed {
    accepted: usize,
    rejected: bool,
}

// Steps until one is rejected or the next would go beyond t1.
fn steps<const N: usize>(
    radau: &mut impl OrdinaryNumericalMethod<f64, [f64; N]>,
    system: &Counted,
    t1: f64,
) -> Result<Passed, StepFailure> {
    let mut accepted = 0;
    loop {
        radau.step(system).map_err(|e| failure(radau.t(), &e))?;
        if matches!(radau.status(), Status::RejectedStep) {
            return Ok(Passed { accepted, rejected: true });
        }
        accepted += 1;
        if radau.t() + STRETCH * radau.h() >= t1 {
            return Ok(Passed { accepted, rejected: false });
        }
    }
}

fn failure<const N: usize>(time: f64, error: &Error<f64, [f64; N]>) -> StepFailure
where
    [f64; N]: State<f64>,
{
    let reason = match error {
        Error::StepSize { .. } => "the step became too small",
        Error::MaxSteps { .. } => "the interval needs too many steps",
        Error::LinearAlgebra { .. } => "the Newton matrix is singular",
        Error::BadInput { .. } => "the tolerances are too small for this method",
        _ => "the equations gave no usable number",
    };
    StepFailure { time, reason: reason.to_owned() }
}
