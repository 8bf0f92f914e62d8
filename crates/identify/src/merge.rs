//! The merging: the same law in several joints may stand for one of the whole robot.
//!
//! A base on a spring swings in the torque of every joint. While friction is missing it is refused, and may then be named as a
//! mode of each link. What was accepted in several joints is taken out of the finished model, and what a rival of the
//! whole robot explains beside the rest is compared with it.

use std::collections::BTreeSet;

use sinew_effect::{Card, Catalogue, PlaceKind};
use sinew_model::Place;

use crate::IdentifyError;
use crate::explore::{CHANCE, Rung, Unseen, accepted_without, is_likelier, rung, without};
use crate::problem::Candidate;
use crate::round::Round;
use crate::search::{Accepted, Search, State};
use crate::trial::How;

/// Puts laws of the whole robot in the place of others that were accepted in several joints, where the log is as likely with
/// them, or without a likelihood the error smaller. True if any was put there.
pub(crate) fn merged(
    search: &mut Search,
    state: &mut State,
    rungs: &mut Vec<Rung>,
    unseen: Option<&Unseen>,
) -> Result<bool, IdentifyError> {
    let names: BTreeSet<&str> = state.accepted.iter().map(|entry| entry.trial.card.name).collect();
    let mut any = false;
    for name in names {
        let are_one = |entry: &&Accepted| is_of(entry, name);
        let several: Vec<Accepted> = state.accepted.iter().filter(are_one).cloned().collect();
        let Some(first) = several.first().filter(|_| several.len() > 1) else { continue };
        let rivals = rivals_of_robot(search.problem.catalogue, first.trial.card, &state.accepted);
        if rivals.is_empty() {
            continue;
        }
        let tried = with_one_for(search, state, name, &rivals, rungs.len())?;
        let holds = |next: &State| next.is_finite() && is_likelier(search, state, next, -CHANCE, unseen);
        let Some(next) = tried.filter(holds) else {
            state.reference.iter().for_each(|reference| search.problem.form.adopt(reference));
            continue;
        };
        let by = next.accepted.last().map_or(String::new(), |entry| entry.trial.label());
        let mut labels: Vec<String> = Vec::new();
        for entry in &several {
            let reason = format!("{by} explains it in {} joints at once", several.len());
            search.refuse(&entry.trial, rungs.len(), reason);
            labels.push(format!("−{}", entry.trial.label()));
        }
        labels.push(by);
        *state = next;
        rungs.push(rung(search, &labels, state, unseen));
        any = true;
    }
    Ok(any)
}

// True of a new law of this name in a joint.
fn is_of(entry: &Accepted, name: &str) -> bool {
    let is_new = matches!(entry.trial.how, How::New { .. });
    is_new && entry.trial.card.name == name && entry.trial.place != Place::Robot
}

// Laws of the whole robot that a card names as rivals, or that name it; none that was accepted.
fn rivals_of_robot(catalogue: &Catalogue, card: &Card, accepted: &[Accepted]) -> Vec<&'static str> {
    let names = |a: &Card, b: &str| a.rivals.iter().any(|rival| rival.name == b);
    let is_rival = |other: &Card| names(card, other.name) || names(other, card.name);
    let is_accepted = |name: &str| accepted.iter().any(|entry| entry.trial.card.name == name);
    let of_robot = catalogue.entries.iter().filter(|e| e.place == PlaceKind::Robot).map(|e| e.card);
    of_robot.filter(|c| is_rival(c) && !is_accepted(c.name)).map(|c| c.name).collect()
}

// The state with the best of these rivals in the place of all that has this name in a joint; none where none of them passes.
fn with_one_for(
    search: &mut Search,
    state: &State,
    name: &str,
    rivals: &[&str],
    step: usize,
) -> Result<Option<State>, IdentifyError> {
    let mut model: Candidate = state.fitted.model.again(search.problem)?;
    let mut accepted = state.accepted.clone();
    while let Some(k) = accepted.iter().position(|entry| is_of(entry, name)) {
        model = without(search.problem, &model, &accepted[k])?;
        accepted = accepted_without(&accepted, k);
    }
    let reduced = search.settled_anew(model, |model| search.descended(model, &state.whitener), accepted)?;
    if !reduced.is_finite() {
        return Ok(None);
    }
    let mut round: Round = search.round(&reduced, step, Vec::new());
    round.passed.retain(|refit| rivals.contains(&refit.trial.card.name));
    round.passed.truncate(1);
    search.accept(&reduced, round)
}

#[cfg(test)]
mod tests {
    use sinew_effects::CATALOGUE;

    use super::*;

    #[test]
    fn modes_of_several_links_may_be_one_of_the_base() {
        let rivals = |name| rivals_of_robot(&CATALOGUE, CATALOGUE.find(name).unwrap().card, &[]);
        assert_eq!(rivals("link_bending_mode"), ["base_compliance"]);
        assert!(rivals("viscous_friction").is_empty());
    }
}
