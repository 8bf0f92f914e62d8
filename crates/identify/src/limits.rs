//! What would have been seen: the smallest strength of each effect that these runs would show.

use serde::Serialize;

use crate::explore::{Explored, widening};
use crate::search::Search;
use crate::trial::{How, Trial};

/// The smallest strength of an effect that would have been named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectionLimit {
    /// Its name in the catalogue.
    pub effect: String,
    /// Joint, link or "robot".
    pub place: String,
    /// The strength.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// Its smallest size that would be named: nine standard deviations.
    pub smallest: f64,
    /// Standard deviations at which these runs put the strength; a number of the standard normal distribution where
    /// the effect is absent and the model right.
    pub score: f64,
}

// z = χ²/(2χ + 2) passes its gate from χ ≈ 9.
const SEEN: f64 = 9.0;

/// The limits of effects of one strength that enter linearly, from the last screen; of several start values the one
/// that is hardest to see. Of a long log, those of candidates that were looked at in a part of it are told from the part.
pub(crate) fn limits(search: &Search, explored: &Explored) -> Vec<DetectionLimit> {
    let state = &explored.state;
    let Some(scores) = state.scores.get() else { return Vec::new() };
    let wide = widening(search, state);
    let mut all: Vec<DetectionLimit> = Vec::new();
    for (trial, score) in state.trials.iter().zip(scores) {
        let Some(score) = score else { continue };
        let (Some(&strength), Some(&std)) = (score.strengths.first(), score.stds.first()) else { continue };
        let Some((parameter, unit)) = strength_of(trial) else { continue };
        let (effect, place) = (trial.card.name.to_owned(), trial.place.to_string());
        let limit = DetectionLimit {
            effect,
            place,
            parameter,
            unit,
            smallest: SEEN * std * wide,
            score: strength / (std * wide),
        };
        if !limit.smallest.is_finite() || score.strengths.len() > 1 {
            continue;
        }
        match all.iter_mut().find(|l| l.effect == limit.effect && l.place == limit.place) {
            Some(known) if known.smallest < limit.smallest => *known = limit,
            Some(_) => {}
            None => all.push(limit),
        }
    }
    for limit in search.look.iter().flat_map(|look| &look.limits) {
        if !all.iter().any(|l| l.effect == limit.effect && l.place == limit.place) {
            all.push(limit.clone());
        }
    }
    all
}

// Key and unit of the only strength of a new linear effect.
fn strength_of(trial: &Trial) -> Option<(String, String)> {
    let How::New { strengths, exact: false, .. } = &trial.how else { return None };
    let [only] = strengths.as_slice() else { return None };
    let parameter = &trial.card.parameters[*only];
    Some((parameter.label(), parameter.unit.to_owned()))
}
