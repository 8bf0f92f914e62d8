//! Fit and discover: parameters with their errors, and the ladder of falling errors.

use serde::Serialize;

use sinew_data::Run;
use sinew_effect::{Catalogue, Screening, Written};
use sinew_model::{EffectSpec, Model, Place, Robot};

use crate::analysis::{Aim, Worked, analysed, residual_told};
use crate::base::{is_nuisance, scope};
use crate::before::of_unseen;
use crate::comparison::{Prepared, SignalError, as_given, signals, total};
use crate::diagnosis::{Diagnosis, report, views_told};
use crate::episode::sudden;
use crate::equations::Equations;
use crate::explore::{Explored, Unseen, explore, rung, widening};
use crate::heterogeneity::run_to_run;
use crate::problem::{Candidate, Problem};
use crate::refit::{Base, refit};
use crate::report::{Finding, Verdict};
use crate::screen::Screen;
use crate::search::{Search, State, taken};
use crate::trial::How;
use crate::unknowns::{FARTHEST, Unknown};
use crate::{IdentifyError, Options};

/// One step of a ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepReport {
    /// Effects added, `effect@place`; those taken out again begin with −.
    pub added: Vec<String>,
    /// Root mean square of all signals, each divided by its noise floor.
    pub rms_error: f64,
    /// The same on runs that no fit has seen.
    pub check_rms_error: Option<f64>,
    /// What noise alone would give: one.
    pub noise_floor: f64,
    /// Errors by signal.
    pub signals: Vec<SignalError>,
    /// The same on runs that no fit has seen.
    pub check_signals: Vec<SignalError>,
}

impl StepReport {
    // The signal that is worst beside what it is on the fitted runs, where it is far worse.
    fn unseen_finding(&self) -> Option<Finding> {
        let floors = |s: &SignalError| s.rms_error / s.noise_floor;
        let (unseen, seen, worst) = (self.signals.iter().zip(&self.check_signals))
            .map(|(seen, unseen)| (floors(unseen), floors(seen), unseen))
            .filter(|(unseen, seen, _)| *unseen > FAR_WORSE * seen.max(1.0))
            .max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))?;
        let (signal, joint) = (&worst.signal, &worst.joint);
        let statement = format!(
            "on the unseen runs the {} of {joint} is off by {unseen:.1} noise floors, on the fitted ones by {seen:.1}: they \
             show what these do not, so fit on them, too",
            signal.replace('_', " ")
        );
        let (joint, signal, regime) = (joint.clone(), signal.clone(), UNSEEN.to_owned());
        Some(Finding { joint, signal, regime, statement, share: 1.0 })
    }
}

/// The regime of a finding about runs that nothing was fitted to.
pub const UNSEEN: &str = "unseen runs";
// Times the error of the fitted runs, or the floor, at which an error on the unseen ones is told.
const FAR_WORSE: f64 = 3.0;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// Place and key, as in `shoulder.coulomb`.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation, widened by the misfit that remains and to the spread between runs.
    pub std: f64,
    /// Its standard deviation from run to run, beyond what noise explains.
    pub between_runs: f64,
    /// Its unit.
    pub unit: String,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Its value before the fit.
    pub start: f64,
    /// What is remarkable about it.
    pub note: Option<String>,
}

impl ParameterReport {
    /// Its name without the place at which it is: `first_moment.x` of `upper_arm.first_moment.x`.
    pub fn key(&self, place: &str) -> &str {
        self.name.strip_prefix(place).and_then(|rest| rest.strip_prefix('.')).unwrap_or(&self.name)
    }

    /// By how much it differs between runs as a share of itself, where that is more than a quarter: something that
    /// changed drives it.
    pub fn difference(&self) -> Option<f64> {
        let share = self.between_runs / self.value.abs();
        (self.value != 0.0 && share > MOST_DIFFERENT).then_some(share)
    }

    /// The same in words.
    pub(crate) fn difference_told(&self) -> Option<String> {
        let share = match self.difference()? {
            share if share > 1.0 => "more than itself".to_owned(),
            share => format!("± {:.0} % of itself", 100.0 * share),
        };
        Some(format!("differs between runs by {share}"))
    }
}

// Share of itself by which a constant of a robot may differ between runs.
const MOST_DIFFERENT: f64 = 0.25;

/// A fitted model and how it came about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// The ladder; step 0 is the model as given.
    pub steps: Vec<StepReport>,
    /// Effects of the fitted model, nuisances left out.
    pub effects: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<ParameterReport>,
    /// The verdict on the fitted model.
    pub verdict: Verdict,
    /// Everything the search found.
    pub diagnosis: Diagnosis,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// By how much logged torques act before the middles of their holds, s: zero where they are held until the next. None where
    /// the rows do not tell.
    pub torques_early: Option<f64>,
    /// The effects of the fitted robot, with values and standard deviations as files write them.
    #[serde(skip)]
    pub specs: Vec<EffectSpec>,
}

/// Estimates the parameters of the robot and of the effects added to it.
///
/// # Errors
/// If the robot is no plant, a run lacks the signals, or an added effect does not exist there.
pub fn fit(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    check: &[Run],
    add: &[EffectSpec],
    options: &Options,
) -> Result<Fit, IdentifyError> {
    work(robot, catalogue, runs, check, options, Aim::Fit, |search, base, unseen| {
        let mut state = base;
        let mut rungs = vec![rung(search, &[], &state, unseen)];
        for spec in add {
            state = added(search, state, spec)?;
            rungs.push(rung(search, &[spec.place.label(&spec.kind)], &state, unseen));
        }
        Ok(Explored { state, rungs, last: None })
    })
}

/// Repeats diagnose, add and fit until nothing structured is left or nothing in the catalogue explains the rest.
///
/// # Errors
/// If the robot is no plant or a run lacks the signals.
pub fn discover(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    check: &[Run],
    options: &Options,
) -> Result<Fit, IdentifyError> {
    work(robot, catalogue, runs, check, options, Aim::Search, explore)
}

fn work(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    check: &[Run],
    options: &Options,
    aim: Aim,
    climb: impl Fn(&mut Search, State, Option<&Unseen>) -> Result<Explored, IdentifyError>,
) -> Result<Fit, IdentifyError> {
    let suspicions = of_unseen(robot, catalogue, [runs, check], options)?;
    analysed(robot, catalogue, runs, options, aim, |search, begun| {
        let robot = begun.robot;
        let prepared = begun.prepared;
        let options = search.problem.options;
        let base = search.base(prepared.base_specs(robot, catalogue))?;
        let sudden = sudden(search, &base);
        let floors = search.as_told(&base)?.floors;
        let unseen_runs = Prepared::with(robot, check, prepared.sensors.clone(), prepared.scales)?;
        let unseen_form = unseen_runs.form(robot);
        let unseen_problem = Problem::new(robot, catalogue, &unseen_form, options);
        let unseen_search = Search::new(&unseen_problem, &unseen_runs.records, &unseen_runs.sensors);
        let unseen = (!check.is_empty()).then(|| Unseen { search: &unseen_search, floors: floors.clone() });
        let yardstick = search.yardstick();
        let (given, given_residual) = as_given(yardstick, base.torques(), &floors)?;
        let given_unseen = match &unseen {
            Some(_) => {
                let model = Candidate::new(yardstick.problem, robot.all_effects())?;
                Some(model.residual_told(&unseen_problem, base.torques()))
            }
            None => None,
        };
        let explored = climb(search, base, unseen.as_ref())?;
        let told = search.as_told(&explored.state)?;
        let floors = &told.floors;
        let yardstick = search.yardstick();
        let step = |added: Vec<String>, residual: &[f64], hidden: Option<&Vec<f64>>| StepReport {
            added,
            rms_error: total(yardstick, residual, floors),
            check_rms_error: hidden.map(|r| total(&unseen_search, r, floors)),
            noise_floor: 1.0,
            signals: signals(yardstick, residual, floors),
            check_signals: hidden.map(|r| signals(&unseen_search, r, floors)).unwrap_or_default(),
        };
        let mut steps = vec![step(Vec::new(), &given_residual, given_unseen.as_ref())];
        steps.extend(explored.rungs.iter().map(|r| step(r.added.clone(), &r.residual, r.unseen.as_ref())));
        let scope = scope(robot, &prepared.sensors, runs);
        let scope = format!("{scope}; {}", residual_told(search, begun));
        let views = views_told(search, given.findings, &explored, floors);
        let (mut diagnosis, is_answered) = report(search, &explored, &told, begun, views, scope)?;
        let left = diagnosis.left(search, &explored, sudden.filter(|e| e.is_alone || !is_answered));
        let unseen = steps.last().and_then(StepReport::unseen_finding);
        diagnosis.findings.splice(0..0, unseen.into_iter().chain(suspicions.iter().cloned()));
        let result = finished(search, &explored.state, diagnosis, steps, runs, check);
        Ok(Worked::of(&explored.state, result, is_answered, left))
    })
}

fn finished(
    search: &Search,
    state: &State,
    diagnosis: Diagnosis,
    steps: Vec<StepReport>,
    runs: &[Run],
    check: &[Run],
) -> Fit {
    let wide = widening(search, state);
    let model = &state.fitted.model;
    let told = |effect: usize| {
        let accepted = state.accepted.iter().any(|a| a.effect == effect);
        accepted || !is_nuisance(&model.specs[effect].kind)
    };
    let reports = parameters(search, state, wide);
    let mut warnings = repeats(runs, check);
    warnings.extend(pulls(state, &reports).into_iter().map(|finding| finding.statement));
    let stds: Option<Vec<f64>> =
        standard_deviations(search, state, wide).map(|spreads| spreads.into_iter().map(|s| s.std).collect());
    let moved = |effect: usize| {
        model.unknowns.iter().any(|u| u.id.effect == effect && u.pull(model.p[u.position]) > 0.0)
    };
    if diagnosis.verdict == Verdict::Unexplained {
        warnings.push(
            "what is not explained bends the fitted parameters: they describe these runs, not the robot"
                .to_owned(),
        );
    }
    let specs = model.present_specs(stds.as_deref()).into_iter().enumerate();
    let specs = specs.filter(|(k, _)| told(*k) || moved(*k)).map(|(_, spec)| spec).collect();
    let effects = model.plant.effects().iter().enumerate();
    Fit {
        steps,
        effects: effects.filter(|(k, _)| told(*k)).map(|(_, e)| e.label()).collect(),
        parameters: told_apart(model, reports.into_iter().filter(|(effect, _)| told(*effect)).collect()),
        verdict: diagnosis.verdict,
        diagnosis,
        warnings,
        torques_early: state.torques().map(|torques| torques.early),
        specs,
    }
}

// Parameters of two effects at one place that bear the same name get that of their effect, too.
fn told_apart(model: &Candidate, reports: Vec<Reported>) -> Vec<ParameterReport> {
    let names: Vec<String> = reports.iter().map(|(_, r)| r.name.clone()).collect();
    let own = |(effect, mut report): Reported| {
        let spec = &model.specs[effect];
        if names.iter().filter(|name| **name == report.name).count() > 1 {
            let place = spec.place.to_string();
            report.name = format!("{place}.{}.{}", spec.kind, report.key(&place));
        }
        report
    };
    reports.into_iter().map(own).collect()
}

// Adds one effect whatever the gates say: the best of its start values, refitted.
fn added(search: &mut Search, state: State, spec: &EffectSpec) -> Result<State, IdentifyError> {
    let wanted = spec.place.label(&spec.kind);
    let layout = search.problem.form.layout();
    let fitted = &state.fitted;
    let own: Vec<usize> = (0..state.trials.len()).filter(|&k| state.trials[k].label() == wanted).collect();
    let base = Equations::new(&state.whitener, search.problem, &fitted.model, &fitted.at, 0.0);
    let best = base.and_then(|base| {
        let screen = Screen::new(search.problem, &fitted.model, &base);
        own.iter()
            .filter_map(|&k| {
                let raw = state.columns[k].as_ref()?;
                let score = screen.score(&state.trials[k], &state.whitener.apply_all(layout, raw))?;
                let base = Base { fitted, whitener: &state.whitener, added: &state.added() };
                refit(
                    search.problem,
                    &base,
                    None,
                    &state.trials[k],
                    &score,
                    f64::INFINITY,
                    &search.channel_std,
                )
            })
            .min_by(|a, b| a.fitted.objective.total_cmp(&b.fitted.objective))
    });
    let Some(best) = best else {
        return Err(IdentifyError::Question {
            what: format!("{wanted} cannot be added: these runs do not show it, or it acts elsewhere"),
            help: format!("`sinew effects {}` says where it acts and what must be measured", spec.kind),
        });
    };
    let mut accepted = state.accepted.clone();
    accepted.push(taken(&best, Vec::new()));
    let mut model = best.fitted.model;
    let at = model.linearise(search.problem);
    let at = crate::problem::refine(search.problem, &mut model, &state.whitener, at, 4);
    search.settled_anew(model, |_| at, accepted)
}

/// A parameter with the number of the effect it belongs to.
pub(crate) type Reported = (usize, ParameterReport);

/// Every unknown of a fitted model, with the effect it belongs to.
pub(crate) fn parameters(search: &Search, state: &State, wide: f64) -> Vec<Reported> {
    let model = &state.fitted.model;
    let stds = standard_deviations(search, state, wide)
        .unwrap_or_else(|| vec![Spread { std: f64::NAN, between_runs: 0.0 }; model.unknowns.len()]);
    model
        .unknowns
        .iter()
        .zip(stds)
        .map(|(u, Spread { mut std, mut between_runs })| {
            let active = &model.plant.effects()[u.id.effect];
            let parameter = &active.effect.card().parameters[u.id.parameter];
            let (mut value, mut start) = (model.p[u.position], active.values[u.id.parameter]);
            let (mut unit, range) = (parameter.unit.to_owned(), u.range);
            let (mut low, mut high) = ((value - 1.96 * std).max(range.0), (value + 1.96 * std).min(range.1));
            if parameter.written == Written::Reciprocal && value > 0.0 {
                // 1/c ± σ/c²
                std /= value * value;
                between_runs /= value * value;
                (low, high) = (1.0 / high, if low > 0.0 { 1.0 / low } else { f64::INFINITY });
                value = 1.0 / value;
                start = if start > 0.0 { 1.0 / start } else { f64::INFINITY };
                unit = parameter.written_unit();
            }
            if slides(model.plant.model(), &active.spec.place) {
                unit = of_slide(&unit);
            }
            let name = format!("{}.{}", active.spec.place, parameter.label());
            let from = if is_assumed(state, u) { "what the catalogue assumes" } else { "what was stated" };
            let note = note(u.pull(model.p[u.position]).sqrt(), from, model.p[u.position], range);
            let mut report = ParameterReport { name, value, std, between_runs, unit, low, high, start, note };
            if report.note.is_none() && !u.shape {
                report.note = report.difference_told();
            }
            (u.id.effect, report)
        })
        .collect()
}

fn note(pull: f64, from: &str, value: f64, range: (f64, f64)) -> Option<String> {
    if value <= range.0 || value >= range.1 {
        Some("at its bound".to_owned())
    } else if pull > 4.0 {
        Some(format!("{pull:.1} σ from {from}"))
    } else {
        None
    }
}

fn slides(model: &Model, place: &Place) -> bool {
    let Place::Joint(name) = place else { return false };
    model.require_dof(name).is_ok_and(|dof| model.joints[model.joint_of_dof(dof).0].kind.slides())
}

// Cards write the units of turning joints: N·m·s/rad of a sliding one is N·s/m.
fn of_slide(unit: &str) -> String {
    unit.replace("kg·m²", "kg").replace("N·m", "N").replace("rad", "m")
}

// How sure a parameter is.
#[derive(Debug, Clone, Copy)]
struct Spread {
    // Widened by the misfit that remains, and to the spread between runs.
    std: f64,
    between_runs: f64,
}

fn standard_deviations(search: &Search, state: &State, wide: f64) -> Option<Vec<Spread>> {
    let equations =
        Equations::new(&state.whitener, search.problem, &state.fitted.model, &state.fitted.at, 0.0)?;
    let between = run_to_run(
        search.problem.form.layout(),
        &equations.columns,
        &equations.residual,
        &equations.quadratic.normal,
        wide,
    );
    let spread = |(variance, between_runs): (f64, f64)| Spread {
        std: (variance.max(0.0).sqrt() * wide).max(between_runs),
        between_runs,
    };
    Some(equations.quadratic.normal.variances().into_iter().zip(between).map(spread).collect())
}

// A check run that repeats a fitted command is no unseen motion.
fn repeats(runs: &[Run], check: &[Run]) -> Vec<String> {
    let all: Vec<Run> = runs.iter().chain(check).cloned().collect();
    sinew_data::find_repeats(&all)
        .into_iter()
        .filter(|r| r.first < runs.len() && r.second >= runs.len())
        .map(|r| {
            format!(
                "{} repeats the motion of {} for {:.1} s: its error is no evidence on unseen motion",
                all[r.second].name, all[r.first].name, r.duration
            )
        })
        .collect()
}

// True if the search added the effect.
fn is_added(state: &State, effect: usize) -> bool {
    state.accepted.iter().any(|a| a.effect == effect && matches!(a.trial.how, How::New { .. }))
}

// A parameter of an effect that the files do not state, or a shape of which they say nothing.
fn is_assumed(state: &State, unknown: &Unknown) -> bool {
    let effect = unknown.id.effect;
    let active = &state.fitted.model.plant.effects()[effect];
    let key = active.effect.card().parameters[unknown.id.parameter].key;
    is_added(state, effect) || (unknown.shape && active.spec.get(key).is_none())
}

// A number of periods a turn that the position scan found.
fn is_scanned(state: &State, unknown: &Unknown) -> bool {
    let card = state.fitted.model.plant.effects()[unknown.id.effect].effect.card();
    is_added(state, unknown.id.effect) && unknown.shape && matches!(card.screening, Screening::Harmonic)
}

// Stated values that the data contradict, the farthest first.
pub(crate) fn pulls(state: &State, reports: &[Reported]) -> Vec<Finding> {
    let model = &state.fitted.model;
    // Clocks of which nothing is stated are told by themselves.
    let is_clock = |effect: usize, start: f64| model.specs[effect].kind == "time_skew" && start == 0.0;
    let stated = reports.iter().zip(&model.unknowns).filter(|((e, report), _)| !is_clock(*e, report.start));
    let pulled = stated.map(|((effect, report), u)| {
        let pull = u.pull(model.p[u.position]).sqrt();
        let spec = &model.specs[*effect];
        let at_least = if pull > 0.99 * FARTHEST { "at least " } else { "" };
        let stops = if at_least.is_empty() { "" } else { ", where a fit stops: state how well it is known" };
        let far = format!("{at_least}{pull:.1} of its standard deviations");
        let (name, value, unit, start) = (&report.name, report.value, &report.unit, report.start);
        let statement = if is_assumed(state, u) {
            let of = if is_scanned(state, u) { "of the position scan" } else { "that the catalogue assumes" };
            format!("{name}: fits with {value:.4} {unit}, {far} from the {start:.4} {of}{stops}")
        } else if start == 0.0 {
            format!("{name}: fits {value:+.4} {unit} away from what the files state, {far}{stops}")
        } else {
            format!("{name}: fits with {value:.4} {unit}, {far} from the {start:.4} stated{stops}")
        };
        let (joint, signal, regime) = (spec.place.to_string(), String::new(), "stated".to_owned());
        (pull, Finding { joint, signal, regime, statement, share: 0.0 })
    });
    let mut far: Vec<(f64, Finding)> = pulled.filter(|(pull, _)| *pull > FAR).collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    far.into_iter().take(MOST_PULLS).map(|(_, finding)| finding).collect()
}

// Standard deviations from its stated value at which one is told, and how many are.
const FAR: f64 = 2.5;
const MOST_PULLS: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_unseen_runs_is_told_where_the_fitted_ones_know_nothing_of_it() {
        let signal = |signal: &str, rms_error| SignalError {
            signal: signal.to_owned(),
            joint: "elbow".to_owned(),
            unit: "rad".to_owned(),
            rms_error,
            rms_measured: 1.0,
            noise_floor: 1e-3,
            fit_percent: 99.0,
            white: false,
        };
        let step = |unseen: f64| StepReport {
            added: Vec::new(),
            rms_error: 1.0,
            check_rms_error: Some(1.0),
            noise_floor: 1.0,
            signals: vec![signal("motor_torque", 2e-3), signal("joint_position", 0.9e-3)],
            check_signals: vec![signal("motor_torque", 5e-3), signal("joint_position", unseen)],
        };
        assert_eq!(step(2.9e-3).unseen_finding(), None);
        let finding = step(46e-3).unseen_finding().unwrap();
        assert_eq!((finding.signal.as_str(), finding.regime.as_str()), ("joint_position", UNSEEN));
        let begins = "on the unseen runs the joint position of elbow is off by 46.0 noise floors, on the fitted ones by 0.9";
        assert!(finding.statement.starts_with(begins), "{}", finding.statement);
    }

    #[test]
    fn units_of_a_sliding_joint_have_no_radians() {
        let units = ["N·m", "N·m·s/rad", "N·m/rad", "rad/s", "kg·m²", "1/turn"].map(of_slide);
        assert_eq!(units, ["N", "N·s/m", "N/m", "m/s", "kg", "1/turn"]);
    }
}
