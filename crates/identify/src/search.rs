//! The search: screen, refit, accept, prune, until nothing in the catalogue passes the gates.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use sinew_model::EffectSpec;

use crate::IdentifyError;
use crate::colour::{Whitener, rows_of};
use crate::exchange::{Other, others};
use crate::features::random_features;
use crate::first_look::FirstLook;
use crate::freedom::Springs;
use crate::gates::{overlap, z_between};
use crate::innovation::Reference;
use crate::problem::{Candidate, Linearised, Problem, refine};
use crate::record::{Record, Sensors};
use crate::refit::{Fitted, Refit};
use crate::report::Refusal;
use crate::residual::LoggedTorques;
use crate::round::Round;
use crate::screen::{Score, all_columns};
use crate::spread::channel_std;
use crate::swings::{Swing, swings};
use crate::trial::{How, Offer, Trial};
use crate::waves::Waves;

/// A state in the rows in which errors are told.
pub(crate) struct Told {
    /// Its reachable floors: as far as what is free and what needs no physics reach.
    pub floors: Vec<f64>,
    // None where these are the rows of the search.
    at: Option<Linearised>,
}

impl Told {
    /// Its residual and the derivatives of its prediction.
    pub fn at<'a>(&'a self, state: &'a State) -> &'a Linearised {
        self.at.as_ref().unwrap_or(&state.fitted.at)
    }
}

/// A model at its fit, with the noise that it leaves.
pub(crate) struct State {
    pub fitted: Fitted,
    pub whitener: Whitener,
    /// Accepted effects, in the order of acceptance.
    pub accepted: Vec<Accepted>,
    /// The candidates offered to this model.
    pub trials: Vec<Trial>,
    /// Their raw columns, which are needed for as long as they have no scores.
    pub columns: Columns,
    /// What the screen says of them, once it is asked.
    pub scores: OnceLock<Scores>,
    /// What the rows were formed about.
    pub reference: Option<Arc<Reference>>,
    /// About which motion of the links its derivatives are.
    pub slopes: Springs,
}

impl State {
    /// True if the model could be followed along all runs, and its noise found.
    pub fn is_finite(&self) -> bool {
        let numbers = [self.fitted.objective, self.misfit()];
        numbers.iter().chain(&self.whitener.floors()).all(|x| x.is_finite()) && self.fitted.at.is_finite()
    }

    /// −2 log likelihood of what was measured about the reference; zero where there is none.
    pub fn misfit(&self) -> f64 {
        self.reference.as_ref().map_or(0.0, |reference| reference.misfit())
    }

    /// True if it leaves no more than torques leave that were held as they were logged.
    pub fn takes_torques_as_held(&self) -> bool {
        self.reference.as_ref().is_some_and(|reference| reference.takes_torques_as_held)
    }

    /// How it takes logged torques, where rows tell.
    pub fn torques(&self) -> Option<LoggedTorques> {
        self.reference.as_ref().map(|reference| reference.torques)
    }

    /// Indices of the effects that the search added to the model.
    pub fn added(&self) -> Vec<usize> {
        let new = self.accepted.iter().filter(|a| matches!(a.trial.how, How::New { .. }));
        new.map(|a| a.effect).collect()
    }

    /// The accepted effects, `effect@place`.
    pub fn names(&self) -> Vec<String> {
        self.accepted.iter().map(|a| a.trial.label()).collect()
    }

    /// The effects that were accepted since the state `before`.
    pub fn added_since(&self, before: &Self) -> &[Accepted] {
        &self.accepted[before.accepted.len()..]
    }
}

/// Raw columns of every candidate; none for one that cannot be evaluated.
pub(crate) type Columns = Vec<Option<Vec<Vec<f64>>>>;
/// The score of every candidate; none for one that has none.
pub(crate) type Scores = Vec<Option<Score>>;

/// What is offered to a model, and the noise that all of it would leave.
pub(crate) struct Saturated {
    pub trials: Vec<Trial>,
    pub columns: Columns,
    pub whitener: Whitener,
}

/// An accepted effect.
#[derive(Debug, Clone)]
pub(crate) struct Accepted {
    pub trial: Trial,
    /// Index of the effect among the model's.
    pub effect: usize,
    pub evidence: crate::gates::Evidence,
    /// The next best significant candidates of its step, with their evidence and χ² disadvantage.
    pub rivals: Vec<(Trial, f64)>,
    /// What may be tried in its place once others stand beside it.
    pub others: Vec<Other>,
}

/// A search over one set of runs.
pub(crate) struct Search<'a> {
    pub problem: &'a Problem<'a>,
    pub records: &'a [Record],
    pub sensors: &'a Sensors,
    // The same runs under the residual in whose units errors are told, if that is another one.
    yardstick: Option<&'a Search<'a>>,
    /// What a first look at a part of the runs has found.
    pub look: Option<&'a FirstLook>,
    pub channel_std: Vec<f64>,
    pub refusals: Vec<Refusal>,
    /// Labels of candidates that are not offered again.
    pub banned: Vec<String>,
    /// Those of them that made the log no likelier about the motion of the state that they were offered to, with the reason.
    pub unlikely: Vec<(Trial, String)>,
    /// Labels of candidates that explained something in any round.
    pub promising: BTreeSet<String>,
    // What depends on the runs only, made when it is first asked for.
    features: OnceLock<Vec<Vec<f64>>>,
    waves: OnceLock<Vec<Waves>>,
}

const FEATURES: usize = 140;
/// Differences of χ² and z below which two candidates are tied.
pub(crate) const TIE_CHI: f64 = 10.0;
pub(crate) const TIE_Z: f64 = 3.0;

impl<'a> Search<'a> {
    pub fn new(problem: &'a Problem<'a>, records: &'a [Record], sensors: &'a Sensors) -> Self {
        let channel_std = channel_std(problem, records);
        Self {
            problem,
            records,
            sensors,
            yardstick: None,
            look: None,
            channel_std,
            refusals: Vec::new(),
            banned: Vec::new(),
            unlikely: Vec::new(),
            promising: BTreeSet::new(),
            features: OnceLock::new(),
            waves: OnceLock::new(),
        }
    }

    /// The same with all made that asks how these records of the same runs make rows of a series: filters take most of the
    /// memory of a reference, and those of the first one are not needed longer.
    pub fn filtered_by(self, records: &[Record]) -> Self {
        let _ = (self.features(records), self.waves(records));
        self
    }

    /// The same with errors told in the rows of another search on the same runs.
    pub fn told_by(self, yardstick: Option<&'a Search<'a>>) -> Self {
        Self { yardstick, ..self }
    }

    /// The same after a first look at a part of the runs.
    pub fn after(self, look: Option<&'a FirstLook>) -> Self {
        Self { look, ..self }
    }

    /// The search in whose rows errors are told.
    pub fn yardstick(&self) -> &Search<'a> {
        self.yardstick.unwrap_or(self)
    }

    /// Residual rows of a state in which errors are told.
    pub fn told(&self, state: &State) -> Vec<f64> {
        match self.yardstick {
            Some(other) => state.fitted.model.residual_told(other.problem, state.torques()),
            None => state.fitted.at.residual.clone(),
        }
    }

    /// The same search for another problem on the same runs.
    pub fn on<'b>(&self, problem: &'b Problem<'b>) -> Search<'b>
    where
        'a: 'b,
    {
        Search {
            problem,
            records: self.records,
            sensors: self.sensors,
            yardstick: None,
            look: None,
            channel_std: self.channel_std.clone(),
            refusals: Vec::new(),
            banned: self.banned.clone(),
            unlikely: Vec::new(),
            promising: BTreeSet::new(),
            features: self.features.clone(),
            waves: self.waves.clone(),
        }
    }

    /// The base fit: every parameter within its tolerance, and the noise it leaves.
    pub fn base(&self, specs: Vec<EffectSpec>) -> Result<State, IdentifyError> {
        let known = self.look.and_then(|look| look.values(&specs));
        let (model, at) = self.fitted(specs, known, 12)?;
        let settled =
            if known.is_some() { self.settled_again(model, at) } else { self.settled_base(model, at) };
        self.with_other_springs(settled?)
    }

    /// A state in the rows in which errors are told: those of another residual, where there is a yardstick.
    pub fn as_told(&self, state: &State) -> Result<Told, IdentifyError> {
        let Some(yardstick) = self.yardstick else {
            return Ok(Told { floors: state.whitener.floors(), at: None });
        };
        // What it would keep for the next time fills more memory than it saves time.
        let other = yardstick.on(yardstick.problem);
        let model = state.fitted.model.again(other.problem)?;
        let at = model.linearise_told(other.problem, state.torques());
        let floors = other.noise(&model, &at.residual, &at.slices()).floors();
        Ok(Told { floors, at: Some(at) })
    }

    /// The noise about a model, from a saturated regression over everything that is offered to it.
    pub fn saturated(&self, problem: &Problem, model: &Candidate, at: &Linearised) -> Saturated {
        let trials = self.offered(model, &at.residual);
        let columns = all_columns(problem, model, &at.residual, &trials);
        let offered = columns.iter().flatten().flatten().map(Vec::as_slice);
        let all: Vec<&[f64]> = at.slices().into_iter().chain(offered).collect();
        let whitener = self.noise(model, &at.residual, &all);
        Saturated { trials, columns, whitener }
    }

    /// The fit of a model from what is stated, or from known values.
    pub fn fitted(
        &self,
        specs: Vec<EffectSpec>,
        known: Option<&[f64]>,
        iterations: usize,
    ) -> Result<(Candidate, Linearised), IdentifyError> {
        let mut model = Candidate::new(self.problem, specs)?;
        if let Some(known) = known {
            model.p.copy_from_slice(known);
        }
        let mut at = model.linearise(self.problem);
        let layout = self.problem.form.layout();
        if let Some(k) = at.residual.iter().position(|x| !x.is_finite()) {
            let segment = layout.segments.iter().find(|s| (s.first..s.first + s.len).contains(&k));
            let run = segment.map_or("run", |s| self.records[s.record].name.as_str());
            return Err(IdentifyError::run(
                run,
                "the model's prediction is not finite along this run",
                "check stiffness, inertias and units with `sinew check`",
            ));
        }
        let whitener = self.noise(&model, &at.residual, &at.slices());
        let white = whitener.apply_all(layout, &at.columns);
        let kept = model.keep_excited(&white, self.problem.robot.trust);
        at.columns = kept.into_iter().map(|k| std::mem::take(&mut at.columns[k])).collect();
        let at = refine(self.problem, &mut model, &whitener, at, iterations);
        Ok((model, at))
    }

    /// Takes banned candidates out of what is offered to a state.
    pub fn offer_again(&self, state: &mut State) {
        let allowed: Vec<bool> = state.trials.iter().map(|t| !self.banned.contains(&t.label())).collect();
        if let Some(scores) = state.scores.get_mut() {
            keep(scores, &allowed);
        }
        keep(&mut state.trials, &allowed);
        keep(&mut state.columns, &allowed);
    }

    /// The noise about a model, from a regression over these columns and what needs no physics.
    pub fn noise(&self, model: &Candidate, residual: &[f64], columns: &[&[f64]]) -> Whitener {
        let seed = self.problem.options.seed;
        let features = self.features(self.records).iter().map(Vec::as_slice);
        let all: Vec<&[f64]> = columns.iter().copied().chain(features).collect();
        Whitener::estimate(self.problem.form, self.records, &model.plant, &model.p, residual, &all, seed)
    }

    fn features(&self, records: &[Record]) -> &[Vec<f64>] {
        let layout = self.problem.form.layout();
        let rows = (0..layout.channels.len()).map(|c| rows_of(layout, c).count()).min().unwrap_or(0);
        let (count, seed) = (FEATURES.min(rows / 8), self.problem.options.seed);
        self.features.get_or_init(|| random_features(records, layout, count, seed))
    }

    fn waves(&self, records: &[Record]) -> &[Waves] {
        self.waves.get_or_init(|| Waves::of(self.problem.robot, records, self.sensors))
    }

    fn offered(&self, model: &Candidate, residual: &[f64]) -> Vec<Trial> {
        let layout = self.problem.form.layout();
        let scaled: Vec<Vec<f64>> = (0..layout.channels.len())
            .map(|c| {
                let rows = layout.of_channel(c).flat_map(|s| s.first..s.first + s.len);
                rows.map(|k| if layout.keep[k] { residual[k] / self.channel_std[c] } else { 0.0 }).collect()
            })
            .collect();
        let waves = self.waves(self.records).iter();
        let harmonics: Vec<(usize, f64)> =
            waves.flat_map(|w| w.harmonics(&scaled).map(|n| (w.dof, n))).collect();
        let offer = Offer {
            problem: self.problem,
            model,
            sensors: self.sensors,
            records: self.records,
            harmonics: &harmonics,
            swings: &self.swings(&scaled),
        };
        offer.trials().into_iter().filter(|trial| self.is_offered(trial)).collect()
    }

    // What is banned is not, nor along a long log what a part of it says nothing for.
    fn is_offered(&self, trial: &Trial) -> bool {
        self.look.is_none_or(|look| look.offers(trial)) && !self.banned.contains(&trial.label())
    }

    // The lines of every channel's rows.
    fn swings(&self, scaled: &[Vec<f64>]) -> Vec<(usize, Swing)> {
        let layout = self.problem.form.layout();
        let scales = self.records[0].scales;
        let of = |(c, rows): (usize, &Vec<f64>)| -> Vec<(usize, Swing)> {
            let mut rest = rows.as_slice();
            let runs = layout.of_channel(c).map(|s| rest.split_off(..s.len).unwrap_or_default());
            let lines = swings(runs, scales.step() * scales.every as f64);
            lines.into_iter().map(|line| (layout.channels[c].dof, line)).collect()
        };
        scaled.iter().enumerate().flat_map(of).collect()
    }

    pub fn refuse(&mut self, trial: &Trial, step: usize, reason: String) {
        let candidate = trial.label();
        if !self.refusals.iter().any(|r| r.candidate == candidate && r.step == step && r.reason == reason) {
            self.refusals.push(Refusal { candidate, step, reason });
        }
    }

    /// The simplest of the candidates tied with the best, with its rivals.
    pub fn choose(&self, round: &Round) -> Option<(usize, Vec<(Trial, f64)>)> {
        let layout = self.problem.form.layout();
        let best = round.passed.first()?;
        let temper = best.evidence.temper;
        let rows = layout.len.max(2) as f64;
        let distance = |o: &Refit| {
            let charge = (o.trial.parameters as f64 - best.trial.parameters as f64) * rows.ln();
            (o.fitted.objective - best.fitted.objective) / temper + charge
        };
        let tied = |o: &Refit| {
            distance(o) < TIE_CHI || z_between(layout, &o.fitted.white, &best.fitted.white) < TIE_Z
        };
        let gain = best.evidence.data + best.evidence.tension;
        let cheap = |o: &Refit| o.fitted.objective - best.fitted.objective < (0.02 * gain).max(8.0 * temper);
        let mut chosen = 0;
        for (k, o) in round.passed.iter().enumerate() {
            if tied(o) && cheap(o) && o.trial.complexity() < round.passed[chosen].trial.complexity() {
                chosen = k;
            }
        }
        let rivals = round
            .passed
            .iter()
            .enumerate()
            .filter(|(k, o)| *k != chosen && tied(o) && o.trial.label() != round.passed[chosen].trial.label())
            .map(|(_, o)| (o.trial.clone(), distance(o)))
            .collect();
        Some((chosen, rivals))
    }

    /// Accepts the chosen candidate, and with it others at other places whose columns do not overlap with it: a robot
    /// with friction missing in every joint needs one step, not one for each.
    pub fn accept(&self, state: &State, round: Round) -> Result<Option<State>, IdentifyError> {
        let Some((chosen, rivals)) = self.choose(&round) else { return Ok(None) };
        let layout = self.problem.form.layout();
        let mut beside: Vec<Vec<Other>> =
            round.passed.iter().map(|one| others(state, layout, &round.passed, one)).collect();
        let mut passed: Vec<Option<Refit>> = round.passed.into_iter().map(Some).collect();
        let Some(first) = passed[chosen].take() else { return Ok(None) };
        let mut companions: Vec<(Refit, Vec<Other>)> = Vec::new();
        for (k, other) in passed.into_iter().enumerate() {
            let Some(other) = other else { continue };
            let apart = |o: &Refit| {
                o.trial.place != other.trial.place
                    && !overlap(&state.fitted.white, &o.fitted.white, &other.fitted.white)
            };
            let new = matches!(other.trial.how, How::New { .. });
            if new && apart(&first) && companions.iter().all(|(o, _)| apart(o)) {
                companions.push((other, std::mem::take(&mut beside[k])));
            }
        }
        let mut accepted = state.accepted.clone();
        accepted.push(Accepted { others: std::mem::take(&mut beside[chosen]), ..taken(&first, rivals) });
        let mut model = first.fitted.model;
        for (companion, others) in companions {
            let How::New { spec, .. } = &companion.trial.how else { continue };
            model = appended(self.problem, model, spec, &companion.fitted.model)?;
            let effect = model.specs.len() - 1;
            accepted.push(Accepted { effect, others, ..taken(&companion, Vec::new()) });
        }
        self.settled_after(state, model, accepted).map(Some)
    }
}

// Keeps the entries that are allowed.
fn keep<T>(entries: &mut Vec<T>, allowed: &[bool]) {
    let mut allowed = allowed.iter();
    entries.retain(|_| allowed.next().is_some_and(|a| *a));
}

pub(crate) fn taken(refit: &Refit, rivals: Vec<(Trial, f64)>) -> Accepted {
    let effect = match &refit.trial.how {
        How::New { .. } => refit.fitted.model.specs.len() - 1,
        How::Release { unknowns } => refit.fitted.model.unknowns[unknowns[0]].id.effect,
    };
    Accepted {
        trial: refit.trial.clone(),
        effect,
        evidence: refit.evidence.clone(),
        rivals,
        others: Vec::new(),
    }
}

// The model with one more effect, at the values that its own refit gave it.
fn appended(
    problem: &Problem,
    mut model: Candidate,
    spec: &EffectSpec,
    refitted: &Candidate,
) -> Result<Candidate, IdentifyError> {
    let mut specs = model.specs.clone();
    specs.push(spec.clone());
    let mut extended = Candidate::new(problem, specs)?;
    let effect = model.specs.len();
    let source = refitted.plant.range(refitted.specs.len() - 1);
    model.p.extend_from_slice(&refitted.p[source.clone()]);
    let first = extended.plant.range(effect).start;
    let new = refitted.unknowns.iter().filter(|u| source.contains(&u.position)).map(|u| {
        let mut unknown = u.clone();
        unknown.id.effect = effect;
        unknown.position = first + u.id.parameter;
        unknown
    });
    model.unknowns.extend(new);
    extended.unknowns = model.unknowns;
    extended.p = model.p;
    Ok(extended)
}
