//! How often a name that was given like this one is right.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::colour::rows_of;
use crate::diagnosis::ChannelReport;
use crate::episode::is_of_one_time;
use crate::explore::{Explored, Rung};
use crate::fitting::Reported;
use crate::gates::{Evidence, mean_square};
use crate::remainder::Left;
use crate::search::{Accepted, Search};
use crate::trial::How;
use crate::unknowns::Unknown;
use crate::verdict::NEAR_FLOOR;

/// What the probability of a name rests on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Grounds {
    /// The relief of priors carries it, not the residual.
    pub by_tension: bool,
    /// Evidence of the residual by its block-robust spread.
    pub z: f64,
    /// Relief of the priors, χ².
    pub tension: f64,
    /// ρ: root of the largest fall of a channel's mean square, in units of its filtered noise.
    pub contribution: f64,
    /// χ² by which the nearest of its tied rivals is worse; 30 where none is nearer.
    pub next: f64,
    /// Likelihoods of all tied rivals, its own being one.
    pub tied: f64,
    /// What is left in the end of the error that the effect was found by, as a share of it and of what the effect took away:
    /// what is more than noise, or what a generic predictor foretells, if that is more; zero where noise alone is left. An effect
    /// that relieves a tension only takes away what would be left were it as stated.
    pub left: f64,
    /// Other effects that were accepted in the same joint: several laws beside each other often stand for one that is missing.
    /// Viscous and Coulomb friction, which every drive has, neither count nor are counted against.
    pub company: usize,
    /// All that it explains lies in one short time of one run, and it leaves more than noise, as it would if something had
    /// acted once.
    pub once: bool,
    /// By how much its strengths differ from run to run beyond noise, as a share of themselves: a constant of a robot is the same
    /// in every run, what stands in for another cause is not.
    pub apart: f64,
}

/// Numbers in which the logit of a probability is linear.
pub const FEATURES: usize = 6;

// Their weights, fitted by `calibration fit` to 218 names of seeds 5000 to 5093 and 5500 to 5592, in whose file the other
// names of a joint were counted afterwards, and the most that is said (docs/recognition.md).
const WEIGHTS: [f64; FEATURES] = [-2.78, 1.44, 1.81, 1.00, 0.21, -2.41];
const LEAST: f64 = 0.02;
const MOST: f64 = 0.96;

impl Grounds {
    /// One, the tension route, ln z of the data route, ln of the tension of its route, ln of the distance to the next, the
    /// company.
    pub fn features(&self) -> [f64; FEATURES] {
        let (tension, data) = if self.by_tension { (1.0, 0.0) } else { (0.0, 1.0) };
        [
            1.0,
            tension,
            data * self.z.max(1.0).ln(),
            tension * self.tension.max(1.0).ln(),
            self.next.clamp(1.0, NO_RIVAL).ln(),
            self.company as f64,
        ]
    }

    /// The most that its probability may be: its share among those that are tied, 1/(1 + Σ e^(−Δχ²/20)) over its rivals, one
    /// more of which is what acts once, times 1/(1 + (left/0.1)²), since a law that is only like the true one takes most of its error away
    /// and leaves the rest, times 1/(1 + (apart/0.5)²), since its constants are others in every run.
    pub fn share(&self) -> f64 {
        let tied = self.tied + f64::from(u8::from(self.once));
        let like = 1.0 + (self.left / LIKE).powi(2);
        let differs = 1.0 + (self.apart / HALF).powi(2);
        1.0 / ((1.0 + tied) * like * differs)
    }

    /// How often a name on such grounds is right.
    ///
    /// ```text
    /// P = share/(1 + e^(−w·f)),   0.02 ≤ P ≤ 0.96
    /// ```
    pub fn probability(&self) -> f64 {
        let logit: f64 = self.features().iter().zip(WEIGHTS).map(|(f, w)| f * w).sum();
        (self.share() / (1.0 + (-logit).exp())).clamp(LEAST, MOST)
    }
}

/// How likely a tied rival is by its χ² disadvantage, the winner being one: the errors of references and noise make
/// differences of some tens. Of thirteen lags and delays of about a sample that were tied, three were told as the other, at Δχ²
/// of 11 to 28.
pub(crate) fn likelihood_of_tied(distance: f64) -> f64 {
    (-distance.max(0.0) / TIED).exp()
}

const TIED: f64 = 20.0;
// χ² distance beyond which a rival is none.
const NO_RIVAL: f64 = 30.0;
// Share left of an error by a law of which one in two is only like the true one.
const LIKE: f64 = 0.1;
// Share of themselves by which strengths of a law differ between runs of which one in two is only like the true one.
const HALF: f64 = 0.5;
// Mean square of whitened rows up to which nothing is left but noise, whose size is known to a part only; the same by that
// of quiet seconds, where a model that is wrong now and then makes too much of the noise.
const NOISE: f64 = 1.5;
const UNEVEN: f64 = 3.0;
// Share of what is left from which a generic predictor foretells more than it does of noise (0.00 in each of nineteen logs of one
// and two joints in which nothing is hidden).
const BY_CHANCE: f64 = 0.02;
// Share of what is left up to which rows are as independent as those of noise: what is left by laws that are only like a cause from
// outside is foretold by the row before from 0.18 up, or ends beyond two floors.
const WHITE: f64 = 0.1;
// z below which a tension, not the data, carries an effect.
const LEAST_Z: f64 = 3.0;

fn rests_on_tension(evidence: &Evidence) -> bool {
    evidence.by_tension() && evidence.z < LEAST_Z
}

impl Grounds {
    /// Of an accepted effect, by what the final model leaves of every channel, and its parameters.
    pub(crate) fn of(
        search: &Search,
        explored: &Explored,
        reports: &[ChannelReport],
        left: &[Left],
        constants: &[Reported],
        entry: &Accepted,
    ) -> Self {
        let evidence = &entry.evidence;
        let channels = &search.yardstick().problem.form.layout().channels;
        let dof = |e: &Accepted| channels[e.evidence.channel].dof;
        let others =
            explored.state.accepted.iter().filter(|other| other.trial.label() != entry.trial.label());
        let left = left_of(search, explored, reports, left, constants, entry);
        let beside = others.filter(|other| dof(other) == dof(entry) && !other.trial.is_plain_friction());
        Self {
            by_tension: rests_on_tension(evidence),
            z: evidence.z,
            tension: evidence.tension,
            contribution: evidence.material.max(0.0).sqrt(),
            next: entry.rivals.iter().map(|(_, d)| d.max(1.0)).fold(NO_RIVAL, f64::min),
            tied: entry.rivals.iter().map(|(_, distance)| likelihood_of_tied(*distance)).sum(),
            left,
            company: if entry.trial.is_plain_friction() { 0 } else { beside.count() },
            once: left > 0.0 && is_of_one_time(search, &explored.state, entry),
            apart: apart(&explored.state.fitted.model.unknowns, constants, entry),
        }
    }

    /// True if so much is left that the effect is rather like the cause than the cause.
    pub(crate) fn is_only_like(&self) -> bool {
        self.left > LIKE
    }
}

// By how much the strengths of a new effect differ between runs as a share of themselves, those of one unit together, as sine and
// cosine are; of several units those that agree best.
fn apart(unknowns: &[Unknown], constants: &[Reported], entry: &Accepted) -> f64 {
    let mut by_unit: BTreeMap<&str, [f64; 2]> = BTreeMap::new();
    let is_own = |(_, (effect, _)): &(&Unknown, &Reported)| *effect == entry.effect;
    for (_, (_, report)) in unknowns.iter().zip(constants).filter(is_own).filter(|(u, _)| !u.shape) {
        let [between, size] = by_unit.entry(&report.unit).or_default();
        *between += report.between_runs.powi(2);
        *size += report.value.powi(2);
    }
    let is_new = matches!(entry.trial.how, How::New { .. });
    let shares = by_unit.values().map(|[between, size]| (between / size).sqrt()).filter(|_| is_new);
    shares.reduce(f64::min).filter(|share| share.is_finite()).unwrap_or(0.0)
}

// What is left of the error that an effect was found by.
fn left_of(
    search: &Search,
    explored: &Explored,
    reports: &[ChannelReport],
    left: &[Left],
    constants: &[Reported],
    entry: &Accepted,
) -> f64 {
    let (evidence, layout) = (&entry.evidence, search.yardstick().problem.form.layout());
    let dof = layout.channels[evidence.channel].dof;
    let by_tension = rests_on_tension(evidence);
    let concerns = |c: usize| by_tension || layout.channels[c].dof == dof;
    let foretold = |c: usize| reports[c].predictable_remainder;
    // As large as an adequate model's may be, and as white as noise.
    let is_white = |c: usize| reports[c].distance_to_floor < NEAR_FLOOR && left[c].is_white();
    let is_small = |c: usize| left[c].square <= left[c].noise() || is_white(c);
    let is_noise = |c: usize| is_small(c) && (by_tension || foretold(c) < BY_CHANCE);
    if (0..left.len()).all(|c| !concerns(c) || is_noise(c)) {
        return 0.0;
    }
    if by_tension {
        // χ² beyond noise of all that is left, and χ² by which all would fit worse were a constant as stated: ((p − p₀)/σ)².
        let beyond = |c: usize| left[c].square * left[c].beyond_noise() * rows_of(layout, c).count() as f64;
        let own = constants.iter().filter(|(effect, _)| *effect == entry.effect);
        let fall = own.map(|(_, p)| ((p.value - p.start) / p.std).powi(2)).fold(0.0, f64::max);
        let rest: f64 = (0..left.len()).map(beyond).sum();
        return rest / (rest + fall).max(1e-300);
    }
    // In rows in which errors are told, which are the same in all steps.
    let error = |rung: &Rung| mean_square(layout, evidence.channel, &rung.residual);
    let rungs = &explored.rungs;
    let step = rungs.iter().position(|rung| rung.added.contains(&entry.trial.label()));
    let before = step.and_then(|step| rungs.get(step.checked_sub(1)?));
    let errors = before.zip(rungs.last()).map(|(before, last)| [error(before), error(last)]);
    let own = evidence.channel;
    share_left(evidence.explained, errors, left[own].beyond_noise().max(foretold(own)))
}

impl Left {
    // The most that noise may be of the mean square.
    fn noise(&self) -> f64 {
        NOISE.min(UNEVEN * self.quiet)
    }

    // Noise that is larger than it was taken for leaves independent rows still.
    fn is_white(&self) -> bool {
        self.foretold < WHITE * self.square
    }

    // The share of the mean square that is more than that.
    fn beyond_noise(&self) -> f64 {
        (1.0 - self.noise() / self.square).max(0.0)
    }
}

// By the errors of a channel before the step of an effect and in the end, and the share of the latter that is no noise; where the
// errors are not known, what the step itself left.
fn share_left(explained: f64, errors: Option<[f64; 2]>, no_noise: f64) -> f64 {
    let Some([before, last]) = errors else { return 1.0 - explained };
    let (fall, rest) = (explained * before, no_noise * last);
    rest / (rest + fall).max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grounds() -> Grounds {
        Grounds {
            by_tension: false,
            z: 20.0,
            tension: 0.0,
            contribution: 1.0,
            next: NO_RIVAL,
            tied: 0.0,
            left: 0.0,
            company: 0,
            once: false,
            apart: 0.0,
        }
    }

    #[test]
    fn an_equal_rival_takes_half() {
        let alone = grounds().probability();
        let shared = Grounds { tied: 1.0, ..grounds() }.probability();
        assert_eq!(shared, Grounds { once: true, ..grounds() }.probability());
        assert!(alone > 0.8 && (shared / alone - 0.5).abs() < 0.02, "{alone} {shared}");
    }

    #[test]
    fn less_evidence_and_more_left_are_less_sure() {
        let p = |change: fn(&mut Grounds)| {
            let mut g = grounds();
            change(&mut g);
            g.probability()
        };
        assert!(p(|g| g.z = 5.0) < p(|_| ()));
        assert!(p(|g| g.left = 0.3) < p(|_| ()));
        assert!(p(|g| g.company = 2) < p(|_| ()));
        assert!(p(|g| g.apart = 0.5) < 0.55 * p(|_| ()) && p(|g| g.apart = 0.05) > 0.98 * p(|_| ()));
        assert!(p(|g| g.next = 1.0) < p(|_| ()));
        assert!(p(|g| g.z = f64::INFINITY) <= MOST && p(|g| g.z = 0.0) >= LEAST);
    }

    #[test]
    fn what_is_white_is_noise_of_another_size() {
        let left = |foretold| Left { square: 2.6, quiet: 1.0, foretold };
        assert!(left(0.01).is_white() && !left(0.6).is_white());
    }

    #[test]
    fn what_is_left_counts_beyond_noise_and_against_what_was_taken_away() {
        // Of an error of 8, 6 were taken away; 4 are left at three times the noise, half of them more than it may be.
        let left = |square, quiet| Left { square, quiet, foretold: 0.0 }.beyond_noise();
        assert_eq!(share_left(0.75, Some([8.0, 4.0]), left(3.0, 1.0)), 0.25);
        assert_eq!(share_left(0.75, Some([8.0, 2.0]), left(1.0, 1.0)), 0.0);
        assert_eq!(share_left(0.75, None, left(3.0, 1.0)), 0.25);
        // The same rows under a noise that was taken for larger.
        assert_eq!(share_left(0.75, Some([8.0, 4.0]), left(0.75, 0.125)), 0.25);
    }
}
