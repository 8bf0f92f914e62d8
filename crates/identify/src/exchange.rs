//! The exchange: what was accepted while others were missing may stand for its neighbour in the catalogue.
//!
//! A dead time that is named while a harmonic is missing, too, may turn out to be a lag beside it. Each accepted effect is
//! taken out of the finished model, and what else passed when it was accepted is put in its place.

use sinew_model::EffectSpec;

use crate::IdentifyError;
use crate::explore::{
    CHANCE, Rung, Unseen, WORSE, accepted_without, error, evidence_between, is_likelier, rung, without,
};
use crate::gates::z_between;
use crate::problem::{Candidate, Problem, refine};
use crate::refit::{Fitted, Refit};
use crate::search::{Accepted, Search, State, TIE_CHI, TIE_Z};
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;

/// A candidate that passed beside one that was accepted, as it was fitted then.
#[derive(Debug, Clone)]
pub(crate) struct Other {
    pub trial: Trial,
    pub spec: EffectSpec,
    // It explained nearly as much about a motion that neither has led.
    is_near: bool,
}

// Fall of the objective that an exchange must bring, and as a share of what the effect to be exchanged explains.
const BETTER: f64 = 10.0;
const BETTER_SHARE: f64 = 0.01;

/// Exchanges accepted effects for others that explain more beside the rest, each at most once; what explains as much is a
/// rival. True if any was exchanged.
pub(crate) fn exchanged(
    search: &mut Search,
    state: &mut State,
    rungs: &mut Vec<Rung>,
    unseen: Option<&Unseen>,
) -> Result<bool, IdentifyError> {
    // What stands alone was compared with the others when it was accepted, but about the same motion.
    let is_alone = state.accepted.len() < 2;
    let labels: Vec<String> = state.accepted.iter().map(|a| a.trial.label()).collect();
    let mut any = false;
    for label in labels {
        let Some(k) = state.accepted.iter().position(|a| a.trial.label() == label) else { continue };
        let entry = &state.accepted[k];
        let is_tied = |o: &Other| entry.rivals.iter().any(|(trial, _)| trial.label() == o.trial.label());
        let is_new = |o: &Other| {
            let own = o.trial.label();
            !search.banned.contains(&own) && state.accepted.iter().all(|a| a.trial.label() != own)
        };
        // Of what is tied the simpler one was taken.
        let others: Vec<Other> = (entry.others.iter().filter(|o| is_new(o)).cloned())
            .map(|o| Other { is_near: o.is_near && !is_tied(&o), ..o })
            .filter(|o| o.is_near || !is_alone)
            .collect();
        for other in &others {
            match compared(search, state, k, other, unseen)? {
                Compared::Worse => {}
                Compared::Tied(distance) => {
                    let rivals = &mut state.accepted[k].rivals;
                    rivals.retain(|(trial, _)| trial.label() != other.trial.label());
                    rivals.push((other.trial.clone(), distance));
                }
                Compared::Better(next, gain) => {
                    let by = other.trial.label();
                    let reason = format!("{by} in its place explains {gain:.0} more");
                    search.refuse(&state.accepted[k].trial, rungs.len(), reason);
                    *state = *next;
                    rungs.push(rung(search, &[format!("−{label}"), by], state, unseen));
                    any = true;
                    break;
                }
            }
        }
    }
    Ok(any)
}

// Another effect in the place of an accepted one.
enum Compared {
    Worse,
    // By its χ² disadvantage.
    Tied(f64),
    // The settled state, and by how much its objective is lower.
    Better(Box<State>, f64),
}

fn compared(
    search: &Search,
    state: &State,
    k: usize,
    other: &Other,
    unseen: Option<&Unseen>,
) -> Result<Compared, IdentifyError> {
    let (problem, whitener) = (search.problem, &state.whitener);
    let layout = problem.form.layout();
    let fitted = |mut model: Candidate| {
        let at = model.linearise(problem);
        let at = refine(problem, &mut model, whitener, at, 6);
        Fitted::of(layout, whitener, model, at)
    };
    let reduced = without(problem, &state.fitted.model, &state.accepted[k])?;
    let with = fitted(extended(problem, &reduced, &other.spec)?);
    let (replaced, reference) = (&state.accepted[k], state.reference.as_ref());
    let gain = state.fitted.objective - with.objective;
    let temper = replaced.evidence.temper;
    let charge = other.trial.parameters as f64 - replaced.trial.parameters as f64;
    let distance = -gain / temper + charge * (layout.len.max(2) as f64).ln();
    if !distance.is_finite() {
        return Ok(Compared::Worse);
    }
    let tied = distance < TIE_CHI || z_between(layout, &with.white, &state.fitted.white) < TIE_Z;
    let equal = if tied { Compared::Tied(distance) } else { Compared::Worse };
    // About a motion of its own, what explains nearly as much may explain more.
    if !other.is_near && gain < (BETTER_SHARE * replaced.evidence.data).max(BETTER * temper) {
        return Ok(equal);
    }
    let evidence = evidence_between(search, &fitted(reduced), &with, other.trial.parameters);
    if evidence.refused(problem.options, 1).is_some() {
        return Ok(equal);
    }
    let mut accepted = accepted_without(&state.accepted, k);
    let effect = with.model.specs.len() - 1;
    let (rivals, others) = (Vec::new(), Vec::new());
    accepted.push(Accepted { trial: other.trial.clone(), effect, evidence, rivals, others });
    let next = search.settled_anew(with.model, |model| search.descended(model, whitener), accepted)?;
    let is_likelier = is_likelier(search, state, &next, CHANCE, unseen);
    if is_likelier && error(search, &next, unseen) < WORSE * error(search, state, unseen) {
        return Ok(Compared::Better(Box::new(next), gain));
    }
    reference.iter().for_each(|reference| problem.form.adopt(reference));
    Ok(equal)
}

// A model with one more effect, all of its parameters free.
fn extended(problem: &Problem, model: &Candidate, spec: &EffectSpec) -> Result<Candidate, IdentifyError> {
    let mut specs = model.specs.clone();
    specs.push(spec.clone());
    let mut extended = Candidate::new(problem, specs)?;
    let own = Unknown::of_effect(&extended.plant, model.specs.len());
    extended.unknowns = model.unknowns.iter().cloned().chain(own).collect();
    extended.p[..model.p.len()].copy_from_slice(&model.p);
    Ok(extended)
}

/// The candidates that passed beside one of a round and explain a good part of what it does in the same channel, best first.
pub(crate) fn others(passed: &[Refit], one: &Refit) -> Vec<Other> {
    let explains = |r: &Refit| r.evidence.data + r.evidence.tension;
    let is_near = |r: &&Refit| {
        r.trial.label() != one.trial.label()
            && matches!(r.trial.how, How::New { .. })
            && r.evidence.channel == one.evidence.channel
            && explains(r) > GOOD_PART * explains(one)
    };
    let of = |r: &Refit| {
        let spec = r.fitted.model.present_specs(None).pop()?;
        Some(Other { trial: r.trial.clone(), spec, is_near: explains(r) > NEAR * explains(one) })
    };
    passed.iter().filter(is_near).take(MOST).filter_map(of).collect()
}

// Share of what was accepted that another must explain to be tried in its place, that from which on it is tried about a
// motion of its own, and how many are.
const GOOD_PART: f64 = 0.3;
const NEAR: f64 = 0.7;
const MOST: usize = 3;
