//! What sensors add to the truth: white noise and steps.

use sinew_data::Quantity;

use crate::Stream;

/// Noise and resolution of the sensors; empty for ideal ones.
///
/// The noise of `motor_torque` is not one of the log: the logged torque is the command, and the torque that acts is
/// the command plus noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// What is known of each; what is said of a joint wins over what is said of all.
    pub sensors: Vec<SensorNoise>,
}

/// Noise and resolution of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorNoise {
    /// The quantity.
    pub quantity: Quantity,
    /// The joint; none for all.
    pub joint: Option<String>,
    /// Standard deviation of white noise, in the quantity's unit.
    pub std: f64,
    /// Step between two readings; zero for none.
    pub resolution: f64,
}

impl Noise {
    /// The same, and this noise of a quantity in every joint.
    pub fn with(mut self, quantity: Quantity, std: f64, resolution: f64) -> Self {
        self.sensors.push(SensorNoise { quantity, joint: None, std, resolution });
        self
    }

    /// The noise of one quantity in one joint.
    pub(crate) fn channel(&self, seed: u64, quantity: Quantity, joint: &str) -> Channel {
        let of = |own: bool| {
            let is = |s: &&SensorNoise| {
                s.quantity == quantity
                    && if own { s.joint.as_deref() == Some(joint) } else { s.joint.is_none() }
            };
            self.sensors.iter().rev().find(is)
        };
        let (std, resolution) = of(true).or(of(false)).map_or((0.0, 0.0), |s| (s.std, s.resolution));
        Channel { stream: Stream::new(seed, &format!("{quantity}.{joint}")), std, resolution }
    }
}

/// The noise of one signal.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    stream: Stream,
    std: f64,
    resolution: f64,
}

impl Channel {
    /// σ·n_k.
    pub fn noise(&self, k: usize) -> f64 {
        if self.std == 0.0 { 0.0 } else { self.std * self.stream.normal(k as u64) }
    }

    /// `x` on the nearest step.
    pub fn rounded(&self, x: f64) -> f64 {
        if self.resolution == 0.0 { x } else { (x / self.resolution).round() * self.resolution }
    }

    /// Standard deviation and resolution, where there are any.
    pub fn stated(&self) -> (Option<f64>, Option<f64>) {
        let some = |x: f64| (x > 0.0).then_some(x);
        (some(self.std), some(self.resolution))
    }

    /// What the sensor shows of `x` in sample `k`.
    pub fn read(&self, x: f64, k: usize) -> f64 {
        self.rounded(x + self.noise(k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joints_own_noise_wins_over_that_of_all() {
        let mut noise = Noise::default().with(Quantity::MotorPosition, 1.0, 0.0);
        noise.sensors.push(SensorNoise {
            quantity: Quantity::MotorPosition,
            joint: Some("elbow".into()),
            std: 0.0,
            resolution: 0.25,
        });
        let read = |joint, x| noise.channel(0, Quantity::MotorPosition, joint).read(x, 5);
        assert_eq!(read("elbow", 0.9), 1.0);
        assert_ne!(read("wrist", 0.9), 0.9);
        assert_eq!(noise.channel(0, Quantity::JointPosition, "elbow").read(0.9, 5), 0.9);
    }
}
