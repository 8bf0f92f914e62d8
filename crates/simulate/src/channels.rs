//! The signals of a simulated run, each read at its own instant.

use sinew_data::{Quantity, Signal};
use sinew_effect::Sensor;

use crate::equations::Equations;
use crate::noise::{self, Noise};

/// One signal while it is being recorded.
pub(crate) struct Channel {
    pub quantity: Quantity,
    pub dof: usize,
    joint: String,
    gain: f64,
    offset: f64,
    delay: f64,
    noise: noise::Channel,
    values: Vec<f64>,
}

impl Channel {
    pub fn new(equations: &Equations, quantity: Quantity, dof: usize, noise: &Noise, seed: u64) -> Self {
        let joint = equations.dynamics.plant().model().dof_name(dof).to_owned();
        let sensor = |sensor| equations.dynamics.reading(sensor)[dof];
        let error = match quantity {
            Quantity::MotorTorque => Some(sensor(Sensor::MotorTorque)),
            Quantity::JointPosition => Some(sensor(Sensor::JointPosition)),
            // A rate has the gain and the delay of its encoder, not its offset.
            Quantity::JointVelocity => {
                let mut encoder = sensor(Sensor::JointPosition);
                encoder.offset = 0.0;
                Some(encoder)
            }
            Quantity::JointTorque => Some(sensor(Sensor::JointTorque)),
            _ => None,
        };
        let (gain, offset, delay) = error.map_or((1.0, 0.0, 0.0), |e| (e.gain, e.offset, e.delay));
        // A drive that is ahead of its log: the command acts at once and is logged late.
        let ahead = (-equations.actuation[dof].delay).max(0.0);
        let delay = if quantity == Quantity::MotorTorque { delay + ahead } else { delay };
        let noise = noise.channel(seed, quantity, &joint);
        Self { quantity, dof, joint, gain, offset, delay, noise, values: Vec::new() }
    }

    /// The next instant whose value is still to be read: tₖ − delay, within the run.
    pub fn due(&self, times: &[f64]) -> f64 {
        let end = times[times.len() - 1];
        times.get(self.values.len()).map_or(f64::INFINITY, |t| (t - self.delay).clamp(times[0], end))
    }

    /// Reads every value due by `t`, the instant of `equations`; `command` is the torque that the log takes.
    pub fn read(&mut self, t: f64, times: &[f64], equations: &Equations, command: &[f64]) {
        while self.due(times) <= t {
            let (state, dof, k) = (equations.stands(), self.dof, self.values.len());
            let truth = match self.quantity {
                Quantity::MotorPosition => state.theta[dof],
                Quantity::MotorVelocity => state.thetad[dof],
                Quantity::JointPosition => state.q[dof],
                Quantity::JointVelocity => state.qd[dof],
                Quantity::JointTorque => equations.rates.tau_j[dof],
                Quantity::Temperature => equations.state.temperature[dof].unwrap_or_default(),
                _ => command[dof],
            };
            let reading = self.gain * truth + self.offset;
            // The noise of the torque acts; the log has the command.
            let commanded = self.quantity == Quantity::MotorTorque;
            let shown = if commanded { self.noise.rounded(reading) } else { self.noise.read(reading, k) };
            self.values.push(shown);
        }
    }

    pub fn into_signal(self) -> Signal {
        let (std, resolution) = self.noise.stated();
        Signal { std, resolution, ..Signal::new(self.quantity, self.joint, self.values) }
    }
}
