//! The residual against another quantity: a cloud of points, its median and the band of four fifths.

use sinew_identify::SignalError;

use crate::ReportInput;
use crate::bins::bins;
use crate::channel::{Channel, extent, limits};
use crate::frame::Frame;
use crate::number::prefix;
use crate::svg::Svg;

const BINS: usize = 30;
const POINTS: usize = 900;

/// What the residual is drawn against.
#[derive(Clone, Copy)]
pub(crate) enum Against {
    Velocity,
    Position,
}

impl Against {
    fn name(self) -> &'static str {
        match self {
            Against::Velocity => "velocity",
            Against::Position => "position",
        }
    }
    fn of(self, channel: &Channel) -> &[f64] {
        match self {
            Against::Velocity => &channel.speed,
            Against::Position => &channel.position,
        }
    }
}

/// The residual of a channel before and after the fit; none if the abscissa does not vary.
pub(crate) fn scatter_view(
    against: Against,
    signal: &SignalError,
    before: &Channel,
    after: Option<&Channel>,
    input: &ReportInput,
) -> Option<String> {
    let across = extent(against.of(before));
    if across.0 >= across.1 {
        return None;
    }
    let ends = limits([before.residual.as_slice()]);
    let (factor, letter) = prefix(ends.1, &signal.unit);
    let title = format!("residual of {} at {} against {}", signal.signal, signal.joint, against.name());
    let text = "Points, their median as a line, and a band that holds four fifths of them.";
    let mut svg = Svg::new(450.0, 280.0, &title, text);
    let frame = Frame::new((64.0, 442.0), (10.0, 235.0), across, (ends.0 * factor, ends.1 * factor));
    let position = crate::channel::position_unit(input, &signal.joint);
    let unit = match against {
        Against::Velocity => format!("{position}/s"),
        Against::Position => position.to_owned(),
    };
    frame.draw(
        &mut svg,
        &format!("{} / {unit}", against.name()),
        &format!("residual, {letter}{}", signal.unit),
    );
    for (class, channel) in [("before", Some(before)), ("after", after)] {
        if let Some(channel) = channel {
            cloud(&mut svg, &frame, class, against.of(channel), channel, factor);
        }
    }
    for (class, channel) in [("before", Some(before)), ("after", after)] {
        if let Some(channel) = channel {
            spread(&mut svg, &frame, class, against.of(channel), channel, (across, factor));
        }
    }
    Some(svg.finish())
}

fn cloud(svg: &mut Svg, frame: &Frame, class: &str, x: &[f64], channel: &Channel, factor: f64) {
    let every = x.len().div_ceil(POINTS).max(1);
    for k in (0..x.len()).step_by(every) {
        svg.dot(&format!("point {class}"), (frame.x.at(x[k]), frame.y.at(channel.residual[k] * factor)), 1.2);
    }
}

fn spread(
    svg: &mut Svg,
    frame: &Frame,
    class: &str,
    x: &[f64],
    channel: &Channel,
    (across, factor): ((f64, f64), f64),
) {
    let bins = bins(x, &channel.residual, across, BINS);
    let at = |middle: f64, value: f64| (frame.x.at(middle), frame.y.at(value * factor));
    let mut band: Vec<_> = bins.iter().map(|b| at(b.middle, b.high)).collect();
    band.extend(bins.iter().rev().map(|b| at(b.middle, b.low)));
    svg.polygon(&format!("band {class}"), &band);
    let median: Vec<_> = bins.iter().map(|b| at(b.middle, b.median)).collect();
    svg.polyline(&format!("median {class}"), &median);
}
