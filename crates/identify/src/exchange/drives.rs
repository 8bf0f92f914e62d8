//! Drives that are late in different ways: a dead time lets a controller's answers to noise through, a lag smooths them.

use std::sync::Arc;

use sinew_effect::Actuation;
use sinew_plant::{Dynamics, LinkState};

use super::Compared;
use crate::IdentifyError;
use crate::colour::Whitener;
use crate::explore::CHANCE;
use crate::innovation::Reference;
use crate::problem::{Candidate, objective, refine};
use crate::record::Record;
use crate::residual::Samples;
use crate::search::{Accepted, Search, State, TIE_CHI};
use crate::settle::Led;

// How close noise is to what was read that is all of it.
const ALL_READ: f64 = 1.15;
// Most that a model leaves in a row that it explains.
const LEAVES_NOISE: f64 = 1.4;
// Times over which torques are smoothed, in lags, and how much larger a fall is that holds against its contrary.
const SMOOTHED: [f64; 6] = [0.35, 0.5, 0.7, 1.0, 1.4, 2.0];
const OUTWEIGHS: f64 = 4.0;
// More than what a smoother leaves of noise in a foretold torque makes a lag likelier by, a sample.
const LEFT_IN_FORETOLD: f64 = 0.08;

/// True if one drive that is late has taken the place of another, and logged torques are held, or were.
pub(super) fn are_late_otherwise(before: &State, after: &Candidate, were_held: bool) -> bool {
    let differ = |(a, b): (&Actuation<f64>, &Actuation<f64>)| {
        is_late(a) && is_late(b) && (a.lag > 0.0) != (b.lag > 0.0)
    };
    (are_held(before) || were_held) && drives(&before.fitted.model).iter().zip(&drives(after)).any(differ)
}

fn is_late(drive: &Actuation<f64>) -> bool {
    drive.lag + drive.delay > 0.0
}

/// True if the logged torques of a state's reference act from one reading to the next.
pub(super) fn are_held(state: &State) -> bool {
    state.reference.as_ref().is_some_and(|reference| reference.torques.early == 0.0)
}

/// A state with drives that are late, settled once more with the whole of the logged torques passing them, if one of them lags or the
/// log is likelier so; none else.
pub(super) fn settled_itself(search: &Search, state: &State) -> Result<Option<State>, IdentifyError> {
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

/// The drive of a state, the k-th of its effects, and that of a model led with another in its place, both settled once more with the
/// whole of the logged torques passing them: what a model does not foretell, a controller's answers to noise, a dead time lets through
/// and a lag does not.
///
/// If torques were read with noise, the log is likelier with a drive that smooths them. So the one that smooths less is asked once more
/// with torques that are smoothed as much, but come no later.
pub(super) fn compared(
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

// Two drives that are late in different ways under torques of which the noise does not act. What the models foretell passes the drives,
// and of two that are not told apart the first is that of the imposed residual, which takes no noise for a motion.
fn compared_as_read(
    search: &Search,
    state: &State,
    k: usize,
    next: Led,
    driven: [&Led; 2],
    accepted: Vec<Accepted>,
) -> Result<Compared, IdentifyError> {
    // A fit that the model without it led astray may not find back: another begins where the drives had all of the torques.
    let own = search.led_foretold(driven[0], &state.whitener)?;
    let next = next.or_likelier(search.led_foretold(driven[1], &state.whitener)?);
    let witnesses = Witnesses::of(search, state, &state.accepted[k], [&own, &next], driven);
    state.reference.iter().for_each(|reference| search.problem.form.adopt(reference));
    let Some(witnesses) = witnesses else { return Ok(Compared::Worse) };
    let told = witnesses.least();
    let distance = told.map_or(0.0, f64::abs);
    let is_other =
        witnesses.imposed.map_or_else(|| told.is_some_and(|fall| fall > CHANCE), |fall| fall > 0.0);
    if next.is_finite() && is_other {
        let gain = witnesses.imposed.unwrap_or(witnesses.foretold);
        return in_its_place(search, &state.accepted[k], gain, distance, (next, accepted));
    }
    let tied = Some(distance).filter(|distance| *distance < TIE_CHI);
    if own.is_finite() && own.misfit() < state.misfit() - CHANCE {
        let own = search.settled_led(own, state.accepted.clone())?;
        return Ok(Compared::Itself(Box::new(own), tied));
    }
    Ok(tied.map_or(Compared::Worse, Compared::Tied))
}

// By how much less one drive leaves than another, each by a witness of its own: in −2 log likelihood where what the models foretell
// passes the drives; the same with all of the logged torques, smoothed as far as the log is likeliest with either; and in the rows of
// the imposed residual, for which noise is one of readings. A lag is likelier in the first two by as much as a smoother leaves of that
// noise in what it foretells. Where a motor creeps, friction tells as much of a drive as its time does: only samples whose rows count
// are asked.
struct Witnesses {
    foretold: f64,
    // None where a drive needs torques of moments.
    smoothed: Option<f64>,
    // None where nothing is asked of it, or it leaves more than noise.
    imposed: Option<f64>,
}

impl Witnesses {
    // From a state's drive to the next; none where neither can be followed.
    fn of(
        search: &Search,
        state: &State,
        replaced: &Accepted,
        [own, next]: [&Led; 2],
        [own_driven, driven]: [&Led; 2],
    ) -> Option<Self> {
        let in_rows = |model: &Candidate, reference: Option<&Arc<Reference>>| {
            reference.and_then(|about| search.misfit_of(Samples::OfRows, model, about, &about.torque_noise))
        };
        let longest = lag(&own_driven.model).max(lag(&driven.model));
        let lowest = |led: &Led| {
            let smoothed = |share: &f64| {
                let driven = search.reference_driven(&led.model, led.reference.as_ref(), share * longest);
                in_rows(&led.model, driven.as_ref())
            };
            SMOOTHED.iter().filter_map(smoothed).reduce(f64::min)
        };
        let before = in_rows(&state.fitted.model, state.reference.as_ref());
        let before = [before, in_rows(&own.model, own.reference.as_ref())].into_iter().flatten();
        let fall = |(before, after): (f64, f64)| (before - after) / replaced.evidence.temper;
        let before = before.reduce(f64::min);
        let foretold = fall(before.zip(in_rows(&next.model, next.reference.as_ref()))?);
        let smoothed = lowest(own_driven).zip(lowest(driven)).map(fall);
        let is_lag = lag(&next.model) > lag(&state.fitted.model);
        let for_a_lag = if is_lag { foretold } else { -foretold };
        let samples: usize = search.records.iter().map(Record::len).sum();
        // A lag that is likelier by far needs no other witness.
        let is_plain = for_a_lag > LEFT_IN_FORETOLD * samples as f64;
        let imposed = || imposed_objectives(search, &state.fitted.model, &next.model).map(fall);
        let imposed = if is_plain { None } else { imposed() };
        Some(Self { foretold, smoothed, imposed })
    }

    // The smaller of what is foretold and what the imposed residual tells; none where one tells the contrary, or torques that are
    // smoothed do by a quarter of what is foretold or more.
    fn least(&self) -> Option<f64> {
        let foretold = self.foretold;
        let [smoothed, imposed] = [self.smoothed, self.imposed].map(|told| told.unwrap_or(foretold));
        let are_contrary = foretold * imposed <= 0.0
            || (foretold * smoothed < 0.0 && foretold.abs() < OUTWEIGHS * smoothed.abs());
        (!are_contrary).then(|| foretold.abs().min(imposed.abs()).copysign(foretold))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_is_told_by_the_least_of_what_agrees() {
        let least = |foretold, smoothed, imposed| Witnesses { foretold, smoothed, imposed }.least();
        assert_eq!(least(-100.0, Some(-50.0), Some(-30.0)), Some(-30.0));
        // Smoothed torques may tell the contrary by less than a quarter.
        assert_eq!(least(100.0, Some(-20.0), Some(200.0)), Some(100.0));
        assert_eq!(least(100.0, Some(-30.0), Some(200.0)), None);
        assert_eq!(least(100.0, Some(300.0), Some(-1.0)), None);
        assert_eq!(least(100.0, None, None), Some(100.0));
    }
}
