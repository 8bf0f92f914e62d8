//! Torques and currents that were filtered before they were logged.

use super::wording::{about, number};
use crate::noise::{fourth_difference_lag1, is_white, white_noise_std};
use crate::note::{Note, Severity};
use crate::quantisation::quantisation_step;
use crate::quantity::Quantity;
use crate::run::{Run, Signal};

pub(super) fn check(run: &Run) -> Vec<Note> {
    use Quantity::*;
    let forces =
        |s: &&Signal| matches!(s.quantity, MotorTorque | MotorCurrent | JointTorque | ToolForce | ToolMoment);
    run.signals.iter().filter(forces).filter_map(|signal| tell(run, signal)).collect()
}

fn tell(run: &Run, signal: &Signal) -> Option<Note> {
    if signal.std.is_some() {
        return None;
    }
    let lag1 = fourth_difference_lag1(&signal.values);
    // Steps have a colour of their own.
    let stepped =
        quantisation_step(&signal.values).is_some_and(|step| step > white_noise_std(&signal.values));
    if stepped || lag1.is_nan() || is_white(lag1) {
        return None;
    }
    let statement = format!(
        "has no white noise (neighbouring fourth differences correlate by {}, white noise by -0.8): filtered before \
         logging, or a command; its noise floor is a lower bound",
        number(lag1)
    );
    Some(about(
        run,
        signal,
        Severity::Note,
        statement,
        "log the raw signal, or state its std in FILE.run.toml",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::white_noise;

    fn notes(torque: Vec<f64>) -> Vec<Note> {
        let time = (0..torque.len()).map(|k| 0.001 * k as f64).collect();
        check(
            &Run::new("log".into(), time, vec![Signal::new(Quantity::MotorTorque, "elbow", torque)]).unwrap(),
        )
    }

    #[test]
    fn a_filtered_torque_is_told_and_a_white_one_is_not() {
        let noise = white_noise(5000, 6);
        assert_eq!(notes(noise.clone()), []);
        let filtered = noise.windows(3).map(|x| x[0] + 2.0 * x[1] + x[2]).collect();
        assert!(notes(filtered)[0].statement.contains("filtered before logging"));
    }
}
