//! Bars: the residual by regime, in units of the noise floor.

use crate::number::number;
use crate::regimes::Regime;
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

const ROW: f64 = 30.0;
const LEFT: f64 = 150.0;
const RIGHT: f64 = 850.0;

/// One row a regime, a bar for each model; a line marks the floor.
pub(crate) fn regime_view(regimes: &[Regime], floor: f64) -> String {
    let height = ROW * regimes.len() as f64 + 52.0;
    let text = "For each regime of motion the root mean square of the residual divided by the noise floor.";
    let mut svg = Svg::new(920.0, height, "residual by regime", text);
    let largest = regimes.iter().map(|r| r.before.max(r.after.unwrap_or(0.0)) / floor).fold(1.0, f64::max);
    let x = Scale::linear(0.0, largest * 1.02, LEFT, RIGHT);
    let bottom = height - 46.0;
    for (value, label) in x.ticks(8) {
        svg.line("grid", (x.at(value), 4.0), (x.at(value), bottom));
        svg.text("tick", Anchor::Middle, (x.at(value), bottom + 16.0), &label);
    }
    svg.line("floor", (x.at(1.0), 4.0), (x.at(1.0), bottom));
    for (k, regime) in regimes.iter().enumerate() {
        let top = ROW * k as f64 + 8.0;
        svg.text("label", Anchor::End, (LEFT - 10.0, top + 14.0), &regime.name);
        let bars = [("before", Some(regime.before), 0.0), ("after", regime.after, 10.5)];
        for (class, value, shift) in bars {
            let Some(value) = value else { continue };
            let end = x.at(value / floor);
            svg.rect(&format!("bar {class}"), (LEFT, top + shift), (end - LEFT, 9.0));
            svg.text("tick", Anchor::Start, (end + 5.0, top + shift + 8.0), &number(value / floor));
        }
    }
    svg.text("name", Anchor::Middle, ((LEFT + RIGHT) / 2.0, bottom + 34.0), "rms residual / noise floor");
    svg.finish()
}
