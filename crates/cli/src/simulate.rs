//! `sinew simulate`: what a robot would do and what its sensors would log.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use sinew_data::{Quantity, Run, RunSpec};
use sinew_model::Model;
use sinew_simulate::{Drive, Noise, Options, Start, Torques, simulate};

use crate::console::Console;
use crate::error::{CliError, did_you_mean};
use crate::inputs::{self, Columns};
use crate::new_file;
use crate::noise_file;
use crate::position_argument::position;
use crate::tracking::{Tracking, held_at};

/// Arguments of `sinew simulate`.
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// Sidecar or URDF
    robot: PathBuf,
    /// A run with motor_torque.J, held between its times; or with joint_position.J to follow by --controller
    #[arg(long, value_name = "FILE")]
    input: RunSpec,
    #[command(flatten)]
    columns: Columns,
    /// Follow joint_position.J of the input
    #[arg(long)]
    controller: bool,
    /// Bandwidth of the controller, rad/s
    #[arg(long, value_name = "RAD_PER_S", default_value_t = 20.0, requires = "controller")]
    bandwidth: f64,
    /// Where the robot starts, at rest: "q1,…" or "joint=value,…"; default 0, or the first reference with the
    /// springs carrying gravity
    #[arg(long, value_name = "Q", allow_hyphen_values = true)]
    start: Option<String>,
    /// Noise and resolution of the sensors (TOML, as arm.run.toml), or none. That of a motor torque moves the joint: the
    /// log has the command
    #[arg(long, value_name = "FILE|none", default_value = "none")]
    noise: PathBuf,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The run (.csv, .csv.gz or .parquet)
    #[arg(short, long, value_name = "RUN")]
    output: PathBuf,
}

impl Simulate {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let read = [self.robot.clone(), self.input.path.clone(), self.noise.clone()];
        new_file::check(&self.output, inputs::RUNS, &read)?;
        let file = inputs::robot(&self.robot)?;
        let plant = inputs::plant(&file)?;
        let model = &file.robot.model;
        let input = self.columns.read(std::slice::from_ref(&self.input))?.remove(0);
        let start = match &self.start {
            Some(text) => position(text, model)?,
            None if self.controller => first_positions(&input, model),
            None => vec![0.0; model.nv],
        };
        let mut drive: Box<dyn Drive + '_> = if self.controller {
            self.check_bandwidth()?;
            require(
                console,
                &input,
                model,
                Quantity::JointPosition,
                "give joint_position.J, the positions to follow",
            )?;
            Box::new(Tracking::new(&file.robot, &input, &start, self.bandwidth))
        } else {
            require(
                console,
                &input,
                model,
                Quantity::MotorTorque,
                "give motor_torque.J, or joint_position.J and --controller",
            )?;
            Box::new(Torques::of_run(&input, &plant))
        };
        let mut options = Options::new(&plant, 1.0, 1.0).along(&input, &plant);
        let p = plant.parameters();
        options.start = if self.controller {
            held_at(&file.robot, &plant, &start)?
        } else {
            Start::sagging(&plant, &p, &start)?
        };
        options.noise = if self.noise == Path::new("none") {
            Noise::default()
        } else {
            noise_file::read(&self.noise, &file.robot.model)?
        };
        options.seed = self.seed;
        console.say("simulating …");
        let simulated = simulate(&plant, &p, drive.as_mut(), &options)?;
        simulated.run.write(&self.output)?;
        let audit = simulated.audit;
        let path = self.output.display();
        let answer = json!({
            "written": path.to_string(), "samples": simulated.run.time.len(), "duration": simulated.run.duration(),
            "energy": { "stored_change": audit.stored_change, "work_in": audit.work_in, "dissipated": audit.dissipated },
        });
        console.answer(&answer, || {
            let n = sinew_report::number;
            let (work, stored, lost) = (n(audit.work_in), n(audit.stored_change), n(audit.dissipated));
            format!(
                "{path}: {} samples; the motors put in {work} J, {stored} J are stored, {lost} J were lost\n",
                input.time.len()
            )
        })
    }

    fn check_bandwidth(&self) -> Result<(), CliError> {
        if self.bandwidth > 0.0 && self.bandwidth.is_finite() {
            return Ok(());
        }
        let what = format!("not a bandwidth (got {}, allowed > 0)", self.bandwidth);
        Err(CliError::usage("--bandwidth", what, "keep it below the first resonance of the joint"))
    }
}

// What drives the robot, with a word on columns of joints that it has not; an error if there is nothing else.
fn require(
    console: &Console,
    input: &Run,
    model: &Model,
    quantity: Quantity,
    help: &str,
) -> Result<(), CliError> {
    let places = || input.signals.iter().filter(|s| s.quantity == quantity).map(|s| s.place.as_str());
    if places().next().is_none() {
        return Err(CliError::usage(&input.name, format!("has no {quantity}"), help));
    }
    let Some(stranger) = places().find(|place| model.dof(place).is_none()) else { return Ok(()) };
    let joints: Vec<&str> = (0..model.nv).map(|dof| model.dof_name(dof)).collect();
    let meant = did_you_mean(stranger, &joints).map_or(String::new(), |meant| meant + " ");
    let help = format!("{meant}its joints: {}", joints.join(", "));
    let what = format!("{quantity}.{stranger}: robot \"{}\" has no such joint", model.name);
    if places().all(|place| model.dof(place).is_none()) {
        return Err(CliError::usage(&input.name, what, help));
    }
    console.say(&format!("note: {}: {what}: ignored\n  help: {help}", input.name));
    Ok(())
}

fn first_positions(input: &Run, model: &Model) -> Vec<f64> {
    let first = |dof| input.signal(Quantity::JointPosition, model.dof_name(dof)).map_or(0.0, |s| s.values[0]);
    (0..model.nv).map(first).collect()
}
