//! Diagnose: which effect is missing, how sure that is, and what would separate it from its rivals.

use serde::Serialize;

use sinew_data::Run;
use sinew_effect::{Card, Catalogue, PlaceKind};
use sinew_model::{Place, Robot, Setting};

use crate::analysis::{Aim, Analysis, LeftOver, Worked, analysed, residual_told};
use crate::base::scope;
use crate::comparison::findings_as_given;
use crate::episode::{self, Episode, Left, episodes, sudden};
use crate::explore::{Explored, explore, widening};
use crate::fitting::{ParameterReport, Reported, parameters, pulls};
use crate::gates::Evidence;
use crate::limits::{DetectionLimit, limits};
use crate::probability::{Grounds, likelihood_of_tied};
use crate::record::{Channel, Record};
use crate::remainder::left_of_channels;
use crate::report::{Finding, Refusal, Verdict};
use crate::scale::Scales;
use crate::search::{Accepted as Entry, Search, State, Told};
use crate::slow::passes_for_noise;
use crate::surrogate::{self, FalseAcceptance, sentence};
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;
use crate::verdict::{channels, word};
use crate::views::findings;
use crate::{IdentifyError, Options};

/// The three numbers of a channel on which the verdict rests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelReport {
    /// The quantity.
    pub signal: String,
    /// The joint.
    pub joint: String,
    /// Error on blocks that the fit left out, as a share of the measured standard deviation.
    pub unseen_error: f64,
    /// Share of the remaining variance that a generic predictor foretells on blocks it has not seen.
    pub predictable_remainder: f64,
    /// Error by the reachable floor.
    pub distance_to_floor: f64,
}

/// An effect of the final set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Accepted {
    /// Its name in the catalogue, or `external_force_episode`.
    pub effect: String,
    /// Joint, link or "robot".
    pub place: String,
}

/// An effect that the data do not, or only by priors, separate from a candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalReport {
    /// Its name in the catalogue.
    pub effect: String,
    /// Joint, link or "robot".
    pub place: String,
    /// Its share of what the candidate's probability leaves.
    pub probability: f64,
    /// What would separate the two.
    pub experiment: String,
}

/// A candidate with its evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateReport {
    /// Its name in the catalogue, or `external_force_episode`.
    pub effect: String,
    /// Joint, link or "robot".
    pub place: String,
    /// How often a statement like this one is right.
    pub probability: f64,
    /// Share of the squared error of its most affected channel.
    pub error_explained: f64,
    /// True if the robot states it and what is stated cannot be right; else it is new.
    pub is_stated: bool,
    /// ρ: root of the largest fall of a channel's mean square, in units of its filtered noise.
    pub contribution: f64,
    /// Its parameters.
    pub values: Vec<ParameterReport>,
    /// Evidence by its block-robust spread.
    pub z: f64,
    /// What the probability rests on; none of what explains a part only, and of episodes.
    pub grounds: Option<Grounds>,
    /// What it cannot be told from.
    pub rivals: Vec<RivalReport>,
}

impl CandidateReport {
    /// Share of the squared error of its most affected channel; none of what relieves a tension only: the base has taken the
    /// error away already, with parameters bent further than what is stated lets them.
    pub fn explains(&self) -> Option<f64> {
        let is_relief = self.grounds.is_some_and(|grounds| grounds.by_tension);
        (!is_relief).then_some(self.error_explained)
    }
}

/// The answer of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The graded verdict.
    pub verdict: Verdict,
    /// What the verdict rests on.
    pub scope: String,
    /// Three numbers a channel.
    pub channels: Vec<ChannelReport>,
    /// False acceptances on surrogates, where they were tried.
    pub false_acceptance: Option<FalseAcceptance>,
    /// The final set, empty unless something is missing.
    pub accepted: Vec<Accepted>,
    /// Candidates, best first.
    pub candidates: Vec<CandidateReport>,
    /// What the data and the fit tell besides, then views of the residual: what is left in the end, and of the model as given.
    pub findings: Vec<Finding>,
    /// Candidates that were refused, and why.
    pub refusals: Vec<Refusal>,
    /// Under `adequate`: what would have been seen.
    pub limits: Vec<DetectionLimit>,
}

/// Names the effects that the model lacks.
///
/// # Errors
/// If the robot is no plant or a run lacks the signals.
pub fn diagnose(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
) -> Result<Diagnosis, IdentifyError> {
    analysed(robot, catalogue, runs, options, Aim::Search, |search, begun| {
        let robot = begun.robot;
        let base = search.base(begun.prepared.base_specs(robot, catalogue))?;
        let sudden = sudden(search, &base);
        let mut told = search.as_told(&base)?;
        let given = findings_as_given(search.yardstick(), base.torques(), &told.floors)?;
        let explored = explore(search, base, None)?;
        if !explored.state.accepted.is_empty() {
            told = search.as_told(&explored.state)?;
        }
        let views = views_told(search, given, &explored, &told.floors);
        let scope = scope(robot, &begun.prepared.sensors, runs);
        let scope = format!("{scope}; {}", residual_told(search, begun));
        let (mut result, is_answered) = report(search, &explored, &told, begun, views, scope)?;
        let left = result.left(search, &explored, sudden.filter(|e| e.is_alone || !is_answered));
        Ok(Worked::of(&explored.state, result, is_answered, left))
    })
}

/// Where the model that was found still fails, then where the given one did.
pub(crate) fn views_told(
    search: &Search,
    given: Vec<Finding>,
    explored: &Explored,
    floors: &[f64],
) -> Vec<Finding> {
    let last = explored.rungs.last();
    let left = last.map(|rung| findings(search.yardstick(), &rung.residual, floors)).unwrap_or_default();
    let left = left.into_iter().map(|view| view.said_of("left in the end"));
    left.chain(given.into_iter().map(|view| view.said_of("as given"))).collect()
}

/// The diagnosis of a finished search, and whether all is explained; `told`: its last state.
pub(crate) fn report(
    search: &Search,
    explored: &Explored,
    told: &Told,
    begun: &Analysis,
    views: Vec<Finding>,
    scope: String,
) -> Result<(Diagnosis, bool), IdentifyError> {
    let state = &explored.state;
    let reports = parameters(search, state, widening(search, state));
    let own = clocks(search, state, &reports).into_iter().chain(differences(state, &reports));
    let suspicions = begun.suspicions.iter().cloned();
    let loads = load_on_axis(search, state).into_iter().chain(load_at_tool(search, state));
    let findings = own.chain(pulls(state, &reports)).chain(loads);
    let findings = findings.chain(suspicions).chain(views).collect();
    let channels = channels(search, state, told);
    let left = left_of_channels(search.problem.form.layout(), &state.fitted.white);
    let mut verdict = word(&channels, &left, state.accepted.len());
    let of = |entry| Grounds::of(search, explored, &channels, &left, &reports, entry);
    let grounds: Vec<Grounds> = state.accepted.iter().map(of).collect();
    let of = |(entry, grounds): (&Entry, &Grounds)| candidate(search, state, &reports, entry, *grounds);
    let mut candidates: Vec<CandidateReport> = state.accepted.iter().zip(&grounds).map(of).collect();
    let mut scope = scope;
    let false_acceptance = false_acceptance(search, state)?;
    if let Some(count) = &false_acceptance {
        scope.push_str(&format!("; {}", sentence(count)));
        // No name is surer than the search is right where nothing is missing.
        let most = if count.decides() { 1.0 - count.chance() } else { 0.5 };
        candidates.iter_mut().for_each(|c| c.probability = c.probability.min(most));
        if !count.decides() {
            verdict = Verdict::Undecidable;
        }
    }
    if !candidates.is_empty() && candidates.iter().all(|c| c.probability < 0.5) {
        let is_like = verdict != Verdict::Undecidable && grounds.iter().all(Grounds::is_only_like);
        verdict = if is_like { Verdict::Unexplained } else { Verdict::Undecidable };
    }
    if verdict == Verdict::Unexplained {
        candidates.extend(partial(explored));
    }
    let accepted = state
        .accepted
        .iter()
        .map(|e| Accepted { effect: e.trial.card.name.to_owned(), place: e.trial.place.to_string() })
        .collect();
    let refusals = search.refusals.clone();
    let is_adequate = verdict == Verdict::Adequate && begun.episodes.iter().all(|e| e.begins);
    let limits = if is_adequate { limits(search, explored) } else { Vec::new() };
    let mut diagnosis = Diagnosis {
        limits,
        verdict,
        scope,
        channels,
        false_acceptance,
        accepted,
        candidates,
        findings,
        refusals,
    };
    let is_explained = diagnosis.add(&begun.episodes, search, state);
    Ok((diagnosis, is_explained))
}

// How often names are false on surrogates of the log, where a name on so few blocks may rest on their chances.
fn false_acceptance(search: &Search, state: &State) -> Result<Option<FalseAcceptance>, IdentifyError> {
    let few = search.problem.form.layout().blocks < FEWEST_BLOCKS;
    if !few || state.accepted.is_empty() {
        return Ok(None);
    }
    surrogate::false_acceptance(search, state).map(Some)
}

impl Diagnosis {
    /// The short times that hold what a search leaves, or else the one that stands out of what its base left: those that may
    /// be left out; the others are told.
    pub(crate) fn left(&mut self, search: &Search, explored: &Explored, sudden: Option<Episode>) -> LeftOver {
        let found = episodes(search, &explored.state);
        let is_rest_noise = !found.is_empty();
        let all = if is_rest_noise { found } else { Vec::from_iter(sudden) };
        let left: Vec<Left> = all.iter().map(|e| Left::of(search, &explored.state, e)).collect();
        let is_gone = left.iter().all(Left::is_noise);
        let is_of_laws = left.iter().all(Left::is_of_laws);
        let (alone, told): (Vec<Episode>, Vec<Episode>) = all.into_iter().partition(|e| e.is_alone);
        self.findings.splice(0..0, told.iter().map(|e| e.finding(search)));
        let is_slow = passes_for_noise(search, explored);
        LeftOver {
            is_rest_noise: is_rest_noise && told.is_empty(),
            is_gone,
            is_of_laws,
            is_slow,
            episodes: alone,
        }
    }

    // Episodes are told before all else and named after the laws, but for the beginnings of runs, whose springs may swing from
    // what was before. True if all is explained.
    fn add(&mut self, episodes: &[Episode], search: &Search, state: &State) -> bool {
        let is_rest_explained = matches!(self.verdict, Verdict::Adequate | Verdict::Missing);
        let (beginnings, acted): (Vec<&Episode>, Vec<&Episode>) = episodes.iter().partition(|e| e.begins);
        self.findings.splice(0..0, beginnings.iter().map(|e| e.finding(search)));
        for (k, episode) in acted.iter().enumerate() {
            let candidate = episode.candidate(search, state, is_rest_explained);
            let (effect, place) = (candidate.effect.clone(), candidate.place.clone());
            self.candidates.insert(self.accepted.len(), candidate);
            self.accepted.push(Accepted { effect, place });
            self.findings.insert(k, episode.finding(search));
        }
        if is_rest_explained && !acted.is_empty() {
            self.verdict = Verdict::Missing;
        }
        is_rest_explained
    }
}

// A load whose mass shows in nothing, since it hangs on the axis about which alone the tool turns: what it is, a user knows.
fn load_on_axis(search: &Search, state: &State) -> Option<Finding> {
    let payload = state.accepted.iter().find(|entry| entry.trial.card.name == "payload")?;
    let is_strength = |u: &Unknown| u.id.effect == payload.effect && u.is_strength();
    if state.fitted.model.unknowns.iter().any(is_strength) {
        return None;
    }
    let tool = &search.problem.robot.model.links[search.problem.robot.tool.0].name;
    let statement = format!(
        "of the payload these runs tell no mass, only what it does about {tool}, whose frame stays on one axis: weigh it and write its \
         mass into the file, or state as `tool` the frame where it hangs"
    );
    Some(about_tool(statement))
}

// A load that may hang at the tool, where the sidecar has it or, by default, at the last link.
fn load_at_tool(search: &Search, state: &State) -> Option<Finding> {
    let robot = search.problem.robot;
    let (model, tool) = (&robot.model, &robot.model.links[robot.tool.0]);
    let body = |place: &Place| match place {
        Place::Link(name) => model.link(name).and_then(|link| model.links[link.0].body),
        _ => None,
    };
    let moment = state.accepted.iter().find(|entry| {
        let is_moment = entry.trial.card.name == "link_first_moment";
        is_moment && tool.body.is_some() && body(&entry.trial.place) == tool.body
    })?;
    let statement = format!(
        "{} is also what a load at {} is whose mass this log does not tell; if there is one, weigh it and state it as a payload with \
         mass and first moment",
        moment.trial.label(),
        tool.name
    );
    Some(about_tool(statement))
}

fn about_tool(statement: String) -> Finding {
    let (joint, signal, regime) = (String::new(), String::new(), "tool".to_owned());
    Finding { joint, signal, regime, statement, share: 0.0 }
}

// Named effects whose strength depends on the run: perhaps on temperature, load or something else that changed.
fn differences(state: &State, reports: &[Reported]) -> Vec<Finding> {
    let strengths = reports.iter().zip(&state.fitted.model.unknowns).filter(|(_, u)| u.is_strength());
    let named = strengths.filter(|((e, _), _)| state.accepted.iter().any(|a| a.effect == *e));
    named
        .map(|(report, _)| report)
        .filter_map(|(effect, r)| {
            let spec = &state.fitted.model.specs[*effect];
            let differs = r.difference_told()?;
            Some(Finding {
                joint: spec.place.to_string(),
                signal: String::new(),
                regime: "runs".to_owned(),
                statement: format!("{}: {} {differs}: something that changed drives it", spec.kind, r.name),
                share: 0.0,
            })
        })
        .collect()
}

// Two sensors of one joint that are not read at the same instant: told before anything else.
fn clocks(search: &Search, state: &State, reports: &[Reported]) -> Vec<Finding> {
    let period = search.records.iter().map(|r| r.scales.period).fold(0.0, f64::max);
    reports
        .iter()
        .filter(|(effect, r)| {
            let skew = state.fitted.model.specs[*effect].kind == "time_skew";
            skew && r.value.abs() > CLOCK_SHARE * period && r.value.abs() > 4.0 * r.std
        })
        .map(|(effect, r)| {
            let spec = &state.fitted.model.specs[*effect];
            let joint = spec.place.to_string();
            let (signal, whose) = match spec.get("signal") {
                Some(Setting::Word(signal)) => (signal.as_str(), "the motor's position"),
                _ => ("joint_position", "the motor's"),
            };
            let (late, size) = (if r.value > 0.0 { "after" } else { "before" }, 1e3 * r.value.abs());
            let hold = if signal == "motor_torque" { of_a_hold(search, r.value) } else { "" };
            Finding {
                statement: format!(
                    "{joint}, {}: read {size:.2} ± {:.2} ms {late} {whose}{hold}",
                    signal.replace('_', " "),
                    1e3 * r.std
                ),
                joint,
                signal: signal.to_owned(),
                regime: "clock".to_owned(),
                share: 1.0,
            }
        })
        .collect()
}

// What the clock of a torque may be that is taken to change between its samples: half a period, which is no clock.
fn of_a_hold(search: &Search, skew: f64) -> &'static str {
    let is_half = |record: &Record| {
        let Scales { period, held, .. } = record.scales;
        !held && (skew + 0.5 * period).abs() < NEARLY_HALF * period
    };
    if !search.problem.form.is_white() && search.records.iter().all(is_half) {
        ": about half a sample period, as a torque has that is held until the next sample"
    } else {
        ""
    }
}

// One-second blocks from which a search can decide without asking surrogates.
const FEWEST_BLOCKS: usize = 12;
// A clock error is told if it is this share of a sample period.
const CLOCK_SHARE: f64 = 0.3;
// … and of a torque that is held if it is half of one within this share.
const NEARLY_HALF: f64 = 0.2;

fn candidate(
    search: &Search,
    state: &State,
    reports: &[Reported],
    entry: &Entry,
    grounds: Grounds,
) -> CandidateReport {
    let probability = grounds.probability();
    let own = reports.iter().filter(|(effect, _)| *effect == entry.effect);
    let own: Vec<ParameterReport> = own.map(|(_, report)| report.clone()).collect();
    CandidateReport {
        effect: entry.trial.card.name.to_owned(),
        place: entry.trial.place.to_string(),
        probability,
        error_explained: entry.evidence.explained,
        is_stated: matches!(entry.trial.how, How::Release { .. }) && own.iter().any(|p| p.start != 0.0),
        contribution: grounds.contribution,
        values: own,
        z: grounds.z,
        grounds: Some(grounds),
        rivals: rivals(search, state, entry, probability, grounds.once),
    }
}

// Weight of a tied rival, the winner's being one, from which it is worth a word.
const NO_CHANCE: f64 = 0.005;

// Tied candidates, then structural partners that the card names; none that is named beside it.
fn rivals(search: &Search, state: &State, entry: &Entry, probability: f64, once: bool) -> Vec<RivalReport> {
    let card = entry.trial.card;
    let is_named = |name: &str, place: &str| {
        let is_it = |a: &Entry| a.trial.card.name == name && a.trial.place.to_string() == place;
        state.accepted.iter().any(is_it)
    };
    let dof = search.problem.robot.model.dof(&entry.trial.place.to_string());
    let seen = |sensor| dof.is_some_and(|dof| search.sensors.channels.contains(&Channel { sensor, dof }));
    let experiment = |name: &str| {
        if name == episode::NAME {
            return episode::EXPERIMENT.to_owned();
        }
        // Either card may name the other.
        let of = |card: &'static Card, name: &str| card.rivals.iter().find(|r| r.name == name);
        let other = search.problem.catalogue.find(name).map(|entry| entry.card);
        let known = of(card, name).or_else(|| of(other?, card.name));
        let generic = || "repeat the motion at two speeds and under two loads".to_owned();
        known.map_or_else(generic, |rival| rival.experiment_with(seen))
    };
    let mut list: Vec<(String, String, f64)> = entry
        .rivals
        .iter()
        .map(|(trial, distance)| {
            (trial.card.name.to_owned(), trial.place.to_string(), likelihood_of_tied(*distance))
        })
        .collect();
    for rival in card.rivals.iter().filter(|r| r.structural) {
        let Some(other) = search.problem.catalogue.find(rival.name) else { continue };
        let plant = &state.fitted.model.plant;
        let place = match (other.place, &entry.trial.place) {
            (PlaceKind::Robot, _) => Place::Robot.to_string(),
            (PlaceKind::Link, Place::Robot) => plant.model().links[plant.tool().0].name.clone(),
            (PlaceKind::Link, Place::Joint(joint)) => {
                let body = plant.model().joint(joint);
                let moved = plant.model().links.iter().find(|l| l.body.is_some() && l.body == body);
                moved.map_or_else(|| joint.clone(), |link| link.name.clone())
            }
            (_, place) => place.to_string(),
        };
        if !list.iter().any(|(name, ..)| name == rival.name) {
            list.push((rival.name.to_owned(), place, 0.3));
        }
    }
    list.retain(|(name, place, weight)| *weight > NO_CHANCE && !is_named(name, place));
    if once {
        let dof = search.yardstick().problem.form.layout().channels[entry.evidence.channel].dof;
        list.push((episode::NAME.to_owned(), search.problem.robot.model.dof_name(dof).to_owned(), 1.0));
    }
    let total: f64 = list.iter().map(|(.., weight)| weight).sum::<f64>() + 0.3;
    list.into_iter()
        .map(|(effect, place, weight)| RivalReport {
            experiment: experiment(&effect),
            effect,
            place,
            probability: (1.0 - probability) * weight / total,
        })
        .collect()
}

// Under "unexplained": what explains a part, although it passes no gate.
fn partial(explored: &Explored) -> Vec<CandidateReport> {
    let Some(round) = &explored.last else { return Vec::new() };
    let of = |trial: &Trial, evidence: &Evidence| CandidateReport {
        effect: trial.card.name.to_owned(),
        place: trial.place.to_string(),
        probability: 0.05,
        error_explained: evidence.explained,
        is_stated: matches!(trial.how, How::Release { .. }),
        contribution: evidence.material.max(0.0).sqrt(),
        values: Vec::new(),
        z: evidence.z,
        grounds: None,
        rivals: Vec::new(),
    };
    let worth = round.failed.iter().filter(|r| r.evidence.z > 2.0 && r.evidence.explained > 0.02);
    worth.take(3).map(|r| of(&r.trial, &r.evidence)).collect()
}
