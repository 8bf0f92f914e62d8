//! The ladder: accept effects step by step, undo what makes unseen runs worse, prune what is no longer needed, exchange
//! what another explains better beside the others, merge what one of the whole robot explains.

use std::sync::Arc;

use rayon::prelude::*;

use sinew_effect::Requirement;

use crate::IdentifyError;
use crate::colour::rows_of;
use crate::comparison::by_channel;
use crate::exchange::exchanged;
use crate::fitting::parameters;
use crate::gates::{Evidence, Pair};
use crate::innovation::Reference;
use crate::merge::merged;
use crate::problem::{Candidate, Problem, refine};
use crate::refit::{Fitted, Refit};
use crate::residual::Samples;
use crate::round::Round;
use crate::search::{Accepted, Columns, Search, State};
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;
use crate::verdict::rms;

/// Runs that no fit and no gate uses.
pub(crate) struct Unseen<'a> {
    pub search: &'a Search<'a>,
    /// Floors of the channels, in the units of its rows.
    pub floors: Vec<f64>,
}

impl Unseen<'_> {
    /// Residual rows of a state on the unseen runs.
    pub fn residual(&self, state: &State) -> Vec<f64> {
        state.fitted.model.residual_told(self.search.problem, state.torques())
    }
    /// Error by floor over all channels.
    pub fn total(&self, state: &State) -> f64 {
        crate::comparison::total(self.search, &self.residual(state), &self.floors)
    }

    /// Accepted effects that do not hold on these runs, each with the reason: those whose own channel gets worse; if
    /// there is none and all channels together get worse, all that are new.
    fn refused(&self, before: &State, after: &State) -> Vec<(Trial, String)> {
        let (was, is) = (self.residual(before), self.residual(after));
        let of = |residual: &[f64]| by_channel(self.search, residual, &self.floors);
        let (old, new) = (of(&was), of(&is));
        let (old_total, new_total) = (rms(old.iter().copied()), rms(new.iter().copied()));
        let added = after.added_since(before);
        let channels = &self.search.problem.form.layout().channels;
        // A run along which the model cannot be followed has no error.
        let worse = |new: f64, old: f64, channels: &[usize]| {
            (old.is_finite() && !new.is_finite())
                || (new > WORSE * old && self.is_plainly_worse(&was, &is, channels))
        };
        let is_worse = |c: usize| worse(new[c], old[c], &[c]);
        let own = added.iter().filter(|a| is_worse(a.evidence.channel)).map(|a| {
            let c = a.evidence.channel;
            let joint = self.search.problem.robot.model.dof_name(channels[c].dof);
            let signal = channels[c].signal();
            (
                a.trial.clone(),
                format!("{signal}.{joint} of unseen runs gets worse ({:.2} → {:.2} × floor)", old[c], new[c]),
            )
        });
        let own: Vec<(Trial, String)> = own.collect();
        let all: Vec<usize> = (0..channels.len()).collect();
        if own.is_empty() && worse(new_total, old_total, &all) {
            let reason = format!("unseen runs get worse ({old_total:.2} → {new_total:.2} × floor)");
            return each_refused(added, &reason);
        }
        own
    }

    // Whether squared errors of these channels grow by more than their changes differ from second to second.
    //
    //   d_b = Σ (r_after² − r_before²)/floor² of second b
    fn is_plainly_worse(&self, before: &[f64], after: &[f64], channels: &[usize]) -> bool {
        let layout = self.search.problem.form.layout();
        let mut change = vec![0.0; layout.blocks];
        for &c in channels {
            for k in rows_of(layout, c) {
                change[layout.block[k]] += (after[k].powi(2) - before[k].powi(2)) / self.floors[c].powi(2);
            }
        }
        exceeds_its_error(&change)
    }
}

// Whether a sum is larger than what its terms would make of it, were each as likely of the other sign.
fn exceeds_its_error(terms: &[f64]) -> bool {
    let (sum, squares) = terms.iter().fold((0.0, 0.0), |(s, q), d| (s + d, q + d * d));
    sum > squares.sqrt()
}

/// One step of the ladder.
pub(crate) struct Rung {
    pub added: Vec<String>,
    pub residual: Vec<f64>,
    pub unseen: Option<Vec<f64>>,
}

/// The end of a ladder and how it was climbed.
pub(crate) struct Explored {
    pub state: State,
    pub rungs: Vec<Rung>,
    /// The last round, in which nothing passed.
    pub last: Option<Round>,
}

// Steps tried for each step that may be taken.
const MOST_STEPS: usize = 2;
// A step that makes the unseen error worse by more than this share, and plainly so, is undone.
pub(crate) const WORSE: f64 = 1.01;
// Share of the promised fall of χ² that the likelihood of the log must show, and what chance may take of it.
const KEPT: f64 = 0.25;
pub(crate) const CHANCE: f64 = 10.0;
// Standard deviations from zero of a strength that is there, from what was stated of a value that is wrong.
const SURE: f64 = 2.0;

/// Climbs from the base until nothing passes the gates.
pub(crate) fn explore(
    search: &mut Search,
    base: State,
    unseen: Option<&Unseen>,
) -> Result<Explored, IdentifyError> {
    let mut state = base;
    let mut rungs = vec![rung(search, &[], &state, unseen)];
    let mut last = None;
    let most = search.problem.options.most_effects;
    let (mut step, mut known) = (1, Vec::new());
    while step <= MOST_STEPS * most && rungs.len() <= most {
        let mut round = search.round(&state, step, std::mem::take(&mut known));
        // Its scores are kept; what they were made of fills much of the memory while the next one settles.
        state.columns = Columns::new();
        if !leave_likely(search, &mut state, &mut round, step) {
            // The state stays as it is, and so do its refits but for those that depend on who leads.
            known = round.failed;
            known.retain(|refit| !refit.trial.switches_springs());
            step += 1;
            continue;
        }
        if round.passed.is_empty() {
            last = Some(round);
            break;
        }
        search.lighten(&mut state);
        let Some(next) = search.accept(&state, round)? else {
            search.restore(&mut state);
            break;
        };
        let mut next = without_passengers(search, next, state.accepted.len(), step, unseen)?;
        let mut refused = refused_once_settled(search, &state, &next, unseen);
        if !refused.is_empty()
            && let Some(both) = with_child(search, &state, &next, step, unseen)?
        {
            (next, refused) = (both, Vec::new());
        }
        if !refused.is_empty() {
            for (trial, reason) in refused {
                search.refuse(&trial, step, reason);
                search.banned.push(trial.label());
            }
            search.offer_again(&mut state);
            search.restore(&mut state);
            step += 1;
            continue;
        }
        let added: Vec<Trial> = next.added_since(&state).iter().map(|a| a.trial.clone()).collect();
        state = next;
        let labels: Vec<String> = added.iter().map(|t| t.label()).collect();
        search.problem.options.tell(&format!("  step {step}: {} explains more", labels.join(", ")));
        rungs.push(rung(search, &labels, &state, unseen));
        step += 1;
    }
    let mut state = pruned(search, state, &mut rungs, unseen)?;
    let is_other = exchanged(search, &mut state, &mut rungs, unseen)?;
    if merged(search, &mut state, &mut rungs, unseen)? || is_other {
        state = pruned(search, state, &mut rungs, unseen)?;
    }
    Ok(Explored { state, rungs, last })
}

// What is refused alone may hold with what needs it: friction that grows with the load, say, beside the plain friction that is
// a part of it. The state with both, if all holds.
fn with_child(
    search: &mut Search,
    before: &State,
    parents: &State,
    step: usize,
    unseen: Option<&Unseen>,
) -> Result<Option<State>, IdentifyError> {
    if unseen.is_none() || !parents.is_finite() {
        return Ok(None);
    }
    let added = parents.added_since(before);
    let is_child = |trial: &Trial| {
        let needs =
            |name| trial.card.requires.iter().any(|r| matches!(r, Requirement::Parent(p) if *p == name));
        added.iter().any(|parent| parent.trial.place == trial.place && needs(parent.trial.card.name))
    };
    if !parents.trials.iter().any(is_child) {
        return Ok(None);
    }
    let mut round = search.round(parents, step, Vec::new());
    round.passed.retain(|refit| is_child(&refit.trial));
    let next = search.accept(parents, round)?;
    Ok(next.filter(|next| refused_once_settled(search, before, next, unseen).is_empty()))
}

// What a step added and does not hold once the model has settled, each with the reason.
fn refused_once_settled(
    search: &Search,
    before: &State,
    after: &State,
    unseen: Option<&Unseen>,
) -> Vec<(Trial, String)> {
    if !after.is_finite() {
        return each_refused(
            after.added_since(before),
            "with it the model cannot be followed along the runs",
        );
    }
    let mut refused = unseen.map(|u| u.refused(before, after)).unwrap_or_default();
    if !search.problem.form.layout().is_much(before.fitted.objective) {
        refused.extend(unlikely(search, before, after));
        refused.extend(unsure(search, before, after));
    }
    refused
}

fn each_refused<'a>(entries: impl IntoIterator<Item = &'a Accepted>, reason: &str) -> Vec<(Trial, String)> {
    entries.into_iter().map(|entry| (entry.trial.clone(), reason.to_owned())).collect()
}

// The rows are formed about a motion in which some of the noise is left, and an effect that averages or delays it, a dead
// time above all, may gain by that alone. In the −2 log likelihood of all samples the gain is gone: it falls by what the
// rows promised and more where the effect is real. What relieves a tension promises nothing.
fn unlikely(search: &Search, before: &State, after: &State) -> Option<(Trial, String)> {
    let added = after.added_since(before);
    if added.iter().all(|a| a.evidence.is_relief()) {
        return None;
    }
    let promised = added.iter().map(|a| a.evidence.data).sum();
    let kept = search.fall_of_misfit(before, &after.fitted.model, after.reference.as_ref())?;
    let refused = |kept: f64| too_little_kept(kept, promised, "a motion of its own");
    refused(kept)?;
    let reason = refused(search.fall_in_rows(before, after)?)?;
    Some((added[0].trial.clone(), reason))
}

// False if a round had candidates and none of them is likely: those are not offered again.
fn leave_likely(search: &mut Search, state: &mut State, round: &mut Round, step: usize) -> bool {
    let taken_out = taken_out_at_once(search, state, round);
    let is_left = !round.passed.is_empty() || taken_out.is_empty();
    for (trial, reason) in taken_out {
        if !is_left {
            search.banned.push(trial.label());
            search.unlikely.push((trial.clone(), reason.clone()));
        }
        search.refuse(&trial, step, reason);
    }
    if !is_left {
        search.offer_again(state);
    }
    is_left
}

// Takes candidates out of a round that make the log no likelier about the motion that is there.
fn taken_out_at_once(search: &Search, state: &State, round: &mut Round) -> Vec<(Trial, String)> {
    let reasons: Vec<Option<String>> =
        round.passed.par_iter().map(|refit| unlikely_at_once(search, state, refit)).collect();
    let (mut likely, mut unlikely) = (Vec::new(), Vec::new());
    for (refit, reason) in round.passed.drain(..).zip(reasons) {
        match reason {
            None => likely.push(refit),
            Some(reason) => unlikely.push((refit.trial.clone(), reason)),
        }
    }
    round.passed = likely;
    unlikely
}

// Why a candidate near the noise makes the log no likelier about the motion that is there: the answer is that about a motion of
// its own, which takes a hundred times as long.
fn unlikely_at_once(search: &Search, state: &State, refit: &Refit) -> Option<String> {
    let reference = state.reference.as_ref()?;
    if search.problem.form.layout().is_much(state.fitted.objective) || refit.evidence.is_relief() {
        return None;
    }
    let (base, model) = (&state.fitted.model, &refit.fitted.model);
    let refused = |kept: f64| too_little_kept(kept, refit.evidence.data, "the present motion");
    let misfit =
        |samples, model: &Candidate| search.misfit_of(samples, model, reference, &reference.torque_noise);
    refused(reference.misfit() - misfit(Samples::All, model)?)?;
    // Where a motor creeps, no row asked the fit for a friction that goes with the motion.
    refused(misfit(Samples::OfRows, base)? - misfit(Samples::OfRows, model)?)
}

/// Candidates of the last round, in which nothing passed, that make the log no likelier, each with the reason.
pub(crate) fn unlikely_in_the_end(search: &Search, explored: &Explored) -> Vec<(Trial, String)> {
    let state = &explored.state;
    // One that was tried beside effects that are gone tells nothing.
    let is_of_state = |refit: &&Refit| {
        matches!(refit.trial.how, How::New { .. })
            && refit.fitted.model.specs.len() == state.fitted.model.specs.len() + 1
    };
    let failed: Vec<&Refit> =
        explored.last.iter().flat_map(|last| &last.failed).filter(is_of_state).collect();
    let of = |refit: &&Refit| Some((refit.trial.clone(), unlikely_at_once(search, state, refit)?));
    failed.par_iter().filter_map(of).collect()
}

// Why a fall of −2 log likelihood is less than rows promised.
fn too_little_kept(kept: f64, promised: f64, about: &str) -> Option<String> {
    let reason =
        || format!("about {about} it explains {kept:.0} of the χ² of {promised:.0} that it promised");
    (kept < KEPT * promised - CHANCE).then(reason)
}

// Effects of which nothing is left that their own error does not cover, once the model has settled about a motion of its
// own and runs may differ: strengths that are new, and stated values that were to be wrong.
fn unsure(search: &Search, before: &State, after: &State) -> Vec<(Trial, String)> {
    let reports = parameters(search, after, widening(search, after));
    let had_prior = |u: &Unknown| {
        before.fitted.model.unknowns.iter().any(|known| known.id == u.id && known.prior.is_some())
    };
    let is_new = |entry: &Accepted| matches!(entry.trial.how, How::New { .. });
    // By how many of its standard deviations it is off from a model without the effect.
    let off = |entry: &Accepted| -> Option<f64> {
        let is_its = |u: &Unknown| {
            if is_new(entry) { u.is_strength() } else { u.prior.is_none() && had_prior(u) }
        };
        let own = reports.iter().zip(&after.fitted.model.unknowns);
        own.filter(|((effect, _), u)| *effect == entry.effect && is_its(u))
            .map(|((_, r), _)| (r.value - if is_new(entry) { 0.0 } else { r.start }).abs() / r.std)
            .reduce(f64::max)
    };
    let reason = |entry: &Accepted| {
        let from = if is_new(entry) { "zero" } else { "what was stated" };
        format!("about a motion of its own it is within two standard deviations of {from}")
    };
    let added = after.added_since(before);
    let unsure = added.iter().filter(|entry| off(entry).is_some_and(|off| off < SURE));
    unsure.map(|entry| (entry.trial.clone(), reason(entry))).collect()
}

pub(crate) fn rung(search: &Search, added: &[String], state: &State, unseen: Option<&Unseen>) -> Rung {
    Rung { added: added.to_vec(), residual: search.told(state), unseen: unseen.map(|u| u.residual(state)) }
}

/// Every accepted effect is taken out in turn and the rest refitted; it goes if it no longer passes the gates.
fn pruned(
    search: &mut Search,
    mut state: State,
    rungs: &mut Vec<Rung>,
    unseen: Option<&Unseen>,
) -> Result<State, IdentifyError> {
    let mut k = 0;
    while state.accepted.len() > 1 && k < state.accepted.len() {
        let Some((candidate, reason)) = superfluous(search, &state, k, unseen)? else {
            k += 1;
            continue;
        };
        let trial = state.accepted[k].trial.clone();
        search.refuse(&trial, rungs.len(), format!("no longer needed: {reason}"));
        search.banned.push(trial.label());
        state = candidate;
        let label = format!("−{}", trial.label());
        rungs.push(rung(search, &[label], &state, unseen));
        k = 0;
    }
    Ok(state)
}

// The companions of the effect accepted as number `first`: those that do not pass beside it go before the step counts.
fn without_passengers(
    search: &mut Search,
    mut state: State,
    first: usize,
    step: usize,
    unseen: Option<&Unseen>,
) -> Result<State, IdentifyError> {
    let mut k = first + 1;
    while k < state.accepted.len() {
        let Some((candidate, reason)) = superfluous(search, &state, k, unseen)? else {
            k += 1;
            continue;
        };
        let beside = state.accepted[first].trial.label();
        search.refuse(&state.accepted[k].trial, step, format!("not needed beside {beside}: {reason}"));
        state = candidate;
    }
    Ok(state)
}

// The state without its accepted effect number `k`, refitted, and why it does without; none if it does not.
fn superfluous(
    search: &Search,
    state: &State,
    k: usize,
    unseen: Option<&Unseen>,
) -> Result<Option<(State, String)>, IdentifyError> {
    let mut reduced = without(search.problem, &state.fitted.model, &state.accepted[k])?;
    let at = reduced.linearise(search.problem);
    let at = refine(search.problem, &mut reduced, &state.whitener, at, 3);
    let reduced = Fitted::of(search.problem.form.layout(), &state.whitener, reduced, at);
    let evidence = evidence_between(search, &reduced, &state.fitted, state.accepted[k].trial.parameters);
    let Some(reason) = evidence.refused(search.problem.options, 1) else { return Ok(None) };
    let candidate = search.settled(reduced.model, reduced.at, accepted_without(&state.accepted, k))?;
    let holds = error(search, &candidate, unseen) <= WORSE * error(search, state, unseen);
    Ok((holds && candidate.is_finite()).then_some((candidate, reason)))
}

/// What speaks for one fitted model against another, both under one noise.
pub(crate) fn evidence_between(
    search: &Search,
    before: &Fitted,
    after: &Fitted,
    parameters: usize,
) -> Evidence {
    let layout = search.problem.form.layout();
    let pair = Pair {
        before: &before.white,
        after: &after.white,
        raw_before: &before.at.residual,
        raw_after: &after.at.residual,
    };
    let mut folds = vec![0.0; layout.folds];
    for row in 0..layout.len {
        folds[layout.fold[row]] += before.white[row].powi(2) - after.white[row].powi(2);
    }
    let tension = before.model.penalty() - after.model.penalty();
    Evidence::of(layout, &pair, tension, parameters, &folds, &search.channel_std)
}

/// The accepted effects of a model but number `k`, as they are numbered in the model without it.
pub(crate) fn accepted_without(accepted: &[Accepted], k: usize) -> Vec<Accepted> {
    let mut accepted = accepted.to_vec();
    let removed = accepted.remove(k);
    if matches!(removed.trial.how, How::New { .. }) {
        accepted.iter_mut().for_each(|a| a.effect -= usize::from(a.effect > removed.effect));
    }
    accepted
}

/// Error by floor: on unseen runs where there are any, else on the fitted ones.
pub(crate) fn error(search: &Search, state: &State, unseen: Option<&Unseen>) -> f64 {
    if let Some(unseen) = unseen {
        return unseen.total(state);
    }
    crate::comparison::total(search, &state.fitted.at.residual, &state.whitener.floors())
}

/// By how much −2 log likelihood falls from one reference to another; none where there is none.
pub(crate) fn fall_between(before: Option<&Arc<Reference>>, after: Option<&Arc<Reference>>) -> Option<f64> {
    Some(before?.misfit() - after?.misfit())
}

/// True if −2 log likelihood falls by more than `by` from one settled state to another, each about its own motion; where
/// there is none, if the error gets smaller.
pub(crate) fn is_likelier(
    search: &Search,
    before: &State,
    after: &State,
    by: f64,
    unseen: Option<&Unseen>,
) -> bool {
    match fall_between(before.reference.as_ref(), after.reference.as_ref()) {
        Some(fall) => fall > by,
        None => error(search, after, unseen) < error(search, before, unseen),
    }
}

/// A model without one of its accepted effects.
pub(crate) fn without(
    problem: &Problem,
    model: &Candidate,
    accepted: &Accepted,
) -> Result<Candidate, IdentifyError> {
    let Accepted { trial, effect, .. } = accepted;
    let mut specs = model.specs.clone();
    let removed = matches!(trial.how, How::New { .. });
    if removed {
        specs.remove(*effect);
    }
    let mut reduced = Candidate::new(problem, specs)?;
    let stated = reduced.unknowns.clone();
    reduced.unknowns = model
        .unknowns
        .iter()
        .filter(|u| !(removed && u.id.effect == *effect))
        .map(|u| {
            let mut unknown = u.clone();
            if removed && u.id.effect > *effect {
                unknown.id.effect -= 1;
            }
            unknown.position = reduced.plant.position(unknown.id);
            reduced.p[unknown.position] = model.p[u.position];
            if !removed && u.id.effect == *effect {
                // A released prior comes back.
                if let Some(original) = stated.iter().find(|s| s.id == unknown.id) {
                    unknown.prior = original.prior;
                }
            }
            unknown
        })
        .collect();
    Ok(reduced)
}

/// Root mean square of the whitened rows of the model, at least one: how much printed intervals are widened.
pub(crate) fn widening(search: &Search, state: &State) -> f64 {
    let layout = search.problem.form.layout();
    let rows = (0..layout.len).filter(|&k| layout.keep[k]).map(|k| state.fitted.white[k]);
    rms(rows).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Changes of either sign are no worsening, the same from second to second are one, one second alone is none.
    #[test]
    fn a_worsening_is_one_that_most_seconds_show() {
        assert!(!exceeds_its_error(&[3.0, -2.0, 2.5, -1.5, 0.5, -1.0]));
        assert!(exceeds_its_error(&[1.0, 1.1, 0.9, 1.2, 1.0]));
        assert!(!exceeds_its_error(&[-1.0, 50.0, -2.0, 0.1]));
        assert!(!exceeds_its_error(&[]));
    }
}
