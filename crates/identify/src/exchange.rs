//! The exchange: what was accepted while others were missing may stand for its neighbour in the catalogue.
//!
//! A dead time that is named while a harmonic is missing, too, may turn out to be a lag beside it. Each accepted effect is
//! taken out of the finished model, and what else passed when it was accepted is put in its place.

mod drives;

use sinew_model::EffectSpec;

use crate::IdentifyError;
use crate::explore::{
    CHANCE, Rung, Unseen, WORSE, accepted_without, error, evidence_between, fall_between, is_likelier, rung,
    without,
};
use crate::gates::z_between;
use crate::problem::{Candidate, Problem, refine};
use crate::refit::{Fitted, Refit};
use crate::residual::Layout;
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
    // Logged torques were taken as held then; those of moments make up for the way in which a drive is late.
    were_held: bool,
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
        let is_late_otherwise = |o: &Other| {
            let reduced = without(search.problem, &state.fitted.model, entry).ok();
            let with = reduced.and_then(|reduced| extended(search.problem, &reduced, &o.spec).ok());
            with.is_some_and(|with| drives::are_late_otherwise(state, &with, o.were_held))
        };
        // Of what is tied the simpler one was taken; drives that are late in different ways differ by what no model foretells.
        let others: Vec<Other> = (entry.others.iter().filter(|o| is_new(o)).cloned())
            .map(|o| Other { is_near: o.is_near && (!is_tied(&o) || is_late_otherwise(&o)), ..o })
            .filter(|o| o.is_near || !is_alone || is_late_otherwise(o))
            .collect();
        for other in &others {
            let tie = |state: &mut State, distance: f64| {
                let rivals = &mut state.accepted[k].rivals;
                rivals.retain(|(trial, _)| trial.label() != other.trial.label());
                rivals.push((other.trial.clone(), distance));
            };
            match compared(search, state, k, other, unseen)? {
                Compared::Worse => {}
                Compared::Tied(distance) => tie(state, distance),
                Compared::Itself(settled, tied) => {
                    *state = *settled;
                    told_anew(search, state, rungs, unseen);
                    tied.into_iter().for_each(|distance| tie(state, distance));
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
    if let Some(settled) = drives::settled_itself(search, state)? {
        *state = settled;
        told_anew(search, state, rungs, unseen);
    }
    Ok(any)
}

// The last rung is that of this state.
fn told_anew(search: &Search, state: &State, rungs: &mut [Rung], unseen: Option<&Unseen>) {
    if let Some(last) = rungs.last_mut() {
        *last = rung(search, &std::mem::take(&mut last.added), state, unseen);
    }
}

// Another effect in the place of an accepted one.
enum Compared {
    Worse,
    // By its χ² disadvantage.
    Tied(f64),
    // The settled state, and by how much its objective is lower.
    Better(Box<State>, f64),
    // The same effects, settled in other rows, and the χ² disadvantage of the other if it is tied.
    Itself(Box<State>, Option<f64>),
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
    let are_late = drives::are_late_otherwise(state, &with.model, other.were_held);
    let tied = distance < TIE_CHI || z_between(layout, &with.white, &state.fitted.white) < TIE_Z;
    let equal = if tied { Compared::Tied(distance) } else { Compared::Worse };
    // About a motion of its own, what explains nearly as much may explain more.
    let is_near = (other.is_near && with.objective < REACH * state.fitted.objective) || are_late;
    if !is_near && gain < (BETTER_SHARE * replaced.evidence.data).max(BETTER * temper) {
        return Ok(equal);
    }
    let evidence = evidence_between(search, &fitted(reduced), &with, other.trial.parameters);
    if !are_late && evidence.refused(problem.options, 1).is_some() {
        return Ok(equal);
    }
    let mut accepted = accepted_without(&state.accepted, k);
    let effect = with.model.specs.len() - 1;
    let (rivals, others) = (Vec::new(), Vec::new());
    accepted.push(Accepted { trial: other.trial.clone(), effect, evidence, rivals, others });
    if are_late {
        let next = search.led_as_held(&with.model, whitener)?;
        return drives::compared(search, state, k, next, accepted);
    }
    let next = search.led_anew(with.model, |model| search.descended(model, whitener), false)?;
    let is_unlikelier = fall_between(reference, next.reference.as_ref()).is_some_and(|fall| fall <= CHANCE);
    if !is_unlikelier {
        let next = search.settled_led(next, accepted)?;
        let is_likelier = is_likelier(search, state, &next, CHANCE, unseen);
        if is_likelier && error(search, &next, unseen) < WORSE * error(search, state, unseen) {
            return Ok(Compared::Better(Box::new(next), gain));
        }
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

/// The candidates that passed beside one of a round and explain a good part of what it does in the same joint, best first.
pub(crate) fn others(state: &State, layout: &Layout, passed: &[Refit], one: &Refit) -> Vec<Other> {
    // Torque and position of a joint tell of the same effect: which of them tells more is often chance.
    let joint = |r: &Refit| layout.channels[r.evidence.channel].dof;
    let explains = |r: &Refit| r.evidence.data + r.evidence.tension;
    let is_near = |r: &&Refit| {
        r.trial.label() != one.trial.label()
            && matches!(r.trial.how, How::New { .. })
            && joint(r) == joint(one)
            && explains(r) > GOOD_PART * explains(one)
    };
    let of = |r: &Refit| {
        let spec = r.fitted.model.present_specs(None).pop()?;
        let is_near = explains(r) > NEAR * explains(one);
        Some(Other { trial: r.trial.clone(), spec, is_near, were_held: drives::are_held(state) })
    };
    passed.iter().filter(is_near).take(MOST).filter_map(of).collect()
}

// Share of what was accepted that another must explain to be tried in its place, that from which on it is tried about a
// motion of its own, and how many are.
const GOOD_PART: f64 = 0.3;
const NEAR: f64 = 0.7;
// What leaves more times as much beside the rest, about the motion that is there, leaves more about one of its own, too.
const REACH: f64 = 2.0;
const MOST: usize = 3;
