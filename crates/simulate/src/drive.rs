//! What decides the motor torques.

use sinew_data::{Quantity, Run};
use sinew_plant::Plant;

/// What a drive knows at a sample.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Time, s.
    pub time: f64,
    /// Motor positions as the encoders show them, noise and steps included, in the order of [`Plant::joints`].
    pub motor_position: &'a [f64],
}

/// Decides the motor torques, which are held until the next sample.
pub trait Drive {
    /// Writes the torque command, N·m, in the order of [`Plant::joints`].
    fn command(&mut self, measured: Measured, tau: &mut [f64]);
}

/// A table of torques, held from each of its times to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Torques {
    /// Times, s, increasing.
    pub time: Vec<f64>,
    /// For each joint one torque a time; empty for none.
    pub tau: Vec<Vec<f64>>,
}

impl Torques {
    /// The same torques at all times.
    pub fn constant(tau: &[f64]) -> Self {
        Self { time: vec![0.0], tau: tau.iter().map(|&t| vec![t]).collect() }
    }

    /// The motor torques of a run; joints without any get none.
    pub fn of_run(run: &Run, plant: &Plant) -> Self {
        let of = |&dof: &usize| {
            let signal = run.signal(Quantity::MotorTorque, plant.model().dof_name(dof));
            signal.map_or_else(Vec::new, |s| s.values.clone())
        };
        Self { time: run.time.clone(), tau: plant.joints().iter().map(of).collect() }
    }
}

impl Drive for Torques {
    fn command(&mut self, measured: Measured, tau: &mut [f64]) {
        // The last time that is not after this one; the first torque holds before the first time.
        let k = self.time.partition_point(|&t| t <= measured.time).saturating_sub(1);
        for (tau, table) in tau.iter_mut().zip(&self.tau) {
            *tau = table.get(k).copied().unwrap_or(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torque_holds_until_the_next_time() {
        let mut table = Torques { time: vec![0.0, 1.0], tau: vec![vec![3.0, 5.0], vec![]] };
        let mut at = |time| {
            let mut tau = [9.0; 2];
            table.command(Measured { time, motor_position: &[0.0; 2] }, &mut tau);
            tau
        };
        assert_eq!([at(-1.0), at(0.0), at(0.999), at(1.0), at(7.0)].map(|t| t[0]), [3.0, 3.0, 3.0, 5.0, 5.0]);
        assert_eq!(at(0.0)[1], 0.0);
    }
}
