//! Drawings of Cartesian stiffness: how far a unit force or moment moves the tool, and where in the workspace how much.

use sinew_linear::{CartesianStiffness, StiffnessPoint};

use crate::drawing::Drawing;
use crate::frame::Frame;
use crate::number::{prefix, quantity};
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

/// Colours of the map, from little to much: class names `heat0` … of the style sheet.
const HEATS: usize = 8;
const PANEL: f64 = 270.0;
const CIRCLE: usize = 96;

/// Where a force or moment of one unit in any direction of a plane moves the tool, in the three planes of the base.
///
/// The upper row are shifts by a force of 1 N, the lower one turns by a moment of 1 N·m; each row has one scale. The curve
/// is what the 3 × 3 block of C makes of a circle.
pub fn compliance_view(told: &CartesianStiffness, link: &str) -> Drawing {
    let title = format!("compliance of {link}");
    let text =
        "Each curve is where forces of one newton (moments of one newton metre) in a plane move the tool.";
    let mut svg = Svg::new(920.0, 640.0, &title, text);
    let rows = [(3, "m", "shift by a force of 1 N"), (0, "rad", "turn by a moment of 1 N·m")];
    for (row, (first, unit, name)) in rows.into_iter().enumerate() {
        let block = told.compliance.fixed_view::<3, 3>(first, first).into_owned();
        let largest = block.symmetric_eigenvalues().max().max(f64::MIN_POSITIVE);
        let (factor, letter) = prefix(largest, unit);
        let top = 40.0 + 310.0 * row as f64;
        svg.text("label", Anchor::Start, (20.0, top - 16.0), &format!("{name}, {letter}{unit}"));
        for (panel, (a, b)) in [(0, 2), (0, 1), (1, 2)].into_iter().enumerate() {
            let left = 70.0 + 300.0 * panel as f64;
            let range = 1.15 * largest * factor;
            let (across, up) = ((left, left + PANEL - 50.0), (top, top + PANEL - 50.0));
            let frame = Frame::new(across, up, (-range, range), (-range, range));
            frame.draw(&mut svg, ["x", "y", "z"][a], ["x", "y", "z"][b]);
            let point = |k: usize| {
                let (s, c) = (core::f64::consts::TAU * k as f64 / CIRCLE as f64).sin_cos();
                let x = factor * (block[(a, a)] * c + block[(a, b)] * s);
                let y = factor * (block[(b, a)] * c + block[(b, b)] * s);
                (frame.x.at(x), frame.y.at(y))
            };
            svg.polygon("ellipse", &(0..CIRCLE).map(point).collect::<Vec<_>>());
        }
    }
    Drawing { title, element: svg.finish() }
}

/// Every point of a grid or path at the place of the tool, coloured by how much it gives way there: by its deflection
/// under the load, or by the softest direction if there is none. Points that do not bear the load are crossed out.
pub fn workspace_view(points: &[StiffnessPoint], link: &str) -> Drawing {
    let loaded = points.iter().any(|p| p.deflection.is_some());
    let name = if loaded { "shift under the load" } else { "shift by 1 N in the softest direction" };
    let values: Vec<Option<f64>> = points.iter().map(|p| shift(p, loaded)).collect();
    let known = || values.iter().flatten();
    let (low, high) = known().fold((f64::INFINITY, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    let (a, b) = widest(points);
    let range = |k: usize| {
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (p.place[k].min(low), p.place[k].max(high))
        });
        let margin = 0.05 * (high - low).max(1e-3);
        (low - margin, high + margin)
    };
    let title = format!("{name} of {link}");
    let mut svg = Svg::new(920.0, 640.0, &title, "Each dot is one configuration.");
    let frame = Frame::new((80.0, 740.0), (30.0, 570.0), range(a), range(b));
    let axis = |k: usize| format!("{} of {link}, m", ["x", "y", "z"][k]);
    frame.draw(&mut svg, &axis(a), &axis(b));
    let heat = |v: f64| {
        let share = if high > low { (v / low).ln() / (high / low).ln() } else { 0.0 };
        ((share * HEATS as f64) as usize).min(HEATS - 1)
    };
    for (point, value) in points.iter().zip(&values) {
        let (x, y) = (frame.x.at(point.place[a]), frame.y.at(point.place[b]));
        match value {
            Some(v) => svg.dot(&format!("heat{}", heat(*v)), (x, y), 4.0),
            None => {
                svg.line("lost", (x - 4.0, y - 4.0), (x + 4.0, y + 4.0));
                svg.line("lost", (x - 4.0, y + 4.0), (x + 4.0, y - 4.0));
            }
        }
    }
    if low.is_finite() && low > 0.0 {
        legend(&mut svg, name, low, high);
    }
    Drawing { title, element: svg.finish() }
}

// How far the point gives way, m.
fn shift(point: &StiffnessPoint, loaded: bool) -> Option<f64> {
    if loaded {
        return point.deflection.map(|x| x.fixed_rows::<3>(3).norm());
    }
    let compliance = point.compliance_with_gravity.filter(|_| point.stable)?;
    Some(compliance.fixed_view::<3, 3>(3, 3).into_owned().symmetric_eigenvalues().max())
}

// The two axes of the base along which the tool moves most, in their order.
fn widest(points: &[StiffnessPoint]) -> (usize, usize) {
    let spread = |k: usize| {
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (p.place[k].min(low), p.place[k].max(high))
        });
        high - low
    };
    // Of equals the later one is left out last: z is what people look at.
    let narrow = (0..3).min_by(|&i, &j| spread(i).total_cmp(&spread(j))).unwrap_or(1);
    match narrow {
        0 => (1, 2),
        1 => (0, 2),
        _ => (0, 1),
    }
}

fn legend(svg: &mut Svg, name: &str, low: f64, high: f64) {
    let scale = Scale::logarithmic(low, high, 570.0, 30.0);
    for k in 0..HEATS {
        let step = 540.0 / HEATS as f64;
        let top = 570.0 - step * (k + 1) as f64;
        svg.rect(&format!("heat{k}"), (770.0, top), (18.0, step));
    }
    for value in [low, (low * high).sqrt(), high] {
        svg.text("tick", Anchor::Start, (796.0, scale.at(value) + 4.0), &quantity(value, "m"));
    }
    svg.upward("name", (890.0, 300.0), name);
}
