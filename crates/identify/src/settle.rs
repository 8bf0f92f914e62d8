//! The settling of a model: about a reference of its own, under the noise that everything on offer would leave.

use std::sync::{Arc, OnceLock};

use crate::IdentifyError;
use crate::colour::Whitener;
use crate::innovation::Reference;
use crate::least_squares::distance;
use crate::problem::{Candidate, Linearised, objective, refine};
use crate::refit::Fitted;
use crate::residual::{LoggedTorques, Samples, Start};
use crate::search::{Accepted, Saturated, Search, State};

// What each reference of a model is led from.
pub(crate) const RENEWALS: [Start; 3] = [Start::Kernel, Start::Reference, Start::Reference];
pub(crate) const ONCE_MORE: [Start; 2] = [Start::Reference; 2];
// About a motion that is settled for nearly the same values, or with a noise that is known.
const ONCE: [Start; 1] = [Start::Reference];
const AS_IT_IS: [Start; 1] = [Start::Same];
// The base is fitted about the kernel's motion already; without the torque noise that acts, a motion is read in another way.
const OF_BASE: [Start; 3] = [Start::Reference; 3];
const WITHOUT_NOISE: [Start; 2] = [Start::Same, Start::Reference];
// Most references in all, and the share of the objective before that one must leave at most for another to follow.
const MOST_REFERENCES: usize = 10;
const GAINS: f64 = 0.95;
// A reference that leaves this many times as much, and makes the log less likely, has gone astray.
const ASTRAY: f64 = 2.0;
// The squared length of what references may differ by, and what −2 log likelihood or an objective falls by where it is no
// chance.
const HOLDS: f64 = 10.0;
pub(crate) const FALLS: f64 = 10.0;
// The share of the objective by which rows may differ besides: where derivatives are taken about the reference, and of two ways
// that end in one valley.
const HOLDS_SHARE: f64 = 0.01;
// Most times that a model is led halfway back to what is stated.
const RETREATS: usize = 4;
// A descent that gains this factor has left the model that its reference was smoothed by.
const MOVED: f64 = 1.1;
// Standard deviations from its stated value at which a parameter has left all reason.
const FAR_BENT: f64 = 10.0;

/// A model led about references of its own; its noise is not settled yet.
pub(crate) struct Led {
    pub model: Candidate,
    at: Linearised,
    pub reference: Option<Arc<Reference>>,
}

impl Led {
    /// −2 log likelihood of what was measured about its reference; zero where there is none.
    pub fn misfit(&self) -> f64 {
        self.reference.as_ref().map_or(0.0, |reference| reference.misfit())
    }

    /// True if the model could be followed along all runs.
    pub fn is_finite(&self) -> bool {
        self.misfit().is_finite() && self.at.is_finite()
    }

    /// The other one, if the log is likelier about it, or this one could not be followed.
    pub fn or_likelier(self, other: Self) -> Self {
        let is_likelier = other.misfit() < self.misfit() || !self.is_finite();
        if is_likelier && other.is_finite() { other } else { self }
    }

    // True if its reference tells of no more than noise.
    fn leaves_noise(&self) -> bool {
        self.is_finite() && self.reference.as_ref().is_some_and(|reference| reference.leaves_noise)
    }
}

impl Search<'_> {
    /// A base settled about a reference of its own, with the logged torques taken as the log says.
    pub fn settled_base(&self, mut model: Candidate, at: Linearised) -> Result<State, IdentifyError> {
        let at = self.led(&mut model, &OF_BASE, |_| at, true);
        let at = self.with_torques_of_moments(&mut model, at)?;
        let at = self.without_noise(&mut model, at)?;
        self.settled(model, at, Vec::new())
    }

    /// The same of a model that a first look at a part of the runs has settled: how torques are logged is known, and that the
    /// joints move without the torque noise, if it was seen.
    pub fn settled_again(&self, mut model: Candidate, at: Linearised) -> Result<State, IdentifyError> {
        let at = self.led(&mut model, &ONCE, |_| at, true);
        let is_told = self.problem.form.reference().is_some_and(|r| r.torques.move_without_noise);
        let at = if is_told { at } else { self.without_noise(&mut model, at)? };
        self.settled(model, at, Vec::new())
    }

    /// [`Search::settled`] about a reference that this model gives; where there is none, from where `descend` leads it.
    pub fn settled_anew(
        &self,
        model: Candidate,
        descend: impl FnOnce(&mut Candidate) -> Linearised,
        accepted: Vec<Accepted>,
    ) -> Result<State, IdentifyError> {
        let led = self.led_anew(model, descend, accepted.is_empty())?;
        self.settled_led(led, accepted)
    }

    /// A model led about a reference that it gives; where there is none, from where `descend` leads it.
    pub fn led_anew(
        &self,
        model: Candidate,
        descend: impl FnOnce(&mut Candidate) -> Linearised,
        is_base: bool,
    ) -> Result<Led, IdentifyError> {
        self.led_from(&RENEWALS, model, descend, is_base)
    }

    // The same from each of `starts`.
    fn led_from(
        &self,
        starts: &[Start],
        mut model: Candidate,
        descend: impl FnOnce(&mut Candidate) -> Linearised,
        is_base: bool,
    ) -> Result<Led, IdentifyError> {
        let mut at = self.led(&mut model, starts, descend, is_base);
        if !is_base {
            at = self.with_torques_of_moments(&mut model, at)?;
        }
        Ok(self.present(model, at))
    }

    /// A model about the present reference.
    pub fn present(&self, model: Candidate, at: Linearised) -> Led {
        Led { model, at, reference: self.problem.form.reference() }
    }

    /// A model settled about the reference that it was led to.
    pub fn settled_led(&self, led: Led, accepted: Vec<Accepted>) -> Result<State, IdentifyError> {
        led.reference.iter().for_each(|reference| self.problem.form.adopt(reference));
        self.settled(led.model, led.at, accepted)
    }

    /// [`Search::settled_anew`] of a model with more effects than that of `before`: about a reference that is led from where that of
    /// `before` is. Friction turns about where the motion does, and a motion that was smoothed without it may keep it from turning
    /// there: as long as the model leaves more than noise, about one that is led from the kernel's motion with the noise that was
    /// read, and from the same with a noise of which nothing is known. If the log is less likely than it was, about the motion as it
    /// is, since friction that holds a light link bends within less than a smoother's correction. The likeliest of these.
    pub fn settled_after(
        &self,
        before: &State,
        model: Candidate,
        accepted: Vec<Accepted>,
    ) -> Result<State, IdentifyError> {
        let form = self.problem.form;
        let descend = |model: &mut Candidate| self.descended(model, &before.whitener);
        let Some(reference) = &before.reference else { return self.settled_anew(model, descend, accepted) };
        let led = |starts: &[Start]| self.led_from(starts, model.again(self.problem)?, descend, false);
        let about = |starts: &[Start]| {
            form.adopt(reference);
            led(starts)
        };
        let mut likeliest = about(&ONCE_MORE)?;
        if !likeliest.leaves_noise() {
            form.begin_as_read(reference);
            likeliest = likeliest.or_likelier(led(&ONCE)?);
        }
        if !likeliest.leaves_noise() {
            likeliest = likeliest.or_likelier(about(&RENEWALS)?);
        }
        if likeliest.misfit() > before.misfit() {
            likeliest = likeliest.or_likelier(about(&AS_IT_IS)?);
        }
        self.settled_led(likeliest, accepted)
    }

    /// Lets the filters of a state's reference go while another is led: of a long log they are large.
    pub fn lighten(&self, state: &mut State) {
        if let Some(lightened) = state.reference.as_ref().and_then(|reference| reference.lightened()) {
            self.problem.form.adopt(state.reference.insert(Arc::new(lightened)));
        }
    }

    /// Makes a state's reference the present one, with its filters.
    pub fn restore(&self, state: &mut State) {
        let Some(reference) = &state.reference else { return };
        self.problem.form.adopt(reference);
        if let Some(p) = reference.to_make_again() {
            self.problem.form.renew(&state.fitted.model.plant, p, Start::Same);
            state.reference = self.problem.form.reference();
        }
    }

    /// By how much −2 log likelihood falls from a state to a model about its own reference; none where there is none.
    ///
    /// What still is missing may leave a small noise in most of a log and much in the rest. A noise that is typical of it makes
    /// the rest most unlikely; so the model may have the noise of the state, too.
    pub fn fall_of_misfit(
        &self,
        before: &State,
        model: &Candidate,
        reference: Option<&Arc<Reference>>,
    ) -> Option<f64> {
        let (old, new) = (before.reference.as_ref()?, reference?);
        let fall = old.misfit() - new.misfit();
        if fall >= 0.0 {
            return Some(fall);
        }
        let alike = self.misfit_of(Samples::All, model, new, &old.torque_noise)?;
        Some(fall.max(old.misfit() - alike))
    }

    /// By how much −2 log likelihood falls from one state to another in the samples whose rows count, under the noise of the first:
    /// where a motor creeps, no row asks a fit for a friction that goes with the motion.
    pub fn fall_in_rows(&self, before: &State, after: &State) -> Option<f64> {
        let noise = &before.reference.as_ref()?.torque_noise;
        let misfit = |state: &State| {
            self.misfit_of(Samples::OfRows, &state.fitted.model, state.reference.as_ref()?, noise)
        };
        Some(misfit(before)? - misfit(after)?)
    }

    /// −2 log likelihood of a model about a reference in these samples, under torque noise of this size.
    pub fn misfit_of(
        &self,
        samples: Samples,
        model: &Candidate,
        about: &Reference,
        torque_noise: &[f64],
    ) -> Option<f64> {
        self.problem.form.misfit(samples, about, torque_noise, &model.plant, &model.p)
    }

    /// A model led about references of its own from each of `starts`; where there is none, by `descend`.
    pub fn led(
        &self,
        model: &mut Candidate,
        starts: &[Start],
        descend: impl FnOnce(&mut Candidate) -> Linearised,
        is_base: bool,
    ) -> Linearised {
        match self.renewed(model, starts) {
            None => descend(model),
            Some((at, value)) if !self.is_doubtful(model, value, is_base) => at,
            Some(first) => {
                // Under the noise that a bent model leaves, the valleys are wide.
                let wide = self.noise(model, &first.0.residual, &first.0.slices());
                let white = |at: &Linearised| wide.apply(self.problem.form.layout(), &at.residual);
                let (here, value) = (white(&first.0), first.1);
                self.lower(model, first, |model| {
                    let at = model.linearise(self.problem);
                    let at = refine(self.problem, model, &wide, at, 10);
                    // The way from the stated values ends in the same valley.
                    let is_same = distance(&here, &white(&at)) < alike(value);
                    if is_same { None } else { self.renewed(model, &RENEWALS) }
                })
            }
        }
    }

    /// A descent under one noise.
    pub fn descended(&self, model: &mut Candidate, whitener: &Whitener) -> Linearised {
        let layout = self.problem.form.layout();
        let descend = |model: &mut Candidate| {
            let at = model.linearise(self.problem);
            let at = refine(self.problem, model, whitener, at, 10);
            let value = objective(&whitener.apply(layout, &at.residual), model);
            (at, value)
        };
        let first = descend(model);
        self.lower(model, first, |model| Some(descend(model)))
    }

    // Parameters that were bent to imitate an effect may not find back: where much is left, the lower end of this
    // descent and of a second one from the stated values.
    fn lower(
        &self,
        model: &mut Candidate,
        (at, value): (Linearised, f64),
        descend: impl FnOnce(&mut Candidate) -> Option<(Linearised, f64)>,
    ) -> Linearised {
        let form = self.problem.form;
        if !self.is_doubtful(model, value, false) {
            return at;
        }
        let (kept, reference) = (model.p.clone(), form.reference());
        model.straighten();
        match descend(model) {
            Some((again, lower)) if lower < value => again,
            _ => {
                model.p = kept;
                reference.iter().for_each(|r| form.adopt(r));
                at
            }
        }
    }

    // True if a fit may have ended in a wrong valley: of a base only what was bent beyond reason tells, since much may be
    // left where an effect is missing.
    fn is_doubtful(&self, model: &Candidate, value: f64, is_base: bool) -> bool {
        let leaves_much = self.problem.form.layout().is_much(value);
        model.is_bent(FAR_BENT) || (leaves_much && !is_base)
    }

    // The model refined about references of its own until they hold, with its objective; none where there is no
    // reference. Beyond `starts` it is led on if the first moved the model, then for as long as both the log gets likelier and the
    // objective falls much; one that leads astray, as where hardly a torque noise is left, is left for that before.
    fn renewed(&self, model: &mut Candidate, starts: &[Start]) -> Option<(Linearised, f64)> {
        let form = self.problem.form;
        form.reference()?;
        let (mut misfit, mut found, mut goes_on) = (f64::INFINITY, None, true);
        for n in 0..MOST_REFERENCES {
            let Some(from) = starts.get(n).copied().or(goes_on.then_some(Start::Reference)) else { break };
            let (last, p) = (form.reference()?, model.p.clone());
            form.renew(&model.plant, &model.p, from);
            // A reference of a long log is large: one that is left behind goes before derivatives are taken.
            let is_likelier = form.reference()?.misfit() <= misfit;
            let last = (!is_likelier).then_some(last);
            let at = self.about_present_reference(model);
            let before_that = std::mem::replace(&mut misfit, form.reference()?.misfit());
            let last = last.filter(|_| misfit > before_that);
            let (at, whitener, [before, value]) = self.refined_alone(model, at);
            if let Some(last) =
                last.filter(|_| found.as_ref().is_some_and(|(_, least)| value > ASTRAY * least))
            {
                form.adopt(&last);
                model.p = p;
                return found;
            }
            let falls = misfit < before_that - FALLS;
            let is_close = || before < MOVED * value && self.off(model, &at, &whitener) < HOLDS;
            let holds = !falls && is_close();
            goes_on = match &found {
                Some((_, last)) => falls && value < GAINS * last,
                None => starts == ONCE && !is_close(),
            };
            found = Some((at, value));
            if holds {
                break;
            }
        }
        found
    }

    /// The model about a new reference, refined there, with the noise it leaves, and its objective before and after.
    pub fn followed(&self, model: &mut Candidate, from: Start) -> (Linearised, Whitener, [f64; 2]) {
        self.problem.form.renew(&model.plant, &model.p, from);
        let at = self.about_present_reference(model);
        self.refined_alone(model, at)
    }

    // The model refined about the present reference, with the noise it leaves, and its objective before and after.
    fn refined_alone(&self, model: &mut Candidate, at: Linearised) -> (Linearised, Whitener, [f64; 2]) {
        let (whitener, before) = self.alone(model, &at);
        let at = refine(self.problem, model, &whitener, at, 6);
        let after = objective(&whitener.apply(self.problem.form.layout(), &at.residual), model);
        (at, whitener, [before, after])
    }

    /// The noise that a model leaves by itself, and its objective under it.
    pub fn alone(&self, model: &Candidate, at: &Linearised) -> (Whitener, f64) {
        let whitener = self.noise(model, &at.residual, &at.slices());
        let value = objective(&whitener.apply(self.problem.form.layout(), &at.residual), model);
        (whitener, value)
    }

    // Torque noise that moves the joints is in their accelerations: without it, if that makes the log likelier.
    fn without_noise(&self, model: &mut Candidate, at: Linearised) -> Result<Linearised, IdentifyError> {
        let form = self.problem.form;
        let Some(reference) = form.reference().filter(|r| r.noise_matters) else { return Ok(at) };
        form.begin_anew(LoggedTorques { move_without_noise: true, ..reference.torques });
        let mut tried = model.again(self.problem)?;
        let renewed = self.renewed(&mut tried, &WITHOUT_NOISE);
        let falls = form.reference().is_some_and(|now| now.misfit() < reference.misfit() - FALLS);
        Ok(match renewed {
            Some((found, _)) if falls => {
                *model = tried;
                found
            }
            _ => {
                form.adopt(&reference);
                at
            }
        })
    }

    // The linearisation about the present reference, which the model gave. A model that was bent too far to be followed on the grid
    // of the derivatives is led back towards what is stated.
    fn about_present_reference(&self, model: &mut Candidate) -> Linearised {
        let mut at = model.linearise(self.problem);
        for _ in 0..RETREATS {
            if at.is_finite() {
                break;
            }
            model.straighten_halfway();
            self.problem.form.renew(&model.plant, &model.p, Start::Kernel);
            at = model.linearise(self.problem);
        }
        at
    }

    // Squared length by which rows are off that take the links to be where the reference has them.
    fn off(&self, model: &Candidate, at: &Linearised, whitener: &Whitener) -> f64 {
        let layout = self.problem.form.layout();
        let given = model.residual_given(self.problem);
        distance(&whitener.apply(layout, &given), &whitener.apply(layout, &at.residual))
    }

    // Unknowns that a larger noise had hidden become free where this model's noise shows them.
    fn bring_back(&self, model: &mut Candidate, at: &mut Linearised) {
        let hidden = model.left_out();
        if hidden.is_empty() {
            return;
        }
        let layout = self.problem.form.layout();
        let positions: Vec<usize> = hidden.iter().map(|u| u.position).collect();
        let columns = model.columns(self.problem, &positions);
        let whitener = self.noise(model, &at.residual, &at.slices());
        let white = whitener.apply_all(layout, &columns);
        for ((unknown, column), white) in hidden.into_iter().zip(columns).zip(white) {
            if model.is_excited(&unknown, &white, self.problem.robot.trust) {
                model.unknowns.push(unknown);
                at.columns.push(column);
            }
        }
    }

    /// Noise from a saturated regression over all candidates, and a last refinement under it.
    pub fn settled(
        &self,
        mut model: Candidate,
        mut at: Linearised,
        accepted: Vec<Accepted>,
    ) -> Result<State, IdentifyError> {
        let layout = self.problem.form.layout();
        let mut problem = *self.problem;
        self.bring_back(&mut model, &mut at);
        if problem.is_rough() {
            let (whitener, value) = self.alone(&model, &at);
            if self.off(&model, &at, &whitener) > alike(value) {
                problem = problem.exact();
                at = model.linearise(&problem);
                at = refine(&problem, &mut model, &whitener, at, 6);
            }
        }
        let Saturated { trials, columns, whitener } = self.saturated(&problem, &model, &at);
        let at = refine(&problem, &mut model, &whitener, at, 6);
        let fitted = Fitted::of(layout, &whitener, model, at);
        let (reference, slopes) = (problem.form.reference(), problem.slopes);
        let scores = OnceLock::new();
        Ok(State { fitted, whitener, accepted, trials, columns, scores, reference, slopes })
    }
}

// The squared length by which rows that leave this objective may differ.
fn alike(value: f64) -> f64 {
    HOLDS + HOLDS_SHARE * value
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use sinew_data::{Quantity, Run, Signal};
    use sinew_effects::CATALOGUE;
    use sinew_model::{Robot, samples};
    use sinew_rigid::inverse_dynamics;

    use super::*;
    use crate::Options;
    use crate::analysis::about_base;
    use crate::comparison::Prepared;
    use crate::problem::Problem;
    use crate::residual::ResidualForm;

    // A rigid joint at 1 kHz with readings of 17 bit a turn.
    fn rigid() -> (Robot, [Run; 1]) {
        let robot = Robot::rigid(samples::planar_arm(1, 4.0, 0.5));
        let time: Vec<f64> = (0..6000).map(|k| 1e-3 * k as f64).collect();
        let step = std::f64::consts::TAU / f64::from(1 << 17);
        let angle = |t: &f64| (0.7 * (3.0 * t).sin() / step).round() * step;
        let torque = |t: &f64| {
            let (s, c) = (3.0 * (t + 5e-4)).sin_cos();
            inverse_dynamics(&robot.model, &[0.7 * s], &[2.1 * c], &[-6.3 * s])[0]
        };
        let signal = |quantity, values| Signal::new(quantity, robot.model.dof_name(0), values);
        let signals = vec![
            signal(Quantity::MotorPosition, time.iter().map(angle).collect()),
            signal(Quantity::MotorTorque, time.iter().map(torque).collect()),
        ];
        let runs = [Run::new("sine".to_owned(), time, signals).unwrap()];
        (robot, runs)
    }

    #[test]
    fn a_state_that_was_let_go_has_its_rows_again_to_the_last_bit() {
        let (robot, runs) = rigid();
        let options = Options::default();
        let prepared = Prepared::new(&robot, &runs, &options).unwrap();
        let form = about_base(&robot, &CATALOGUE, &runs, &prepared, None).unwrap().unwrap();
        let records = form.present().motion();
        let problem = Problem::new(&robot, &CATALOGUE, &form, &options);
        let search = Search::new(&problem, &records, &prepared.sensors);
        let mut state = search.base(prepared.base_specs(&robot, &CATALOGUE)).unwrap();
        let rows = |state: &State| state.fitted.model.residual(&problem);
        let (before, misfit) = (rows(&state), state.misfit());
        search.lighten(&mut state);
        assert!(state.reference.as_ref().unwrap().records().is_empty());
        search.restore(&mut state);
        assert_eq!((rows(&state), state.misfit()), (before, misfit));
    }

    #[test]
    fn the_likelihood_of_rows_is_that_of_the_samples_that_count() {
        let (robot, runs) = rigid();
        let options = Options::default();
        let prepared = Prepared::new(&robot, &runs, &options).unwrap();
        let form = || about_base(&robot, &CATALOGUE, &runs, &prepared, None).unwrap().unwrap();
        let whole = form();
        let (problem, records) =
            (Problem::new(&robot, &CATALOGUE, &whole, &options), whole.present().motion());
        let search = Search::new(&problem, &records, &prepared.sensors);
        let (model, _) = search.fitted(prepared.base_specs(&robot, &CATALOGUE), None, 12).unwrap();
        let (reference, rows) = (whole.present(), whole.layout().len);
        let without = |left_out: Range<usize>| {
            let mut form = form();
            form.leave_out_rows(left_out);
            form.misfit(Samples::OfRows, &reference, &reference.torque_noise, &model.plant, &model.p).unwrap()
        };
        let [all, last, first] = [0..0, 0..rows / 2, rows / 2..rows].map(without);
        assert!((first + last - all).abs() < 1e-9 * all.abs() && first != last, "{first} + {last} ≠ {all}");
    }
}
