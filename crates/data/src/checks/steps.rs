//! Readings that come in steps larger than their noise.

use super::wording::{about, number, unit};
use crate::noise::white_noise_std;
use crate::note::{Note, Severity};
use crate::quantisation::quantisation_step;
use crate::run::{Run, Signal};
use crate::statistics::extremes;

/// Steps below this share of the noise do no harm.
const HARMLESS: f64 = 0.5;
/// Steps below this share of the range are told only as far as the noise floor goes; above, as coarse.
const COARSE: f64 = 1e-3;

pub(super) fn check(run: &Run) -> Vec<Note> {
    run.signals.iter().filter_map(|signal| tell(run, signal)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Option<Note> {
    let step = quantisation_step(&signal.values)?;
    let (low, high) = extremes(&signal.values);
    if step <= HARMLESS * white_noise_std(&signal.values) || step < COARSE * (high - low) {
        return None;
    }
    let unit = unit(signal.quantity);
    let statement = format!(
        "comes in steps of {} {unit}, {} over its range; noise below {} {unit} cannot be seen",
        number(step),
        ((high - low) / step).round(),
        number(step / 12f64.sqrt())
    );
    Some(about(run, signal, Severity::Note, statement, "log more digits if the sensor has them"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;
    use crate::samples::white_noise;

    fn notes(step: f64, noise: f64) -> Vec<Note> {
        let values = white_noise(2000, 9)
            .into_iter()
            .enumerate()
            .map(|(k, n)| (((0.01 * k as f64).sin() + noise * n) / step).round() * step);
        let signal = Signal::new(Quantity::MotorPosition, "elbow", values.collect());
        check(
            &Run::new("log".into(), (0..2000).map(|k| 0.001 * f64::from(k)).collect(), vec![signal]).unwrap(),
        )
    }

    #[test]
    fn coarse_steps_are_told_with_their_size() {
        let notes = notes(0.01, 0.0);
        assert_eq!(notes.len(), 1);
        assert!(
            notes[0].statement.starts_with("comes in steps of 0.01 rad (m), 200 over its range"),
            "{}",
            notes[0]
        );
    }

    #[test]
    fn steps_below_the_noise_or_a_thousandth_of_the_range_are_not_mentioned() {
        assert_eq!(notes(0.01, 0.1), []);
        assert_eq!(notes(0.001, 0.0), []);
    }
}
