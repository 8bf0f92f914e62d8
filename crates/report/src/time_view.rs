//! Measured, predicted and residual over time.

use sinew_identify::{SignalError, Trace};

use crate::ReportInput;
use crate::channel::{extent, limits, residual, traces};
use crate::decimate::decimate;
use crate::frame::Frame;
use crate::number::prefix;
use crate::svg::Svg;

const SIDES: (f64, f64) = (64.0, 910.0);

/// The channel in the run that nothing was fitted to, else in the first.
pub(crate) fn time_view(input: &ReportInput, signal: &SignalError) -> Option<(String, String)> {
    let before = traces(input.before, signal);
    let unseen = before.iter().find(|t| input.unseen.contains(&t.run));
    let shown = unseen.or(before.first())?;
    let fitted = input.after.map(|c| traces(c, signal)).unwrap_or_default();
    let after = fitted.into_iter().find(|t| t.run == shown.run);
    Some((draw(shown, after), shown.run.clone()))
}

fn draw(before: &Trace, after: Option<&Trace>) -> String {
    let title = format!("{} of {} over time", before.signal, before.joint);
    let text = "Above: measured and predicted. Below: measured minus predicted, for each model.";
    let mut svg = Svg::new(920.0, 400.0, &title, text);
    let start = before.time.first().copied().unwrap_or(0.0);
    let across = (0.0, before.time.last().map_or(1.0, |t| t - start));
    let (measured, predicted) = (extent(&before.measured), extent(&before.predicted));
    let (low, high) = (measured.0.min(predicted.0), measured.1.max(predicted.1));
    let (factor, letter) = prefix(high.max(-low), &before.unit);
    let margin = 0.06 * (high - low);
    let upper = Frame::new(SIDES, (10.0, 190.0), across, ((low - margin) * factor, (high + margin) * factor));
    upper.draw(&mut svg, "", &format!("{letter}{}", before.unit));
    curve(&mut svg, &upper, "measured", before, &before.measured, factor);
    curve(&mut svg, &upper, "before", before, &before.predicted, factor);
    if let Some(after) = after {
        curve(&mut svg, &upper, "after", after, &after.predicted, factor);
    }
    let (was, now) = (residual(before), after.map(residual));
    let ends = limits([was.as_slice()]);
    let (factor, letter) = prefix(ends.1, &before.unit);
    let lower = Frame::new(SIDES, (215.0, 355.0), across, (ends.0 * factor, ends.1 * factor));
    lower.draw(&mut svg, "time / s", &format!("residual, {letter}{}", before.unit));
    curve(&mut svg, &lower, "before", before, &was, factor);
    if let (Some(after), Some(now)) = (after, now) {
        curve(&mut svg, &lower, "after", after, &now, factor);
    }
    svg.finish()
}

fn curve(svg: &mut Svg, frame: &Frame, class: &str, trace: &Trace, values: &[f64], factor: f64) {
    let start = trace.time.first().copied().unwrap_or(0.0);
    let points = decimate(&trace.time, values, |t| frame.x.at(t - start));
    let points: Vec<_> = points.into_iter().map(|(x, v)| (x, frame.y.at(v * factor))).collect();
    svg.polyline(&format!("curve {class}"), &points);
}
