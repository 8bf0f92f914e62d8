//! Numbers, units and places as the notes write them.

use crate::note::{Note, Severity};
use crate::quantity::Quantity;
use crate::run::{Run, Signal};

/// A number with three digits that count: 0.0123, 57.3, 1.2e-6.
pub(crate) fn number(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    if (1e-4..1e6).contains(&rounded.abs()) { rounded.to_string() } else { format!("{rounded:e}") }
}

/// A share as per cent.
pub(crate) fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

/// The unit, with the one of sliding joints in brackets: a run does not know which joints slide.
pub(crate) fn unit(quantity: Quantity) -> String {
    match (quantity.unit(false), quantity.unit(true)) {
        (turning, sliding) if turning == sliding => turning.into(),
        (turning, sliding) => format!("{turning} ({sliding})"),
    }
}

/// A note about a whole signal.
pub(crate) fn about(run: &Run, signal: &Signal, severity: Severity, statement: String, help: &str) -> Note {
    Note { severity, place: format!("{}: {}", run.name, signal.name()), statement, help: help.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_that_count() {
        assert_eq!(number(57.29578), "57.3");
        assert_eq!(number(0.012_345), "0.0123");
        assert_eq!(number(-1.0), "-1");
        assert_eq!(number(4.793e-5), "4.79e-5");
        assert_eq!(number(0.0), "0");
        assert_eq!(percent(0.0312), "3.12 %");
        assert_eq!(unit(Quantity::MotorTorque), "N·m (N)");
        assert_eq!(unit(Quantity::MotorCurrent), "A");
    }
}
