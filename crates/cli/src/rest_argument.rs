//! Where a robot is taken for linear, and over which motion.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sinew_linear::{Amplitude, Described, Equilibrium, Nonlinear, Options, Port};
use sinew_model::Model;
use sinew_plant::Plant;
use sinew_report::number;
use sinew_urdf::RobotFile;

use crate::console::Console;
use crate::error::CliError;
use crate::inputs;
use crate::position_argument::position;

/// The robot, its position, and what is done with effects that are not linear.
#[derive(Debug, Args)]
pub(crate) struct Rest {
    /// Sidecar or URDF
    pub robot: PathBuf,
    /// Position of the links at rest: "q1,…" in rad (m), or "joint=value,…"; joints not named are 0
    #[arg(long, value_name = "Q", allow_hyphen_values = true, default_value = "")]
    pub at: String,
    /// Effects that are not linear over the amplitude: their describing functions, a refusal, or their slopes at the
    /// very point
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Treatment::Describe)]
    nonlinear: Treatment,
    /// Amplitude of the motion over which effects are taken for linear, rad (m)
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, default_value_t = Amplitude::default().size)]
    amplitude: f64,
    /// Frequency of that motion, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, default_value_t = Amplitude::default().frequency)]
    frequency: f64,
}

/// What is done with effects that are not linear.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Treatment {
    /// The gains that carry the same first harmonic
    Describe,
    /// No linear model
    Refuse,
    /// Their slopes at the very point
    Slope,
}

/// A robot that was read, where it rests, and how it is taken for linear.
pub(crate) struct AtRest {
    pub file: RobotFile,
    pub plant: Plant,
    pub q: Vec<f64>,
    pub options: Options,
}

impl Rest {
    /// Reads the robot and the position.
    pub fn read(&self, console: &Console) -> Result<AtRest, CliError> {
        let file = inputs::robot(&self.robot)?;
        for note in &file.notes {
            console.say(&note.to_string());
        }
        let plant = inputs::plant(&file)?;
        let q = position(&self.at, &file.robot.model)?;
        let amplitude = Amplitude {
            size: positive("--amplitude", self.amplitude, "rad (m)")?,
            frequency: positive("--frequency", self.frequency, "Hz")?,
        };
        let nonlinear = match self.nonlinear {
            Treatment::Describe => Nonlinear::Describe(amplitude),
            Treatment::Refuse => Nonlinear::Refuse(amplitude),
            Treatment::Slope => Nonlinear::Slope,
        };
        if !plant.elastic().contains(&true) && plant.virtual_joints().is_empty() {
            console.say(&format!(
                "{}: no joint is elastic and no link bends: what swings is held by gravity and by effects alone\n  help: state `stiffness` in [joints.…] of {}",
                inputs::name(&file),
                file.sidecar.file()
            ));
        }
        Ok(AtRest { file, plant, q, options: Options { nonlinear } })
    }

    /// What is said before a table: where the robot rests, and what stands for effects that are not linear.
    pub fn heading(&self, plant: &Plant, at: &Equilibrium, described: &[Described]) -> String {
        let model = plant.model();
        let joint = |dof: &usize| format!("{} {}", model.dof_name(*dof), number(at.q[*dof]));
        let place: Vec<String> = plant.joints().iter().map(joint).collect();
        let mut text = format!("{} at rest at {}\n", model.name, place.join(", "));
        for effect in described.iter().filter(|d| !d.gains.is_empty()) {
            text += &format!(
                "{} is not linear over {} rad (m) at {} Hz; for it stands {}\n",
                effect.effect,
                number(self.amplitude),
                number(self.frequency),
                in_words(effect, model)
            );
        }
        text + "\n"
    }

    /// The same for programs.
    pub fn described(&self, described: &[Described], model: &Model) -> Value {
        let gain = |g: &sinew_linear::Gain| {
            json!({
                "follows": port(g.input, model), "acts_on": port(g.output, model),
                "stiffness": 0.0 - g.position, "damping": 0.0 - g.rate,
            })
        };
        let one = |d: &Described| {
            let gains: Vec<Value> = d.gains.iter().map(gain).collect();
            json!({ "effect": d.effect, "amplitude": self.amplitude, "frequency_hz": self.frequency, "gains": gains })
        };
        described.iter().map(one).collect()
    }
}

/// Where a robot rests, by the names of the linear model.
pub(crate) fn place(plant: &Plant, at: &Equilibrium) -> Value {
    let mut entries = serde_json::Map::new();
    let mut add = |quantity: &str, values: &[f64], told: &dyn Fn(usize) -> bool| {
        for &dof in plant.joints().iter().filter(|dof| told(**dof)) {
            entries.insert(format!("{quantity}.{}", plant.model().dof_name(dof)), json!(values[dof]));
        }
    };
    add("q", &at.q, &|_| true);
    add("theta", &at.theta, &|dof| plant.elastic()[dof]);
    add("motor_torque", &at.tau_m, &|_| true);
    for v in plant.virtual_joints() {
        entries.insert(plant.coordinate(v), json!(at.q[v.dof]));
    }
    Value::Object(entries)
}

fn in_words(effect: &Described, model: &Model) -> String {
    let gain = |g: &sinew_linear::Gain| {
        let part = |value: f64, what: &str, unit: &str| {
            (value != 0.0).then(|| format!("a {what} of {} {unit}", number(value)))
        };
        let parts = [part(-g.position, "stiffness", "N·m/rad"), part(-g.rate, "damping", "N·m·s/rad")];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        format!("{} at {}", parts.join(" and "), port(g.output, model))
    };
    effect.gains.iter().map(gain).collect::<Vec<_>>().join("; ")
}

fn port(port: Port, model: &Model) -> String {
    match port {
        Port::Motor(dof) => format!("motor {}", model.dof_name(dof)),
        Port::Link(dof) => format!("link {}", model.dof_name(dof)),
        Port::Spring(dof) => format!("spring {}", model.dof_name(dof)),
    }
}

/// A number that must be greater than zero.
pub(crate) fn positive(argument: &str, value: f64, unit: &str) -> Result<f64, CliError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    let what = format!("must be greater than zero (got {value} {unit})");
    Err(CliError::usage(argument, what, "give a positive number, or leave it out for the default"))
}
