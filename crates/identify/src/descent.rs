//! The descent of a candidate from its screened strengths to its minimum.

use std::ops::RangeInclusive;

use sinew_effect::{Act, Role, SWING_FREQUENCY};
use sinew_model::Place;

use crate::colour::Whitener;
use crate::equations::Equations;
use crate::problem::{Budget, Candidate, Linearised, MANY, Problem, objective, straighten};
use crate::refit::Fitted;
use crate::screen::{SHIFT, Score};
use crate::trial::{How, Trial};
use crate::unknowns::Unknown;

/// A candidate on its way down. The base's columns stay as they are; the candidate's own are computed anew, and all of
/// them where the candidate changes the structure or is far from the base.
pub(crate) struct Descent<'a> {
    problem: Problem<'a>,
    base: &'a Fitted,
    whitener: &'a Whitener,
    start: Vec<f64>,
    structural: bool,
    pub model: Candidate,
    /// Which unknowns are the candidate's.
    pub own: Vec<usize>,
    /// True for a new effect, false for a release.
    pub new: bool,
    pub at: Linearised,
    pub white: Vec<f64>,
    /// The objective reached.
    pub best: f64,
    // The objective before the first step, and what its equations promised.
    promised: [f64; 2],
    // True if the inertia of links was given back: the base's columns do not hold.
    unloaded: bool,
}

const ITERATIONS: usize = 8;
const SHRINKS: usize = 4;
// A candidate is behind where so many times what its next step promises leaves it so many times as high as the leader.
const HOPE: f64 = 3.0;
const BEHIND: f64 = 1.5;
// Share of the objective that a step must gain for all columns to change with it, where they are dear.
const MUCH: f64 = 0.1;
const VALLEY_STEPS: usize = 6;
// Steps of a body by itself to where it stands for what links were bent to.
const BODY_STEPS: usize = 3;
// A gain that ends a descent, and its share of the objective.
const ENOUGH: [f64; 2] = [0.05, 1e-5];
// Share of an objective by which sums of its rows may differ.
const ROUNDING: f64 = 1e-12;
// A promise that is worth the way along a valley, the share of it below which a descent has not arrived, and the share of the
// objective that is to be left where derivatives are dear.
pub(crate) const VALLEY: f64 = 30.0;
const KEPT: f64 = 0.5;
const MOST: f64 = 0.5;
// Powers of √2 by which a screened strength is multiplied, about the base and about what is stated: a base that was bent to swing as the
// log does says little of how strong a spring is that makes the links swing so.
const STRENGTHS: RangeInclusive<i32> = -4..=4;
const STATED_STRENGTHS: RangeInclusive<i32> = -4..=12;
// Powers of ⁸√2 about the lowest of these: links swing in time with the log for a tenth of a spring's strength.
const NEIGHBOURS: [i32; 6] = [-3, -2, -1, 1, 2, 3];

impl<'a> Descent<'a> {
    /// At the screened strengths.
    pub fn new(
        problem: Problem<'a>,
        base: &'a Fitted,
        whitener: &'a Whitener,
        trial: &Trial,
        score: &Score,
    ) -> Option<Self> {
        let (model, own) = started(&problem, &base.model, trial, score)?;
        let new = matches!(&trial.how, How::New { .. });
        let structural = new && model.plant.elastic() != base.model.plant.elastic();
        let at = Linearised { residual: Vec::new(), columns: Vec::new() };
        let (start, white) = (model.p.clone(), Vec::new());
        let best = f64::INFINITY;
        let mut descent = Self {
            problem,
            base,
            whitener,
            start,
            structural,
            model,
            own,
            new,
            at,
            white,
            best,
            promised: [0.0; 2],
            unloaded: false,
        };
        descent.settle();
        Some(descent)
    }

    // Takes the present parameters for the best.
    fn settle(&mut self) {
        (self.at.residual, self.white, self.best) = self.evaluate();
    }

    fn evaluate(&self) -> (Vec<f64>, Vec<f64>, f64) {
        let residual = self.model.residual(&self.problem);
        let white = self.whitener.apply(self.problem.form.layout(), &residual);
        let value = objective(&white, &self.model);
        (residual, white, value)
    }

    /// A spring of another shape makes the links swing at other times, and one derivative says little of how strong it is:
    /// where much is left, goes to the best of several strengths, about the base and about what is stated.
    pub fn scan(&mut self) {
        let Some(effect) = self.own.first().map(|&k| self.model.unknowns[k].id.effect) else { return };
        let bends = self.model.plant.effects()[effect].effect.acts().contains(&Act::SpringTorque);
        if !(self.new && bends && self.problem.form.layout().is_much(self.base.objective)) {
            return;
        }
        let mut stated = self.model.p.clone();
        straighten(&self.base.model.unknowns, &mut stated);
        let of_two = |p: &[f64], eighths: i32| self.scaled(p, 2f64.powf(f64::from(eighths) / 8.0));
        let about = [(self.model.p.clone(), STRENGTHS), (stated, STATED_STRENGTHS)];
        let sets = about.iter().flat_map(|(p, halves)| halves.clone().map(|k| of_two(p, 4 * k)));
        let Some((coarse, best)) = self.lowest(sets.collect()) else { return };
        let finer = self.lowest(NEIGHBOURS.iter().map(|&k| of_two(&best, k)).collect());
        let (objective, best) = finer.filter(|(o, _)| *o < coarse).unwrap_or((coarse, best));
        if objective < self.best {
            self.model.p.clone_from(&best);
            self.start = best;
            self.settle();
        }
    }

    // Parameters with the candidate's strengths so many times as large.
    fn scaled(&self, p: &[f64], factor: f64) -> Vec<f64> {
        let mut p = p.to_vec();
        for unknown in self.own.iter().map(|&k| &self.model.unknowns[k]).filter(|u| !u.shape) {
            p[unknown.position] *= factor;
        }
        p
    }

    // Which parameters of several leave least, and that.
    fn lowest(&self, sets: Vec<Vec<f64>>) -> Option<(f64, Vec<f64>)> {
        let objectives = self.model.objectives(&self.problem, self.whitener, &sets);
        objectives.into_iter().zip(sets).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// What the inertia of links was bent to imitate is a body's: where much is left, goes to where links, or all parameters, are as
    /// stated and the body alone makes up for it, if that leaves less. From a bent link to the body is a long way along which hardly a
    /// row changes.
    pub fn unload(&mut self, trial: &Trial) {
        let is_body = self.new && trial.card.parameters.iter().any(|p| p.role == Role::Optional);
        if !(is_body && self.problem.form.layout().is_much(self.base.objective)) {
            return;
        }
        let place = |u: &Unknown| &self.model.plant.effects()[u.id.effect].spec.place;
        let all = &self.base.model.unknowns;
        let of_links: Vec<Unknown> =
            all.iter().filter(|u| matches!(place(u), Place::Link(_))).cloned().collect();
        let sets: Vec<Vec<f64>> =
            [&of_links, all].into_iter().flat_map(|bent| self.body_alone(bent)).collect();
        let kept = self.model.p.clone();
        for p in sets {
            self.model.p = p;
            let (residual, white, now) = self.evaluate();
            if now < self.best {
                self.start.clone_from(&self.model.p);
                (self.at.residual, self.white, self.best) = (residual, white, now);
                self.unloaded = true;
            }
        }
        self.model.p = if self.unloaded { self.start.clone() } else { kept };
    }

    // The parameters with `bent` as stated, where the candidate by itself makes up for it: with its strengths, then with all that is
    // its own, as far as it can be followed.
    fn body_alone(&self, bent: &[Unknown]) -> Vec<Vec<f64>> {
        let exact = self.problem.exact();
        let Ok(mut body) = self.model.again(&exact) else { return Vec::new() };
        let own: Vec<Unknown> = self.own.iter().map(|&k| self.model.unknowns[k].clone()).collect();
        straighten(bent, &mut body.p);
        own.iter().for_each(|own| body.p[own.position] = 0.0);
        let mut sets = Vec::new();
        for free in [own.iter().filter(|u| u.is_strength()).cloned().collect(), own.clone()] {
            body.unknowns = free;
            for _ in 0..BODY_STEPS {
                let at = body.linearise(&exact);
                let equations = Equations::new(self.whitener, &exact, &body, &at, 0.0);
                let Some(equations) = equations.and_then(|e| e.bounded(&body)) else { return sets };
                body.step(&equations.quadratic.step);
            }
            sets.push(body.p.clone());
        }
        sets
    }

    /// Where the screen promised too much, goes towards absence until the base is beaten, or nothing is left of the effect: what
    /// begins at a threshold, as the limit of a drive does, is absent before it is zero. A body that stands for what links were bent to
    /// is needed as it is.
    pub fn shrink(&mut self) {
        if self.unloaded {
            return;
        }
        for _ in 0..SHRINKS {
            let is_absent = (self.best - self.base.objective).abs() <= ROUNDING * self.base.objective;
            if is_absent || self.best < self.base.objective {
                return;
            }
            for &k in self.own.iter().filter(|&&k| self.new && !self.model.unknowns[k].shape) {
                self.model.p[self.model.unknowns[k].position] *= 0.3;
            }
            self.settle();
        }
    }

    /// Levenberg–Marquardt. A descent with dear derivatives is given up where its equations promise by far less than would
    /// take it to `leader`, or less than would take it anywhere below `ceiling`.
    pub fn descend(&mut self, leader: f64, ceiling: f64) {
        self.begin_columns();
        let dear = self.is_dear();
        let mut linearised = self.best;
        let mut damping = 0.0;
        let mut budget = Budget::new(ITERATIONS);
        while budget.lasts() {
            let equations = Equations::new(self.whitener, &self.problem, &self.model, &self.at, damping);
            let Some(equations) = equations.and_then(|e| e.bounded(&self.model)) else { return };
            if budget.is_whole() {
                self.promised = [self.best, equations.quadratic.promised()];
            }
            let enough = ENOUGH[0] + ENOUGH[1] * self.best;
            let hoped = self.best - HOPE * equations.quadratic.promised();
            let is_behind = self.structural && dear && (hoped > BEHIND * leader || hoped > ceiling);
            if is_behind || equations.quadratic.promised() < enough {
                return;
            }
            let before = self.model.p.clone();
            self.model.step(&equations.quadratic.step);
            let (residual, white, now) = self.evaluate();
            let misled = self.problem.is_rough()
                && equations.misled(&self.problem, self.whitener, &self.model, self.best, now);
            if misled {
                self.problem = self.problem.exact();
                self.model.p = before;
                self.renew_all();
                continue;
            }
            budget.spend(self.best, now);
            if !(now.is_finite() && now < self.best) {
                self.model.p = before;
                damping = if damping == 0.0 { 4e-3 } else { damping * 16.0 };
                if damping > 10.0 {
                    return;
                }
                continue;
            }
            let gain = self.best - now;
            (self.at.residual, self.white, self.best) = (residual, white, now);
            damping /= 8.0;
            if gain < enough {
                return;
            }
            // Far from the base its columns no longer hold; near the minimum all of them do.
            let far = self.best < 0.7 * linearised && !dear;
            let remade = self.structural && (!dear || gain > MUCH * self.best);
            if far || remade {
                self.renew_all();
            } else if self.structural || gain > 0.01 * self.best {
                self.renew_own();
            }
            linearised = if far { self.best } else { linearised };
        }
    }

    /// True if far less came of the descent than its first equations promised: a curved valley, where every step that is worth it
    /// first leads up. Where derivatives are dear, only what was to explain most tells.
    pub fn falls_short(&self) -> bool {
        let [before, promised] = self.promised;
        let is_worth_it = !self.is_dear() || before - promised < MOST * self.base.objective;
        is_worth_it && promised > VALLEY && before - self.best < KEPT * promised
    }

    /// A curved valley (a gain scales every other parameter; a link is off by compliance times torque): plain Gauss–Newton steps
    /// from the screened strengths run along it, whatever the objective says on the way. Kept if they end lower.
    pub fn follow_valley(&mut self, problem: &Problem) {
        let kept = std::mem::replace(&mut self.model.p, self.start.clone());
        for _ in 0..VALLEY_STEPS {
            let at = self.model.linearise(problem);
            let equations = Equations::new(self.whitener, problem, &self.model, &at, 0.0);
            let Some(equations) = equations.filter(|e| at.is_finite() && e.quadratic.promised() > ENOUGH[0])
            else {
                break;
            };
            self.model.step(&equations.quadratic.step);
        }
        let (residual, white, now) = self.evaluate();
        if now < self.best {
            (self.at.residual, self.white, self.best) = (residual, white, now);
            self.renew_all();
        } else {
            self.model.p = kept;
        }
    }

    // The base's columns and the candidate's own; all of them anew where the candidate changes the structure, unless that is
    // dear and it begins where the base is.
    fn begin_columns(&mut self) {
        if self.unloaded || (self.structural && !(self.is_dear() && self.begins_at_base())) {
            return self.renew_all();
        }
        self.at.columns.clone_from(&self.base.at.columns);
        let added = self.own.iter().filter(|&&k| k >= self.at.columns.len());
        let positions: Vec<usize> = added.map(|&k| self.model.unknowns[k].position).collect();
        let added = self.model.columns(&self.problem, &positions);
        self.at.columns.extend(added);
    }

    // With many unknowns derivatives are dear.
    fn is_dear(&self) -> bool {
        self.model.unknowns.len() > MANY
    }

    fn begins_at_base(&self) -> bool {
        self.model.p[..self.base.model.p.len()] == self.base.model.p
    }

    fn renew_all(&mut self) {
        let positions: Vec<usize> = self.model.unknowns.iter().map(|u| u.position).collect();
        self.at.columns = self.model.columns(&self.problem, &positions);
    }

    fn renew_own(&mut self) {
        let positions: Vec<usize> = self.own.iter().map(|&k| self.model.unknowns[k].position).collect();
        let own = self.model.columns(&self.problem, &positions);
        for (&k, column) in self.own.iter().zip(own) {
            self.at.columns[k] = column;
        }
    }
}

// The extended model at the screened values, and which of its unknowns are the candidate's.
fn started(
    problem: &Problem,
    base: &Candidate,
    trial: &Trial,
    score: &Score,
) -> Option<(Candidate, Vec<usize>)> {
    match &trial.how {
        How::Release { unknowns } => {
            let mut model = base.again(problem).ok()?;
            for &k in unknowns {
                model.unknowns[k].prior = None;
            }
            Some((model, unknowns.clone()))
        }
        How::New { spec, strengths, exact } => {
            let mut specs = base.specs.clone();
            specs.push(spec.clone());
            let mut model = Candidate::new(problem, specs).ok()?;
            let effect = base.specs.len();
            let first = model.plant.range(effect).start;
            let mut p = base.p.clone();
            p.extend_from_slice(&model.p[first..]);
            let still = |s: usize| strengths.iter().zip(&score.moving).any(|(k, moves)| *k == s && !moves);
            for (k, &s) in strengths.iter().enumerate() {
                p[first + s] = if *exact {
                    p[first + s] * score.strengths[0].clamp(0.3, 3.0)
                } else {
                    let (low, high) = trial.card.parameters[s].range;
                    score.strengths[k].clamp(low, high)
                };
            }
            if let [share, shift] = score.strengths[..]
                && trial.swings()
            {
                // z(f + δ) ≈ a z + b ∂z
                p[first + SWING_FREQUENCY] *= 1.0 + SHIFT * (shift / share.max(shift.abs())).clamp(-1.0, 1.0);
            }
            model.p = p;
            if model.plant.elastic() != base.plant.elastic() {
                base.straighten_where_bent(&mut model.p);
            }
            let mut new = Unknown::of_effect(&model.plant, effect);
            new.retain(|unknown| !still(unknown.id.parameter));
            for unknown in &mut new {
                if unknown.is_strength() {
                    unknown.prior = None;
                    unknown.scale = model.p[unknown.position].abs().max(1e-9);
                }
            }
            let own = (base.unknowns.len()..base.unknowns.len() + new.len()).collect();
            model.unknowns = base.unknowns.iter().cloned().chain(new).collect();
            Some((model, own))
        }
    }
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Run, Signal};
    use sinew_effects::CATALOGUE;
    use sinew_model::{Inertia, JointSettings, Robot, Vector3, samples};
    use sinew_rigid::inverse_dynamics;

    use super::*;
    use crate::Options;
    use crate::arrangement::tests::run;
    use crate::comparison::Prepared;
    use crate::search::Search;

    // What a descent does with the model of a log, from what the screen says of an effect with so many strengths; `said` may look at
    // it and change it.
    fn descended(
        robot: &Robot,
        run: Run,
        (name, strengths): (&str, usize),
        said: impl FnOnce(&mut Score),
        check: impl FnOnce(&mut Descent, &Trial),
    ) {
        let (runs, options) = ([run], Options::default());
        let prepared = Prepared::new(robot, &runs, &options).unwrap();
        let form = prepared.form(robot);
        let problem = Problem::new(robot, &CATALOGUE, &form, &options);
        let search = Search::new(&problem, &prepared.records, &prepared.sensors);
        let state = search.base(prepared.base_specs(robot, &CATALOGUE)).unwrap();
        let scores = search.scores(&state.fitted, &state, &state.columns).unwrap();
        let of = |t: &&Trial| t.card.name == name && t.weights().len() == strengths;
        let trial = state.trials.iter().find(of).unwrap();
        let score = state.trials.iter().zip(scores).find(|(t, _)| of(t)).and_then(|(_, score)| score);
        let mut score = score.unwrap();
        said(&mut score);
        let mut descent = Descent::new(problem, &state.fitted, &state.whitener, trial, &score).unwrap();
        check(&mut descent, trial);
    }

    // A swinging link behind a spring that hardens, and its drive's rotor, begun from rest.
    //
    // K δ + K₃ δ³ = τ,   θ = q + δ,   τ_m = B θ̈ + τ
    fn hardened(robot: &Robot, cubic: f64) -> Run {
        let [stiffness, rotor] = [robot.joints[0].stiffness.unwrap(), robot.joints[0].rotor_inertia];
        let (period, step) = (2e-3, 1e-3);
        let motion = |t: f64| {
            let (begun, begins, curve) = {
                let e = (-(t * t)).exp();
                (1.0 - e, 2.0 * t * e, (2.0 - 4.0 * t * t) * e)
            };
            let swing = |w: f64, a: f64| {
                let (s, c) = (w * t).sin_cos();
                [a * s, a * w * c, -a * w * w * s]
            };
            let [x, v, a]: [f64; 3] = std::array::from_fn(|n| swing(5.3, 0.6)[n] + swing(9.1, 0.3)[n]);
            [begun * x, begins * x + begun * v, curve * x + 2.0 * begins * v + begun * a]
        };
        let torque = |t: f64| {
            let [q, qd, qdd] = motion(t);
            inverse_dynamics(&robot.model, &[q], &[qd], &[qdd])[0]
        };
        let theta = |t: f64| {
            let tau = torque(t);
            let step =
                |d: f64| d - (stiffness * d + cubic * d * d * d - tau) / (stiffness + 3.0 * cubic * d * d);
            motion(t)[0] + (0..30).fold(tau / stiffness, |d, _| step(d))
        };
        let curve = |t: f64| (theta(t + step) - 2.0 * theta(t) + theta(t - step)) / (step * step);
        let time: Vec<f64> = (0..4000).map(|k| period * k as f64).collect();
        let series = |of: &dyn Fn(f64) -> f64| time.iter().map(|t| of(*t)).collect::<Vec<f64>>();
        let name = robot.model.dof_name(0);
        let signals = [
            Signal::new(Quantity::MotorPosition, name, series(&theta)),
            Signal::new(Quantity::MotorTorque, name, series(&|t| rotor * curve(t) + torque(t))),
        ];
        Run::new("swing".to_owned(), time.clone(), signals.to_vec()).unwrap()
    }

    // An arm of one joint behind a spring.
    fn one_joint() -> Robot {
        let mut robot = Robot::rigid(samples::pendulum(4.0, 0.5));
        robot.joints[0] =
            JointSettings { stiffness: Some(500.0), damping: 0.5, rotor_inertia: 0.2, ..Default::default() };
        robot
    }

    #[test]
    fn a_spring_of_another_shape_is_scanned_for_its_strength() {
        let (robot, cubic) = (one_joint(), 2e5);
        descended(
            &robot,
            hardened(&robot, cubic),
            ("stiffness_hardening", 1),
            |score| score.strengths = vec![0.07 * cubic],
            |descent, _| {
                let own = descent.model.unknowns[descent.own[0]].position;
                let before = descent.best;
                descent.scan();
                let found = descent.model.p[own];
                assert!((found / cubic).ln().abs() < 0.09, "{found}, {before} {}", descent.best);
            },
        );
    }

    // 4 kg half a metre from the axis in which the frame of the tool stands.
    #[test]
    fn a_load_whose_mass_does_nothing_is_fitted_without_it() {
        let robot = one_joint();
        let mut loaded = robot.clone();
        let centre = robot.model.joints[0].inertia.centre_of_mass();
        loaded.model.joints[0].inertia += Inertia::point(4.0, centre);
        // Two components of its first moment and one of its inertia turn with the joint.
        let said = |score: &mut Score| {
            let shown: Vec<usize> = (0..10).filter(|&k| score.moving[k]).collect();
            assert_eq!((shown, score.parameters), (vec![1, 3, 5], 3), "{score:?}");
        };
        descended(&robot, hardened(&loaded, 0.0), ("payload", 10), said, |descent, _| {
            assert!(descent.own.iter().all(|&k| !descent.model.unknowns[k].is_strength()));
            let (before, first) =
                (descent.best, descent.model.plant.range(descent.model.specs.len() - 1).start);
            descent.descend(f64::INFINITY, f64::INFINITY);
            let of = |k: usize| descent.model.p[first + k];
            assert!(descent.best < 0.05 * before && of(0) == 0.0, "{before} {}", descent.best);
        });
    }

    // 5 kg at the second of two joints, more than the links can be bent to.
    #[test]
    fn a_body_takes_back_what_links_were_bent_to() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let mut loaded = robot.clone();
        loaded.model.joints[1].inertia += Inertia::point(5.0, Vector3::default());
        let said = |score: &mut Score| score.strengths = vec![0.1];
        descended(&robot, run(&loaded), ("payload", 1), said, |descent, trial| {
            descent.unload(trial);
            let mass = descent.model.p[descent.model.unknowns[descent.own[0]].position];
            assert!(descent.unloaded && (mass - 5.0).abs() < 0.05, "{mass}");
        });
    }
}
