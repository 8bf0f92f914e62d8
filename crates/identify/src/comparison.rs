//! Compare: how far the model, as it stands, is from the measurement.

use serde::Serialize;

use sinew_data::{Repeat, Run, find_repeats};
use sinew_effect::Catalogue;
use sinew_model::Robot;

use crate::base::{nuisances, trusted};
use crate::before::begun;
use crate::colour::rows_of;
use crate::problem::{Candidate, Linearised, Problem};
use crate::record::{Again, Channel, Record, Sensors};
use crate::report::Finding;
use crate::residual::{Imposed, LoggedTorques, ResidualForm, TRANSIENT};
use crate::scale::Scales;
use crate::search::Search;
use crate::spread::std;
use crate::verdict::rms;
use crate::views::findings;
use crate::{IdentifyError, Options};

/// The error of one signal of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalError {
    /// The quantity, as in a run's header.
    pub signal: String,
    /// The joint.
    pub joint: String,
    /// Unit of the three numbers.
    pub unit: String,
    /// Root mean square of measured minus predicted.
    pub rms_error: f64,
    /// Standard deviation of what was measured.
    pub rms_measured: f64,
    /// The error that noise alone would leave.
    pub noise_floor: f64,
    /// 100 · (1 − error/measured).
    pub fit_percent: f64,
    /// True if the error is within a tenth of the floor.
    pub white: bool,
}

// What changes by less than this share of its error stands still.
const STILL: f64 = 1e-6;

impl SignalError {
    /// The error as a share of what was measured, as a standard deviation; none of a sensor that stands still.
    ///
    /// # Example
    /// ```
    /// # let (signal, joint, unit) = ("motor_torque".to_owned(), "elbow".to_owned(), "N·m".to_owned());
    /// use sinew_identify::SignalError;
    /// let noise_floor = 0.1;
    /// let error = SignalError { signal, joint, unit, rms_error: 1.0, rms_measured: 4.0, noise_floor, fit_percent: 75.0, white: false };
    /// assert_eq!(error.share(), Some(0.25));
    /// assert_eq!(SignalError { rms_measured: 0.0, ..error }.share(), None);
    /// ```
    pub fn share(&self) -> Option<f64> {
        (self.rms_measured > STILL * self.rms_error).then(|| self.rms_error / self.rms_measured)
    }
}

/// The error of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunError {
    /// The run.
    pub run: String,
    /// Its length, s.
    pub duration: f64,
    /// Root mean square of all signals, each divided by its noise floor.
    pub rms_error: f64,
}

/// A signal along a run, thinned for drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trace {
    /// The run.
    pub run: String,
    /// The quantity.
    pub signal: String,
    /// The joint.
    pub joint: String,
    /// Unit of the values.
    pub unit: String,
    /// Times, s.
    pub time: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// What the model predicts.
    pub predicted: Vec<f64>,
    /// Motor velocity at the same times.
    pub speed: Vec<f64>,
    /// Motor position at the same times.
    pub position: Vec<f64>,
}

/// What a comparison finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Errors by signal and joint.
    pub signals: Vec<SignalError>,
    /// Errors by run.
    pub runs: Vec<RunError>,
    /// Root mean square of all signals, each divided by its noise floor.
    pub rms_error: f64,
    /// Where, when and in which regime it fails.
    pub findings: Vec<Finding>,
    /// The curves behind the numbers.
    #[serde(skip)]
    pub traces: Vec<Trace>,
}

/// Compares the model as it stands with the runs: nothing is fitted; the noise floor is what a fit of everything the
/// catalogue offers would leave.
///
/// # Errors
/// If the robot is no plant or a run lacks the signals.
pub fn compare(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
) -> Result<Comparison, IdentifyError> {
    compare_knowing(robot, catalogue, runs, options, Known::default())
}

/// What is known of runs before a model is compared with them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known<'a> {
    /// By how much logged torques act before the middles of their holds, s, as a fit found
    /// ([`Fit::torques_early`](crate::Fit)); none: as the rows tell.
    pub torques_early: Option<f64>,
    /// Another model's comparison with the same runs, whose noise floors are taken; none: as this model's rows tell.
    pub floors_of: Option<&'a Comparison>,
}

impl Known<'_> {
    // The floors of these channels, where they are known.
    fn floors(&self, search: &Search) -> Option<Vec<f64>> {
        let signals = &self.floors_of?.signals;
        let model = &search.problem.robot.model;
        let is = |s: &&SignalError, c: &Channel| s.signal == c.signal() && s.joint == model.dof_name(c.dof);
        let channels = &search.problem.form.layout().channels;
        channels.iter().map(|c| Some(signals.iter().find(|s| is(s, c))?.noise_floor)).collect()
    }
}

/// [`compare`] with what is known of the runs.
///
/// # Errors
/// As of [`compare`].
pub fn compare_knowing(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
    known: Known,
) -> Result<Comparison, IdentifyError> {
    let (robot, prepared, suspicions) = begun(robot, catalogue, runs, options)?;
    let specs = prepared.base_specs(&robot, catalogue);
    let form = prepared.form(&robot);
    let problem = Problem::new(&robot, catalogue, &form, options);
    let search = Search::new(&problem, &prepared.records, &prepared.sensors);
    let (model, at) = search.fitted(specs, None, 5)?;
    let early = known.torques_early.or_else(|| search.torques_told(&model, &at));
    let torques = early.map(|early| LoggedTorques { early, ..LoggedTorques::default() });
    let at = Linearised { residual: model.residual_told(&problem, torques), ..at };
    let saturated = || search.saturated(&problem, &model, &at).whitener.floors();
    let floors = known.floors(&search).unwrap_or_else(saturated);
    let (mut comparison, _) = as_given(&search, torques, &floors)?;
    let moments = early.filter(|early| *early > 0.0).map(of_moments);
    comparison.findings.splice(0..0, suspicions.into_iter().chain(moments));
    Ok(comparison)
}

fn of_moments(early: f64) -> Finding {
    Finding {
        joint: String::new(),
        signal: "motor_torque".to_owned(),
        regime: "clock".to_owned(),
        statement: format!("logged torques are {}", moments_told(early)),
        share: 0.0,
    }
}

/// What is said of torques of moments.
pub(crate) fn moments_told(early: f64) -> String {
    let early = 1e3 * early;
    format!(
        "those of moments, {early:.2} ms before the middle of a row, between which the drive changed them"
    )
}

/// What the residual of the model as given looks like.
pub(crate) fn findings_as_given(
    search: &Search,
    torques: Option<LoggedTorques>,
    floors: &[f64],
) -> Result<Vec<Finding>, IdentifyError> {
    Ok(findings(search, &given(search)?.residual_told(search.problem, torques), floors))
}

/// The comparison of the model as given, and its residual rows, with logged torques taken so, where that is known.
pub(crate) fn as_given(
    search: &Search,
    torques: Option<LoggedTorques>,
    floors: &[f64],
) -> Result<(Comparison, Vec<f64>), IdentifyError> {
    let model = given(search)?;
    let residual = model.residual_told(search.problem, torques);
    let comparison = Comparison {
        signals: signals(search, &residual, floors),
        runs: run_errors(search, &residual, floors),
        rms_error: total(search, &residual, floors),
        findings: findings(search, &residual, floors),
        traces: traces(search, &residual),
    };
    Ok((comparison, residual))
}

// The robot's model with every effect that is stated, at the stated values.
fn given(search: &Search) -> Result<Candidate, IdentifyError> {
    Candidate::new(search.problem, search.problem.robot.all_effects())
}

// How a bending link stands is measured by no sensor, and nothing here estimates it.
fn refuse_bending(robot: &Robot) -> Result<(), IdentifyError> {
    let Some(bending) = robot.bending.first() else { return Ok(()) };
    let link = &robot.model.links[bending.link.0].name;
    Err(IdentifyError::Question {
        what: format!(
            "robot \"{}\": link \"{link}\" bends, and no run says how far: comparing, diagnosing and fitting need robots whose links are rigid",
            robot.model.name
        ),
        help: format!(
            "remove [links.{link}.bending], or lump it into the joint before it: 1/stiffness = 1/K + L/(3 EI) of [joints.…]"
        ),
    })
}

// Rows of the richest channel from which anything can be said, and the range of a position, in units of its noise, that is a
// motion.
const FEWEST_ROWS: usize = 60;
const REST: f64 = 20.0;
// Times what is needed at the least from which a log is not too short.
const LONG: f64 = 3.0;

/// Largest less smallest value.
pub(crate) fn range(x: &[f64]) -> f64 {
    let (least, most) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    most - least
}

/// Runs made ready, with what they measure.
pub(crate) struct Prepared {
    pub records: Vec<Record>,
    pub sensors: Sensors,
    pub scales: Scales,
    /// Motions that occur twice.
    pub repeats: Vec<Repeat>,
}

impl Prepared {
    pub fn new(robot: &Robot, runs: &[Run], options: &Options) -> Result<Self, IdentifyError> {
        refuse_bending(robot)?;
        let sensors = Sensors::of(robot, runs)?;
        let scales = Scales::of(robot, runs, options);
        let mut prepared = Self::with(robot, runs, sensors, scales)?;
        prepared.hold_enough(robot, runs)?;
        prepared.repeats = find_repeats(runs);
        for repeat in &prepared.repeats {
            let [first, second] = [repeat.first, repeat.second].map(|r| runs[r].time[0]);
            let from = first + repeat.first_from;
            prepared.records[repeat.first].repeats.push(Again {
                window: [from, from + repeat.duration],
                record: repeat.second,
                lag: second - first + repeat.lag(),
            });
        }
        Ok(prepared)
    }

    // A comparison of a few rows, or of a robot at rest, finds nothing, and says so as if nothing were missing.
    fn hold_enough(&self, robot: &Robot, runs: &[Run]) -> Result<(), IdentifyError> {
        let form = self.form(robot);
        let layout = form.layout();
        let rows = |c: usize| layout.of_channel(c).flat_map(|s| s.first..s.first + s.len);
        let kept = |c: usize| rows(c).filter(|&k| layout.keep[k]).count();
        let most = (0..layout.channels.len()).map(kept).max().unwrap_or(0);
        let row = self.scales.step() * self.scales.every as f64;
        let [least, have] = [FEWEST_ROWS, most].map(|rows| rows as f64 * row);
        let moves =
            |r: &Record| r.theta.iter().zip(&r.position_noise).any(|(x, noise)| range(x) > REST * noise);
        let all: f64 = runs.iter().map(Run::duration).sum();
        let (what, help) = if !self.records.iter().any(moves) {
            ("nothing moves in it".to_owned(), "record a motion, or check which columns the map names")
        } else if most < FEWEST_ROWS && all > LONG * (least + TRANSIENT) {
            (
                format!(
                    "{have:.1} s of {all:.1} s can be compared (needed: {least:.1} s): its positions step so coarsely, or stand still so often, that they must be smoothed over most of it"
                ),
                "log positions as finely as they are measured, and each reading once",
            )
        } else if most < FEWEST_ROWS {
            (
                format!(
                    "too short: {have:.1} s that can be compared (needed: {least:.1} s, after {TRANSIENT} s in which springs settle and what the filters take at both ends)"
                ),
                "record longer, or use a wider window",
            )
        } else {
            return Ok(());
        };
        let names: Vec<&str> = self.records.iter().map(|r| r.name.as_str()).collect();
        Err(IdentifyError::run(&names.join(", "), what, help))
    }

    /// The same channels and scales for other runs of the robot.
    ///
    /// # Errors
    /// If a run lacks a channel, or is too short.
    pub fn with(
        robot: &Robot,
        runs: &[Run],
        sensors: Sensors,
        scales: Scales,
    ) -> Result<Self, IdentifyError> {
        runs.iter().try_for_each(|run| sensors.are_all_in(robot, run))?;
        let records =
            runs.iter().map(|run| Record::new(robot, run, &sensors, scales)).collect::<Result<_, _>>()?;
        Ok(Self { records, sensors, scales, repeats: Vec::new() })
    }

    pub fn form(&self, robot: &Robot) -> Imposed<'_> {
        Imposed::new(&self.records, &self.sensors.channels, robot.model.nv)
    }

    /// The effects of the robot with the nuisances of these runs.
    pub fn base_specs(&self, robot: &Robot, catalogue: &Catalogue) -> Vec<sinew_model::EffectSpec> {
        let mut specs = trusted(robot, robot.all_effects());
        specs.extend(nuisances(robot, catalogue, &self.sensors, &self.records));
        specs
    }
}

pub(crate) fn signals(search: &Search, residual: &[f64], floors: &[f64]) -> Vec<SignalError> {
    let layout = search.problem.form.layout();
    let model = &search.problem.robot.model;
    layout
        .channels
        .iter()
        .enumerate()
        .map(|(c, channel)| {
            let rms_error = rms(rows_of(layout, c).map(|k| residual[k]));
            let values: Vec<f64> = search.records.iter().flat_map(|r| r.rows(&r.measured[c])).collect();
            let rms_measured = std(&values);
            SignalError {
                signal: channel.signal().to_owned(),
                joint: model.dof_name(channel.dof).to_owned(),
                unit: channel.unit(model).to_owned(),
                rms_error,
                rms_measured,
                noise_floor: floors[c],
                fit_percent: 100.0 * (1.0 - rms_error / rms_measured),
                white: rms_error < 1.1 * floors[c],
            }
        })
        .collect()
}

fn run_errors(search: &Search, residual: &[f64], floors: &[f64]) -> Vec<RunError> {
    let layout = search.problem.form.layout();
    let of = |r: usize| {
        let rows = layout.segments.iter().filter(move |s| s.record == r);
        let scaled = rows.flat_map(|s| {
            (s.first..s.first + s.len)
                .filter(|&k| layout.keep[k])
                .map(move |k| residual[k] / floors[s.channel])
        });
        rms(scaled)
    };
    let records = search.records.iter().enumerate();
    records
        .map(|(r, record)| RunError {
            run: record.name.clone(),
            duration: record.time.last().unwrap_or(&0.0) - record.time[0],
            rms_error: of(r),
        })
        .collect()
}

/// Root mean square over channels of error by floor.
pub(crate) fn total(search: &Search, residual: &[f64], floors: &[f64]) -> f64 {
    rms(by_channel(search, residual, floors).into_iter())
}

/// Error by floor of every channel.
pub(crate) fn by_channel(search: &Search, residual: &[f64], floors: &[f64]) -> Vec<f64> {
    let layout = search.problem.form.layout();
    (0..layout.channels.len()).map(|c| rms(rows_of(layout, c).map(|k| residual[k])) / floors[c]).collect()
}

/// Curves of every channel and run at the residual's rows.
pub(crate) fn traces(search: &Search, residual: &[f64]) -> Vec<Trace> {
    let layout = search.problem.form.layout();
    let robot = &search.problem.robot.model;
    layout
        .segments
        .iter()
        .map(|s| {
            let (record, channel) = (&search.records[s.record], &layout.channels[s.channel]);
            let measured = record.rows(&record.measured[s.channel]);
            let rows = s.first..s.first + s.len;
            Trace {
                run: record.name.clone(),
                signal: channel.signal().to_owned(),
                joint: robot.dof_name(channel.dof).to_owned(),
                unit: channel.unit(robot).to_owned(),
                time: (0..s.len).map(|k| record.stamp(k)).collect(),
                predicted: measured.iter().zip(&residual[rows]).map(|(m, r)| m - r).collect(),
                measured,
                speed: record.rows(&record.thetad[channel.dof]),
                position: record.rows(&record.theta[channel.dof]),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use sinew_data::Quantity;
    use sinew_effects::CATALOGUE;
    use sinew_model::{Bending, LinkId, samples};

    use super::*;
    use crate::arrangement::tests::run;

    #[test]
    fn a_robot_with_bending_links_is_refused_with_the_way_out() {
        let mut robot = Robot::rigid(samples::planar_arm(1, 1.0, 0.5));
        assert!(refuse_bending(&robot).is_ok());
        robot.bending.push(Bending::base_spring(LinkId(1), &['y'], 100.0));
        let Err(error) = Prepared::new(&robot, &[], &Options::default()) else { panic!("not refused") };
        let text = error.to_string();
        assert!(text.contains("link \"link_1\" bends") && text.contains("help: remove"), "{text}");
    }

    // A torque that jitters from sample to sample and a motion that does not show it: no noise of the rows.
    #[test]
    fn a_floor_is_not_clearly_more_than_what_is_left() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let mut run = run(&robot);
        for signal in run.signals.iter_mut().filter(|s| s.quantity == Quantity::MotorTorque) {
            signal.values.iter_mut().enumerate().for_each(|(k, x)| *x += if k % 2 == 0 { 1.0 } else { -1.0 });
        }
        let options = Options::default();
        let own = compare(&robot, &CATALOGUE, &[run.clone()], &options).unwrap();
        for signal in &own.signals {
            assert!(signal.noise_floor < 0.01 && signal.white, "{}: {}", signal.joint, signal.noise_floor);
        }
        // The floors of another comparison are taken as they are.
        let mut other = own.clone();
        other.signals[1].noise_floor = 7.0;
        let known = Known { floors_of: Some(&other), ..Known::default() };
        let beside = compare_knowing(&robot, &CATALOGUE, &[run], &options, known).unwrap();
        let floors: Vec<f64> = beside.signals.iter().map(|s| s.noise_floor).collect();
        assert_eq!(floors, [own.signals[0].noise_floor, 7.0]);
    }
}
