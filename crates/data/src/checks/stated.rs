//! Noise that was stated beside what a signal shows.

use super::wording::{about, number, unit};
use crate::noise::{fourth_difference_lag1, instrument_noise, is_white, white_noise_std};
use crate::note::{Note, Severity};
use crate::run::{Run, Signal};
use crate::statistics::std;

/// A factor between the stated noise and that of the readings which no two estimates differ by.
const FACTOR: f64 = 30.0;
/// Standard deviations of its noise by which a signal that is not at rest varies.
const MUCH: f64 = 10.0;

pub(super) fn check(run: &Run) -> Vec<Note> {
    run.signals.iter().filter_map(|signal| tell(run, signal)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Option<Note> {
    let (stated, all) = (signal.std?, std(&signal.values));
    let unit = unit(signal.quantity);
    let help = "state std in the unit of the quantity, for one sample, in FILE.run.toml, or leave it out";
    let (seen, noise) = (white_noise_std(&signal.values), instrument_noise(signal));
    let does_much = all > MUCH * seen;
    if does_much && stated > all {
        let (stated, all) = (number(stated), number(all));
        let statement = format!(
            "the noise stated for it, {stated} {unit}, is larger than all that it does (standard deviation {all}): every model would do"
        );
        return Some(about(run, signal, Severity::Error, statement, help));
    }
    if !is_white(fourth_difference_lag1(&signal.values)) || (seen / FACTOR..=seen * FACTOR).contains(&noise) {
        return None;
    }
    let statement = format!(
        "the noise stated for it is {} times that of its readings ({} {unit}, from their fourth differences)",
        number(noise / seen),
        number(seen)
    );
    Some(about(run, signal, Severity::Warning, statement, help))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;
    use crate::samples::white_noise;

    fn told(std: f64) -> Vec<Note> {
        let noise = white_noise(3000, 4);
        let values = noise.iter().enumerate().map(|(k, n)| (0.01 * k as f64).sin() + 1e-3 * n).collect();
        let mut signal = Signal::new(Quantity::MotorTorque, "elbow", values);
        signal.std = Some(std);
        let time = (0..3000).map(|k| 0.001 * k as f64).collect();
        check(&Run::new("log".into(), time, vec![signal]).unwrap())
    }

    #[test]
    fn noise_in_another_unit_is_told() {
        assert_eq!(told(1e-3), []);
        assert_eq!(told(1e-2), []);
        assert_eq!(told(0.1)[0].severity, Severity::Warning);
        assert!(told(1e-6)[0].statement.contains("times that of its readings"), "{}", told(1e-6)[0]);
        assert_eq!(told(1.0)[0].severity, Severity::Error);
    }
}
