//! A scale: from values to places on the page, with round ticks.

use crate::number::number;

/// Linear or logarithmic map from values to pixels.
#[derive(Clone, Copy)]
pub(crate) struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Linear,
    Logarithmic,
    Degrees,
}

impl Scale {
    /// `low … high` onto `from … to`; an empty interval is widened.
    pub fn linear(low: f64, high: f64, from: f64, to: f64) -> Self {
        let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
        Self { low, high, from, to, kind: Kind::Linear }
    }

    /// The same by decades; both values must be positive.
    pub fn logarithmic(low: f64, high: f64, from: f64, to: f64) -> Self {
        Self { low, high: high.max(low * 1.001), from, to, kind: Kind::Logarithmic }
    }

    /// Linear, with ticks at parts of a turn.
    pub fn degrees(low: f64, high: f64, from: f64, to: f64) -> Self {
        Self { kind: Kind::Degrees, ..Self::linear(low, high, from, to) }
    }

    /// The place of a value, kept inside the scale.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.kind == Kind::Logarithmic {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// About `count` round values inside, with their labels.
    pub fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let values = match self.kind {
            Kind::Linear => self.steps(count, &[1.0, 2.0, 5.0, 10.0]),
            Kind::Logarithmic => self.decades(count),
            Kind::Degrees => self.turns(count),
        };
        values.into_iter().map(|v| (v, number(v).replace('-', "−"))).collect()
    }

    // Steps of some multiples of a power of ten.
    fn steps(&self, count: usize, multiples: &[f64]) -> Vec<f64> {
        let rough = (self.high - self.low) / count.max(1) as f64;
        let power = 10f64.powf(rough.log10().floor());
        let step = multiples.iter().map(|m| m * power).find(|s| *s >= rough * 0.999);
        self.multiples(step.unwrap_or(10.0 * power))
    }

    fn turns(&self, count: usize) -> Vec<f64> {
        const PARTS: [f64; 8] = [1.0, 5.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
        let rough = (self.high - self.low) / count.max(1) as f64;
        self.multiples(
            PARTS.into_iter().find(|s| *s >= rough * 0.999).unwrap_or((rough / 360.0).ceil() * 360.0),
        )
    }

    fn multiples(&self, step: f64) -> Vec<f64> {
        let (first, last) =
            ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        (first..=last).map(|k| k as f64 * step).collect()
    }

    fn decades(&self, count: usize) -> Vec<f64> {
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let inside = |m: &[f64]| -> Vec<f64> {
            let all = (first..=last).flat_map(|d| m.iter().map(move |m| m * 10f64.powi(d)));
            all.filter(|v| *v >= self.low * 0.999 && *v <= self.high * 1.001).collect()
        };
        let rich = inside(&[1.0, 2.0, 5.0]);
        if rich.len() <= count + 1 { rich } else { inside(&[1.0]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |s: Scale| s.ticks(5).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(labels(Scale::linear(-1.0, 1.0, 0.0, 1.0)), ["−1", "−0.5", "0", "0.5", "1"]);
        assert_eq!(labels(Scale::logarithmic(0.8, 30.0, 0.0, 1.0)), ["1", "2", "5", "10", "20"]);
        assert_eq!(labels(Scale::degrees(-185.0, 95.0, 0.0, 1.0)), ["−180", "−90", "0", "90"]);
    }

    #[test]
    fn ends_of_the_scale_are_ends_of_the_axis() {
        let scale = Scale::logarithmic(1.0, 100.0, 10.0, 30.0);
        assert_eq!((scale.at(1.0), scale.at(10.0).round(), scale.at(1e9)), (10.0, 20.0, 30.0));
    }
}
