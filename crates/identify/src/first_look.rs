//! A first look at a part of a long log: where its model settles, how its torques are logged, and which candidates are
//! worth being tried along the whole of it.

use std::collections::{BTreeMap, BTreeSet};

use sinew_data::Run;
use sinew_effect::{Catalogue, Requirement};
use sinew_model::{EffectSpec, Robot};

use crate::analysis::about_base;
use crate::comparison::Prepared;
use crate::explore::{explore, unlikely_in_the_end};
use crate::limits::{DetectionLimit, limits};
use crate::problem::Problem;
use crate::record::Record;
use crate::report::Refusal;
use crate::residual::LoggedTorques;
use crate::search::Search;
use crate::spread::std;
use crate::trial::{How, Trial};
use crate::{IdentifyError, Options};

/// What a first look leaves for the search of the whole log.
pub(crate) struct FirstLook {
    specs: Vec<EffectSpec>,
    values: Vec<f64>,
    /// How the logged torques are taken.
    pub torques: LoggedTorques,
    /// Standard deviation of the torque noise of every joint that moves, N·m.
    pub torque_noise: Vec<f64>,
    // Labels of the candidates that explained something in any of its rounds, and those of the others.
    promising: BTreeSet<String>,
    unpromising: BTreeSet<String>,
    // Those of candidates that made the part no likelier, with the reason.
    unlikely: BTreeMap<String, String>,
    /// What the whole log would have shown: the standard deviations of the part shrink by the root of the samples.
    pub limits: Vec<DetectionLimit>,
    // Samples of the part.
    samples: usize,
}

// Samples of all runs beyond which a log is long, and those of its part.
const LONG: usize = 24_000;
const PART: usize = 12_000;
// Least samples of a run in the part, and least share of the speeds and reaches of the whole log with which every joint moves
// there.
const LEAST: usize = 4_000;
const LIKE_WHOLE: f64 = 0.5;

impl FirstLook {
    /// The first look at these runs; none where they are not long, or no part of them is like the whole.
    pub fn of(
        robot: &Robot,
        catalogue: &Catalogue,
        runs: &[Run],
        prepared: &Prepared,
        options: &Options,
    ) -> Option<Self> {
        let part = part(runs)?;
        let of_part = Prepared::with(robot, &part, prepared.sensors.clone(), prepared.scales).ok()?;
        if !moves_like(&of_part, prepared) {
            return None;
        }
        let mut look = Self::at(robot, catalogue, &part, &of_part, options).ok().flatten()?;
        let share = (look.samples as f64 / samples(runs) as f64).sqrt();
        look.limits.iter_mut().for_each(|limit| limit.smallest *= share);
        Some(look)
    }

    fn at(
        robot: &Robot,
        catalogue: &Catalogue,
        runs: &[Run],
        prepared: &Prepared,
        options: &Options,
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(form) = about_base(robot, catalogue, runs, prepared, None)? else { return Ok(None) };
        let records = form.present().motion();
        let problem = Problem::new(robot, catalogue, &form, options);
        let mut search =
            Search::new(&problem, &records, &prepared.sensors).filtered_by(form.present().records());
        let base = search.base(prepared.base_specs(robot, catalogue))?;
        let Some(reference) = base.reference.clone().filter(|_| base.is_finite()) else { return Ok(None) };
        let (specs, values) = (base.fitted.model.specs.clone(), base.fitted.model.p.clone());
        let may_be_left_out = |trial: &&Trial| is_new(trial) && is_steady(trial);
        let offered: BTreeSet<String> =
            base.trials.iter().filter(may_be_left_out).map(Trial::label).collect();
        let explored = explore(&mut search, base, None)?;
        let limits = limits(&search, &explored);
        search.unlikely.extend(unlikely_in_the_end(&search, &explored));
        // Beside what it is a rival of, a candidate makes nothing likelier; along the whole log it may be the better one.
        let is_rival = |trial: &Trial| explored.state.accepted.iter().any(|a| a.trial.place == trial.place);
        let unlikely = search.unlikely.into_iter().filter(|(trial, _)| !is_rival(trial));
        let unlikely = unlikely.map(|(trial, reason)| (trial.label(), reason)).collect();
        let promising = search.promising;
        Ok(Some(Self {
            specs,
            values,
            torques: reference.torques,
            torque_noise: reference.torque_noise.clone(),
            unpromising: offered.difference(&promising).cloned().collect(),
            promising,
            unlikely,
            limits,
            samples: samples(runs),
        }))
    }

    /// True if a candidate is tried along the whole log: what needs a prediction of its own only if it explained something,
    /// of the rest all that did not explain nothing; none that made the part no likelier.
    pub fn offers(&self, trial: &Trial) -> bool {
        let label = trial.label();
        let is_worth_it = self.promising.contains(&label)
            || (trial.exact_spec().is_none() && !self.unpromising.contains(&label));
        is_worth_it && !(is_new(trial) && is_steady(trial) && self.unlikely.contains_key(&label))
    }

    /// Why candidates are not tried along the whole log.
    pub fn refusals(&self) -> Vec<Refusal> {
        let part = format!("a part of the log ({} samples)", self.samples);
        let of = |label: &String, reason: String| Refusal { candidate: label.clone(), step: 1, reason };
        let unpromising =
            self.unpromising.iter().map(|label| of(label, format!("explains nothing in {part}")));
        let unlikely = self.unlikely.iter().map(|(label, reason)| of(label, format!("in {part}: {reason}")));
        unpromising.chain(unlikely).collect()
    }

    /// What was done, in words.
    pub fn told(&self) -> String {
        format!("a part of {} samples was searched first, then the whole log from what it gave", self.samples)
    }

    /// The values at which a model of these effects settled; none of other effects.
    pub fn values(&self, specs: &[EffectSpec]) -> Option<&[f64]> {
        let mut pairs = self.specs.iter().zip(specs);
        let are_alike = self.specs.len() == specs.len() && pairs.all(|(a, b)| a.is_same_as(b));
        are_alike.then_some(&self.values)
    }
}

// True if the effect is not in the model yet.
fn is_new(trial: &Trial) -> bool {
    matches!(trial.how, How::New { .. })
}

// True if a part of a log shows it as well as another: a joint grows warm in the course of it.
fn is_steady(trial: &Trial) -> bool {
    !trial.card.requires.iter().any(|r| matches!(r, Requirement::Temperature { .. }))
}

fn samples(runs: &[Run]) -> usize {
    runs.iter().map(|run| run.time.len()).sum()
}

// The first seconds of some of the runs, as long as they need to be; none of runs that are not long.
fn part(runs: &[Run]) -> Option<Vec<Run>> {
    if samples(runs) <= LONG {
        return None;
    }
    let count = (PART / LEAST).min(runs.len());
    let kept = (0..count).map(|k| &runs[k * runs.len() / count]);
    let of = |run: &Run| {
        let end = run.time[(PART / count).min(run.time.len() - 1)];
        run.window(0.0, end - run.time[0]).ok()
    };
    kept.map(of).collect()
}

// True if every joint moves in the part about as fast and as far as in the whole.
fn moves_like(part: &Prepared, whole: &Prepared) -> bool {
    let spread = |prepared: &Prepared, of: fn(&Record) -> &Vec<Vec<f64>>, dof: usize| {
        let series = prepared.records.iter().flat_map(|record| &of(record)[dof]);
        std(&series.copied().collect::<Vec<f64>>())
    };
    let is_alike = |of, dof| spread(part, of, dof) >= LIKE_WHOLE * spread(whole, of, dof);
    whole
        .sensors
        .moving()
        .all(|dof| is_alike(|record| &record.thetad, dof) && is_alike(|record| &record.theta, dof))
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Signal};

    use super::*;

    fn run(seconds: f64) -> Run {
        let time: Vec<f64> = (0..(1e3 * seconds) as usize).map(|k| 1e-3 * k as f64).collect();
        let values = time.iter().map(|t| t.sin()).collect();
        Run::new("sine".to_owned(), time, vec![Signal::new(Quantity::MotorPosition, "j", values)]).unwrap()
    }

    #[test]
    fn a_part_is_taken_of_long_logs_only_and_of_several_runs() {
        assert!(part(&[run(20.0)]).is_none());
        let lengths =
            |runs: &[Run]| -> Vec<usize> { part(runs).unwrap().iter().map(|run| run.time.len()).collect() };
        assert_eq!(lengths(&[run(60.0)]), [PART]);
        assert_eq!(lengths(&[run(15.0), run(15.0)]), [PART / 2; 2]);
        assert_eq!(lengths(&vec![run(5.0); 7]), [PART / 3; 3]);
    }
}
