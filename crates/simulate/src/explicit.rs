//! The explicit method: Dormand and Prince's 8(5,3), from the library `differential-equations`.

use core::fmt;

use differential_equations::error::Error;
use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::OrdinaryNumericalMethod;
use differential_equations::status::Status;

use crate::counted::Counted;
use crate::solver::STRETCH;
use crate::{StepFailure, System, Tolerance, Work};

type Dop853 = ExplicitRungeKutta<Ordinary, DormandPrince, f64, Vec<f64>, 8, 12, 16>;

// One object for all intervals: a restart costs about a microsecond, most of it for the buffers.
pub(crate) struct Explicit {
    solver: Box<Dop853>,
    guess: f64,
}

// Rejections in a row after which no step will do.
const MAX_REJECTED: usize = 60;

impl Explicit {
    pub fn new(tolerance: Tolerance) -> Self {
        // Its step count runs over all intervals, so it must not end.
        let solver = Dop853::dop853().rtol(tolerance.relative).atol(tolerance.absolute).max_steps(usize::MAX);
        Self { solver: Box::new(solver), guess: 0.0 }
    }

    /// Moves `x` from `t0` towards `t1` in at most `budget` steps; returns how far it came.
    pub fn advance(
        &mut self,
        system: &mut dyn System,
        t0: f64,
        x: &mut [f64],
        t1: f64,
        budget: usize,
        work: &mut Work,
    ) -> Result<f64, StepFailure> {
        let system = Counted::new(system);
        let result = self.steps(&system, t0, x, t1, budget, work);
        work.evaluations += system.evaluations.get();
        x.copy_from_slice(self.solver.y());
        result
    }

    fn steps(
        &mut self,
        system: &Counted,
        t0: f64,
        x: &[f64],
        t1: f64,
        budget: usize,
        work: &mut Work,
    ) -> Result<f64, StepFailure> {
        self.restart(system, t0, &x.to_vec(), t1)?;
        let mut rejected = 0;
        for _ in 0..budget {
            let left = t1 - self.solver.t();
            let planned = self.solver.h();
            let last = planned * STRETCH >= left;
            if last {
                self.solver.set_h(left);
            }
            match self.solver.step(system) {
                Ok(_) => {}
                // The library's own alarm of stiffness, which this method does not heed: it was chosen.
                Err(Error::Stiffness { t, y }) => {
                    self.restart(system, t, &y, t1)?;
                    continue;
                }
                Err(error) => return Err(failure(self.solver.t(), &error)),
            }
            if matches!(self.solver.status(), Status::RejectedStep) {
                (work.rejected, rejected) = (work.rejected + 1, rejected + 1);
                if rejected == MAX_REJECTED {
                    let reason = "no step meets the tolerance".to_owned();
                    return Err(StepFailure { time: self.solver.t(), reason });
                }
                continue;
            }
            (work.steps, rejected) = (work.steps + 1, 0);
            self.guess = self.solver.h();
            if last {
                // The last step was cut short by the interval, not by its error.
                self.guess = self.guess.max(planned);
                return Ok(t1);
            }
        }
        Ok(self.solver.t())
    }

    fn restart(&mut self, system: &Counted, t0: f64, x: &Vec<f64>, t1: f64) -> Result<(), StepFailure> {
        // Zero asks the library for a guess of its own.
        self.solver.h0 = self.guess.min(t1 - t0);
        self.solver.init(system, t0, t1, x).map_err(|e| failure(t0, &e))?;
        self.solver.set_status(Status::Solving);
        Ok(())
    }
}

fn failure(time: f64, error: &Error<f64, Vec<f64>>) -> StepFailure {
    let reason = match error {
        Error::StepSize { .. } => "the step became too small".to_owned(),
        _ => "the equations gave no usable number".to_owned(),
    };
    StepFailure { time, reason }
}

impl fmt::Debug for Explicit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Explicit").field("guess", &self.guess).finish_non_exhaustive()
    }
}
