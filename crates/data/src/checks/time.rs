//! Time stamps: unit, jitter and gaps.

use super::wording::{number, percent};
use crate::note::{Note, Severity};
use crate::run::Run;

/// A step that differs from the median by more than this share is jitter.
const JITTER: f64 = 0.2;
/// A step longer than this many medians is a gap.
const GAP: f64 = 3.0;
/// Medians of the step that are believable, s.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 1e-5..=0.5;

pub(super) fn check(run: &Run) -> Vec<Note> {
    let period = run.period();
    let steps: Vec<f64> = run.time.windows(2).map(|t| t[1] - t[0]).collect();
    [unit(run, period), gaps(run, &steps, period), jitter(run, &steps, period)]
        .into_iter()
        .flatten()
        .collect()
}

fn unit(run: &Run, period: f64) -> Option<Note> {
    if PLAUSIBLE.contains(&period) {
        return None;
    }
    let guess = [("milliseconds", "1e-3"), ("microseconds", "1e-6"), ("nanoseconds", "1e-9")]
        .into_iter()
        .find(|(_, scale)| scale.parse::<f64>().is_ok_and(|scale| (1e-4..=0.1).contains(&(period * scale))));
    let (suspicion, help) = match guess {
        Some((unit, scale)) => (
            format!("; the stamps look like {unit}"),
            format!(
                "time = {{ column = \"…\", scale = {scale} }} in the columns map; {scale} times the scale that it has, if it has one"
            ),
        ),
        None => (String::new(), "give the unit of the stamps with a scale in the columns map".into()),
    };
    Some(Note {
        severity: Severity::Error,
        place: run.name.clone(),
        statement: format!(
            "the median time step is {} s (believable: 1e-5 s to 0.5 s){suspicion}",
            number(period)
        ),
        help,
    })
}

fn gaps(run: &Run, steps: &[f64], period: f64) -> Option<Note> {
    let gaps: Vec<usize> = (0..steps.len()).filter(|&k| steps[k] > GAP * period).collect();
    let longest = *gaps.iter().max_by(|&&a, &&b| steps[a].total_cmp(&steps[b]))?;
    Some(Note {
        severity: Severity::Warning,
        place: run.place_of(longest + 1),
        statement: format!(
            "{} in the time stamps, here one of {} s (median step {} s)",
            if gaps.len() == 1 { "a gap".into() } else { format!("{} gaps", gaps.len()) },
            number(steps[longest]),
            number(period)
        ),
        help: if run.is_gap(longest + 1) {
            "the commands take the stretches between long gaps as runs of their own; FILE@FROM..TO names one"
        } else {
            "use windows of the run between the gaps: FILE@FROM..TO"
        }
        .into(),
    })
}

fn jitter(run: &Run, steps: &[f64], period: f64) -> Option<Note> {
    let off = |step: f64| (step - period).abs();
    let late: Vec<usize> =
        (0..steps.len()).filter(|&k| off(steps[k]) > JITTER * period && steps[k] <= GAP * period).collect();
    let worst = *late.iter().max_by(|&&a, &&b| off(steps[a]).total_cmp(&off(steps[b])))?;
    Some(Note {
        severity: Severity::Note,
        place: run.place_of(worst + 1),
        statement: format!(
            "{} of the time steps differ by more than 20 % from the period of {} s, here {} s",
            percent(late.len() as f64 / steps.len() as f64),
            number(period),
            number(steps[worst])
        ),
        help: "the stamps are used as logged; a logged velocity would tell whether they are true".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(time: Vec<f64>) -> Vec<Note> {
        check(&Run::new("log".into(), time, vec![]).unwrap())
    }

    fn clock(step: f64) -> Vec<f64> {
        (0..100).map(|k| step * f64::from(k)).collect()
    }

    #[test]
    fn an_even_clock_is_not_mentioned() {
        assert_eq!(notes(clock(0.001)), []);
    }

    #[test]
    fn a_gap_is_told_with_its_place() {
        let mut time = clock(0.01);
        time[40..].iter_mut().for_each(|t| *t += 0.3);
        let notes = notes(time);
        assert_eq!(notes.len(), 1);
        assert_eq!(notes[0].place, "log, sample 41");
        assert!(notes[0].statement.starts_with("a gap in the time stamps, here one of 0.31 s"));
    }

    #[test]
    fn jitter_is_told_with_its_share() {
        let mut time = clock(0.01);
        time[50] += 0.003;
        let notes = notes(time);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].statement.starts_with("2.02 % of the time steps differ"), "{}", notes[0]);
    }

    #[test]
    fn stamps_in_another_unit_are_recognised() {
        for (step, unit) in [(10.0, "milliseconds"), (1000.0, "microseconds"), (4e6, "nanoseconds")] {
            let notes = notes(clock(step));
            assert!(notes[0].statement.contains(unit), "{}", notes[0]);
            assert_eq!(notes[0].severity, Severity::Error);
        }
    }
}
