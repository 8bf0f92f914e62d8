//! Screening: every candidate of the catalogue by one derivative, orthogonalised against what is already free.

use faer::Mat;
use rayon::prelude::*;

use sinew_effect::{SWING_FREQUENCY, Screening};
use sinew_model::Setting;
use sinew_plant::Plant;

use crate::equations::Equations;
use crate::freedom::Springs;
use crate::least_squares::{Normal, column, cross, dot, matrix};
use crate::problem::{Candidate, Problem, is_moved};
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
            let bent = bent.as_ref().unwrap_or(&about);
            let families = families(trials);
            let of_each = families.par_iter().map(|family| secants(problem, model, [&about, bent], family));
            of_each.collect::<Vec<_>>().into_iter().flatten().collect()
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
fn families(trials: &[Trial]) -> Vec<Vec<&Trial>> {
    let mut families: Vec<Vec<&Trial>> = Vec::new();
    for trial in trials.iter().filter(|t| t.exact_spec().is_some()) {
        match families.last_mut().filter(|f| is_alike(f[0], trial)) {
            Some(family) => family.push(trial),
            None => families.push(vec![trial]),
        }
    }
    families
}

fn is_alike(a: &Trial, b: &Trial) -> bool {
    let words = |trial: &Trial| -> Vec<(String, Setting)> {
        let settings = trial.exact_spec().map_or(&[][..], |spec| &spec.settings);
        settings.iter().filter(|(_, s)| matches!(s, Setting::Word(_))).cloned().collect()
    };
    a.label() == b.label() && words(a) == words(b)
}

// Share of its frequency by which a swing is shifted: about the half width of its resonance.
pub(crate) const SHIFT: f64 = 0.03;

// What an effect changes when it is switched on, for each of its start values, and of what swings, what a shift of its
// frequency changes besides; `about` the motion that derivatives are taken about, or with every spring simulated where
// it makes a joint elastic.
fn secants(
    problem: &Problem,
    model: &Candidate,
    [about, bent]: [&Before; 2],
    family: &[&Trial],
) -> Vec<Option<Vec<Vec<f64>>>> {
    let extended = |trial: &Trial| {
        let specs = model.specs.iter().chain(trial.exact_spec()).cloned().collect();
        Candidate::new(problem, specs).ok()
    };
    let Some(plant) = extended(family[0]).map(|c| c.plant) else { return vec![None; family.len()] };
    let swings = family[0].swings();
    let mut stated = model.p.clone();
    if !swings && plant.elastic() != model.plant.elastic() {
        model.straighten_where_bent(&mut stated);
    }
    let shifts: &[f64] = if swings { &[1.0, 1.0 + SHIFT] } else { &[1.0] };
    let with = |trial: &&Trial| -> Option<Vec<Vec<f64>>> {
        let own = extended(trial)?.p;
        let shifted = |shift: &f64| {
            let mut p: Vec<f64> = stated.iter().chain(&own[model.p.len()..]).copied().collect();
            if swings {
                p[model.p.len() + SWING_FREQUENCY] *= shift;
            }
            p
        };
        Some(shifts.iter().map(shifted).collect())
    };
    let Some(sets) = family.iter().map(with).collect::<Option<Vec<_>>>() else {
        return vec![None; family.len()];
    };
    let sets = sets.concat();
    let before = if springs_of(&plant).eq(springs_of(&model.plant)) { about } else { bent };
    let springs = before.springs;
    let coarse = before.coarse.as_ref().filter(|_| problem.form.holds_on_coarse(&plant, &sets, springs));
    let (residual, grid) = coarse.map_or((&before.fine, Grid::Fine), |coarse| (coarse, Grid::Coarse));
    let left = problem.form.residuals(&plant, &sets, springs, grid);
    let change = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let secant = |left: &[Vec<f64>]| {
        let mut columns = vec![change(residual, &left[0])];
        columns.extend(left.windows(2).map(|pair| change(&pair[0], &pair[1])));
        Some(columns)
    };
    left.chunks(shifts.len()).map(secant).collect()
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
    /// Which of them move a row at all; all, if empty.
    pub moving: Vec<bool>,
    /// How many parameters it takes, as far as the log tells them.
    pub parameters: usize,
    /// Fall of the objective.
    pub drop: f64,
    /// Why it is out of the question.
    pub out: Option<String>,
    /// It promises less than it is given.
    pub on_trust: bool,
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
// Share of the objective that a new degree of freedom is trusted to explain after its refit.
const TRUST: f64 = 0.5;
// A candidate that the free parameters imitate to this share cannot be told from them.
const ABSORBED: f64 = 1.0 - 1e-9;

impl<'a> Screen<'a> {
    /// About a fitted model and its equations.
    pub fn new(problem: &'a Problem<'a>, model: &'a Candidate, base: &'a Equations) -> Self {
        // r⊥ = r − J d₀
        let mut minimum = base.residual.clone();
        for (column, d) in base.columns.iter().zip(&base.quadratic.step) {
            for (x, c) in minimum.iter_mut().zip(column) {
                *x -= c * d;
            }
        }
        Self {
            problem,
            model,
            base,
            jacobian: matrix(minimum.len(), &base.columns),
            minimum: column(&minimum),
        }
    }

    /// Score of a trial whose whitened columns are given. Shares of the signal are left to the refit.
    pub fn score(&self, trial: &Trial, white: &[Vec<f64>]) -> Option<Score> {
        match &trial.how {
            How::Release { unknowns } => self.release(trial, unknowns),
            How::New { exact: true, .. } if matches!(trial.card.screening, Screening::Resonance { .. }) => {
                self.switched(trial, white)
            }
            How::New { .. } => {
                let mut score = self.added(trial, white)?;
                // A swing in the wrong time may look like its opposite: where much is left, its refit may still find the
                // time.
                if let [share, shift] = score.strengths[..]
                    && trial.swings()
                    && self.is_far()
                    && shift.abs() > share.abs()
                {
                    score.out = None;
                }
                Some(score)
            }
        }
    }

    // The whitened residual is several times the noise.
    fn is_far(&self) -> bool {
        let residual = &self.base.residual;
        dot(residual, residual) > FAR * residual.len() as f64
    }

    // A new degree of freedom is no small change: judged by what is left with it at the stated values, after the free
    // parameters have followed as far as their columns carry.
    //
    // left = |r − z|² − gᵀ A⁻¹ g,   g = Jᵀ(r − z)
    fn switched(&self, trial: &Trial, white: &[Vec<f64>]) -> Option<Score> {
        let before = dot(&self.base.residual, &self.base.residual);
        let at_stated: Vec<f64> = self.base.residual.iter().zip(white.first()?).map(|(r, z)| r - z).collect();
        let g: Vec<f64> = self.base.columns.iter().map(|c| dot(c, &at_stated)).collect();
        let left = dot(&at_stated, &at_stated) - dot(&g, &self.base.quadratic.normal.solve(&g));
        let drop = before - left;
        // Even where it is worse before its refit it deserves one.
        let on_trust = drop < TRUST * before;
        left.is_finite().then(|| Score {
            strengths: vec![1.0],
            stds: Vec::new(),
            moving: Vec::new(),
            parameters: trial.parameters,
            drop: if on_trust { TRUST * before - 1e-6 * left } else { drop },
            out: None,
            on_trust,
        })
    }

    // S = ZᵀZ − ZᵀJ A⁻¹ JᵀZ + W,  s = Zᵀ r⊥,  a = S⁻¹ s;  W: what is known of the strengths
    fn added(&self, trial: &Trial, white: &[Vec<f64>]) -> Option<Score> {
        let own: Vec<f64> = white.iter().map(|z| dot(z, z)).collect();
        if own.iter().all(|n| *n <= 1e-12 || !n.is_finite()) {
            return None;
        }
        let z = matrix(self.minimum.nrows(), white);
        let j = &self.jacobian;
        let share = self.base.quadratic.normal.solve_many(&cross(j, &z));
        let orthogonal: Mat<f64> = &z - j * &share;
        let mut s_matrix = cross(&z, &orthogonal);
        let s = cross(&z, &self.minimum);
        let k = white.len();
        let right: Vec<f64> = (0..k).map(|i| s[(i, 0)]).collect();
        let left = (0..k).map(|i| s_matrix[(i, i)] / own[i].max(1e-300)).fold(0.0, f64::max);
        let weights = trial.weights();
        weights.iter().enumerate().for_each(|(i, weight)| s_matrix[(i, i)] += weight);
        let normal = Normal::new(&s_matrix)?;
        let mut a = normal.solve(&right);
        let variances: Vec<f64> = normal.variances().iter().map(|v| v.max(0.0)).collect();
        let sizes = trial.sizes(self.problem.robot);
        let moving: Vec<bool> = own.iter().zip(sizes).map(|(n, size)| is_moved(n.sqrt(), size)).collect();
        a.iter_mut().zip(&moving).filter(|(_, moves)| !**moves).for_each(|(a, _)| *a = 0.0);
        // tr S (S + W)⁻¹ = k − Σ wᵢ σᵢ², of those that move a row
        let known = weights.iter().zip(&variances).map(|(weight, variance)| weight * variance);
        let told: f64 = known.zip(&moving).filter(|(_, moves)| **moves).map(|(known, _)| 1.0 - known).sum();
        let parameters = trial.parameters - weights.len() + (told.round() as usize).max(1);
        let stds = variances.iter().map(|v| v.sqrt()).collect();
        let drop = dot(&a, &right);
        let out = if left < 1.0 - ABSORBED {
            Some("these runs do not separate it from what is already free".to_owned())
        } else {
            trial.wrong_sign(&a)
        };
        Some(Score { strengths: a, stds, moving, parameters, drop, out, on_trust: false })
    }

    // The same equations without the priors of some unknowns.
    fn release(&self, trial: &Trial, unknowns: &[usize]) -> Option<Score> {
        let (model, base) = (self.model, &self.base.quadratic);
        let mut freed = model.again(self.problem).ok()?;
        for &k in unknowns {
            freed.unknowns[k].prior = None;
        }
        let step = base.without_priors(unknowns, model)?.bounded(&freed)?.step;
        let pull = |candidate: &Candidate, step: &[f64]| -> f64 {
            let unknowns = candidate.unknowns.iter().zip(step);
            unknowns.map(|(u, d)| u.pull(model.p[u.position] + d)).sum()
        };
        let rows = base.fall_of_rows(&step, model) - base.fall_of_rows(&base.step, model);
        let drop = rows + pull(model, &base.step) - pull(&freed, &step);
        let of = |&k: &usize| model.p[model.unknowns[k].position] + step[k];
        let strengths = unknowns.iter().map(of).collect();
        let (stds, moving, parameters) = (Vec::new(), Vec::new(), trial.parameters);
        Some(Score { strengths, stds, moving, parameters, drop, out: None, on_trust: false })
    }
}
