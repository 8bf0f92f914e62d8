//! Which start values of a candidate are worth a refit.

use crate::refit::Refit;
use crate::screen::Score;
use crate::trial::Trial;

/// The best start values of each effect and place, best first.
pub(crate) fn best_starts(trials: &[Trial], scores: &[Option<Score>]) -> Vec<usize> {
    best_by_label(trials, scores, |s| s.out.is_none())
}

/// The same of those that physics forbids and the data ask for.
pub(crate) fn impossible_starts(trials: &[Trial], scores: &[Option<Score>]) -> Vec<usize> {
    best_by_label(trials, scores, |s| s.out.is_some() && s.drop > WORTH_A_WORD)
}

fn best_by_label(trials: &[Trial], scores: &[Option<Score>], counts: impl Fn(&Score) -> bool) -> Vec<usize> {
    let drop = |k: usize| scores[k].as_ref().map_or(0.0, |s| s.drop);
    let mut best: Vec<usize> = Vec::new();
    for k in 0..trials.len() {
        if !scores[k].as_ref().is_some_and(|s| s.drop.is_finite() && s.drop >= LEAST_DROP && counts(s)) {
            continue;
        }
        match best.iter_mut().find(|b| trials[**b].label() == trials[k].label()) {
            Some(slot) if drop(*slot) < drop(k) => *slot = k,
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

// Falls of the objective below which a trial is not refitted, and above which an impossible one is told.
const LEAST_DROP: f64 = 12.0;
const WORTH_A_WORD: f64 = 30.0;
