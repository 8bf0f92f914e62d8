//! The ladder: one row a step, the error falling towards the floor.

use sinew_identify::StepReport;

use crate::number::number;
use crate::scale::Scale;
use crate::svg::{Anchor, Svg};

const ROW: f64 = 34.0;
const LEFT: f64 = 270.0;
const RIGHT: f64 = 780.0;

/// The error after each step, on the fitted runs and on the unseen ones, by decades.
pub(crate) fn ladder_view(steps: &[StepReport]) -> String {
    let height = ROW * steps.len() as f64 + 60.0;
    let text = "Each row adds effects to the model; the dots show the error in units of the noise floor.";
    let mut svg = Svg::new(920.0, height, "the ladder of errors", text);
    let floor = steps.first().map_or(1.0, |s| s.noise_floor);
    let all = || steps.iter().flat_map(|s| [Some(s.rms_error), s.check_rms_error]).flatten();
    let (low, high) = all().fold((floor, floor), |(a, b), v| (a.min(v), b.max(v)));
    let x = Scale::logarithmic(low.max(1e-3 * floor) * 0.85, high * 1.2, LEFT, RIGHT);
    let bottom = height - 46.0;
    for (value, label) in x.ticks(9) {
        svg.line("grid", (x.at(value), 4.0), (x.at(value), bottom));
        svg.text("tick", Anchor::Middle, (x.at(value), bottom + 16.0), &label);
    }
    svg.line("floor", (x.at(floor), 4.0), (x.at(floor), bottom));
    let middle = |k: usize| ROW * k as f64 + 22.0;
    rail(&mut svg, "seen", steps, |s| Some(x.at(s.rms_error)), middle);
    rail(&mut svg, "unseen", steps, |s| s.check_rms_error.map(|v| x.at(v)), middle);
    for (k, step) in steps.iter().enumerate() {
        let y = middle(k);
        let name = match step.added.as_slice() {
            [] if k == 0 => "as given".to_owned(),
            [] => "parameters fitted".to_owned(),
            added => format!("+ {}", added.join(" + ")),
        };
        svg.text("label", Anchor::End, (LEFT - 14.0, y + 4.0), &name);
        svg.dot("seen", (x.at(step.rms_error), y), 5.0);
        if let Some(check) = step.check_rms_error {
            svg.dot("unseen", (x.at(check), y), 7.5);
        }
        let check = step.check_rms_error.map_or(String::new(), |c| format!(", unseen {}", number(c)));
        svg.text(
            "tick",
            Anchor::Start,
            (RIGHT + 14.0, y + 4.0),
            &format!("{}{check}", number(step.rms_error)),
        );
    }
    svg.text(
        "name",
        Anchor::Middle,
        ((LEFT + RIGHT) / 2.0, bottom + 34.0),
        "rms error / noise floor, by decades",
    );
    svg.finish()
}

fn rail(
    svg: &mut Svg,
    class: &str,
    steps: &[StepReport],
    x: impl Fn(&StepReport) -> Option<f64>,
    y: impl Fn(usize) -> f64,
) {
    let points: Vec<_> = steps.iter().enumerate().filter_map(|(k, s)| Some((x(s)?, y(k)))).collect();
    svg.polyline(&format!("rail {class}"), &points);
}
