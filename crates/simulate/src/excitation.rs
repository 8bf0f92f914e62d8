//! The shapes of motion that bring out what a robot is made of, in closed form.

use core::f64::consts::TAU;

use crate::trajectory::smooth_step;
use crate::{Point, Stream};

/// A shape of motion about zero that stays within ± amplitude and within ± speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    shape: Shape,
    scale: f64,
}

/// How far and how fast a motion may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest distance from the centre, rad (m).
    pub amplitude: f64,
    /// Largest speed, rad/s (m/s).
    pub speed: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Hold,
    // Σ a_k sin(kωt + φ_k); ω, then a_k and φ_k.
    Fourier { omega: f64, terms: Vec<(f64, f64)> },
    Strokes { omega: f64 },
    Chirp { from: f64, to: f64 },
    Steps { period: f64, move_time: f64, levels: Vec<f64> },
    Reversals { omega: f64 },
}

// How round the turns of strokes are: 1 is a triangle.
const ROUNDNESS: f64 = 0.995;
// Samples a period on which the largest value of a Fourier sum is looked for, and the margin for what lies between.
const SCAN: usize = 64;
const MARGIN: f64 = 1.005;

impl Excitation {
    /// Stays at zero.
    pub fn hold() -> Self {
        Self { shape: Shape::Hold, scale: 0.0 }
    }

    /// A periodic sum of `harmonics` of 1/`period`, of falling size and random phases; as large as the limits let
    /// it be.
    ///
    /// ```text
    /// s = c Σ_k sin(kωt + φ_k)/k,   k = 1 … n,   ω = 2π/T
    /// ```
    pub fn fourier(seed: u64, harmonics: usize, period: f64, limits: Limits) -> Self {
        let phases = Stream::new(seed, "fourier");
        let term = |k: usize| (1.0 / (k + 1) as f64, TAU * phases.uniform(k as u64));
        let shape = Shape::Fourier { omega: TAU / period, terms: (0..harmonics).map(term).collect() };
        Self::within(shape, period, SCAN * harmonics.max(1), limits)
    }

    /// Slow strokes to and fro at almost constant speed, the turns rounded.
    ///
    /// ```text
    /// s = A arcsin(κ sin ωt)/arcsin κ
    /// ```
    pub fn strokes(limits: Limits) -> Self {
        // Speed in the middle of a stroke: A ω κ/arcsin κ.
        let omega = limits.speed * ROUNDNESS.asin() / (limits.amplitude * ROUNDNESS);
        Self { shape: Shape::Strokes { omega }, scale: limits.amplitude }
    }

    /// A sine whose frequency rises from `from` to `to` Hz over its part.
    ///
    /// ```text
    /// s = A sin 2π(f₀ t + (f₁ − f₀) t²/2T)
    /// ```
    pub fn chirp(from: f64, to: f64, limits: Limits) -> Self {
        let fastest = TAU * from.max(to);
        Self { shape: Shape::Chirp { from, to }, scale: limits.amplitude.min(limits.speed / fastest) }
    }

    /// `count` random levels, each held for `dwell` s, with moves of least jerk between them; over again when they
    /// are used up.
    pub fn steps(seed: u64, count: usize, dwell: f64, limits: Limits) -> Self {
        let random = Stream::new(seed, "steps");
        let levels: Vec<f64> = (0..count).map(|k| 2.0 * random.uniform(k as u64) - 1.0).collect();
        let jump = |k: usize| (levels[(k + 1) % count] - levels[k]).abs();
        let largest = (0..count).map(jump).fold(0.0, f64::max).max(levels.first().map_or(0.0, |l| l.abs()));
        // Greatest speed of a move of least jerk: 15/8 of the mean.
        let move_time = (1.875 * largest * limits.amplitude / limits.speed).max(f64::MIN_POSITIVE);
        Self { shape: Shape::Steps { period: move_time + dwell, move_time, levels }, scale: limits.amplitude }
    }

    /// Small reversals of `frequency` Hz that grow from nothing to the limits over their part.
    ///
    /// ```text
    /// s = A (t/T) sin ωt
    /// ```
    pub fn reversals(frequency: f64, limits: Limits) -> Self {
        let omega = TAU * frequency;
        // |ṡ| ≤ A (ω + 1/T), and a part has a period at least.
        let scale = limits.amplitude.min(limits.speed / (omega + frequency));
        Self { shape: Shape::Reversals { omega }, scale }
    }

    // The shape as large as the limits let it be.
    fn within(shape: Shape, period: f64, samples: usize, limits: Limits) -> Self {
        let unit = Self { shape, scale: 1.0 };
        let (mut far, mut fast) = (0.0f64, 0.0f64);
        for k in 0..samples {
            let point = unit.at(period * k as f64 / samples as f64, period);
            far = far.max(point.position.abs());
            fast = fast.max(point.velocity.abs());
        }
        let scale = (limits.amplitude / far).min(limits.speed / fast) / MARGIN;
        Self { scale: if scale.is_finite() { scale } else { 0.0 }, ..unit }
    }

    /// The shape at `t` s after its part began, which lasts `duration` s.
    pub fn at(&self, t: f64, duration: f64) -> Point {
        let unit = match &self.shape {
            Shape::Hold => Point::default(),
            Shape::Fourier { omega, terms } => fourier(*omega, terms, t),
            Shape::Strokes { omega } => strokes(*omega, t),
            Shape::Chirp { from, to } => chirp(*from, *to, t, duration),
            Shape::Steps { period, move_time, levels } => steps(*period, *move_time, levels, t),
            Shape::Reversals { omega } => {
                let (sin, cos) = (omega * t).sin_cos();
                Point {
                    position: t * sin / duration,
                    velocity: (sin + omega * t * cos) / duration,
                    acceleration: (2.0 * cos - omega * t * sin) * omega / duration,
                }
            }
        };
        Point {
            position: self.scale * unit.position,
            velocity: self.scale * unit.velocity,
            acceleration: self.scale * unit.acceleration,
        }
    }
}

fn fourier(omega: f64, terms: &[(f64, f64)], t: f64) -> Point {
    let mut sum = Point::default();
    for (k, &(a, phase)) in terms.iter().enumerate() {
        let w = omega * (k + 1) as f64;
        let (sin, cos) = (w * t + phase).sin_cos();
        sum.position += a * sin;
        sum.velocity += a * w * cos;
        sum.acceleration -= a * w * w * sin;
    }
    sum
}

fn strokes(omega: f64, t: f64) -> Point {
    let (sin, cos) = (omega * t).sin_cos();
    let (k, full) = (ROUNDNESS, ROUNDNESS.asin());
    // With r² = 1 − κ² sin²: ṡ = κ ω cos/r, s̈ = −κ ω² sin (1 − κ²)/r³
    let r = (1.0 - k * k * sin * sin).sqrt();
    Point {
        position: (k * sin).asin() / full,
        velocity: k * omega * cos / (r * full),
        acceleration: -k * omega * omega * sin * (1.0 - k * k) / (r * r * r * full),
    }
}

fn chirp(from: f64, to: f64, t: f64, duration: f64) -> Point {
    let rise = TAU * (to - from) / duration;
    let w = TAU * from + rise * t;
    let (sin, cos) = (TAU * from * t + 0.5 * rise * t * t).sin_cos();
    Point { position: sin, velocity: w * cos, acceleration: rise * cos - w * w * sin }
}

// A move, then a dwell, for each level in turn; the first move starts from zero.
fn steps(period: f64, move_time: f64, levels: &[f64], t: f64) -> Point {
    if levels.is_empty() {
        return Point::default();
    }
    let k = (t / period) as usize;
    let from = if k == 0 { 0.0 } else { levels[(k - 1) % levels.len()] };
    let jump = levels[k % levels.len()] - from;
    let s = smooth_step(t - k as f64 * period, move_time);
    Point {
        position: from + jump * s.position,
        velocity: jump * s.velocity,
        acceleration: jump * s.acceleration,
    }
}
