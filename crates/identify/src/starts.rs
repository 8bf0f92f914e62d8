//! Which start values of a candidate are worth a refit.

use crate::refit::Refit;
use crate::screen::Score;
use crate::swings;
use crate::trial::{How, Trial};

/// The best start values of each effect and place, best first.
pub(crate) fn best_starts(trials: &[Trial], scores: &[Option<Score>]) -> Vec<usize> {
    best_by_label(trials, scores, |s| s.out.is_none())
}

/// The same of those that physics forbids and the data ask for.
pub(crate) fn impossible_starts(trials: &[Trial], scores: &[Option<Score>]) -> Vec<usize> {
    best_by_label(trials, scores, |s| s.out.is_some() && s.drop > WORTH_A_WORD)
}

/// Labels of trials that explain something, be it by chance.
pub(crate) fn promising(trials: &[Trial], scores: &[Option<Score>]) -> impl Iterator<Item = String> {
    let least = |trial: &Trial| if trial.swings() { PROMISING_SWING } else { PROMISING };
    let explains = move |(trial, score): &(&Trial, &Option<Score>)| {
        score.as_ref().is_some_and(|s| s.drop >= least(trial))
    };
    trials.iter().zip(scores).filter(explains).map(|(trial, _)| trial.label())
}

/// What is refitted in a round: the best start values of each effect and place, the best by the fall of the objective,
/// not too many of one place where `joints` joints move.
pub(crate) fn short_list(trials: &[Trial], scores: &[Option<Score>], joints: usize) -> Vec<usize> {
    let best = best_starts(trials, scores);
    let drop = |k: usize| scores[k].as_ref().map_or(0.0, |s| s.drop);
    let is_on_trust = |k: usize| scores[k].as_ref().is_some_and(|s| s.on_trust);
    let per_place = (SHORT_LIST / joints.max(1)).clamp(SHORT_LIST_PLACE.0, SHORT_LIST_PLACE.1);
    let top = best.first().map_or(0.0, |&k| drop(k));
    let mut list: Vec<usize> = Vec::new();
    for &k in &best {
        let here = list.iter().filter(|&&l| trials[l].place == trials[k].place).count();
        let trusted = list.iter().filter(|&&l| is_on_trust(l)).count();
        let least = if trials[k].switches_springs() { LEAST_SWING } else { LEAST };
        let is_worth_it = list.len() < 2 || drop(k) > least * top;
        let has_room = here < per_place && list.len() < SHORT_LIST;
        if is_worth_it && has_room && !(is_on_trust(k) && trusted == MOST_ON_TRUST) {
            list.push(k);
        }
    }
    list = with_lines(list, trials, scores);
    // A wrong tolerance changes no residual: the best releases are always heard.
    let releases = best.iter().filter(|&&k| matches!(trials[k].how, How::Release { .. }));
    let unheard: Vec<usize> = releases.copied().filter(|k| !list.contains(k)).take(RELEASES).collect();
    list.extend(unheard);
    // What the rest was bent to takes from a mass what its first moment gives back.
    let bent = best_by_label(trials, scores, |s| s.out.is_some() && s.drop > LEAST * top);
    list.extend(bent.into_iter().filter(|&k| trials[k].has_optional()));
    list
}

/// Of a list what promises a good part of what the best of it does, and the rest.
pub(crate) fn first_of(list: &[usize], scores: &[Option<Score>]) -> (Vec<usize>, Vec<usize>) {
    let drop = |k: usize| scores[k].as_ref().map_or(0.0, |s| s.drop);
    let top = list.iter().map(|&k| drop(k)).fold(0.0, f64::max);
    list.iter().partition(|&&k| drop(k) >= FIRST * top)
}

/// What is refitted where nothing of a list explains anything: the next best, one for each of its `refits` that takes away next
/// to nothing of what its screen promised of this `objective`; none that is dear. Where friction is sharp and rows are far
/// apart, times and stops promise most, all of it in a few rows.
pub(crate) fn next_in_line(
    trials: &[Trial],
    scores: &[Option<Score>],
    list: &[usize],
    refits: &[Refit],
    objective: f64,
) -> Vec<usize> {
    let drop = |k: usize| scores[k].as_ref().map_or(0.0, |s| s.drop);
    let is_hollow = |r: &&Refit| {
        let own = list.iter().filter(|k| trials[**k].label() == r.trial.label());
        let promised = own.map(|&k| drop(k)).fold(0.0, f64::max);
        objective - r.fitted.objective < HOLLOW * promised
    };
    let is_heard = |k: &usize| list.iter().any(|&l| trials[l].label() == trials[*k].label());
    let rest = best_starts(trials, scores).into_iter().filter(|k| !is_heard(k));
    let cheap = rest.filter(|&k| !trials[k].switches_springs());
    cheap.take(refits.iter().filter(is_hollow).count()).collect()
}

/// These trials, and of each effect among them that swings its best start at every line of the residual's spectrum: a
/// swing that is nearly in time is found from there, whatever its screen says.
pub(crate) fn with_lines(mut list: Vec<usize>, trials: &[Trial], scores: &[Option<Score>]) -> Vec<usize> {
    let swings: Vec<usize> = list.iter().copied().filter(|&k| trials[k].switches_springs()).collect();
    for k in swings {
        for line in 0..swings::MOST {
            let is_at_line =
                |&l: &usize| trials[l].line == Some(line) && trials[l].label() == trials[k].label();
            let drop = |l: usize| scores[l].as_ref().map_or(f64::NEG_INFINITY, |s| s.drop);
            let best = (0..trials.len()).filter(is_at_line).max_by(|&a, &b| drop(a).total_cmp(&drop(b)));
            list.extend(best.filter(|best| scores[*best].is_some() && !list.contains(best)));
        }
    }
    list
}

fn best_by_label(trials: &[Trial], scores: &[Option<Score>], counts: impl Fn(&Score) -> bool) -> Vec<usize> {
    let drop = |k: usize| scores[k].as_ref().map_or(0.0, |s| s.drop);
    // Of starts of one effect those with more parameters must be worth them.
    let count = |k: usize| scores[k].as_ref().map_or(0, |s| s.parameters);
    let worth = |k: usize| drop(k) - PARAMETER * count(k) as f64;
    let mut best: Vec<usize> = Vec::new();
    for k in 0..trials.len() {
        if !scores[k].as_ref().is_some_and(|s| s.drop.is_finite() && s.drop >= LEAST_DROP && counts(s)) {
            continue;
        }
        match best.iter_mut().find(|b| trials[**b].label() == trials[k].label()) {
            Some(slot) if worth(*slot) < worth(k) => *slot = k,
            Some(_) => {}
            None => best.push(k),
        }
    }
    best.sort_by(|&a, &b| drop(b).total_cmp(&drop(a)));
    best
}

/// Of refits of one candidate from several starts the one that ended lowest.
pub(crate) fn lowest_of_each(refits: impl Iterator<Item = Refit>) -> Vec<Refit> {
    let mut lowest: Vec<Refit> = Vec::new();
    for refit in refits {
        match lowest.iter_mut().find(|l| l.trial.label() == refit.trial.label()) {
            Some(slot) if refit.fitted.objective < slot.fitted.objective => *slot = refit,
            Some(_) => {}
            None => lowest.push(refit),
        }
    }
    lowest
}

// Falls of the objective along a part of a log below which a trial is left out along the whole of it; a swing has many starts,
// each with two columns.
const PROMISING: f64 = 2.0;
const PROMISING_SWING: f64 = 8.0;
// Falls of the objective below which a trial is not refitted, and above which an impossible one is told.
pub(crate) const LEAST_DROP: f64 = 12.0;
const WORTH_A_WORD: f64 = 30.0;
// Most candidates refitted in a round, and fewest and most for one place.
const SHORT_LIST: usize = 8;
const SHORT_LIST_PLACE: (usize, usize) = (3, 5);
// Fall of the objective that a start must promise for each parameter that it has more than another of the same effect: about ln of
// the rows of a log.
const PARAMETER: f64 = 10.0;
// Share of its promise that a candidate must keep for its place in the list to count.
const HOLLOW: f64 = 0.1;
// Releases refitted besides.
const RELEASES: usize = 2;
// Share of the best promise that a candidate's must have to be refitted; more for new springs, which cost most.
const LEAST: f64 = 0.02;
const LEAST_SWING: f64 = 0.1;
// Share of the best promise from which on a candidate of a list is refitted first.
const FIRST: f64 = 0.1;
// Most candidates refitted whose screen does not speak for them.
const MOST_ON_TRUST: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_promises_a_tenth_of_the_best_comes_first() {
        let of = |drop: f64| Score {
            strengths: vec![1.0],
            stds: Vec::new(),
            moving: Vec::new(),
            parameters: 1,
            drop,
            out: None,
            on_trust: false,
        };
        let scores = [Some(of(100.0)), None, Some(of(9.0)), Some(of(10.0))];
        assert_eq!(first_of(&[0, 2, 3], &scores), (vec![0, 3], vec![2]));
        assert_eq!(first_of(&[], &scores), (Vec::new(), Vec::new()));
    }
}
