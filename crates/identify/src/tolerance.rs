//! How far the inertias of a URDF can be trusted: found by leaving runs out, before any effect is named.

use faer::Mat;

use sinew_effect::{Catalogue, Screening, Sensor};
use sinew_model::{EffectSpec, Place, Robot, Setting, Trust};

use crate::base::{inertial, is_inertial};
use crate::colour::{Whitener, rows_of};
use crate::comparison::Prepared;
use crate::equations::Equations;
use crate::least_squares::{Normal, cross, dot, matrix};
use crate::problem::{Candidate, Linearised, Problem};
use crate::report::Finding;
use crate::residual::Layout;
use crate::screen::Screen;
use crate::search::Search;
use crate::unknowns::Unknown;
use crate::verdict::rms;
use crate::{IdentifyError, Options};

// Factors by which tolerances are widened, the last where nothing of them is left. Narrower ones are not tried: whatever is
// missing bends inertias, and the less they bend the better they then predict.
const FACTORS: [f64; 3] = [3.0, 10.0, UNKNOWN];
const UNKNOWN: f64 = 300.0;
// By how much more than the least the error on what is left out may be: the widest tolerance that predicts as well.
const AS_GOOD: f64 = 1.05;
// Standard deviations from its stated value at which a parameter contradicts it.
const CONTRADICTS: f64 = 5.0;
// Bodies, and their share, that must contradict what is stated of them before it is the description that is wrong and
// not one body or a load.
const FEWEST_BODIES: usize = 3;
const SHARE_OF_BODIES: f64 = 0.5;
// Factor on the tolerances of one body that is free alone, and the share of what all bodies gain that no single cause may.
const ALONE: f64 = 100.0;
const SINGLE: f64 = 0.9;
// Parts of a single run that are left out in turn.
const QUARTERS: usize = 4;

/// The robot with the tolerances of its inertias as they predict best what was left out, and the finding that says so.
///
/// Only where rows are linear in the inertias, of three bodies or more: joints are rigid. A robot whose user has said more
/// than that its inertias are nominal stays as it is.
///
/// # Errors
/// If the robot is no plant.
pub(crate) fn with_tolerance(
    robot: Robot,
    catalogue: &Catalogue,
    prepared: &Prepared,
    options: &Options,
) -> Result<(Robot, Option<Finding>), IdentifyError> {
    let bodies = robot.model.joints.len();
    if robot.trust != Trust::Nominal || bodies < FEWEST_BODIES {
        return Ok((robot, None));
    }
    let wrong = {
        let form = prepared.form(&robot);
        let problem = Problem::new(&robot, catalogue, &form, options);
        let search = Search::new(&problem, &prepared.records, &prepared.sensors);
        let trials = Trials::new(&search, prepared, catalogue)?;
        trials.and_then(|trials| trials.wrong(bodies))
    };
    Ok(match wrong {
        None => (robot, None),
        Some((1.0, finding)) => (robot, Some(finding)),
        Some((UNKNOWN, finding)) => (Robot { trust: Trust::Unknown, ..robot }, Some(finding)),
        Some((factor, finding)) => (widened(robot, factor), Some(finding)),
    })
}

// The robot with the tolerances of its inertias multiplied, as if they were stated.
fn widened(mut robot: Robot, factor: f64) -> Robot {
    let stated =
        |spec: &EffectSpec| robot.effects.iter().any(|e| e.kind == spec.kind && e.place == spec.place);
    let mut tolerances: Vec<EffectSpec> =
        (0..robot.model.joints.len()).flat_map(|joint| inertial(&robot, joint)).collect();
    tolerances.retain(|spec| !stated(spec));
    let stds =
        tolerances.iter_mut().flat_map(|spec| &mut spec.settings).filter(|(key, _)| key.ends_with("_std"));
    for (_, setting) in stds {
        match setting {
            Setting::Number(std) => *std *= factor,
            Setting::Numbers(stds) => stds.iter_mut().for_each(|std| *std *= factor),
            _ => (),
        }
    }
    robot.effects.extend(tolerances);
    robot
}

/// The base with friction in every joint, linearised at its stated values.
struct Trials<'a> {
    search: &'a Search<'a>,
    model: Candidate,
    at: Linearised,
    whitener: Whitener,
    // By part left out: JᵀJ and Jᵀr of its whitened rows.
    parts: Vec<(Mat<f64>, Vec<f64>)>,
    part_of: Vec<usize>,
}

impl<'a> Trials<'a> {
    // None where rows are not linear in the inertias.
    fn new(
        search: &'a Search<'a>,
        prepared: &Prepared,
        catalogue: &Catalogue,
    ) -> Result<Option<Self>, IdentifyError> {
        let problem = search.problem;
        let mut specs = prepared.base_specs(problem.robot, catalogue);
        specs.extend(friction(problem.robot, prepared, &specs));
        let mut model = Candidate::new(problem, specs)?;
        if model.plant.elastic().contains(&true) {
            return Ok(None);
        }
        let mut at = model.linearise(problem);
        if !at.is_finite() {
            return Ok(None);
        }
        let layout = problem.form.layout();
        let whitener = search.noise(&model, &at.residual, &at.slices());
        let kept = model.keep_excited(&whitener.apply_all(layout, &at.columns), problem.robot.trust);
        at.columns = kept.into_iter().map(|k| at.columns[k].clone()).collect();
        let part_of = parts(layout, prepared.records.len());
        let white = matrix(layout.len, &whitener.apply_all(layout, &at.columns));
        let right = whitener.apply(layout, &at.residual);
        let of = |part: usize| {
            let rows: Vec<usize> = (0..layout.len).filter(|&k| part_of[k] == part).collect();
            let j = Mat::from_fn(rows.len(), white.ncols(), |i, c| white[(rows[i], c)]);
            let r: Vec<f64> = rows.iter().map(|&k| right[k]).collect();
            (cross(&j, &j), (0..j.ncols()).map(|c| dot(j.col_as_slice(c), &r)).collect())
        };
        let parts = (0..=part_of.iter().copied().max().unwrap_or(0)).map(of).collect();
        Ok(Some(Self { search, model, at, whitener, parts, part_of }))
    }

    // What is told of a description that contradicts the runs in many of its `bodies`, and the factor on their tolerances; none
    // where a single cause explains as much.
    fn wrong(&self, bodies: usize) -> Option<(f64, Finding)> {
        let stated = self.weights(|_| 1.0);
        let widened = |factor: f64| self.weights(|_| factor);
        let against = self.contradicting(&stated);
        let are_many =
            against.len() >= FEWEST_BODIES && against.len() as f64 >= SHARE_OF_BODIES * bodies as f64;
        if !are_many {
            return None;
        }
        let all = self.gain(&widened(FACTORS[1]))? - self.gain(&stated)?;
        if self.single_gain(&against)? > SINGLE * all {
            return None;
        }
        let before = self.unseen_error(&stated);
        let errors = FACTORS.map(|factor| (factor, self.unseen_error(&widened(factor))));
        let least = errors.iter().map(|(_, error)| *error).fold(before, f64::min);
        let chosen = errors.into_iter().rev().find(|(_, error)| *error <= AS_GOOD * least);
        let (link, pull) = &against[0];
        let mut statement = format!(
            "the inertias of the URDF are wrong, or the scales of the torques: {} of {bodies} links contradict what is stated of them ({link} by {pull:.0} standard deviations)",
            against.len()
        );
        if let Some((factor, after)) = chosen {
            let taken = match factor {
                UNKNOWN => "they are taken as unknown".to_owned(),
                factor => format!("their tolerances are taken {factor} times as wide"),
            };
            let [before, after] = [before, after].map(|error| 100.0 * error);
            statement += &format!(
                "; {taken}, which leaves {after:.1} % of the signals on parts left out ({before:.1} % as stated)"
            );
        }
        let finding = Finding::of_data(String::new(), "", statement);
        Some((chosen.map_or(1.0, |(factor, _)| factor), finding))
    }

    // What is stated of every unknown as a weight, tolerances of a link's inertia multiplied.
    fn weights(&self, factor: impl Fn(&str) -> f64) -> Vec<f64> {
        let of = |u: &Unknown| {
            let factor = self.link(u).map_or(1.0, |link| factor(&link));
            u.weight() / (factor * factor)
        };
        self.model.unknowns.iter().map(of).collect()
    }

    // The link whose inertia an unknown belongs to.
    fn link(&self, unknown: &Unknown) -> Option<String> {
        let spec = &self.model.specs[unknown.id.effect];
        is_inertial(&spec.kind).then(|| spec.place.to_string())
    }

    // The largest fall of the objective by a candidate of the catalogue, or by one of the bodies `against` alone.
    fn single_gain(&self, against: &[(String, f64)]) -> Option<f64> {
        let (search, problem) = (self.search, self.search.problem);
        let offered = search.saturated(problem, &self.model, &self.at);
        let base = Equations::new(&self.whitener, problem, &self.model, &self.at, 0.0)?;
        let screen = Screen::new(problem, &self.model, &base);
        let layout = problem.form.layout();
        let by_candidate = offered.trials.iter().zip(&offered.columns).filter_map(|(trial, columns)| {
            let white = self.whitener.apply_all(layout, columns.as_ref()?);
            let score = screen.score(trial, &white)?;
            // What makes a joint elastic is compared with the stated values, not with what the base reaches.
            let resonance = matches!(trial.card.screening, Screening::Resonance { .. });
            let reached = if resonance { base.quadratic.promised() } else { 0.0 };
            (score.out.is_none() && !score.on_trust).then_some(score.drop - reached)
        });
        let stated = self.gain(&self.weights(|_| 1.0))?;
        let alone = |name: &str| self.gain(&self.weights(|link| if link == name { ALONE } else { 1.0 }));
        let by_body = against.iter().filter_map(|(name, _)| Some(alone(name)? - stated));
        Some(by_candidate.chain(by_body).fold(0.0, f64::max))
    }

    // By how much the best step lowers the objective: Jᵀr · d.
    fn gain(&self, weights: &[f64]) -> Option<f64> {
        let step = self.step(weights, None)?;
        Some(self.parts.iter().map(|(_, right)| dot(right, &step)).sum())
    }

    // The step from what is stated without one part.
    fn step(&self, weights: &[f64], without: Option<usize>) -> Option<Vec<f64>> {
        let n = weights.len();
        let mut a = Mat::from_fn(n, n, |i, j| if i == j { weights[i] } else { 0.0 });
        let mut g = vec![0.0; n];
        let parts = self.parts.iter().enumerate().filter(|(part, _)| Some(*part) != without);
        for (_, (square, right)) in parts {
            a += square;
            g.iter_mut().zip(right).for_each(|(g, right)| *g += right);
        }
        Some(Normal::new(&a)?.solve(&g))
    }

    // Error on what is left out in turn, by channel in units of what was measured, all together.
    fn unseen_error(&self, weights: &[f64]) -> f64 {
        let layout = self.search.problem.form.layout();
        let mut unseen = self.at.residual.clone();
        for part in 0..self.parts.len() {
            let Some(step) = self.step(weights, Some(part)) else { return f64::INFINITY };
            for k in (0..layout.len).filter(|&k| self.part_of[k] == part) {
                unseen[k] -= self.at.columns.iter().zip(&step).map(|(c, d)| c[k] * d).sum::<f64>();
            }
        }
        let of = |c: usize| rms(rows_of(layout, c).map(|k| unseen[k])) / self.search.channel_std[c];
        rms((0..layout.channels.len()).map(of))
    }

    // Links with a parameter that contradicts what is stated, and by how much, the worst first.
    fn contradicting(&self, stated: &[f64]) -> Vec<(String, f64)> {
        let Some(step) = self.step(stated, None) else { return Vec::new() };
        let mut out: Vec<(String, f64)> = Vec::new();
        for ((unknown, step), weight) in self.model.unknowns.iter().zip(step).zip(stated) {
            let (Some(link), pull) = (self.link(unknown), step.abs() * weight.sqrt()) else { continue };
            match out.iter_mut().find(|(known, _)| *known == link) {
                Some((_, most)) => *most = most.max(pull),
                None => out.push((link, pull)),
            }
        }
        out.retain(|(_, pull)| *pull > CONTRADICTS);
        out.sort_by(|a, b| b.1.total_cmp(&a.1));
        out
    }
}

// Runs, or the quarters of a single one.
fn parts(layout: &Layout, runs: usize) -> Vec<usize> {
    if runs > 1 {
        let mut of = vec![0; layout.len];
        for segment in &layout.segments {
            of[segment.first..segment.first + segment.len].fill(segment.record);
        }
        return of;
    }
    layout.fold.iter().map(|fold| fold * QUARTERS / layout.folds).collect()
}

// Viscous and Coulomb friction of the joints whose torque is measured, where the model has none.
fn friction(robot: &Robot, prepared: &Prepared, stated: &[EffectSpec]) -> Vec<EffectSpec> {
    let torques = prepared.sensors.channels.iter().filter(|c| c.sensor != Sensor::JointPosition);
    let at = |dof: usize, behind: bool| {
        let place = Place::Joint(robot.model.dof_name(dof).to_owned());
        let names = if behind { LINK_FRICTION } else { MOTOR_FRICTION };
        names.map(|kind| EffectSpec::new(kind, place.clone()))
    };
    let all = torques.flat_map(|c| at(c.dof, c.sensor == Sensor::JointTorque));
    all.filter(|s| !stated.iter().any(|e| e.kind == s.kind && e.place == s.place)).collect()
}

const MOTOR_FRICTION: [&str; 2] = ["viscous_friction", "coulomb_friction"];
const LINK_FRICTION: [&str; 2] = ["link_viscous_friction", "link_coulomb_friction"];
