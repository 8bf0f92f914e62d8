//! A model under test: its effects, its free parameters, and their fit to the residual rows.

use std::sync::Arc;

use sinew_effect::Catalogue;
use sinew_model::{EffectSpec, Robot, Trust};
use sinew_plant::Plant;

use crate::base::{EXACT_TO_NOMINAL, is_inertial};
use crate::colour::Whitener;
use crate::equations::Equations;
use crate::freedom::Springs;
use crate::least_squares::dot;
use crate::residual::{Grid, LoggedTorques, ResidualForm};
use crate::unknowns::Unknown;
use crate::{IdentifyError, Options};

/// What stays the same in a whole search.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub robot: &'a Robot,
    pub catalogue: &'a Catalogue,
    pub form: &'a dyn ResidualForm,
    /// About which motion of the links derivatives are taken where the form has a reference.
    pub slopes: Springs,
    pub options: &'a Options,
}

// Joints up to which derivatives about the motion that the links have cost little more than about a reference's.
const FEW_JOINTS: usize = 3;

impl<'a> Problem<'a> {
    pub fn new(
        robot: &'a Robot,
        catalogue: &'a Catalogue,
        form: &'a dyn ResidualForm,
        options: &'a Options,
    ) -> Self {
        let slopes = if robot.model.nv > FEW_JOINTS { Springs::Given } else { Springs::Simulated };
        Self { robot, catalogue, form, slopes, options }
    }

    /// The same with derivatives about the motion that the links have, not a reference's.
    pub fn exact(&self) -> Problem<'a> {
        Problem { slopes: Springs::Simulated, ..*self }
    }
    /// True if derivatives may be about another motion than the links'.
    pub fn is_rough(&self) -> bool {
        self.slopes == Springs::Given && self.form.reference().is_some()
    }
}

/// A set of effects with their present values.
pub(crate) struct Candidate {
    pub specs: Vec<EffectSpec>,
    pub plant: Plant,
    pub unknowns: Vec<Unknown>,
    pub p: Vec<f64>,
}

/// Standard deviations from its stated value beyond which a parameter is bent.
pub(crate) const BENT: f64 = 4.0;

/// Every unknown of which something is stated back to what was stated, among the parameters `p`: what was bent to
/// imitate a missing effect hides it.
pub(crate) fn straighten(unknowns: &[Unknown], p: &mut [f64]) {
    for unknown in unknowns {
        if let Some((mean, _)) = unknown.prior {
            p[unknown.position] = mean;
        }
    }
}

/// A derivative of all rows; a candidate shares those of its base.
pub(crate) type Column = Arc<[f64]>;

/// A model and its linearisation in raw rows.
pub(crate) struct Linearised {
    pub residual: Vec<f64>,
    /// One column for each unknown of the model.
    pub columns: Vec<Column>,
}

impl Linearised {
    /// True if the model could be followed along all runs.
    pub fn is_finite(&self) -> bool {
        self.slices().into_iter().flatten().chain(&self.residual).all(|x| x.is_finite())
    }

    /// The columns.
    pub fn slices(&self) -> Vec<&[f64]> {
        self.columns.iter().map(AsRef::as_ref).collect()
    }
}

impl Candidate {
    /// The plant of these effects, every parameter that is not stated free.
    pub fn new(problem: &Problem, specs: Vec<EffectSpec>) -> Result<Self, IdentifyError> {
        let plant = Plant::with_effects(problem.robot, &specs, problem.catalogue)?;
        let unknowns = (0..specs.len()).flat_map(|e| Unknown::of_effect(&plant, e)).collect();
        let p = plant.parameters();
        Ok(Self { specs, plant, unknowns, p })
    }

    /// Sum of the priors' misfits.
    pub fn penalty(&self) -> f64 {
        self.penalty_at(&self.p)
    }

    fn penalty_at(&self, p: &[f64]) -> f64 {
        self.unknowns.iter().map(|u| u.pull(p[u.position])).sum()
    }

    /// The same model once more.
    pub fn again(&self, problem: &Problem) -> Result<Self, IdentifyError> {
        let plant = Plant::with_effects(problem.robot, &self.specs, problem.catalogue)?;
        let (specs, unknowns, p) = (self.specs.clone(), self.unknowns.clone(), self.p.clone());
        Ok(Self { specs, plant, unknowns, p })
    }

    /// Every unknown of which something is stated back to what was stated.
    pub fn straighten(&mut self) {
        straighten(&self.unknowns, &mut self.p);
    }

    /// True if some parameter is so many standard deviations from its stated value.
    pub fn is_bent(&self, deviations: f64) -> bool {
        self.unknowns.iter().any(|u| u.pull(self.p[u.position]) >= deviations * deviations)
    }

    /// Straightens parameters of this model and more where it is bent: what was bent to imitate a spring hides it.
    pub fn straighten_where_bent(&self, p: &mut [f64]) {
        if self.is_bent(BENT) {
            straighten(&self.unknowns, p);
        }
    }

    /// Every unknown of which something is stated halfway to what was stated.
    pub fn straighten_halfway(&mut self) {
        for unknown in &self.unknowns {
            if let Some((mean, _)) = unknown.prior {
                let p = &mut self.p[unknown.position];
                *p = 0.5 * (*p + mean);
            }
        }
    }

    /// Moves every unknown by its step, as far as its range and its prior let it.
    pub fn step(&mut self, step: &[f64]) {
        for (unknown, step) in self.unknowns.iter().zip(step) {
            self.p[unknown.position] = unknown.moved(self.p[unknown.position], *step);
        }
    }

    pub fn residual(&self, problem: &Problem) -> Vec<f64> {
        problem.form.residual(&self.plant, &self.p)
    }

    /// The same with logged torques taken so, where that is known.
    pub fn residual_told(&self, problem: &Problem, torques: Option<LoggedTorques>) -> Vec<f64> {
        let told = |torques| problem.form.residual_told(torques, &self.plant, &self.p);
        torques.map_or_else(|| self.residual(problem), told)
    }

    /// The same with the links where a reference has them.
    pub fn residual_given(&self, problem: &Problem) -> Vec<f64> {
        self.residual_on(problem, Springs::Given, Grid::Fine)
    }

    /// The same on either grid.
    pub fn residual_on(&self, problem: &Problem, springs: Springs, grid: Grid) -> Vec<f64> {
        problem.form.residuals(&self.plant, std::slice::from_ref(&self.p), springs, grid).concat()
    }

    /// The objective at each of several sets of parameters, springs simulated on the grid of the derivatives; infinite where
    /// the model cannot be followed.
    pub fn objectives(&self, problem: &Problem, whitener: &Whitener, sets: &[Vec<f64>]) -> Vec<f64> {
        let form = problem.form;
        let rows = form.residuals(&self.plant, sets, Springs::Simulated, Grid::Coarse);
        let objective = |(p, rows): (&Vec<f64>, &Vec<f64>)| {
            let white = whitener.apply(form.layout(), rows);
            Some(dot(&white, &white) + self.penalty_at(p)).filter(|x| x.is_finite()).unwrap_or(f64::INFINITY)
        };
        sets.iter().zip(&rows).map(objective).collect()
    }

    pub fn linearise(&self, problem: &Problem) -> Linearised {
        self.linearise_told(problem, None)
    }

    /// The same with logged torques taken so in the residual, where that is known.
    pub fn linearise_told(&self, problem: &Problem, torques: Option<LoggedTorques>) -> Linearised {
        let positions: Vec<usize> = self.unknowns.iter().map(|u| u.position).collect();
        let (residual, columns) =
            rayon::join(|| self.residual_told(problem, torques), || self.columns(problem, &positions));
        Linearised { residual, columns }
    }

    /// Derivatives of the prediction along the parameters at these positions.
    pub fn columns(&self, problem: &Problem, positions: &[usize]) -> Vec<Column> {
        let columns = problem.form.columns(&self.plant, &self.p, positions, problem.slopes);
        columns.into_iter().map(Column::from).collect()
    }

    /// The specifications with the present values.
    pub fn present_specs(&self, stds: Option<&[f64]>) -> Vec<EffectSpec> {
        let mut by_position = vec![None; self.p.len()];
        if let Some(stds) = stds {
            for (unknown, std) in self.unknowns.iter().zip(stds) {
                by_position[unknown.position] = Some(*std);
            }
        }
        let effects = self.plant.effects().iter().enumerate();
        effects
            .map(|(k, e)| e.with_values(&self.p[self.plant.range(k)], &by_position[self.plant.range(k)]))
            .collect()
    }

    /// Drops unknowns that the data cannot move, by their whitened columns. Returns the indices of those kept.
    pub fn keep_excited(&mut self, whitened: &[Vec<f64>], trust: Trust) -> Vec<usize> {
        let excited = |k: &usize| self.is_excited(&self.unknowns[*k], &whitened[*k], trust);
        let kept: Vec<usize> = (0..self.unknowns.len()).filter(excited).collect();
        self.unknowns = kept.iter().map(|&k| self.unknowns[k].clone()).collect();
        kept
    }

    /// True if an unknown's column is not shorter than the noise even at its tolerance. Inertias that are known exactly
    /// count as nominal: what hangs on a link is not known as well as the link.
    pub fn is_excited(&self, unknown: &Unknown, whitened: &[f64], trust: Trust) -> bool {
        let is_exact = trust == Trust::Exact && is_inertial(&self.specs[unknown.id.effect].kind);
        let size = if is_exact { EXACT_TO_NOMINAL * unknown.scale } else { unknown.scale };
        is_moved(dot(whitened, whitened).sqrt(), size)
    }

    /// Unknowns of its effects that are not free.
    pub fn left_out(&self) -> Vec<Unknown> {
        let all = (0..self.specs.len()).flat_map(|e| Unknown::of_effect(&self.plant, e));
        all.filter(|u| self.unknowns.iter().all(|free| free.id != u.id)).collect()
    }
}

/// True if a whitened column of this length is not shorter than the noise for a parameter of this size.
pub(crate) fn is_moved(length: f64, size: f64) -> bool {
    length.is_finite() && length * size > 0.05
}

/// Squared length of whitened rows plus the priors' misfit.
pub(crate) fn objective(whitened: &[f64], model: &Candidate) -> f64 {
    dot(whitened, whitened) + model.penalty()
}

// A step that lowers the objective by a smaller share leaves the derivatives as they are; with many unknowns, mostly
// linear ones, new derivatives are dear and change little.
const RELINEARISE: f64 = 0.002;
const RELINEARISE_MANY: f64 = 0.05;
pub(crate) const MANY: usize = 60;

/// Steps of a descent: a step that gains much does not count, so that a long way down is walked to its end.
pub(crate) struct Budget {
    counted: usize,
    all: usize,
}

// Share of the objective that a step must gain not to count, and the most steps in all.
const MUCH: f64 = 0.1;
const MOST_STEPS: usize = 40;

impl Budget {
    /// Room for `counted` steps that gain little.
    pub fn new(counted: usize) -> Self {
        Self { counted, all: MOST_STEPS }
    }
    /// True if a further step may be tried.
    pub fn lasts(&self) -> bool {
        self.counted > 0 && self.all > 0
    }
    /// True before the first step.
    pub fn is_whole(&self) -> bool {
        self.all == MOST_STEPS
    }
    /// Accounts for a step from one objective to another.
    pub fn spend(&mut self, before: f64, after: f64) {
        self.all -= 1;
        let gains_much = after < (1.0 - MUCH) * before;
        self.counted -= usize::from(!gains_much);
    }
}

// Fall of the objective that is not worth a step: a thirtieth of a standard deviation.
const NOTHING: f64 = 1e-3;

/// Levenberg–Marquardt on all unknowns from the linearisation `at`. Returns that at the end.
pub(crate) fn refine(
    problem: &Problem,
    model: &mut Candidate,
    whitener: &Whitener,
    mut at: Linearised,
    iterations: usize,
) -> Linearised {
    let layout = problem.form.layout();
    let mut problem = *problem;
    let mut best = objective(&whitener.apply(layout, &at.residual), model);
    let mut damping = 0.0;
    let relinearise = if model.unknowns.len() > MANY { RELINEARISE_MANY } else { RELINEARISE };
    let mut budget = Budget::new(iterations);
    while budget.lasts() {
        let equations = Equations::new(whitener, &problem, model, &at, damping);
        let Some(equations) = equations.and_then(|e| e.bounded(model)) else { break };
        if equations.quadratic.promised() < NOTHING {
            break;
        }
        let before = model.p.clone();
        model.step(&equations.quadratic.step);
        let residual = model.residual(&problem);
        let now = objective(&whitener.apply(layout, &residual), model);
        if problem.is_rough() && equations.misled(&problem, whitener, model, best, now) {
            problem = problem.exact();
            model.p = before;
            at = model.linearise(&problem);
            continue;
        }
        budget.spend(best, now);
        let gain = best - now;
        let lower = now.is_finite() && gain > 0.0;
        // Bent far enough, a model may be followed no longer on the grid of the derivatives.
        let again = (lower && gain > relinearise * now).then(|| model.linearise(&problem));
        if !lower || again.as_ref().is_some_and(|again| !again.is_finite()) {
            model.p = before;
            damping = if damping == 0.0 { 4e-3 } else { damping * 16.0 };
            if damping > 10.0 {
                break;
            }
            continue;
        }
        best = now;
        damping /= 8.0;
        match again {
            Some(again) => at = again,
            None => at.residual = residual,
        }
        if gain < 0.05 + 1e-5 * best {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Run, Signal};
    use sinew_effects::CATALOGUE;
    use sinew_model::samples;

    use super::*;
    use crate::comparison::Prepared;

    // What hangs on the last link of an exact robot shows in columns far longer than the link's own tolerance asks for.
    #[test]
    fn exact_inertias_stay_in_the_model_where_nominal_ones_are_not_excited() {
        let robot = Robot::rigid(samples::planar_arm(1, 4.0, 0.5));
        let time: Vec<f64> = (0..2500).map(|k| 1e-3 * k as f64).collect();
        let sine: Vec<f64> = time.iter().map(|t| 0.5 * (3.0 * t).sin()).collect();
        let signal = |quantity| Signal::new(quantity, robot.model.dof_name(0), sine.clone());
        let signals = vec![signal(Quantity::MotorPosition), signal(Quantity::MotorTorque)];
        let runs = [Run::new("sine".to_owned(), time, signals).unwrap()];
        let options = Options::default();
        let prepared = Prepared::new(&robot, &runs, &options).unwrap();
        let form = prepared.form(&robot);
        let problem = Problem::new(&robot, &CATALOGUE, &form, &options);
        let kept = |trust| {
            let mut model = Candidate::new(&problem, prepared.base_specs(&robot, &CATALOGUE)).unwrap();
            let faint: Vec<Vec<f64>> = model.unknowns.iter().map(|u| vec![0.01 / u.scale]).collect();
            model.keep_excited(&faint, trust);
            model.unknowns.iter().map(|u| model.specs[u.id.effect].kind.clone()).collect::<Vec<_>>()
        };
        assert!(kept(Trust::Nominal).is_empty());
        let exact = kept(Trust::Exact);
        assert!(exact.len() == 10 && exact.iter().all(|kind| is_inertial(kind)), "{exact:?}");
    }

    #[test]
    fn a_step_that_gains_much_is_free() {
        let mut budget = Budget::new(2);
        for _ in 0..10 {
            budget.spend(1.0, 0.5);
        }
        assert!(budget.lasts());
        budget.spend(1.0, 0.99);
        budget.spend(1.0, f64::NAN);
        assert!(!budget.lasts());
    }
}
