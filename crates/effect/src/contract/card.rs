//! The clause that a card is complete.

use crate::{Card, Role, Screening};

/// Checks a card and its example.
///
/// # Panics
/// With a sentence that names the effect and what its card lacks.
pub(super) fn check(card: &Card, example: &[f64]) {
    let name = card.name;
    let texts = [name, card.title, card.law, card.symptom];
    assert!(texts.iter().all(|t| !t.trim().is_empty()), "{name}: a text of the card is empty");
    assert!(!card.sources.is_empty(), "{name}: the card gives no source");
    assert!(card.strengths() > 0, "{name}: no parameter is a strength, so it can never be absent");
    assert_eq!(example.len(), card.parameters.len(), "{name}: the example needs one value a parameter");
    for (k, parameter) in card.parameters.iter().enumerate() {
        let label = parameter.label();
        let same =
            |other: &crate::Parameter| (other.key, other.component) == (parameter.key, parameter.component);
        assert!(!card.parameters[..k].iter().any(same), "{name}: two parameters are called `{label}`");
        let (low, high) = parameter.range;
        let within = |x: f64| (low..=high).contains(&x);
        assert!(low < high, "{name}: the range of `{label}` is empty");
        assert!(within(parameter.start()), "{name}: `{label}` starts outside its range");
        assert!(within(example[k]), "{name}: the example of `{label}` is outside its range");
        assert!(
            !parameter.symbol.is_empty() && !parameter.unit.is_empty(),
            "{name}: `{label}` has no symbol or unit"
        );
        if let Role::Shape { grid } = parameter.role {
            assert!(grid.is_sorted(), "{name}: the grid of `{label}` is not in order");
            assert!(grid.iter().all(|&x| within(x)), "{name}: the grid of `{label}` leaves its range");
        }
    }
    check_screening(card);
    for rival in card.rivals {
        assert!(rival.name != name, "{name}: it is its own rival");
        assert!(!rival.experiment.is_empty(), "{name}: no experiment separates it from {}", rival.name);
    }
}

fn check_screening(card: &Card) {
    let name = card.name;
    let shape_last = card.parameters.last().is_some_and(|p| matches!(p.role, Role::Shape { .. }));
    match card.screening {
        Screening::Exact { strengths } => {
            let (low, high) = card.parameters[0].range;
            let fits = |&x: &f64| x != 0.0 && (low..=high).contains(&x);
            assert!(strengths.iter().all(fits), "{name}: a first strength to try is zero or out of range");
        }
        Screening::Harmonic | Screening::Quantiles { .. } => {
            assert!(shape_last, "{name}: its screening needs a shape as last parameter");
        }
        _ => {}
    }
}
