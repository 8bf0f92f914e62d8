//! A frequency response: magnitude and phase by decades, with resonances and antiresonances.

use sinew_linear::{Bode, Peak, Transfer};

use crate::decimate::decimate;
use crate::drawing::Drawing;
use crate::frame::Frame;
use crate::number::number;
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

const SIDES: (f64, f64) = (76.0, 910.0);
const ABOVE: (f64, f64) = (56.0, 320.0);
const BELOW: (f64, f64) = (344.0, 520.0);
/// Decades of magnitude that are drawn at most: deeper dips are cut off.
const DECADES: f64 = 7.0;
/// Labels nearer to each other than this share a place; the least damped keeps it.
const ROOM: f64 = 52.0;

/// Bode's diagram of `transfer` at the points of `bode`; `unit` is that of the magnitude.
pub fn bode_view(transfer: &Transfer, bode: &Bode, unit: &str) -> Drawing {
    let title = format!("{} to {}", transfer.from, transfer.to);
    let text = "Above: magnitude, both axes by decades. Below: phase in degrees. Dashed: resonances and antiresonances.";
    let mut svg = Svg::new(920.0, 570.0, &title, text);
    let across = (bode.frequency[0], bode.frequency[bode.frequency.len() - 1]);
    let finite = bode.magnitude.iter().copied().filter(|m| m.is_finite() && *m > 0.0);
    let (low, high) = finite.fold((f64::INFINITY, 0.0f64), |(l, h), m| (l.min(m), h.max(m)));
    let low = low.max(high * 10f64.powf(-DECADES));
    let magnitude = |b: f64, t: f64| Scale::logarithmic(low / 1.5, high * 1.5, b, t);
    let upper = Frame::by_decades(SIDES, ABOVE, across, magnitude);
    svg.text("heading", Anchor::Start, (SIDES.0, 18.0), &title);
    upper.draw(&mut svg, "", &format!("magnitude, {unit}"));
    let degrees: Vec<f64> = bode.phase.iter().map(|p| p.to_degrees()).collect();
    let (least, most) =
        degrees.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let phase = |b: f64, t: f64| Scale::degrees(least - 10.0, most + 10.0, b, t);
    let lower = Frame::by_decades(SIDES, BELOW, across, phase);
    lower.draw(&mut svg, "frequency / Hz", "phase, °");
    // Resonances are labelled above the magnitude, antiresonances below it.
    for (mut peaks, class, row) in
        [(transfer.resonances(), "peak", ABOVE.0 - 8.0), (transfer.antiresonances(), "dip", ABOVE.1 + 16.0)]
    {
        let mut taken: Vec<f64> = Vec::new();
        peaks.sort_by(|a, b| a.damping_ratio.abs().total_cmp(&b.damping_ratio.abs()));
        let inside = |p: &&Peak| p.frequency >= across.0 && p.frequency <= across.1;
        for peak in peaks.iter().filter(inside) {
            let x = upper.x.at(peak.frequency);
            for (top, bottom) in [ABOVE, BELOW] {
                svg.polyline(&format!("curve mark {class}"), &[(x, top), (x, bottom)]);
            }
            if taken.iter().all(|other| (other - x).abs() > ROOM) {
                taken.push(x);
                let label = format!("{} Hz", number(peak.frequency));
                svg.text(&format!("tag {class}"), Anchor::Middle, (x, row), &label);
            }
        }
    }
    for (frame, values) in [(&upper, &bode.magnitude), (&lower, &degrees)] {
        let points = decimate(&bode.frequency, values, |f| frame.x.at(f));
        let points: Vec<_> = points.into_iter().map(|(x, v)| (x, frame.y.at(v))).collect();
        svg.polyline("curve plain", &points);
    }
    Drawing { title, element: svg.finish() }
}
