//! Screening: every candidate of the catalogue by one derivative, orthogonalised against what is already free.

use faer::Mat;
use rayon::prelude::*;

use sinew_effect::Screening;
use sinew_model::{EffectSpec, Setting};
use sinew_plant::Plant;

use crate::freedom::Springs;
use crate::least_squares::{Normal, cross, dot, matrix};
use crate::problem::{Candidate, Equations, Problem, straighten};
use crate::residual::Grid;
use crate::trial::{How, Trial};

/// Raw columns of all trials, one for each strength (one secant for an exact trial); none for a trial whose effect
/// cannot be evaluated. Linear trials share one plant: at zero strength none of them changes the others.
pub(crate) fn all_columns(
    problem: &Problem,
    model: &Candidate,
    residual: &[f64],
    trials: &[Trial],
) -> Vec<Option<Vec<Vec<f64>>>> {
    let is_linear = |t: &Trial| matches!(t.how, How::New { exact: false, .. });
    let linear: Vec<&Trial> = trials.iter().filter(|t| is_linear(t)).collect();
    let simulated = || Before::of(problem, model, Springs::Simulated, residual.to_vec());
    let given = || Before::of(problem, model, Springs::Given, model.residual_given(problem));
    let about = if problem.is_rough() { given() } else { simulated() };
    let bent = if problem.is_rough() { Some(simulated()) } else { None };
    let (linear, secants) = rayon::join(
        || {
            derivatives(problem, model, &linear)
                // A trial that fits nowhere must not take the others with it.
                .unwrap_or_else(|| linear.iter().map(|t| derivatives(problem, model, &[t])?.pop()?).collect())
        },
        || -> Vec<Option<Vec<Vec<f64>>>> {
            let families: Vec<Vec<&EffectSpec>> = families(trials);
            families
                .par_iter()
                .map(|family| secants(problem, model, [&about, bent.as_ref().unwrap_or(&about)], family))
                .collect::<Vec<_>>()
                .concat()
        },
    );
    let (mut linear, mut secants) = (linear.into_iter(), secants.into_iter());
    let set_of = |trial: &Trial| match &trial.how {
        How::New { exact: true, .. } => secants.next().flatten(),
        How::New { .. } => linear.next().flatten(),
        How::Release { .. } => Some(Vec::new()),
    };
    let finite = |set: &Vec<Vec<f64>>| set.iter().flatten().all(|x| x.is_finite());
    trials.iter().map(set_of).map(|set| set.filter(finite)).collect()
}

// What is left before an effect is switched on, about one motion of the links.
struct Before {
    springs: Springs,
    fine: Vec<f64>,
    // None where the model's own springs are too fast for the coarse grid.
    coarse: Option<Vec<f64>>,
}

impl Before {
    fn of(problem: &Problem, model: &Candidate, springs: Springs, fine: Vec<f64>) -> Self {
        let p = std::slice::from_ref(&model.p);
        let is_slow = problem.form.holds_on_coarse(&model.plant, p, springs);
        let coarse = is_slow.then(|| model.residual_on(problem, springs, Grid::Coarse));
        Self { springs, fine, coarse }
    }
}

// Exact trials that follow each other and differ in numbers only: the same effect at the same place in the same words.
fn families(trials: &[Trial]) -> Vec<Vec<&EffectSpec>> {
    let mut families: Vec<Vec<&EffectSpec>> = Vec::new();
    for trial in trials {
        let How::New { spec, exact: true, .. } = &trial.how else { continue };
        match families.last_mut().filter(|f| is_alike(f[0], spec)) {
            Some(family) => family.push(spec),
            None => families.push(vec![spec]),
        }
    }
    families
}

fn is_alike(a: &EffectSpec, b: &EffectSpec) -> bool {
    let words = |spec: &EffectSpec| -> Vec<(String, Setting)> {
        spec.settings.iter().filter(|(_, s)| matches!(s, Setting::Word(_))).cloned().collect()
    };
    a.kind == b.kind && a.place == b.place && words(a) == words(b)
}

// What an effect changes when it is switched on, for each of its start values; `about` the motion that derivatives are
// taken about, or with every spring simulated where it makes a joint elastic.
fn secants(
    problem: &Problem,
    model: &Candidate,
    [about, bent]: [&Before; 2],
    family: &[&EffectSpec],
) -> Vec<Option<Vec<Vec<f64>>>> {
    let extended = |spec: &EffectSpec| {
        let specs = model.specs.iter().chain([spec]).cloned().collect();
        Candidate::new(problem, specs).ok()
    };
    let Some(plant) = extended(family[0]).map(|c| c.plant) else { return vec![None; family.len()] };
    let mut stated = model.p.clone();
    if plant.elastic() != model.plant.elastic() {
        straighten(&model.unknowns, &mut stated);
    }
    let with = |spec: &&EffectSpec| -> Option<Vec<f64>> {
        let own = extended(spec)?.p;
        Some(stated.iter().chain(&own[model.p.len()..]).copied().collect())
    };
    let Some(sets) = family.iter().map(with).collect::<Option<Vec<_>>>() else {
        return vec![None; family.len()];
    };
    let before = if springs_of(&plant).eq(springs_of(&model.plant)) { about } else { bent };
    let springs = before.springs;
    let coarse = before.coarse.as_ref().filter(|_| problem.form.holds_on_coarse(&plant, &sets, springs));
    let (residual, grid) = coarse.map_or((&before.fine, Grid::Fine), |coarse| (coarse, Grid::Coarse));
    let secant = |changed: Vec<f64>| Some(vec![residual.iter().zip(changed).map(|(a, b)| a - b).collect()]);
    problem.form.residuals(&plant, &sets, springs, grid).into_iter().map(secant).collect()
}

// Which of the robot's own joints have a spring.
fn springs_of(plant: &Plant) -> impl Iterator<Item = bool> {
    plant.joints().iter().map(|&dof| plant.elastic()[dof])
}

// Derivatives along the strengths of several trials at zero, in one plant; none if there is no such plant.
fn derivatives(
    problem: &Problem,
    model: &Candidate,
    trials: &[&Trial],
) -> Option<Vec<Option<Vec<Vec<f64>>>>> {
    let new = || {
        trials.iter().filter_map(|t| match &t.how {
            How::New { spec, strengths, .. } => Some((spec, strengths)),
            How::Release { .. } => None,
        })
    };
    let specs = model.specs.iter().chain(new().map(|(spec, _)| spec)).cloned().collect();
    let extended = Candidate::new(problem, specs).ok()?;
    let mut p = model.p.clone();
    p.extend_from_slice(&extended.p[model.p.len()..]);
    let mut positions = Vec::new();
    for (k, (_, strengths)) in new().enumerate() {
        let first = extended.plant.range(model.specs.len() + k).start;
        for &s in strengths {
            p[first + s] = 0.0;
            positions.push(first + s);
        }
    }
    let mut columns = problem.form.columns(&extended.plant, &p, &positions, problem.slopes).into_iter();
    Some(new().map(|(_, strengths)| Some(columns.by_ref().take(strengths.len()).collect())).collect())
}

/// What a screen says of a trial.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Strengths at the minimum (for an exact trial, the share of its first strength).
    pub strengths: Vec<f64>,
    /// Their standard deviations, of effects that enter linearly.
    pub stds: Vec<f64>,
    /// Fall of the objective.
    pub drop: f64,
    /// Why it is out of the question.
    pub out: Option<String>,
}

/// Scores of trials against a fitted base.
pub(crate) struct Screen<'a> {
    problem: &'a Problem<'a>,
    model: &'a Candidate,
    base: &'a Equations,
    // J, and the residual at the base's minimum.
    jacobian: Mat<f64>,
    minimum: Mat<f64>,
}

// Mean square of a whitened residual from which a linear screen is not believed about swings.
const FAR: f64 = 9.0;
// A candidate that the free parameters imitate to this share cannot be told from them.
const ABSORBED: f64 = 1.0 - 1e-9;

impl<'a> Screen<'a> {
    /// About a fitted model and its equations.
    pub fn new(problem: &'a Problem<'a>, model: &'a Candidate, base: &'a Equations) -> Self {
        // r⊥ = r − J d₀
        let mut minimum = base.residual.clone();
        for (column, d) in base.columns.iter().zip(&base.step) {
            for (x, c) in minimum.iter_mut().zip(column) {
                *x -= c * d;
            }
        }
        Self { problem, model, base, jacobian: matrix(&base.columns), minimum: matrix(&[minimum]) }
    }

    /// Score of a trial whose whitened columns are given. Shares of the signal are left to the refit.
    pub fn score(&self, trial: &Trial, white: &[Vec<f64>]) -> Option<Score> {
        match &trial.how {
            How::Release { unknowns } => self.release(unknowns),
            How::New { exact: true, .. } if matches!(trial.card.screening, Screening::Resonance { .. }) => {
                self.switched(white)
            }
            // A swing in the wrong time looks like its opposite: where much is left, its refit may still find the time.
            How::New { exact: true, .. }
                if matches!(trial.card.screening, Screening::Swing { .. }) && self.is_far() =>
            {
                self.switched(white)
            }
            How::New { .. } => self.added(trial, white),
        }
    }

    // The whitened residual is several times the noise.
    fn is_far(&self) -> bool {
        let residual = &self.base.residual;
        dot(residual, residual) > FAR * residual.len() as f64
    }

    // A new degree of freedom is no small change: judged by the residual that it leaves at the stated values.
    fn switched(&self, white: &[Vec<f64>]) -> Option<Score> {
        let before = dot(&self.base.residual, &self.base.residual);
        let left: f64 = self.base.residual.iter().zip(white.first()?).map(|(r, z)| (r - z).powi(2)).sum();
        // Even where it is worse before its refit it deserves one.
        let drop = (before - left).max(0.5 * before);
        left.is_finite().then(|| Score {
            strengths: vec![1.0],
            stds: Vec::new(),
            drop: drop - 1e-6 * left,
            out: None,
        })
    }

    // S = ZᵀZ − ZᵀJ A⁻¹ JᵀZ,  s = Zᵀ r⊥,  a = S⁻¹ s
    fn added(&self, trial: &Trial, white: &[Vec<f64>]) -> Option<Score> {
        let own: Vec<f64> = white.iter().map(|z| dot(z, z)).collect();
        if own.iter().all(|n| *n <= 1e-12 || !n.is_finite()) {
            return None;
        }
        let z = matrix(white);
        let j = &self.jacobian;
        let share = self.base.normal.solve_many(&cross(j, &z));
        let orthogonal: Mat<f64> = &z - j * &share;
        let s_matrix = cross(&z, &orthogonal);
        let s = cross(&z, &self.minimum);
        let k = white.len();
        let right: Vec<f64> = (0..k).map(|i| s[(i, 0)]).collect();
        let left = (0..k).map(|i| s_matrix[(i, i)] / own[i].max(1e-300)).fold(0.0, f64::max);
        let normal = Normal::new(&s_matrix)?;
        let a = normal.solve(&right);
        let stds = normal.variances().iter().map(|v| v.max(0.0).sqrt()).collect();
        let drop = dot(&a, &right);
        let out = if left < 1.0 - ABSORBED {
            Some("these runs do not separate it from what is already free".to_owned())
        } else {
            trial.wrong_sign(&a)
        };
        Some(Score { strengths: a, stds, drop, out })
    }

    // The same equations without the priors of some unknowns.
    fn release(&self, unknowns: &[usize]) -> Option<Score> {
        let mut freed = self.model.again(self.problem).ok()?;
        for &k in unknowns {
            freed.unknowns[k].prior = None;
        }
        let equations = Equations::of(self.base.columns.clone(), self.base.residual.clone(), &freed, 0.0)?;
        let at = |step: &[f64]| -> (Vec<f64>, f64) {
            let mut r = self.base.residual.clone();
            for (column, d) in self.base.columns.iter().zip(step) {
                r.iter_mut().zip(column).for_each(|(x, c)| *x -= c * d);
            }
            let pull = self
                .model
                .unknowns
                .iter()
                .enumerate()
                .map(
                    |(k, u)| {
                        if unknowns.contains(&k) { 0.0 } else { u.pull(self.model.p[u.position] + step[k]) }
                    },
                )
                .sum();
            (r, pull)
        };
        let (before, _) = at(&self.base.step);
        let pull_before: f64 = self
            .model
            .unknowns
            .iter()
            .zip(&self.base.step)
            .map(|(u, d)| u.pull(self.model.p[u.position] + d))
            .sum();
        let (after, pull_after) = at(&equations.step);
        let tension = pull_before - pull_after;
        let drop = dot(&before, &before) - dot(&after, &after) + tension;
        let strengths = unknowns
            .iter()
            .map(|&k| self.model.p[self.model.unknowns[k].position] + equations.step[k])
            .collect();
        Some(Score { strengths, stds: Vec::new(), drop, out: None })
    }
}
