//! How often a name that was given like this one is right.

use crate::explore::{Explored, Rung};
use crate::gates::{Evidence, mean_square};
use crate::remainder::Left;
use crate::search::{Accepted, Search};

/// Logistic form in z, tension and distance to the next candidate, and what remains.
///
/// ```text
/// logit P = −6.1 + 1.8 [tension] + 2.2 [data] ln z + 1.1 [tension] ln Δpenalty
///           + 0.93 min(ln max(d₁₂, 1), ln 30) − 1.2 (effects in company)
/// ```
///
/// times 1/(1 + (s/0.1)²), s the share of the error left by an effect in a model that leaves more than noise: a law that
/// is only like the true one takes most of its error away and leaves the rest. And times 1/(1 + Σ e^(−Δχ²/20)) over the
/// rivals that are tied with it.
pub(crate) fn probability(entry: &Accepted, likeness: &Likeness) -> f64 {
    let evidence = &entry.evidence;
    let next = entry.rivals.iter().map(|(_, d)| d.max(1.0)).fold(30.0, f64::min);
    let route = if rests_on_tension(evidence) {
        1.8 + 1.1 * evidence.tension.ln()
    } else {
        2.2 * evidence.z.max(1.0).ln()
    };
    let logit = -6.1 + route + 0.93 * next.ln().min(30f64.ln()) - 1.2 * likeness.company as f64;
    let complete = 1.0 / (1.0 + (likeness.share / LIKE).powi(2));
    let tied: f64 = entry.rivals.iter().map(|(_, distance)| likelihood_of_tied(*distance)).sum();
    (complete / (1.0 + (-logit).exp()) / (1.0 + tied)).clamp(0.02, 0.99)
}

/// How likely a tied rival is by its χ² disadvantage, the winner being one: the errors of references and noise make
/// differences of some tens. Of thirteen lags and delays of about a sample that were tied, three were told as the other, at Δχ²
/// of 11 to 28.
pub(crate) fn likelihood_of_tied(distance: f64) -> f64 {
    (-distance.max(0.0) / TIED).exp()
}

const TIED: f64 = 20.0;

/// Whether a name may be only like the cause.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Likeness {
    // What is left in the end of the error that the effect was found by, as a share of it and of what the effect took away;
    // zero where noise alone is left. Of an effect that relieves a tension only, one where more than noise is left.
    share: f64,
    // Effects that were accepted at the same place before; where more than noise is left, all others in the same joint:
    // several laws beside each other stand for one that is missing.
    company: usize,
}

// Share left of an error by a law of which one in two is only like the true one.
const LIKE: f64 = 0.1;
// Mean square of whitened rows up to which nothing is left but noise, whose size is known to a part only; the same by that
// of quiet seconds, where a model that is wrong now and then makes too much of the noise.
const NOISE: f64 = 1.5;
const UNEVEN: f64 = 3.0;
// z below which a tension, not the data, carries an effect.
const LEAST_Z: f64 = 3.0;

fn rests_on_tension(evidence: &Evidence) -> bool {
    evidence.by_tension() && evidence.z < LEAST_Z
}

impl Likeness {
    /// Of an accepted effect, by what the final model leaves of every channel.
    pub fn of(search: &Search, explored: &Explored, left: &[Left], entry: &Accepted) -> Self {
        let (evidence, layout) = (&entry.evidence, search.yardstick().problem.form.layout());
        let dof = |e: &Accepted| layout.channels[e.evidence.channel].dof;
        let accepted = &explored.state.accepted;
        let concerns = |c: usize| rests_on_tension(evidence) || layout.channels[c].dof == dof(entry);
        if !left.iter().enumerate().any(|(c, l)| concerns(c) && l.noise() < l.square) {
            let before = accepted.iter().take_while(|a| a.trial.label() != entry.trial.label());
            let company = before.filter(|a| a.trial.place == entry.trial.place).count();
            return Self { share: 0.0, company };
        }
        let company = accepted.iter().filter(|a| dof(a) == dof(entry)).count() - 1;
        if rests_on_tension(evidence) {
            return Self { share: 1.0, company };
        }
        // In rows in which errors are told, which are the same in all steps.
        let error = |rung: &Rung| mean_square(layout, evidence.channel, &rung.residual);
        let rungs = &explored.rungs;
        let step = rungs.iter().position(|rung| rung.added.contains(&entry.trial.label()));
        let before = step.and_then(|step| rungs.get(step.checked_sub(1)?));
        let errors = before.zip(rungs.last()).map(|(before, last)| [error(before), error(last)]);
        let share = share_left(evidence.explained, errors, left[evidence.channel]);
        Self { share, company }
    }

    /// True if so much is left that the effect is rather like the cause than the cause.
    pub fn is_only_like(&self) -> bool {
        self.share > LIKE
    }
}

impl Left {
    // The most that noise may be of the mean square.
    fn noise(&self) -> f64 {
        NOISE.min(UNEVEN * self.quiet)
    }
}

// By the errors of a channel before the step of an effect and in the end, and what is left of its whitened rows; where the
// errors are not known, what the step itself left.
fn share_left(explained: f64, errors: Option<[f64; 2]>, left: Left) -> f64 {
    let Some([before, last]) = errors else { return 1.0 - explained };
    let (fall, rest) = (explained * before, (1.0 - left.noise() / left.square).max(0.0) * last);
    rest / (rest + fall).max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_counts_beyond_noise_and_against_what_was_taken_away() {
        // Of an error of 8, 6 were taken away; 4 are left at three times the noise, half of them more than it may be.
        let left = |square, quiet| Left { square, quiet, foretold: 0.0 };
        assert_eq!(share_left(0.75, Some([8.0, 4.0]), left(3.0, 1.0)), 0.25);
        assert_eq!(share_left(0.75, Some([8.0, 2.0]), left(1.0, 1.0)), 0.0);
        assert_eq!(share_left(0.75, None, left(3.0, 1.0)), 0.25);
        // The same rows under a noise that was taken for larger.
        assert_eq!(share_left(0.75, Some([8.0, 4.0]), left(0.75, 0.125)), 0.25);
    }
}
