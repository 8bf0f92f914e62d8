//! Words shared by all answers: verdicts, findings, refusals.

use core::fmt;

use serde::Serialize;

/// The graded verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is missing within the scope.
    Adequate,
    /// Effects are missing, and with them nothing predictable remains.
    Missing,
    /// Effects are missing, and with them something predictable still remains.
    PartlyExplained,
    /// Something is missing that the catalogue does not explain.
    Unexplained,
    /// These data cannot decide.
    Undecidable,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Verdict::Adequate => "adequate",
            Verdict::Missing => "missing",
            Verdict::PartlyExplained => "partly_explained",
            Verdict::Unexplained => "unexplained",
            Verdict::Undecidable => "undecidable",
        })
    }
}

/// One view of a residual, in a sentence. A view, not a cause: it never names an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The joint.
    pub joint: String,
    /// The signal.
    pub signal: String,
    /// Where or when: "reversals", "fast", "run b.csv" …
    pub regime: String,
    /// The sentence, with numbers and units.
    pub statement: String,
    /// Share of the excess error it carries.
    pub share: f64,
}

impl Finding {
    /// The same, said of one of several models.
    pub(crate) fn said_of(self, model: &str) -> Self {
        Self { statement: format!("{model}: {}", self.statement), ..self }
    }

    /// What the data themselves say, before any model.
    pub(crate) fn of_data(joint: String, signal: &str, statement: String) -> Self {
        Self { joint, signal: signal.to_owned(), regime: "data".to_owned(), statement, share: 0.0 }
    }
}

/// Why a candidate was not accepted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refusal {
    /// `effect@place`.
    pub candidate: String,
    /// The step of the search, counted from one.
    pub step: usize,
    /// The gate that refused it, with its number.
    pub reason: String,
}
