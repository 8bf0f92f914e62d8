//! `sinew linearize`: A, B, C, D with names, for python-control, MATLAB and everybody else.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sinew_linear::{
    Reduced, StateSpace, balanced_truncation, discretize, linearize_with, modal_truncation, poles,
};
use sinew_plant::Plant;
use sinew_report::number;

use crate::console::Console;
use crate::error::CliError;
use crate::rest_argument::{AtRest, Rest, place, positive};

/// Arguments of `sinew linearize`.
#[derive(Debug, Args)]
pub(crate) struct Linearize {
    #[command(flatten)]
    rest: Rest,
    /// Inputs to keep, as motor_torque.J; all without
    #[arg(long, value_name = "SIGNAL", value_delimiter = ',')]
    from: Vec<String>,
    /// Outputs to keep, as joint_position.J; all without
    #[arg(long, value_name = "SIGNAL", value_delimiter = ',')]
    to: Vec<String>,
    /// Reduce to this many states
    #[arg(long, value_name = "STATES")]
    order: Option<usize>,
    /// How the order is reduced
    #[arg(long, value_enum, default_value_t = Method::Balanced, requires = "order")]
    method: Method,
    /// Time between samples, s: the system that a computer sees, inputs held between
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    sample_time: Option<f64>,
    /// The model: .json, .mat (MATLAB) or .npz (NumPy)
    #[arg(short, long, value_name = "MODEL")]
    output: Option<PathBuf>,
}

/// How the order is reduced.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Method {
    /// Balanced truncation: the smallest error, with a bound
    Balanced,
    /// The slowest modes, two states each; the others follow without inertia
    Modal,
}

/// The formats of a linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Json,
    Mat,
    Npz,
}

impl Linearize {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let format = self.output.as_deref().map(format_of).transpose()?;
        let robot = self.rest.read(console)?;
        let (linear, reduced) = self.model(&robot)?;
        let mut answer = object(&robot.plant, &linear);
        answer["described"] = self.rest.described(&linear.described, robot.plant.model());
        if let Some(reduced) = &reduced {
            answer["reduction"] =
                json!({ "hankel": reduced.hankel, "kept": reduced.kept, "bound": reduced.bound });
        }
        if let (Some(path), Some(format)) = (&self.output, format) {
            let bytes = match format {
                Format::Json => {
                    let text = serde_json::to_string_pretty(&answer).map_err(CliError::Json)?;
                    format!("{text}\n").into_bytes()
                }
                Format::Mat => linear.to_mat(),
                Format::Npz => linear.to_npz(),
            };
            std::fs::write(path, bytes).map_err(|source| CliError::Write { path: path.clone(), source })?;
            answer["written"] = json!(path.display().to_string());
        }
        let stable = slowest(&robot, &linear)?;
        console.answer(&answer, || {
            let mut text = self.rest.heading(&robot.plant, &linear.at, &linear.described);
            text += &format!(
                "{} states: {}\n{} inputs: {}\n{} outputs: {}\n{stable}\n",
                linear.states.len(),
                linear.states.join(", "),
                linear.inputs.len(),
                linear.inputs.join(", "),
                linear.outputs.len(),
                linear.outputs.join(", ")
            );
            if let Some(reduced) = &reduced {
                text += &in_words(reduced);
            }
            if let (Some(path), Some(format)) = (&self.output, format) {
                text += &format!("\n{}: {}\n", path.display(), how_to_load(format, path));
            }
            text
        })
    }

    // The model that was asked for, and what its reduction lost where that has a bound.
    fn model(&self, robot: &AtRest) -> Result<(StateSpace, Option<Reduced>), CliError> {
        let wrong = |source| CliError::linear(&robot.file, source);
        let (plant, p) = (&robot.plant, robot.plant.parameters());
        let part = |whole: StateSpace| whole.part(&self.from, &self.to).map_err(wrong);
        let (linear, reduced) = match (self.order, self.method) {
            (Some(order), Method::Modal) => {
                if order % 2 == 1 {
                    let what = format!("must be even for modes, which have two states each (got {order})");
                    return Err(CliError::usage("--order", what, "give twice the number of modes"));
                }
                let modal = modal_truncation(plant, &p, &robot.q, &robot.options, order / 2);
                (part(modal.map_err(wrong)?)?, None)
            }
            (order, _) => {
                let whole = part(linearize_with(plant, &p, &robot.q, &robot.options).map_err(wrong)?)?;
                match order {
                    None => (whole, None),
                    Some(order) => {
                        let reduced = balanced_truncation(&whole, order).map_err(wrong)?;
                        (reduced.model.clone(), Some(reduced))
                    }
                }
            }
        };
        let linear = match self.sample_time {
            None => linear,
            Some(h) => discretize(&linear, positive("--sample-time", h, "s")?).map_err(wrong)?,
        };
        Ok((linear, reduced))
    }
}

/// The JSON object of a linear model.
fn object(plant: &Plant, linear: &StateSpace) -> Value {
    let rows = |m: &faer::Mat<f64>| -> Vec<Vec<f64>> {
        (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| m[(i, j)]).collect()).collect()
    };
    json!({
        "states": linear.states, "inputs": linear.inputs, "outputs": linear.outputs,
        "A": rows(&linear.A), "B": rows(&linear.B), "C": rows(&linear.C), "D": rows(&linear.D),
        "dt": linear.sample_time.unwrap_or(0.0),
        "input_delay": linear.input_delay, "output_delay": linear.output_delay,
        "at": place(plant, &linear.at),
    })
}

fn format_of(path: &Path) -> Result<Format, CliError> {
    let place = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let format = match extension.as_str() {
        "json" => Format::Json,
        "mat" => Format::Mat,
        "npz" => Format::Npz,
        other => {
            let what = format!("no format of a linear model (got \"{other}\", allowed json, mat, npz)");
            return Err(CliError::usage(place, what, "end the name with .json, .mat or .npz"));
        }
    };
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        return Err(CliError::usage(place, "there is no such folder", "make the folder first"));
    }
    Ok(format)
}

// What the poles say in a sentence.
fn slowest(robot: &AtRest, linear: &StateSpace) -> Result<String, CliError> {
    let poles = poles(&linear.A).map_err(|source| CliError::linear(&robot.file, source))?;
    // How far a pole is on the wrong side, against the size of all.
    let (scale, beyond): (f64, fn(&faer::c64) -> f64) = match linear.sample_time {
        None => (poles.iter().map(|l| l.norm()).fold(0.0, f64::max), |l| l.re),
        Some(_) => (1.0, |l| l.norm() - 1.0),
    };
    const ROUNDING: f64 = 1e-6;
    let unstable = poles.iter().filter(|l| beyond(l) > ROUNDING * scale).count();
    let free = poles.iter().filter(|l| beyond(l).abs() <= ROUNDING * scale).count();
    Ok(match (unstable, free) {
        (0, 0) => "stable: every motion dies out".to_owned(),
        (0, 1) => "not unstable: 1 pole neither dies out nor grows".to_owned(),
        (0, free) => format!("not unstable: {free} poles neither die out nor grow"),
        (1, _) => "unstable: 1 pole grows, as of an arm that falls over".to_owned(),
        (unstable, _) => format!("unstable: {unstable} poles grow, as of an arm that falls over"),
    })
}

fn in_words(reduced: &Reduced) -> String {
    let told = reduced.hankel.iter().take(12).map(|s| number(*s)).collect::<Vec<_>>().join(", ");
    let kept = match reduced.kept {
        0 => String::new(),
        k => format!("; {k} states that do not die out are kept as they are"),
    };
    format!(
        "Hankel singular values {told}; the error of no frequency is larger than {}{kept}\n",
        number(reduced.bound)
    )
}

fn how_to_load(format: Format, path: &Path) -> String {
    let path = path.display();
    match format {
        Format::Json => "one object with A, B, C, D by rows".to_owned(),
        Format::Npz => format!(
            "in Python m = numpy.load(\"{path}\"); sys = control.ss(m[\"A\"], m[\"B\"], m[\"C\"], m[\"D\"], float(m[\"dt\"]))"
        ),
        Format::Mat => format!("in MATLAB m = load('{path}'); sys = ss(m.A, m.B, m.C, m.D, m.dt)"),
    }
}
