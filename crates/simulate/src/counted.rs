//! A system as the solver library wants it, with its evaluations counted.

use core::cell::{Cell, RefCell};

use differential_equations::linalg::Matrix;
use differential_equations::ode::ODE;

use crate::System;

pub(crate) struct Counted<'a> {
    // The library evaluates through a shared reference; a system has scratch space of its own.
    system: RefCell<&'a mut dyn System>,
    pub evaluations: Cell<usize>,
}

impl<'a> Counted<'a> {
    pub fn new(system: &'a mut dyn System) -> Self {
        Self { system: RefCell::new(system), evaluations: Cell::new(0) }
    }

    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        self.system.borrow_mut().rate(t, x, dx);
    }
}

impl ODE<f64, Vec<f64>> for Counted<'_> {
    fn diff(&self, t: f64, x: &Vec<f64>, dx: &mut Vec<f64>) {
        self.rate(t, x, dx);
    }
}

// Step of the differences, relative to the state: √ε, below which rounding eats the quotient.
const DIFFERENCE: f64 = 1.5e-8;
// Smallest size of a state in those differences: laws change within milliradians.
const SMALLEST: f64 = 1e-2;

/// The states of the array beyond those of the system stay at zero.
impl<const N: usize> ODE<f64, [f64; N]> for Counted<'_> {
    fn diff(&self, t: f64, x: &[f64; N], dx: &mut [f64; N]) {
        let n = self.system.borrow().len();
        dx[n..].fill(0.0);
        self.rate(t, &x[..n], &mut dx[..n]);
    }

    fn jacobian(&self, t: f64, x: &[f64; N], jacobian: &mut Matrix<f64>) {
        let n = self.system.borrow().len();
        let (mut x, mut at_x, mut beside) = (*x, [0.0; N], [0.0; N]);
        self.diff(t, &x, &mut at_x);
        for j in 0..n {
            let here = x[j];
            x[j] += DIFFERENCE * here.abs().max(SMALLEST);
            let step = x[j] - here;
            self.diff(t, &x, &mut beside);
            x[j] = here;
            for i in 0..n {
                jacobian[(i, j)] = (beside[i] - at_x[i]) / step;
            }
        }
    }
}
