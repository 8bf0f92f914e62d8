//! Refit of a screened candidate: its strengths and shapes free, everything else along.

use crate::colour::Whitener;
use crate::gates::{Evidence, Pair};
use crate::least_squares::{Normal, cross, dot, matrix};
use crate::problem::{Candidate, Equations, Linearised, MANY, Problem, objective};
use crate::residual::Layout;
use crate::screen::Score;
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;

/// A fitted model with what a search needs to go on from it.
pub(crate) struct Fitted {
    pub model: Candidate,
    /// Raw residual and columns.
    pub at: Linearised,
    /// Whitened residual.
    pub white: Vec<f64>,
    pub objective: f64,
}

/// A candidate after its refit.
pub(crate) struct Refit {
    pub trial: Trial,
    pub fitted: Fitted,
    pub evidence: Evidence,
    /// Why it is refused whatever its evidence.
    pub refused: Option<String>,
}

const ITERATIONS: usize = 8;
const SHRINKS: usize = 4;
const VALLEY_STEPS: usize = 6;

/// Refits one candidate from its screened strengths. The base's columns stay as they are; the candidate's own are
/// computed anew at every iteration, and all of them where the candidate changes the structure.
pub(crate) fn refit(
    problem: &Problem,
    base: &Fitted,
    whitener: &Whitener,
    trial: &Trial,
    score: &Score,
    channel_std: &[f64],
) -> Option<Refit> {
    let layout = problem.form.layout();
    let (mut model, own) = started(problem, &base.model, trial, score)?;
    let new = matches!(&trial.how, How::New { .. });
    let structural = new && model.plant.elastic() != base.model.plant.elastic();
    let mut at = Linearised { residual: model.residual(problem), columns: Vec::new() };
    let mut white = whitener.apply(layout, &at.residual);
    let mut best = objective(&white, &model);
    for _ in 0..SHRINKS {
        if best.is_finite() && best < base.objective {
            break;
        }
        // The screen promised too much: towards absence.
        for &k in own.iter().filter(|&&k| new && !model.unknowns[k].shape) {
            model.p[model.unknowns[k].position] *= 0.3;
        }
        at.residual = model.residual(problem);
        white = whitener.apply(layout, &at.residual);
        best = objective(&white, &model);
    }
    at.columns = columns(problem, base, &model, &own, structural);
    let mut linearised = best;
    let mut damping = 0.0;
    for _ in 0..ITERATIONS {
        let Some(equations) = Equations::new(whitener, problem, &model, &at, damping) else { break };
        let before = model.p.clone();
        for (unknown, step) in model.unknowns.iter().zip(&equations.step) {
            model.p[unknown.position] = unknown.moved(model.p[unknown.position], *step);
        }
        let residual = model.residual(problem);
        let now_white = whitener.apply(layout, &residual);
        let now = objective(&now_white, &model);
        if now.is_finite() && now < best {
            let gain = best - now;
            (best, white, at.residual) = (now, now_white, residual);
            damping /= 8.0;
            if gain < 0.05 + 1e-5 * best {
                break;
            }
            // Far from the base its columns no longer hold; near the minimum all of them do.
            let far = best < 0.7 * linearised && model.unknowns.len() <= MANY;
            if far || structural || gain > 0.01 * best {
                at.columns = columns(problem, base, &model, &own, structural || far);
            }
            linearised = if far { best } else { linearised };
        } else {
            model.p = before;
            damping = if damping == 0.0 { 4e-3 } else { damping * 16.0 };
            if damping > 10.0 {
                break;
            }
        }
    }
    let structural_rival = trial.card.rivals.iter().any(|r| r.structural);
    if structural_rival && score.drop > 30.0 && best > base.objective - 0.1 * score.drop {
        // A curved valley (a gain scales every other parameter): plain Gauss–Newton steps run along it.
        let (start, kept) = (started(problem, &base.model, trial, score)?.0.p, model.p.clone());
        model.p = start;
        let found = gauss_newton(problem, &mut model, whitener);
        let residual = model.residual(problem);
        let now_white = whitener.apply(layout, &residual);
        let now = objective(&now_white, &model);
        if found && now < best {
            (best, white, at.residual) = (now, now_white, residual);
            at.columns = columns(problem, base, &model, &own, true);
        } else {
            model.p = kept;
        }
    }
    let held_out = held_out(layout, &model, whitener, &at, &own, &base.white, &white)?;
    let pair =
        Pair { before: &base.white, after: &white, raw_before: &base.at.residual, raw_after: &at.residual };
    let tension = base.model.penalty() - model.penalty();
    let evidence = Evidence::of(layout, &pair, tension, trial.parameters, &held_out, channel_std);
    let refused =
        impossible(&base.model, &model, &own).or_else(|| vague(problem, whitener, &model, &at, &own, new));
    Some(Refit {
        trial: trial.clone(),
        fitted: Fitted { model, at, white, objective: best },
        evidence,
        refused,
    })
}

// Undamped steps with all columns new each time, whatever the objective says on the way.
fn gauss_newton(problem: &Problem, model: &mut Candidate, whitener: &Whitener) -> bool {
    for _ in 0..VALLEY_STEPS {
        let at = model.linearise(problem);
        let finite = at.residual.iter().chain(at.columns.iter().flatten()).all(|x| x.is_finite());
        let Some(equations) = finite.then(|| Equations::new(whitener, problem, model, &at, 0.0)).flatten()
        else {
            return false;
        };
        for (unknown, step) in model.unknowns.iter().zip(&equations.step) {
            model.p[unknown.position] = unknown.moved(model.p[unknown.position], *step);
        }
    }
    true
}

// The extended model at the screened values, and which of its unknowns are the candidate's.
fn started(
    problem: &Problem,
    base: &Candidate,
    trial: &Trial,
    score: &Score,
) -> Option<(Candidate, Vec<usize>)> {
    match &trial.how {
        How::Release { unknowns } => {
            let mut model = Candidate::new(problem, base.specs.clone()).ok()?;
            model.unknowns = base.unknowns.clone();
            model.p = base.p.clone();
            for &k in unknowns {
                model.unknowns[k].prior = None;
            }
            Some((model, unknowns.clone()))
        }
        How::New { spec, strengths, exact } => {
            let mut specs = base.specs.clone();
            specs.push(spec.clone());
            let mut model = Candidate::new(problem, specs).ok()?;
            let effect = base.specs.len();
            let first = model.plant.range(effect).start;
            let mut p = base.p.clone();
            p.extend_from_slice(&model.p[first..]);
            for (k, &s) in strengths.iter().enumerate() {
                p[first + s] = if *exact {
                    p[first + s] * score.strengths[0].clamp(0.3, 3.0)
                } else {
                    score.strengths[k]
                };
            }
            model.p = p;
            if model.plant.elastic() != base.plant.elastic() {
                // A rigid base has bent its parameters to imitate the spring: back to what was stated.
                for u in base.unknowns.iter() {
                    if let Some((mean, _)) = u.prior {
                        model.p[u.position] = mean;
                    }
                }
            }
            let mut new = Unknown::of_effect(&model.plant, effect);
            for unknown in &mut new {
                if !unknown.shape {
                    unknown.prior = None;
                    unknown.scale = model.p[unknown.position].abs().max(1e-9);
                }
            }
            let own = (base.unknowns.len()..base.unknowns.len() + new.len()).collect();
            model.unknowns = base.unknowns.iter().cloned().chain(new).collect();
            Some((model, own))
        }
    }
}

fn columns(
    problem: &Problem,
    base: &Fitted,
    model: &Candidate,
    own: &[usize],
    structural: bool,
) -> Vec<Vec<f64>> {
    if structural {
        let positions: Vec<usize> = model.unknowns.iter().map(|u| u.position).collect();
        return problem.form.columns(&model.plant, &model.p, &positions);
    }
    let mut columns = base.at.columns.clone();
    let positions: Vec<usize> =
        own.iter().filter(|&&k| k >= columns.len()).map(|&k| model.unknowns[k].position).collect();
    columns.extend(problem.form.columns(&model.plant, &model.p, &positions));
    columns
}

// Per fold: ‖r₀‖² − ‖r₁ − Z⊥ δ‖², with δ the candidate's change of strengths when the fold is left out.
fn held_out(
    layout: &Layout,
    model: &Candidate,
    whitener: &Whitener,
    at: &Linearised,
    own: &[usize],
    before: &[f64],
    after: &[f64],
) -> Option<Vec<f64>> {
    let of_shape = |shape: bool| own.iter().copied().filter(move |&k| model.unknowns[k].shape == shape);
    let mut strengths: Vec<usize> = of_shape(false).collect();
    if strengths.is_empty() {
        strengths = of_shape(true).collect();
    }
    let white = whitener.apply_all(layout, &at.columns);
    let others: Vec<Vec<f64>> =
        (0..white.len()).filter(|k| !own.contains(k)).map(|k| white[k].clone()).collect();
    let z: Vec<Vec<f64>> = strengths.iter().map(|&k| white[k].clone()).collect();
    let mut orthogonal = matrix(&z);
    if !others.is_empty() {
        let j = matrix(&others);
        let mut a = cross(&j, &j);
        let kept: Vec<usize> = (0..white.len()).filter(|k| !own.contains(k)).collect();
        for (i, &k) in kept.iter().enumerate() {
            a[(i, i)] += model.unknowns[k].weight();
        }
        let share = Normal::new(&a)?.solve_many(&cross(&j, &orthogonal));
        orthogonal -= &j * share;
    }
    let k = strengths.len();
    let mut folds = vec![(faer::Mat::<f64>::zeros(k, k), vec![0.0; k], 0.0); layout.folds];
    for row in 0..layout.len {
        let (s, b, gain) = &mut folds[layout.fold[row]];
        *gain += before[row] * before[row] - after[row] * after[row];
        for i in 0..k {
            b[i] += orthogonal[(row, i)] * after[row];
            for l in 0..k {
                s[(i, l)] += orthogonal[(row, i)] * orthogonal[(row, l)];
            }
        }
    }
    let mut total = (faer::Mat::<f64>::zeros(k, k), vec![0.0; k]);
    for (s, b, _) in &folds {
        total.0 += s;
        total.1.iter_mut().zip(b).for_each(|(t, x)| *t += x);
    }
    let left_out = |(s, b, gain): &(faer::Mat<f64>, Vec<f64>, f64)| {
        let rest: Vec<f64> = total.1.iter().zip(b).map(|(t, x)| t - x).collect();
        let Some(normal) = Normal::new(&(&total.0 - s)) else { return 0.0 };
        let d = normal.solve(&rest);
        let quadratic: f64 = (0..k).map(|i| (0..k).map(|l| d[i] * s[(i, l)] * d[l]).sum::<f64>()).sum();
        gain + 2.0 * dot(&d, b) - quadratic
    };
    Some(folds.iter().map(left_out).collect())
}

// A strength that its own error covers is no effect: the rest of the model had not settled.
fn vague(
    problem: &Problem,
    whitener: &Whitener,
    model: &Candidate,
    at: &Linearised,
    own: &[usize],
    new: bool,
) -> Option<String> {
    let variances = Equations::new(whitener, problem, model, at, 0.0)?.normal.variances();
    let sure = |k: usize| model.p[model.unknowns[k].position].abs() > 2.0 * variances[k].max(0.0).sqrt();
    let strengths: Vec<usize> = own.iter().copied().filter(|&k| !model.unknowns[k].shape).collect();
    (new && !strengths.is_empty() && !strengths.into_iter().any(sure))
        .then(|| "its strength is within two standard deviations of zero".to_owned())
}

// A parameter that must be positive and is driven to zero, or a strength that vanishes, speaks against the candidate.
fn impossible(base: &Candidate, model: &Candidate, own: &[usize]) -> Option<String> {
    let name = |u: &Unknown| {
        let active = &model.plant.effects()[u.id.effect];
        format!("{} of {}", active.effect.card().parameters[u.id.parameter].key, active.label())
    };
    for (k, u) in model.unknowns.iter().enumerate() {
        let value = model.p[u.position];
        if u.range.0 == 0.0 && !u.shape {
            if own.contains(&k) {
                if value <= 0.0 {
                    return Some(format!("{} ends at zero", name(u)));
                }
            } else if let Some(before) = base.unknowns.get(k).map(|b| base.p[b.position])
                && value < 0.1 * before
            {
                return Some(format!("drives {} to zero", name(u)));
            }
        }
    }
    None
}
