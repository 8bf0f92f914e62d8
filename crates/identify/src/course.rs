//! Squares of what a model leaves, row by row of a run.

use crate::residual::Layout;

/// Squares and counts of one run by row, all channels together, with the stamps of the rows.
pub(crate) struct Course {
    pub record: usize,
    pub time: Vec<f64>,
    pub squares: Vec<f64>,
    pub counts: Vec<f64>,
}

// The most of a run that one may take.
const LONGEST: f64 = 0.2;
// Rows of a peak.
const PEAK_ROWS: usize = 16;

impl Course {
    /// True if some rows are a short time of the run.
    pub fn is_short(&self, first: usize, end: usize) -> bool {
        (end - first) as f64 <= LONGEST * self.time.len() as f64
    }

    /// Sum of squares and count of some rows.
    pub fn sums(&self, first: usize, end: usize) -> (f64, f64) {
        (self.squares[first..end].iter().sum(), self.counts[first..end].iter().sum())
    }

    /// The largest mean square of a few rows.
    pub fn peak(&self) -> f64 {
        let last = self.time.len().saturating_sub(PEAK_ROWS);
        let means = (0..=last).map(|k| self.sums(k, (k + PEAK_ROWS).min(self.time.len())));
        means.map(|(square, count)| square / count.max(1.0)).fold(0.0, f64::max)
    }

    /// The rows with the largest sum of squares beyond `level` each: sum, first, end (Kadane's scan).
    pub fn highest(&self, level: f64) -> (f64, usize, usize) {
        let (mut best, mut sum, mut first) = ((0.0, 0, 0), 0.0f64, 0);
        for k in 0..self.time.len() {
            if sum <= 0.0 {
                (sum, first) = (0.0, k);
            }
            sum += self.squares[k] - level * self.counts[k];
            if sum > best.0 {
                best = (sum, first, k + 1);
            }
        }
        best
    }

    /// Only rows with such stamps count on.
    pub fn retain(&mut self, counts: impl Fn(f64) -> bool) {
        for k in (0..self.time.len()).filter(|&k| !counts(self.time[k])) {
            (self.squares[k], self.counts[k]) = (0.0, 0.0);
        }
    }
}

/// Those of whitened rows, a run after the other.
pub(crate) fn courses(layout: &Layout, white: &[f64], stamp: impl Fn(usize, usize) -> f64) -> Vec<Course> {
    let mut courses: Vec<Course> = Vec::new();
    for segment in &layout.segments {
        if courses.last().is_none_or(|c| c.record != segment.record) {
            courses.push(Course {
                record: segment.record,
                time: (0..segment.len).map(|row| stamp(segment.record, row)).collect(),
                squares: vec![0.0; segment.len],
                counts: vec![0.0; segment.len],
            });
        }
        let Some(course) = courses.last_mut() else { continue };
        for row in (0..segment.len).filter(|row| layout.keep[segment.first + row]) {
            course.squares[row] += white[segment.first + row].powi(2);
            course.counts[row] += 1.0;
        }
    }
    courses
}

/// Sum of squares and count of all runs.
pub(crate) fn total(courses: &[Course]) -> (f64, f64) {
    courses.iter().map(|c| c.sums(0, c.time.len())).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
}
