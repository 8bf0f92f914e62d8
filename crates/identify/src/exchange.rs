//! The exchange: what was accepted while others were missing may stand for its neighbour in the catalogue.
//!
//! A dead time that is named while a harmonic is missing, too, may turn out to be a lag beside it. Each accepted effect is
//! taken out of the finished model, and what else passed when it was accepted is put in its place.

use std::sync::Arc;

use sinew_effect::Actuation;
use sinew_model::EffectSpec;
use sinew_plant::{Dynamics, LinkState};

use crate::IdentifyError;
use crate::colour::Whitener;
use crate::explore::{
    CHANCE, Rung, Unseen, WORSE, accepted_without, error, evidence_between, fall_between, is_likelier, rung,
    without,
};
use crate::gates::z_between;
use crate::innovation::Reference;
use crate::problem::{Candidate, Problem, objective, refine};
use crate::record::Record;
use crate::refit::{Fitted, Refit};
use crate::residual::{Layout, Samples};
use crate::search::{Accepted, Search, State, TIE_CHI, TIE_Z};
use crate::settle::Led;
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
            with.is_some_and(|with| are_late_otherwise(state, &with, o.were_held))
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
    if let Some(settled) = settled_itself(search, state)? {
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
    let are_late = are_late_otherwise(state, &with.model, other.were_held);
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
        let next = search.led_as_held(with.model, whitener)?;
        return drives_compared(search, state, k, next, accepted);
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

// True if one drive that is late has taken the place of another, and logged torques are held, or were.
fn are_late_otherwise(before: &State, after: &Candidate, were_held: bool) -> bool {
    let differ = |(a, b): (&Actuation<f64>, &Actuation<f64>)| {
        is_late(a) && is_late(b) && (a.lag > 0.0) != (b.lag > 0.0)
    };
    (are_held(before) || were_held) && drives(&before.fitted.model).iter().zip(&drives(after)).any(differ)
}

fn is_late(drive: &Actuation<f64>) -> bool {
    drive.lag + drive.delay > 0.0
}

fn are_held(state: &State) -> bool {
    state.reference.as_ref().is_some_and(|reference| reference.torques.early == 0.0)
}

// A state with drives that are late, settled once more with the whole of the logged torques passing them, if one of them lags or the
// log is likelier so; none else.
fn settled_itself(search: &Search, state: &State) -> Result<Option<State>, IdentifyError> {
    let are_late = are_held(state) && drives(&state.fitted.model).iter().any(is_late);
    if !are_late || state.reference.as_ref().is_some_and(|reference| reference.torques.is_whole()) {
        return Ok(None);
    }
    let own = search.led_driven(&state.fitted.model, state.reference.as_ref(), &state.whitener)?;
    let is_of_readings = is_noise_of_readings(search, state.reference.as_ref(), &own);
    if own.is_finite() && !is_of_readings && is_better_driven(search, state, &own) {
        return search.settled_led(own, state.accepted.clone()).map(Some);
    }
    state.reference.iter().for_each(|reference| search.problem.form.adopt(reference));
    Ok(None)
}

fn is_better_driven(search: &Search, before: &State, own: &Led) -> bool {
    let without = || search.misfit_driven(&before.fitted.model, before.reference.as_ref(), 0.0);
    lag(&own.model) > 0.0 || without().is_some_and(|without| without > own.misfit() + CHANCE)
}

// Two drives that are late in different ways, both settled once more with the whole of the logged torques passing them: what a model
// does not foretell, a controller's answers to noise, a dead time lets through and a lag does not.
//
// If torques were read with noise, the log is likelier with a drive that smooths them. So the one that smooths less is asked once more
// with torques that are smoothed as much, but come no later.
fn drives_compared(
    search: &Search,
    state: &State,
    k: usize,
    next: Led,
    accepted: Vec<Accepted>,
) -> Result<Compared, IdentifyError> {
    let driven = |model: &Candidate, reference: &Option<Arc<Reference>>| {
        search.led_driven(model, reference.as_ref(), &state.whitener)
    };
    let mut own = driven(&state.fitted.model, &state.reference)?;
    let mut other = driven(&next.model, &next.reference)?;
    let (delayed, lagging) =
        if lag(&own.model) > lag(&other.model) { (&other, &own) } else { (&own, &other) };
    if is_noise_of_readings(search, delayed.reference.as_ref(), lagging) {
        return compared_as_read(search, state, k, next, [&own, &other], accepted);
    }
    // Motions in valleys that lie apart, of other joints too, would be compared in place of the drives.
    if other.misfit() > own.misfit() {
        other = search.led_driven_beside(other, &own, &state.whitener)?;
    } else {
        own = search.led_driven_beside(own, &other, &state.whitener)?;
    }
    let (lag_of_own, lag_of_other) = (lag(&own.model), lag(&other.model));
    let lowest = |of: &Led, lag: f64, of_the_other: f64| {
        let smoothed = || search.misfit_driven(&of.model, of.reference.as_ref(), of_the_other);
        let smoothed = if of_the_other > lag { smoothed() } else { None };
        smoothed.map_or(of.misfit(), |smoothed| smoothed.min(of.misfit()))
    };
    let fall = lowest(&own, lag_of_own, lag_of_other) - lowest(&other, lag_of_other, lag_of_own);
    let fall = fall / state.accepted[k].evidence.temper;
    if other.is_finite() && fall > CHANCE {
        return in_its_place(search, &state.accepted[k], fall, fall, (other, accepted));
    }
    let tied = Some((-fall).max(0.0)).filter(|distance| *distance < TIE_CHI);
    if own.is_finite() && is_better_driven(search, state, &own) {
        let own = search.settled_led(own, state.accepted.clone())?;
        return Ok(Compared::Itself(Box::new(own), tied));
    }
    state.reference.iter().for_each(|reference| search.problem.form.adopt(reference));
    Ok(tied.map_or(Compared::Worse, Compared::Tied))
}

// A drive in the place of another that explains so much less, which becomes its rival at this distance.
fn in_its_place(
    search: &Search,
    replaced: &Accepted,
    gain: f64,
    distance: f64,
    (other, accepted): (Led, Vec<Accepted>),
) -> Result<Compared, IdentifyError> {
    let mut other = search.settled_led(other, accepted)?;
    if let Some(entry) = other.accepted.last_mut() {
        entry.rivals.push((replaced.trial.clone(), distance));
    }
    Ok(Compared::Better(Box::new(other), gain))
}

// True if the noise of the logged torques is one of their readings and does not act: where no drive takes it away all of it is missing in
// the motion, and with a lag no less than what a lag leaves of it.
//
// σ_d ≈ σ_read,   σ_T ≥ σ_read √(h/2T)
fn is_noise_of_readings(search: &Search, delayed: Option<&Arc<Reference>>, lagging: &Led) -> bool {
    let read = search.problem.form.read_noise();
    let step = search.problem.form.layout().period;
    let (Some(all), Some(left)) = (delayed, &lagging.reference) else { return false };
    let drives = drives(&lagging.model);
    let is_read = |(joint, dof): (usize, usize)| {
        let (time, read) = (drives[dof].lag, read[joint]);
        let is_all = (1.0 / ALL_READ..ALL_READ).contains(&(all.torque_noise[joint] / read));
        time > 0.0 && is_all && left.torque_noise[joint] > read * (step / (2.0 * time)).sqrt()
    };
    !read.is_empty() && search.sensors.moving().enumerate().any(is_read)
}

// How close noise is to what was read that is all of it.
const ALL_READ: f64 = 1.15;

// Two drives that are late in different ways under torques of which the noise does not act, in the samples whose rows count: where a
// motor creeps, friction tells as much of a drive as its time does. What the models foretell passes the drives. Two more must not tell
// the contrary, or neither is told: all of the logged torques besides, smoothed as far as the log is likeliest with either drive, and
// the imposed residual, for which noise is one of readings. A lag is likelier in the first two by as much as a smoother leaves of that
// noise in what it foretells: only one that is likelier by far more needs no other witness, and of two that are not told apart the first
// is that of the imposed residual.
fn compared_as_read(
    search: &Search,
    state: &State,
    k: usize,
    next: Led,
    [own, other]: [&Led; 2],
    accepted: Vec<Accepted>,
) -> Result<Compared, IdentifyError> {
    let in_rows = |model: &Candidate, reference: Option<&Arc<Reference>>| {
        reference.and_then(|about| search.misfit_of(Samples::OfRows, model, about, &about.torque_noise))
    };
    let longest = lag(&own.model).max(lag(&other.model));
    let lowest = |led: &Led| {
        let smoothed = |share: &f64| {
            let driven = search.reference_driven(&led.model, led.reference.as_ref(), share * longest);
            in_rows(&led.model, driven.as_ref())
        };
        SMOOTHED.iter().filter_map(smoothed).reduce(f64::min)
    };
    // A fit that the model without it led astray may not find back: another begins where the drives had all of the torques.
    let own_next = search.led_foretold(own, &state.whitener)?;
    let next = next.or_likelier(search.led_foretold(other, &state.whitener)?);
    let in_rows_of = |led: &Led| in_rows(&led.model, led.reference.as_ref());
    let before = in_rows(&state.fitted.model, state.reference.as_ref());
    let before = [before, in_rows_of(&own_next)].into_iter().flatten().reduce(f64::min);
    let after = in_rows_of(&next);
    let fall = |(before, after): (f64, f64)| (before - after) / state.accepted[k].evidence.temper;
    let foretold = before.zip(after).map(fall);
    // None where a drive needs torques of moments.
    let smoothed = lowest(own).zip(lowest(other)).map(fall);
    let is_lag = lag(&next.model) > lag(&state.fitted.model);
    let for_a_lag = foretold.map_or(0.0, |fall| if is_lag { fall } else { -fall });
    let samples: usize = search.records.iter().map(Record::len).sum();
    let imposed = || imposed_objectives(search, &state.fitted.model, &next.model).map(fall);
    let imposed = if for_a_lag > LEFT_IN_FORETOLD * samples as f64 { None } else { imposed() };
    state.reference.iter().for_each(|reference| search.problem.form.adopt(reference));
    let Some(foretold) = foretold else { return Ok(Compared::Worse) };
    let told = least_told(foretold, smoothed, imposed);
    let distance = told.map_or(0.0, f64::abs);
    // The imposed residual takes no noise for a motion.
    let is_other = imposed.map_or_else(|| told.is_some_and(|fall| fall > CHANCE), |fall| fall > 0.0);
    if next.is_finite() && is_other {
        let gain = imposed.unwrap_or(foretold);
        return in_its_place(search, &state.accepted[k], gain, distance, (next, accepted));
    }
    let tied = Some(distance).filter(|distance| *distance < TIE_CHI);
    if own_next.is_finite() && own_next.misfit() < state.misfit() - CHANCE {
        let own = search.settled_led(own_next, state.accepted.clone())?;
        return Ok(Compared::Itself(Box::new(own), tied));
    }
    Ok(tied.map_or(Compared::Worse, Compared::Tied))
}

// The smaller of what is foretold and what the imposed residual tells; none where one tells the contrary, or torques that are smoothed
// do by a quarter of what is foretold or more.
fn least_told(foretold: f64, smoothed: Option<f64>, imposed: Option<f64>) -> Option<f64> {
    let [smoothed, imposed] = [smoothed, imposed].map(|told| told.unwrap_or(foretold));
    let are_contrary = foretold * imposed <= 0.0
        || (foretold * smoothed < 0.0 && foretold.abs() < OUTWEIGHS * smoothed.abs());
    (!are_contrary).then(|| foretold.abs().min(imposed.abs()).copysign(foretold))
}

// The objectives of two models in the rows of the imposed residual, each fitted there, under the noise that one of them leaves, for which
// they differ less; none where these rows are not known, or both leave more than noise in them.
fn imposed_objectives(search: &Search, one: &Candidate, other: &Candidate) -> Option<(f64, f64)> {
    let asked = search.yardstick();
    let (problem, layout) = (asked.problem, asked.problem.form.layout());
    if problem.form.is_white() {
        return None;
    }
    let fitted = |model: &Candidate| {
        let mut model = model.again(problem).ok()?;
        let at = model.linearise(problem);
        let noise = asked.noise(&model, &at.residual, &at.slices());
        let at = refine(problem, &mut model, &noise, at, 6);
        Some((model, at.residual, noise))
    };
    let (one, other) = (fitted(one)?, fitted(other)?);
    let under = |noise: &Whitener| {
        let [one, other] =
            [&one, &other].map(|(m, residual, _)| objective(&noise.apply(layout, residual), m));
        (one, other)
    };
    let fall = |(one, other): &(f64, f64)| (one - other).abs();
    let kept = layout.keep.iter().filter(|kept| **kept).count() as f64;
    let told = [under(&one.2), under(&other.2)].into_iter().min_by(|a, b| fall(a).total_cmp(&fall(b)));
    told.filter(|(one, other)| one.min(*other) < LEAVES_NOISE * kept)
}

// Most that a model leaves in a row that it explains.
const LEAVES_NOISE: f64 = 1.4;
// Times over which torques are smoothed, in lags, and how much larger a fall is that holds against its contrary.
const SMOOTHED: [f64; 6] = [0.35, 0.5, 0.7, 1.0, 1.4, 2.0];
const OUTWEIGHS: f64 = 4.0;
// More than what a smoother leaves of noise in a foretold torque makes a lag likelier by, a sample.
const LEFT_IN_FORETOLD: f64 = 0.08;

// The largest lag of a model's drives at rest, s.
fn lag(model: &Candidate) -> f64 {
    drives(model).iter().map(|drive| drive.lag).fold(0.0, f64::max)
}

// The drives of a model at rest.
fn drives(model: &Candidate) -> Vec<Actuation<f64>> {
    let mut drives = vec![Actuation::default(); model.plant.model().nv];
    Dynamics::new(&model.plant, &model.p).actuation(&LinkState::zero(&model.plant), &mut drives);
    drives
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
        Some(Other { trial: r.trial.clone(), spec, is_near, were_held: are_held(state) })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_is_told_by_the_least_of_what_agrees() {
        assert_eq!(least_told(-100.0, Some(-50.0), Some(-30.0)), Some(-30.0));
        // Smoothed torques may tell the contrary by less than a quarter.
        assert_eq!(least_told(100.0, Some(-20.0), Some(200.0)), Some(100.0));
        assert_eq!(least_told(100.0, Some(-30.0), Some(200.0)), None);
        assert_eq!(least_told(100.0, Some(300.0), Some(-1.0)), None);
        assert_eq!(least_told(100.0, None, None), Some(100.0));
    }
}
