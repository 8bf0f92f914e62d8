//! `sinew frf`: how one signal answers to another, by frequency.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use sinew_data::SignalName;
use sinew_linear::{Bode, Peak, Transfer, linearize_with};
use sinew_model::Model;
use sinew_report::{bode_view, number};

use crate::console::Console;
use crate::error::CliError;
use crate::plot_file::PlotFile;
use crate::rest_argument::{Rest, place, positive};
use crate::table::{percent, table};

/// Arguments of `sinew frf`.
#[derive(Debug, Args)]
pub(crate) struct Frf {
    #[command(flatten)]
    rest: Rest,
    /// The signal that is imposed: motor_torque.J, or an output such as motor_position.J, which the torque of the same
    /// joint then makes move as told
    #[arg(long, value_name = "SIGNAL")]
    from: String,
    /// The signal that answers: motor_position.J, motor_velocity.J, joint_position.J, joint_velocity.J or joint_torque.J
    #[arg(long, value_name = "SIGNAL")]
    to: String,
    /// Lowest frequency, Hz; default a tenth of the slowest pole or zero that is not at zero
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    low: Option<f64>,
    /// Highest frequency, Hz; default ten times the fastest pole or zero
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    high: Option<f64>,
    /// The response as a table (.csv): frequency_Hz, magnitude, phase_rad
    #[arg(short, long, value_name = "TABLE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    plot: PlotFile,
}

impl Frf {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        self.plot.check()?;
        let robot = self.rest.read(console)?;
        let wrong = |source| CliError::linear(&robot.file, source);
        let plant = &robot.plant;
        let linear = linearize_with(plant, &plant.parameters(), &robot.q, &robot.options).map_err(wrong)?;
        let transfer = Transfer::new(&linear, &self.from, &self.to).map_err(wrong)?;
        let bode = transfer.bode(&self.grid(&transfer)?);
        let unit = unit(&self.to, &self.from, plant.model());
        if let Some(path) = &self.output {
            write(path, &bode)?;
        }
        self.plot.write(|| bode_view(&transfer, &bode, &unit))?;
        let peaks = |peaks: Vec<Peak>| peaks.iter().map(object).collect::<Vec<_>>();
        let pairs = |roots: &[faer::c64]| roots.iter().map(|s| [s.re, s.im]).collect::<Vec<_>>();
        let degrees: Vec<f64> = bode.phase.iter().map(|p| p.to_degrees()).collect();
        let answer = json!({
            "from": self.from, "to": self.to, "unit": unit, "at": place(plant, &linear.at),
            "frequency_hz": bode.frequency, "magnitude": bode.magnitude, "phase_deg": degrees,
            "resonances": peaks(transfer.resonances()), "antiresonances": peaks(transfer.antiresonances()),
            "poles": pairs(&transfer.poles), "zeros": pairs(&transfer.zeros),
            "gain": transfer.gain, "delay": transfer.delay,
            "described": self.rest.described(&linear.described, plant.model()),
        });
        console.answer(&answer, || {
            let heading = self.rest.heading(plant, &linear.at, &linear.described);
            heading + &self.text(&transfer, &bode, &unit)
        })
    }

    fn grid(&self, transfer: &Transfer) -> Result<Vec<f64>, CliError> {
        let whole = transfer.grid();
        let end = |given: Option<f64>, name: &str, default: f64| match given {
            Some(f) => possible(name, positive(name, f, "Hz")?),
            None => Ok(default),
        };
        let low = end(self.low, "--low", whole[0])?;
        let default = whole[whole.len() - 1].max(10.0 * low).min(Transfer::FASTEST);
        let high = end(self.high, "--high", default)?;
        if low >= high {
            let what = format!("no range (got {low} to {high} Hz, allowed --low below --high)");
            return Err(CliError::usage("--low, --high", what, "leave both out to see everything"));
        }
        Ok(transfer.grid_between(low, high))
    }

    fn text(&self, transfer: &Transfer, bode: &Bode, unit: &str) -> String {
        let mut text = format!("{} to {}, {unit}\n\n", self.from, self.to);
        let mut all: Vec<(Peak, &str)> = Vec::new();
        all.extend(transfer.resonances().into_iter().map(|p| (p, "resonance")));
        all.extend(transfer.antiresonances().into_iter().map(|p| (p, "antiresonance")));
        all.sort_by(|a, b| a.0.omega.total_cmp(&b.0.omega));
        let row = |(peak, kind): &(Peak, &str)| {
            let frequency = format!("{} Hz", number(peak.frequency));
            vec![(*kind).to_owned(), frequency, percent(peak.damping_ratio), number(peak.magnitude)]
        };
        if all.is_empty() {
            text += "no resonance and no antiresonance: every pole and zero is at zero or damped by more than 71 %\n";
        } else {
            let magnitude = format!(">|G|, {unit}");
            text += &(table(&["", ">frequency", ">damping", &magnitude], all.iter().map(row)) + "\n");
        }
        if let Some(words) = self.held(transfer) {
            text += &format!("\n{words}\n");
        }
        if transfer.poles.iter().any(|p| p.re > 1e-9 * p.norm()) {
            text += "\nunstable: a response is measured only in a loop that holds the arm\n";
        }
        let row = |k: usize| {
            let decibel = 20.0 * bode.magnitude[k].log10();
            let phase = bode.phase[k].to_degrees();
            [bode.frequency[k], bode.magnitude[k], decibel, phase].map(number).to_vec()
        };
        const ROWS: usize = 24;
        let step = bode.frequency.len().div_ceil(ROWS).max(1);
        let header = [">Hz", ">|G|", ">dB", ">phase, °"];
        text + "\n" + &table(&header, (0..bode.frequency.len()).step_by(step).map(row)) + "\n"
    }

    // What an antiresonance of a drive means.
    fn held(&self, transfer: &Transfer) -> Option<String> {
        let (from, joint) = self.from.split_once('.')?;
        let (to, same) = self.to.split_once('.')?;
        let first = transfer.antiresonances().first().copied()?;
        (from == "motor_torque" && to.starts_with("motor_") && joint == same).then(|| {
            format!(
                "at the antiresonances, first {} Hz, the motor of {joint} stands: they are the resonances of the arm with this motor held",
                number(first.frequency)
            )
        })
    }
}

// A frequency at which a robot is looked at.
fn possible(argument: &str, f: f64) -> Result<f64, CliError> {
    let (least, most) = (Transfer::SLOWEST, Transfer::FASTEST);
    if (least..=most).contains(&f) {
        return Ok(f);
    }
    let what = format!("no frequency of a robot (got {f:e} Hz, allowed {least:e} to {most:e} Hz)");
    Err(CliError::usage(argument, what, "leave it out to see every pole and zero"))
}

fn object(peak: &Peak) -> Value {
    json!({
        "frequency_hz": peak.frequency, "omega": peak.omega,
        "damping_ratio": peak.damping_ratio, "magnitude": peak.magnitude,
    })
}

// The unit of `to` by that of `from`.
fn unit(to: &str, from: &str, model: &Model) -> String {
    let of = |name: &str| {
        let name: Option<SignalName> = name.parse().ok();
        let joint = name.as_ref().and_then(|n| model.joint(&n.place));
        let sliding = joint.is_some_and(|j| model.joints[j.0].kind.slides());
        name.map_or("", |n| n.quantity.unit(sliding))
    };
    match (of(to), of(from)) {
        (above, below) if above == below => "1".to_owned(),
        (above, below) => format!("({above})/({below})"),
    }
}

fn write(path: &PathBuf, bode: &Bode) -> Result<(), CliError> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv")) {
        let place = path.display().to_string();
        return Err(CliError::usage(
            place,
            "no format of a response (allowed csv)",
            "end the name with .csv",
        ));
    }
    let row = |k: usize| format!("{},{},{}\n", bode.frequency[k], bode.magnitude[k], bode.phase[k]);
    let rows: String = (0..bode.frequency.len()).map(row).collect();
    std::fs::write(path, format!("frequency_Hz,magnitude,phase_rad\n{rows}"))
        .map_err(|source| CliError::Write { path: path.clone(), source })
}
