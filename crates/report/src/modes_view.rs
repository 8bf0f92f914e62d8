//! Mode shapes: one panel a mode, one bar a coordinate.

use sinew_linear::{Mode, Share};

use crate::drawing::Drawing;
use crate::number::number;
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

const ROW: f64 = 17.0;
const PANEL: f64 = 440.0;
const COLUMNS: usize = 2;
const NAMES: f64 = 130.0;

/// The shapes of `modes` of the robot called `robot`, each by its largest entry: links, motors and what bends.
pub fn modes_view(robot: &str, modes: &[Mode]) -> Drawing {
    let coordinates = modes.first().map_or(0, |m| m.shape.len());
    let panel = ROW * coordinates as f64 + 66.0;
    let rows = modes.len().div_ceil(COLUMNS);
    let title = format!("mode shapes of {robot}");
    let text =
        "One panel for each mode, slowest first; one bar for each coordinate, by the largest of its mode.";
    let mut svg = Svg::new(PANEL * COLUMNS as f64 + 20.0, panel * rows as f64 + 40.0, &title, text);
    svg.text("heading", Anchor::Start, (12.0, 20.0), &title);
    key(&mut svg, modes);
    for (k, mode) in modes.iter().enumerate() {
        let (column, row) = (k % COLUMNS, k / COLUMNS);
        draw(&mut svg, k, mode, (10.0 + PANEL * column as f64, 40.0 + panel * row as f64));
    }
    Drawing { title, element: svg.finish() }
}

fn class(coordinate: &str) -> &'static str {
    match coordinate.split('.').next() {
        Some("theta") => "motor",
        Some("v") => "bend",
        _ => "link",
    }
}

// Which colour is which, where there is more than one.
fn key(svg: &mut Svg, modes: &[Mode]) {
    let used = |kind: &str| modes.first().is_some_and(|m| m.shape.iter().any(|s| class(&s.0) == kind));
    let mut x = PANEL * COLUMNS as f64 - 250.0;
    for (kind, name) in [("link", "link side"), ("motor", "motor side"), ("bend", "bending")] {
        if used(kind) {
            svg.rect(&format!("bar {kind}"), (x, 11.0), (10.0, 10.0));
            svg.text("tick", Anchor::Start, (x + 15.0, 20.0), name);
            x += 90.0;
        }
    }
}

fn draw(svg: &mut Svg, k: usize, mode: &Mode, (left, top): (f64, f64)) {
    let speed = match mode.omega_squared {
        w if w > 0.0 => format!("{} Hz", number(mode.frequency)),
        0.0 => "free".to_owned(),
        _ => "falls over".to_owned(),
    };
    let damping = mode.damping_ratio.map_or(String::new(), |d| format!(", damping {} %", number(100.0 * d)));
    svg.text("label", Anchor::Start, (left, top + 14.0), &format!("mode {}: {speed}{damping}", k + 1));
    let shares = if mode.participation.is_empty() { &mode.motion } else { &mode.participation };
    let words: Vec<String> = shares.iter().filter(|s| s.share.abs() >= 0.01).take(3).map(share).collect();
    svg.text("tick", Anchor::Start, (left, top + 30.0), &words.join(", "));
    let x = Scale::linear(-1.0, 1.0, left + NAMES, left + PANEL - 30.0);
    let bottom = top + 40.0 + ROW * mode.shape.len() as f64;
    svg.line("zero", (x.at(0.0), top + 38.0), (x.at(0.0), bottom));
    let largest = mode.shape.iter().map(|s| s.1.abs()).fold(0.0, f64::max);
    for (row, (name, value)) in mode.shape.iter().enumerate() {
        let (y, value) = (top + 40.0 + ROW * row as f64, value / largest);
        svg.text("tick", Anchor::End, (left + NAMES - 8.0, y + 11.0), name);
        let (from, to) = (x.at(value.min(0.0)), x.at(value.max(0.0)));
        svg.rect(&format!("bar {}", class(name)), (from, y + 3.0), (to - from, ROW - 6.0));
    }
}

fn share(share: &Share) -> String {
    let size = format!("{:.0} %", 100.0 * share.share.abs());
    if share.share < 0.0 {
        format!("{} pushes over {size}", share.part)
    } else {
        format!("{} {size}", share.part)
    }
}
