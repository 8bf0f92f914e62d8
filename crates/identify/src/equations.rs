//! Normal equations of a linearised model, and the step of its unknowns that they give.

use faer::Mat;

use crate::colour::Whitener;
use crate::least_squares::{Normal, column, cross, dot, matrix};
use crate::problem::{Candidate, Linearised, Problem, objective};

/// Whitened equations of a linearised model.
pub(crate) struct Equations {
    /// J
    pub columns: Vec<Vec<f64>>,
    /// r
    pub residual: Vec<f64>,
    pub quadratic: Quadratic,
}

/// The objective by the step d of the unknowns.
///
/// ‖r − J d‖² + (x + d − m)ᵀ Λ (x + d − m) = constant − 2 gᵀd + dᵀA d
pub(crate) struct Quadratic {
    // A, and g.
    a: Mat<f64>,
    g: Vec<f64>,
    /// A as it is solved.
    pub normal: Normal,
    /// The step to the minimum.
    pub step: Vec<f64>,
}

// Weight, by a diagonal entry, that holds an unknown at its bound.
const HELD: f64 = 1e8;
const BOUND_ROUNDS: usize = 4;
// Share of a promised gain that speaks for the derivatives.
const KEPT: f64 = 0.3;

impl Equations {
    /// A = JᵀJ + Λ,   g = Jᵀ r + Λ (m − x),   with A's diagonal multiplied by 1 + `damping`.
    pub fn new(
        whitener: &Whitener,
        problem: &Problem,
        model: &Candidate,
        at: &Linearised,
        damping: f64,
    ) -> Option<Self> {
        let layout = problem.form.layout();
        let columns = whitener.apply_all(layout, &at.columns);
        let residual = whitener.apply(layout, &at.residual);
        let jacobian = matrix(residual.len(), &columns);
        let mut a = cross(&jacobian, &jacobian);
        let mut g: Vec<f64> = columns.iter().map(|c| dot(c, &residual)).collect();
        for (k, (weight, pull)) in priors(model).enumerate() {
            a[(k, k)] += weight;
            a[(k, k)] += damping * a[(k, k)];
            g[k] += pull;
        }
        Some(Self { columns, residual, quadratic: Quadratic::of(a, g)? })
    }

    /// The same with steps that stay within the ranges of the unknowns.
    pub fn bounded(self, model: &Candidate) -> Option<Self> {
        Some(Self { quadratic: self.quadratic.bounded(model)?, ..self })
    }

    /// True if the step to this model, from one objective to another, gained little of what these equations promised,
    /// because links are not where their reference has them.
    pub fn misled(
        &self,
        problem: &Problem,
        whitener: &Whitener,
        model: &Candidate,
        before: f64,
        after: f64,
    ) -> bool {
        let promised = self.quadratic.promised();
        if promised < 10.0 + 1e-3 * before || before - after > KEPT * promised {
            return false;
        }
        let given = model.residual_given(problem);
        let given = objective(&whitener.apply(problem.form.layout(), &given), model);
        let agrees = (given - after).abs() < KEPT * promised;
        !agrees
    }
}

// Of each unknown λ and λ (m − x).
fn priors(model: &Candidate) -> impl Iterator<Item = (f64, f64)> {
    model.unknowns.iter().map(|unknown| {
        let weight = unknown.weight();
        let pull = unknown.prior.map_or(0.0, |(mean, _)| weight * (mean - model.p[unknown.position]));
        (weight, pull)
    })
}

impl Quadratic {
    fn of(a: Mat<f64>, g: Vec<f64>) -> Option<Self> {
        let normal = Normal::new(&a)?;
        let step = normal.solve(&g);
        Some(Self { a, g, normal, step })
    }

    /// What the step gains.
    pub fn promised(&self) -> f64 {
        self.gain(&self.step)
    }

    // 2 gᵀd − dᵀA d
    fn gain(&self, step: &[f64]) -> f64 {
        let d = column(step);
        2.0 * dot(&self.g, step) - (d.transpose() * &self.a * &d)[(0, 0)]
    }

    /// The same of equations without damping, with nothing stated of some unknowns of their model.
    pub fn without_priors(&self, unknowns: &[usize], model: &Candidate) -> Option<Self> {
        let (mut a, mut g) = (self.a.clone(), self.g.clone());
        for (k, (weight, pull)) in priors(model).enumerate().filter(|(k, _)| unknowns.contains(k)) {
            a[(k, k)] -= weight;
            g[k] -= pull;
        }
        Self::of(a, g)
    }

    /// By how much a step lowers the squared length of the rows, of equations without damping.
    ///
    /// ‖r‖² − ‖r − J d‖² = 2 dᵀ(g − Λ(m − x)) − dᵀ(A − Λ) d
    pub fn fall_of_rows(&self, step: &[f64], model: &Candidate) -> f64 {
        let stated = priors(model).zip(step).map(|((weight, pull), d)| 2.0 * d * pull - weight * d * d);
        self.gain(step) - stated.sum::<f64>()
    }

    /// The same with every unknown that would leave its range held where it may go, so that the others do not count on
    /// the rest of its step.
    pub fn bounded(mut self, model: &Candidate) -> Option<Self> {
        // What holds an unknown is no part of what a step promises.
        let (mut a, mut g) = (self.a.clone(), self.g.clone());
        let mut held = vec![false; model.unknowns.len()];
        for _ in 0..BOUND_ROUNDS {
            let mut changed = false;
            for (k, unknown) in model.unknowns.iter().enumerate() {
                if held[k] {
                    continue;
                }
                let from = model.p[unknown.position];
                let allowed = unknown.moved(from, self.step[k]) - from;
                if (allowed - self.step[k]).abs() > 1e-6 * unknown.scale {
                    let weight = HELD * a[(k, k)];
                    a[(k, k)] += weight;
                    g[k] += weight * allowed;
                    (held[k], changed) = (true, true);
                }
            }
            if !changed {
                break;
            }
            self.normal = Normal::new(&a)?;
            self.step = self.normal.solve(&g);
        }
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Run, Signal};
    use sinew_effects::CATALOGUE;
    use sinew_model::{Robot, samples};

    use super::*;
    use crate::Options;
    use crate::comparison::Prepared;
    use crate::search::Search;

    // A rigid joint whose torque is twice what its model asks for.
    #[test]
    fn a_prior_taken_away_and_a_fall_of_rows_are_those_of_the_rows_themselves() {
        let robot = Robot::rigid(samples::planar_arm(1, 4.0, 0.5));
        let time: Vec<f64> = (0..2500).map(|k| 1e-3 * k as f64).collect();
        let sine = |size: f64| time.iter().map(|t| size * (3.0 * t).sin()).collect();
        let signal = |quantity, size| Signal::new(quantity, robot.model.dof_name(0), sine(size));
        let signals = vec![signal(Quantity::MotorPosition, 0.5), signal(Quantity::MotorTorque, 20.0)];
        let runs = [Run::new("sine".to_owned(), time.clone(), signals).unwrap()];
        let options = Options::default();
        let prepared = Prepared::new(&robot, &runs, &options).unwrap();
        let form = prepared.form(&robot);
        let problem = Problem::new(&robot, &CATALOGUE, &form, &options);
        let search = Search::new(&problem, &prepared.records, &prepared.sensors);
        let (model, at) = search.fitted(prepared.base_specs(&robot, &CATALOGUE), None, 1).unwrap();
        let whitener = search.noise(&model, &at.residual, &at.slices());
        let equations = |model: &Candidate| Equations::new(&whitener, &problem, model, &at, 0.0).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * (1.0 + b.abs());

        let all = equations(&model);
        let first = model.unknowns.iter().position(|u| u.prior.is_some()).unwrap();
        let mut freed = model.again(&problem).unwrap();
        freed.unknowns[first].prior = None;
        let without = all.quadratic.without_priors(&[first], &model).unwrap();
        let again = equations(&freed).quadratic.step;
        assert!(without.step.iter().zip(&again).all(|(a, b)| near(*a, *b)), "{:?} {again:?}", without.step);

        let step = &without.step;
        let left =
            |k: usize| all.residual[k] - all.columns.iter().zip(step).map(|(c, d)| c[k] * d).sum::<f64>();
        let fall: f64 = (0..all.residual.len()).map(|k| all.residual[k].powi(2) - left(k).powi(2)).sum();
        let told = all.quadratic.fall_of_rows(step, &model);
        assert!(fall > 1.0 && near(told, fall), "{told} {fall}");
    }
}
