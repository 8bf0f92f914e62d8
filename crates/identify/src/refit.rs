//! Refit of a screened candidate: its strengths and shapes free, everything else along.

use crate::colour::Whitener;
use crate::descent::{Descent, VALLEY};
use crate::equations::Equations;
use crate::gates::{Evidence, Pair};
use crate::heterogeneity::signs_differ;
use crate::least_squares::{Normal, cross, dot, matrix};
use crate::problem::{Candidate, Linearised, MANY, Problem, objective};
use crate::residual::Layout;
use crate::screen::Score;
use crate::starts::LEAST_DROP;
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

impl Fitted {
    /// A model at its linearisation.
    pub fn of(layout: &Layout, whitener: &Whitener, model: Candidate, at: Linearised) -> Self {
        let white = whitener.apply(layout, &at.residual);
        let objective = objective(&white, &model);
        Self { model, at, white, objective }
    }
}

/// A candidate after its refit.
pub(crate) struct Refit {
    pub trial: Trial,
    pub fitted: Fitted,
    pub evidence: Evidence,
    /// Why it is refused whatever its evidence.
    pub refused: Option<String>,
}

/// What a candidate is added to.
pub(crate) struct Base<'a> {
    pub fitted: &'a Fitted,
    pub whitener: &'a Whitener,
    /// Effects that the search itself has added: a candidate may take their place.
    pub added: &'a [usize],
}

/// Refits one candidate from its screened strengths, and from the model about which they were screened if that is not
/// the base, and gathers the evidence for it.
pub(crate) fn refit(
    problem: &Problem,
    base: &Base,
    start: Option<&Fitted>,
    trial: &Trial,
    score: &Score,
    leader: f64,
    channel_std: &[f64],
) -> Option<Refit> {
    let (added, whitener) = (base.added, base.whitener);
    let base = base.fitted;
    let layout = problem.form.layout();
    // About the stated values, and with something that swings, links are not where the base's reference has them.
    let elsewhere = start.is_some() || trial.switches_springs();
    let about = if elsewhere { problem.exact() } else { *problem };
    let mut descent = Descent::new(about, start.unwrap_or(base), whitener, trial, score)?;
    if start.is_none() {
        descent.scan();
        descent.unload(trial);
        descent.shrink();
    }
    descent.descend(leader, base.objective - LEAST_DROP);
    let structural_rival = trial.card.rivals.iter().any(|r| r.structural);
    let misses_screen = || descent.best > base.objective - 0.1 * score.drop;
    // With many unknowns exact derivatives are dear, and each is pulled a little.
    let few = base.model.unknowns.len() <= MANY;
    let strained = if few { STRAINED } else { STRAINED_EACH * descent.model.unknowns.len() as f64 };
    let is_rival_in_valley =
        || structural_rival && score.drop > VALLEY && (misses_screen() || descent.model.penalty() > strained);
    if descent.falls_short() || is_rival_in_valley() {
        descent.follow_valley(&if few { problem.exact() } else { about });
    }
    let Descent { model, own, new, at, white, best, .. } = descent;
    let (strengths, orthogonal) = orthogonal(layout, &model, whitener, &at, &own)?;
    let weights: Vec<f64> = strengths.iter().map(|&k| model.unknowns[k].weight()).collect();
    let held_out = held_out(layout, &orthogonal, &weights, &base.white, &white);
    let pair =
        Pair { before: &base.white, after: &white, raw_before: &base.at.residual, raw_after: &at.residual };
    let tension = base.model.penalty() - model.penalty();
    let trial = Trial { parameters: score.parameters, ..trial.clone() };
    let evidence = Evidence::of(layout, &pair, tension, trial.parameters, &held_out, channel_std);
    // A rigid joint fits nothing: what its friction was bent to says nothing against the spring that explains the rest.
    // Nor does that of other joints against what explains most.
    let remakes = best < REMADE * base.objective;
    let tells = |effect: usize| {
        let is_own = model.specs[effect].place == trial.place;
        !added.contains(&effect) && !(remakes && (trial.switches_springs() || !is_own))
    };
    let refused = impossible(&base.model, &model, &own, tells)
        .or_else(|| shorter_than_a_sample(&model, &own, layout.period))
        .or_else(|| {
            let [only] = strengths.as_slice() else { return None };
            let value = model.p[model.unknowns[*only].position];
            signs_differ(layout, &orthogonal, &white, value, evidence.temper)
                .then(|| "its sign differs from run to run".to_owned())
        })
        .or_else(|| if new { at_its_bound(&model, &own) } else { None })
        .or_else(|| if new { vague(problem, whitener, &model, &at, &own, &trial) } else { None });
    let fitted = Fitted { model, at, white, objective: best };
    Some(Refit { trial, fitted, evidence, refused })
}

// A candidate's strengths, and their whitened columns free of what the other parameters imitate.
fn orthogonal(
    layout: &Layout,
    model: &Candidate,
    whitener: &Whitener,
    at: &Linearised,
    own: &[usize],
) -> Option<(Vec<usize>, faer::Mat<f64>)> {
    let of_shape = |shape: bool| own.iter().copied().filter(move |&k| model.unknowns[k].shape == shape);
    let mut strengths: Vec<usize> = of_shape(false).collect();
    if strengths.is_empty() {
        strengths = of_shape(true).collect();
    }
    let white = whitener.apply_all(layout, &at.columns);
    let others: Vec<Vec<f64>> =
        (0..white.len()).filter(|k| !own.contains(k)).map(|k| white[k].clone()).collect();
    let z: Vec<Vec<f64>> = strengths.iter().map(|&k| white[k].clone()).collect();
    let mut orthogonal = matrix(layout.len, &z);
    if !others.is_empty() {
        let j = matrix(layout.len, &others);
        let mut a = cross(&j, &j);
        let kept: Vec<usize> = (0..white.len()).filter(|k| !own.contains(k)).collect();
        for (i, &k) in kept.iter().enumerate() {
            a[(i, i)] += model.unknowns[k].weight();
        }
        let share = Normal::new(&a)?.solve_many(&cross(&j, &orthogonal));
        orthogonal -= &j * share;
    }
    Some((strengths, orthogonal))
}

// Per fold: ‖r₀‖² − ‖r₁ − Z⊥ δ‖², with δ the candidate's change of strengths when the fold is left out; `weights` of their
// priors.
fn held_out(
    layout: &Layout,
    orthogonal: &faer::Mat<f64>,
    weights: &[f64],
    before: &[f64],
    after: &[f64],
) -> Vec<f64> {
    let k = orthogonal.ncols();
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
    let mut total = (faer::Mat::from_fn(k, k, |i, l| if i == l { weights[i] } else { 0.0 }), vec![0.0; k]);
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
    folds.iter().map(left_out).collect()
}

// A strength that its own error covers is no effect: the rest of the model had not settled. An effect that is switched
// on by one strength is nothing without it.
fn vague(
    problem: &Problem,
    whitener: &Whitener,
    model: &Candidate,
    at: &Linearised,
    own: &[usize],
    trial: &Trial,
) -> Option<String> {
    let variances = Equations::new(whitener, problem, model, at, 0.0)?.quadratic.normal.variances();
    let sure = |k: usize| model.p[model.unknowns[k].position].abs() > 2.0 * variances[k].max(0.0).sqrt();
    let switch = match &trial.how {
        How::New { strengths, exact: true, .. } => strengths.first().copied(),
        _ => None,
    };
    let counts = |k: usize| {
        let unknown = &model.unknowns[k];
        unknown.is_strength() && switch.is_none_or(|switch| unknown.id.parameter == switch)
    };
    let strengths: Vec<usize> = own.iter().copied().filter(|&k| counts(k)).collect();
    (!strengths.is_empty() && !strengths.into_iter().any(sure))
        .then(|| "its strength is within two standard deviations of zero".to_owned())
}

// A shape that its range stops is the sign of another cause: a Stribeck velocity as small as the width of the sign, a
// width as large as the motion. So is a strength that can be no larger: of a link that swings whole the joint gives way.
fn at_its_bound(model: &Candidate, own: &[usize]) -> Option<String> {
    own.iter().find_map(|&k| {
        let unknown = &model.unknowns[k];
        let (value, (low, high)) = (model.p[unknown.position], unknown.range);
        let stopped = value >= high * (1.0 - AT_BOUND) || (unknown.shape && value <= low * (1.0 + AT_BOUND));
        let active = &model.plant.effects()[unknown.id.effect];
        let parameter = &active.effect.card().parameters[unknown.id.parameter];
        stopped.then(|| format!("its {} ends at its bound ({value:.3} {})", parameter.key, parameter.unit))
    })
}

// Share of a bound by which a shape has reached it.
const AT_BOUND: f64 = 0.01;

// Times below the period of the commands, of which a slow log may keep one of several, are a matter of how the log was
// written, not of the robot; what a log keeps of the others tells no less than half of its own period either.
const COMMANDS: f64 = 1e-3;
const TOLD: f64 = 0.5;

fn shorter_than_a_sample(model: &Candidate, own: &[usize], period: f64) -> Option<String> {
    let of = |k: &usize| {
        let unknown = &model.unknowns[*k];
        let active = &model.plant.effects()[unknown.id.effect];
        let parameter = &active.effect.card().parameters[unknown.id.parameter];
        (parameter.unit == "s" && !unknown.shape).then_some(model.p[unknown.position].abs())
    };
    let time = own.iter().filter_map(of).fold(f64::NAN, f64::max);
    let least = period.min(COMMANDS.max(TOLD * period));
    (time < least).then(|| format!("{:.2} ms are less than this log tells of times", 1e3 * time))
}

// χ² of the priors at the end of a descent above which a candidate that scales them all may not have arrived.
const STRAINED: f64 = 9.0;
// The same by unknown where there are many.
const STRAINED_EACH: f64 = 0.5;

// Standard deviations from zero of a stated parameter that is there for sure.
const SURE: f64 = 3.0;

// Share of the objective below which a new degree of freedom has made another model of what it was offered to.
const REMADE: f64 = 0.5;

// Strengths that all vanish, or a stated parameter that must be positive and is driven from its value in the base to zero,
// if its effect tells anything, speak against the candidate.
fn impossible(
    base: &Candidate,
    model: &Candidate,
    own: &[usize],
    tells: impl Fn(usize) -> bool,
) -> Option<String> {
    let name = |u: &Unknown| {
        let active = &model.plant.effects()[u.id.effect];
        format!("{} of {}", active.effect.card().parameters[u.id.parameter].key, active.label())
    };
    let strength = |k: usize| (&model.unknowns[k], model.p[model.unknowns[k].position]);
    let positive = |u: &Unknown| u.range.0 == 0.0 && !u.shape;
    let mut strengths = own.iter().map(|&k| strength(k)).filter(|(u, _)| u.is_strength());
    if strengths.clone().all(|(u, value)| positive(u) && value <= 0.0)
        && let Some((u, _)) = strengths.next()
    {
        return Some(format!("{} ends at zero", name(u)));
    }
    let others = (0..model.unknowns.len()).filter(|k| !own.contains(k)).map(|k| (k, strength(k)));
    others.filter(|(_, (u, _))| positive(u) && tells(u.id.effect)).find_map(|(k, (u, value))| {
        let before = base.p[base.unknowns.get(k)?.position];
        // What is not sure to be there may go.
        let is_sure = u.prior.is_none_or(|(mean, std)| mean > SURE * std);
        (is_sure && value < 0.1 * before).then(|| format!("drives {} to zero", name(u)))
    })
}
