//! The frame of a plot: two scales, a grid, ticks and the names of the axes.

use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

/// A rectangle of the drawing with a scale along each side.
pub(crate) struct Frame {
    pub x: Scale,
    pub y: Scale,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    /// A frame with linear scales; `across` and `up` are the ranges of values.
    pub fn new(left_right: (f64, f64), top_bottom: (f64, f64), across: (f64, f64), up: (f64, f64)) -> Self {
        let ((left, right), (top, bottom)) = (left_right, top_bottom);
        let x = Scale::linear(across.0, across.1, left, right);
        let y = Scale::linear(up.0, up.1, bottom, top);
        Self { x, y, left, right, top, bottom }
    }

    /// A frame whose axis across is by decades and whose other axis is as `up` makes it from bottom and top.
    pub fn by_decades(
        left_right: (f64, f64),
        top_bottom: (f64, f64),
        across: (f64, f64),
        up: impl Fn(f64, f64) -> Scale,
    ) -> Self {
        let ((left, right), (top, bottom)) = (left_right, top_bottom);
        let x = Scale::logarithmic(across.0, across.1, left, right);
        Self { x, y: up(bottom, top), left, right, top, bottom }
    }

    /// Grid, tick labels and names of the axes; an empty name leaves its tick labels out too.
    pub fn draw(&self, svg: &mut Svg, x_name: &str, y_name: &str) {
        for (value, label) in self.y.ticks(5) {
            let y = self.y.at(value);
            let class = if value == 0.0 { "zero" } else { "grid" };
            svg.line(class, (self.left, y), (self.right, y));
            svg.text("tick", Anchor::End, (self.left - 6.0, y + 3.5), &label);
        }
        svg.line("axis", (self.left, self.bottom), (self.right, self.bottom));
        if !x_name.is_empty() {
            for (value, label) in self.x.ticks(((self.right - self.left) / 90.0) as usize) {
                let x = self.x.at(value);
                svg.line("axis", (x, self.bottom), (x, self.bottom + 4.0));
                svg.text("tick", Anchor::Middle, (x, self.bottom + 16.0), &label);
            }
            let middle = (self.left + self.right) / 2.0;
            svg.text("name", Anchor::Middle, (middle, self.bottom + 33.0), x_name);
        }
        svg.upward("name", (self.left - 46.0, (self.top + self.bottom) / 2.0), y_name);
    }
}
