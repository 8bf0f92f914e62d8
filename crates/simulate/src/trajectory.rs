//! Reference trajectories: what a robot is told to do.

use crate::Excitation;

/// A point of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// rad (m).
    pub position: f64,
    /// rad/s (m/s).
    pub velocity: f64,
    /// rad/s² (m/s²).
    pub acceleration: f64,
}

/// The motions of all joints, side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// One motion for each degree of freedom.
    pub joints: Vec<Motion>,
}

/// The motion of one joint: excitations one after the other, each beginning and ending at rest in the centre.
///
/// Beginning and end take a tenth of a part, at most 1 s, and add up to 1.9 · amplitude/ramp to its speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Where it rests, rad (m).
    pub centre: f64,
    /// The parts and how long each takes, s. After the last it rests.
    pub parts: Vec<(f64, Excitation)>,
}

impl Trajectory {
    /// Where degree of freedom `dof` should be at `t`.
    ///
    /// # Panics
    /// If there is no such degree of freedom.
    pub fn at(&self, dof: usize, t: f64) -> Point {
        self.joints[dof].at(t)
    }
}

// Share of a part that its beginning takes, and its end.
const RAMP: f64 = 0.1;
// Longest beginning or end, s.
const LONGEST_RAMP: f64 = 1.0;

impl Motion {
    /// A motion that stays where it is.
    pub fn hold(centre: f64) -> Self {
        Self { centre, parts: Vec::new() }
    }

    /// One excitation for `duration` s.
    pub fn one(centre: f64, duration: f64, excitation: Excitation) -> Self {
        Self { centre, parts: vec![(duration, excitation)] }
    }

    /// Time until it rests for good, s.
    pub fn duration(&self) -> f64 {
        self.parts.iter().map(|(duration, _)| duration).sum()
    }

    /// Where it is at `t`; at rest before 0.
    ///
    /// ```text
    /// r = centre + w(t) s(t),   w smooth from 0 to 1 and back to 0 within each part
    /// ```
    pub fn at(&self, t: f64) -> Point {
        let mut start = 0.0;
        for (duration, excitation) in &self.parts {
            if t >= start && t < start + duration {
                let s = excitation.at(t - start, *duration);
                let w = window(t - start, *duration);
                return Point {
                    position: self.centre + w.position * s.position,
                    velocity: w.velocity * s.position + w.position * s.velocity,
                    acceleration: w.acceleration * s.position
                        + 2.0 * w.velocity * s.velocity
                        + w.position * s.acceleration,
                };
            }
            start += duration;
        }
        Point { position: self.centre, ..Point::default() }
    }
}

// Up, stay, down: with continuous acceleration.
fn window(t: f64, duration: f64) -> Point {
    let ramp = (RAMP * duration).min(LONGEST_RAMP);
    if t < ramp {
        return smooth_step(t, ramp);
    }
    let down = smooth_step(duration - t, ramp);
    Point { velocity: -down.velocity, ..down }
}

/// From 0 to 1 in time T with the least jerk: x = 10 s³ − 15 s⁴ + 6 s⁵, s = t/T; 0 before, 1 after.
pub(crate) fn smooth_step(t: f64, duration: f64) -> Point {
    let s = (t / duration).clamp(0.0, 1.0);
    Point {
        position: s * s * s * (10.0 + s * (6.0 * s - 15.0)),
        velocity: 30.0 * s * s * (1.0 - s) * (1.0 - s) / duration,
        acceleration: 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (duration * duration),
    }
}
