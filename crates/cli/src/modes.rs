//! `sinew modes`: natural frequencies, damping, mode shapes, and what takes part in each.

use clap::Args;
use serde_json::{Value, json};
use sinew_linear::{Mode, Modes as Found, Share, modes_with};
use sinew_report::{modes_view, number};

use crate::console::Console;
use crate::error::CliError;
use crate::plot_file::PlotFile;
use crate::rest_argument::{Rest, place};
use crate::table::{percent, table};

/// Arguments of `sinew modes`.
#[derive(Debug, Args)]
pub(crate) struct Modes {
    #[command(flatten)]
    rest: Rest,
    #[command(flatten)]
    plot: PlotFile,
}

impl Modes {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        self.plot.check()?;
        let robot = self.rest.read(console)?;
        let plant = &robot.plant;
        let found = modes_with(plant, &plant.parameters(), &robot.q, &robot.options)
            .map_err(|source| CliError::linear(&robot.file, source))?;
        self.plot.write(|| modes_view(&plant.model().name, &found.modes))?;
        let answer = json!({
            "at": place(plant, &found.at),
            "modes": found.modes.iter().map(object).collect::<Vec<_>>(),
            "described": self.rest.described(&found.described, plant.model()),
            "shape_norm": "unit modal mass, largest entry positive",
        });
        console.answer(&answer, || self.rest.heading(plant, &found.at, &found.described) + &text(&found))
    }
}

fn object(mode: &Mode) -> Value {
    let shares =
        |s: &[Share]| s.iter().map(|s| json!({ "part": s.part, "share": s.share })).collect::<Vec<_>>();
    let shape = mode
        .shape
        .iter()
        .map(|(name, value)| json!({ "coordinate": name, "value": value }))
        .collect::<Vec<_>>();
    json!({
        "omega": mode.omega,
        "omega_squared": mode.omega_squared,
        "frequency_hz": mode.frequency,
        "damping_ratio": mode.damping_ratio,
        "poles": mode.poles.iter().map(|l| [l.re, l.im]).collect::<Vec<_>>(),
        "stable": mode.stable,
        "shape": shape,
        "participation": shares(&mode.participation),
        "motion": shares(&mode.motion),
        "words": in_words(mode),
    })
}

fn text(found: &Found) -> String {
    let row = |(k, mode): (usize, &Mode)| {
        vec![
            format!("{}", k + 1),
            frequency(mode),
            mode.damping_ratio.map_or_else(|| "–".to_owned(), percent),
            listed(&mode.participation),
            listed(&mode.motion),
        ]
    };
    let header = [">mode", ">frequency", ">damping", "what bends", "what moves"];
    let mut text = table(&header, found.modes.iter().enumerate().map(row)) + "\n";
    let told: Vec<String> = found.modes.iter().enumerate().filter_map(|(k, m)| remark(k, m)).collect();
    if !told.is_empty() {
        text += &format!("\n{}\n", told.join("\n"));
    }
    text + "\n" + &shapes(&found.modes)
}

fn frequency(mode: &Mode) -> String {
    match mode.omega_squared {
        w if w > 0.0 => format!("{} Hz", number(mode.frequency)),
        0.0 => "free".to_owned(),
        _ => "falls over".to_owned(),
    }
}

// The three largest shares that matter.
fn listed(shares: &[Share]) -> String {
    let told = shares.iter().filter(|s| s.share.abs() >= 0.01).take(3);
    let words: Vec<String> = told.map(share).collect();
    if words.is_empty() { "–".to_owned() } else { words.join(", ") }
}

fn share(share: &Share) -> String {
    let size = format!("{:.0} %", 100.0 * share.share.abs());
    if share.share < 0.0 {
        format!("{} pushes over {size}", share.part)
    } else {
        format!("{} {size}", share.part)
    }
}

fn in_words(mode: &Mode) -> String {
    if mode.participation.is_empty() { listed(&mode.motion) } else { listed(&mode.participation) }
}

// What the table cannot say of a mode.
fn remark(k: usize, mode: &Mode) -> Option<String> {
    let fastest = mode.poles.iter().map(|l| l.re).fold(0.0, f64::max);
    let doubling = || format!("its motion doubles every {} s", number(core::f64::consts::LN_2 / fastest));
    let what = match mode.omega_squared {
        w if w < 0.0 && mode.stable => "is held up by damping alone".to_owned(),
        w if w < 0.0 => format!("is unstable: gravity is stronger than what holds it; {}", doubling()),
        _ if !mode.stable => format!("is unstable: an effect puts energy in; {}", doubling()),
        0.0 => "meets no stiffness: a rigid-body motion of exactly zero frequency".to_owned(),
        _ => return None,
    };
    Some(format!("mode {} {what}", k + 1))
}

// One row a coordinate, one column a mode, each mode by its largest entry.
fn shapes(modes: &[Mode]) -> String {
    const COLUMNS: usize = 12;
    let mut text = String::new();
    for (block, modes) in modes.chunks(COLUMNS).enumerate() {
        let names: Vec<String> =
            (0..modes.len()).map(|k| format!(">mode {}", block * COLUMNS + k + 1)).collect();
        let header: Vec<&str> =
            std::iter::once("shape, by its largest entry").chain(names.iter().map(String::as_str)).collect();
        let row = |i: usize| {
            let entry = |mode: &Mode| {
                let largest = mode.shape.iter().map(|s| s.1.abs()).fold(0.0, f64::max);
                // no minus before a zero
                format!("{:.3}", (1e3 * mode.shape[i].1 / largest).round() / 1e3 + 0.0)
            };
            std::iter::once(modes[0].shape[i].0.clone()).chain(modes.iter().map(entry)).collect()
        };
        let coordinates = modes.first().map_or(0, |m| m.shape.len());
        text += &(table(&header, (0..coordinates).map(row)) + "\n");
    }
    text
}
