//! One round of the search: screen what is offered, refit the short list, pass it through the gates.

use rayon::prelude::*;

use sinew_effect::Screening;
use sinew_model::Place;

use crate::equations::Equations;
use crate::gates::Evidence;
use crate::problem::{BENT, MANY, Problem};
use crate::refit::{Base, Fitted, Refit, refit};
use crate::screen::{Score, Screen, all_columns};
use crate::search::{Columns, Scores, Search, State};
use crate::starts::{
    best_starts, first_of, impossible_starts, lowest_of_each, next_in_line, promising, short_list, with_lines,
};
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;

/// Result of one round of screening and refitting.
pub(crate) struct Round {
    /// Candidates that pass, best first.
    pub passed: Vec<Refit>,
    /// Candidates that do not, best first.
    pub failed: Vec<Refit>,
}

// A model at the values that its robot states: a parameter that was bent to imitate a missing effect hides the effect
// from a screen about the fit.
struct Stated {
    fitted: Fitted,
    columns: Columns,
}

// Most candidates refitted from a screen about the stated values.
const STATED_LIST: usize = 4;
// Mean square of the whitened rows up to which a candidate leaves little to find.
const UNEXPLAINED: f64 = 1.2;
// Share of the present objective that a candidate leaves which explains nearly all of it.
const NEARLY: f64 = 0.1;
// Share of the samples that a limit of a drive may cut off.
const MOST_CUT: f64 = 0.4;

impl Search<'_> {
    // The model of a state at its stated values, if some value is far from what was stated.
    fn stated(&self, state: &State) -> Option<Stated> {
        let model = &state.fitted.model;
        if !model.is_bent(BENT) {
            return None;
        }
        let mut stated = model.again(self.problem).ok()?;
        stated.straighten();
        let exact = self.problem.exact();
        let at = stated.linearise(&exact);
        let columns = all_columns(&exact, &stated, &at.residual, &state.trials);
        let fitted = Fitted::of(self.problem.form.layout(), &state.whitener, stated, at);
        Some(Stated { fitted, columns })
    }

    // A limit of a drive is met now and then: one that is met all the time, and does not explain all, says that the log does not
    // drive the joint.
    fn cuts(&self, refit: &Refit) -> Option<String> {
        let Screening::Peaks { .. } = refit.trial.card.screening else { return None };
        let model = &refit.fitted.model;
        let label = |u: &&Unknown| model.plant.effects()[u.id.effect].label() == refit.trial.label();
        let inverse = model.p[model.unknowns.iter().find(label)?.position];
        let dof = self.problem.robot.model.dof(&refit.trial.place.to_string())?;
        let logged = || self.sensors.motor_torque(self.records, dof);
        let beyond = logged().filter(|u| u.abs() * inverse > 1.0).count();
        let share = beyond as f64 / logged().count().max(1) as f64;
        (share > MOST_CUT)
            .then(|| format!("would cut off {:.0} % of the samples: no limit is met so often", 100.0 * share))
    }

    /// One round: screen everything, refit the short list, pass it through the gates; `known`: refits of candidates that were
    /// made about this state before.
    pub fn round(&mut self, state: &State, step: usize, known: Vec<Refit>) -> Round {
        let trials = &state.trials;
        let scores = state
            .scores
            .get_or_init(|| self.scores(&state.fitted, state, &state.columns).unwrap_or_default());
        if scores.is_empty() {
            return Round { passed: Vec::new(), failed: Vec::new() };
        }
        self.promising.extend(promising(trials, scores));
        for k in impossible_starts(trials, scores) {
            if let Some(reason) = scores[k].as_ref().and_then(|s| s.out.clone()) {
                self.refuse(&trials[k], step, reason);
            }
        }
        let list = short_list(trials, scores, self.sensors.moving().count());
        let base = Base { fitted: &state.fitted, whitener: &state.whitener, added: &state.added() };
        let problem = Problem { slopes: state.slopes, ..*self.problem };
        let refitted = |list: &[usize], scores: &[Option<Score>], start: Option<&Fitted>, leader: f64| {
            let is_known = |k: &&usize| known.iter().any(|r| r.trial.label() == trials[**k].label());
            let of = |&k: &usize| {
                let score = scores[k].as_ref()?;
                refit(&problem, &base, start, &trials[k], score, leader, &self.channel_std)
            };
            let followed = |r: &Refit| r.fitted.objective.is_finite();
            list.par_iter().filter(|k| !is_known(k)).filter_map(of).filter(followed).collect::<Vec<Refit>>()
        };
        // A candidate that explains all and leaves nothing bent has no better start; where derivatives are dear, one that
        // explains nearly all is not asked to have a better one.
        let noise = UNEXPLAINED * self.problem.form.layout().counted();
        let dear = state.fitted.model.unknowns.len() > MANY;
        let leaves_noise = |r: &Refit| r.fitted.objective < noise;
        let explains_nearly_all = |r: &Refit| r.fitted.objective < NEARLY * state.fitted.objective;
        let is_enough = |r: &Refit| {
            (leaves_noise(r) && !r.fitted.model.is_bent(BENT)) || (dear && explains_nearly_all(r))
        };
        let gate = |refit: &Refit| refit.evidence.refused(self.problem.options, trials.len());
        let explains = |r: &Refit| r.refused.is_none() && !r.evidence.is_relief() && gate(r).is_none();
        // What changes which joints have springs costs most: it comes last, when there is a leader.
        let (swings, others): (Vec<usize>, Vec<usize>) =
            list.into_iter().partition(|&k| trials[k].switches_springs());
        // What promises little waits for the next round where something explains enough: beside a model that lacks most of
        // what is missing it says little.
        let (first, rest) = first_of(&others, scores);
        let mut refits = refitted(&first, scores, None, f64::INFINITY);
        if !refits.iter().chain(&known).any(|r| explains(r) && is_enough(r)) {
            refits.extend(refitted(&rest, scores, None, f64::INFINITY));
        }
        let unrefused = refits.iter().chain(&known).filter(|r| r.refused.is_none());
        let leader = unrefused.map(|r| r.fitted.objective).fold(f64::INFINITY, f64::min);
        refits.extend(refitted(&swings, scores, None, leader));
        if !refits.iter().chain(&known).any(explains) {
            let more = next_in_line(trials, scores, &others, &refits, state.fitted.objective);
            refits.extend(refitted(&more, scores, None, f64::INFINITY));
        }
        let stated = if refits.iter().chain(&known).any(is_enough) { None } else { self.stated(state) };
        if let Some(Stated { fitted, columns }) = &stated
            && let Some(scores) = self.scores(fitted, state, columns)
        {
            self.promising.extend(promising(trials, &scores));
            let is_new = |&k: &usize| matches!(trials[k].how, How::New { .. });
            let best: Vec<usize> =
                best_starts(trials, &scores).into_iter().filter(is_new).take(STATED_LIST).collect();
            let list = with_lines(best, trials, &scores);
            refits.extend(refitted(&list, &scores, Some(fitted), leader));
        }
        let refits = lowest_of_each(refits.into_iter().chain(known));
        let (mut passed, mut failed) = (Vec::new(), Vec::new());
        // What speaks for one that relieves a tension speaks for a rival at its place that explains more besides.
        let is_relief = |r: &&Refit| r.refused.is_none() && r.evidence.is_relief() && gate(r).is_none();
        let reliefs: Vec<(Place, Evidence)> =
            refits.iter().filter(is_relief).map(|r| (r.trial.place.clone(), r.evidence.clone())).collect();
        let includes_one = |refit: &Refit| {
            reliefs
                .iter()
                .any(|(place, relief)| refit.trial.place == *place && refit.evidence.includes(relief))
        };
        for mut refit in refits {
            let explains_all = leaves_noise(&refit) && explains_nearly_all(&refit);
            if refit.refused.is_none() && !explains_all {
                refit.refused = self.cuts(&refit);
            }
            if refit.refused.is_none() && !includes_one(&refit) {
                refit.refused = gate(&refit);
            }
            match &refit.refused {
                None => passed.push(refit),
                Some(reason) => {
                    self.refuse(&refit.trial, step, reason.clone());
                    failed.push(refit);
                }
            }
        }
        for list in [&mut passed, &mut failed] {
            list.sort_by(|a, b| a.fitted.objective.total_cmp(&b.fitted.objective));
        }
        Round { passed, failed }
    }

    // Scores of all trials about one model.
    pub fn scores(&self, about: &Fitted, state: &State, columns: &Columns) -> Option<Scores> {
        let layout = self.problem.form.layout();
        let base = Equations::new(&state.whitener, self.problem, &about.model, &about.at, 0.0)?;
        let base = base.bounded(&about.model)?;
        let screen = Screen::new(self.problem, &about.model, &base);
        let score = |(trial, raw): (&Trial, &Option<Vec<Vec<f64>>>)| {
            screen.score(trial, &state.whitener.apply_all(layout, raw.as_ref()?))
        };
        Some(state.trials.par_iter().zip(columns).map(score).collect())
    }
}
