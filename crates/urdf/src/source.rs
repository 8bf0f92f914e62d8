//! The sidecar's text, and the checks of its numbers with place and name.

use std::ops::Range;

use serde_spanned::Spanned;

use crate::grammar::Number;
use crate::{Location, UrdfError};

/// The sidecar's text with what its messages need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl Source<'_> {
    pub(crate) fn at(&self, span: Range<usize>) -> Location {
        Location::of(self.file, self.text, span.start)
    }

    /// The error of a value that cannot be.
    pub(crate) fn value(
        &self,
        span: Range<usize>,
        what: String,
        got: String,
        allowed: &str,
        help: &'static str,
    ) -> UrdfError {
        UrdfError::Value { at: self.at(span), what, got, allowed: allowed.to_owned(), help }
    }

    /// A number that passes `test`; `key` is its full name.
    pub(crate) fn number(
        &self,
        number: &Spanned<Number>,
        key: &str,
        range: Domain,
    ) -> Result<f64, UrdfError> {
        let x = number.get_ref().0;
        let (holds, what, allowed, help) = range.judge(x);
        if holds {
            return Ok(x);
        }
        Err(self.value(number.span(), format!("{key}: {what}"), shown(x), allowed, help))
    }

    /// A list of finite numbers.
    pub(crate) fn numbers(&self, list: &Spanned<Vec<Number>>, key: &str) -> Result<Vec<f64>, UrdfError> {
        let values: Vec<f64> = list.get_ref().iter().map(|x| x.0).collect();
        match values.iter().find(|x| !x.is_finite()) {
            None => Ok(values),
            Some(x) => Err(self.value(list.span(), format!("{key}: not finite"), shown(*x), FINITE, STATE)),
        }
    }
}

const FINITE: &str = "a finite number";
const STATE: &str = "state the value, or leave the key out";

/// What a number may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Domain {
    /// More than zero.
    Positive,
    /// Zero or more.
    NotNegative,
    /// 1, 2, 3 …
    Count,
}

impl Domain {
    fn judge(self, x: f64) -> (bool, &'static str, &'static str, &'static str) {
        if !x.is_finite() {
            return (false, "not finite", FINITE, STATE);
        }
        match self {
            Domain::Positive => (x > 0.0, "must be positive", "> 0", "state its size, or leave the key out"),
            Domain::NotNegative => {
                (x >= 0.0, "must not be negative", "≥ 0", "state its size; 0 leaves it out")
            }
            Domain::Count => {
                (x >= 1.0 && x.fract() == 0.0 && x <= 1e3, "must be a count", "1, 2, 3 …", "a few are enough")
            }
        }
    }
}

pub(crate) fn shown(x: f64) -> String {
    format!("{x:?}")
}
