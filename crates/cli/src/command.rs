//! The command line: its verbs and what all of them share.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::console::Console;
use crate::error::CliError;
use crate::{
    add, check, compare, demo, diagnose, discover, effects, fit, frf, info, linearize, modes, report,
    simulate, stiffness, trial,
};

/// Compare a robot's model with its measurements, find the missing effect, watch the error fall.
#[derive(Debug, Parser)]
#[command(
    name = "sinew",
    version,
    after_help = "ROBOT is a sidecar (arm.sinew.toml) or a URDF; RUN is a file, a window FILE@FROM..TO in s,\nor FILE#N, the Nth recording of a file whose clock starts anew.\nStart with `sinew demo`.\nExit status: 0 done, 1 the answer is no (check), 2 wrong usage or input."
)]
pub(crate) struct Command {
    /// Print one JSON object on standard output and nothing else
    #[arg(long, global = true)]
    json: bool,
    /// No progress and no messages, only results and errors
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Show the whole loop on an embedded arm with a hidden effect, and write a report
    Demo(demo::Demo),
    /// Read everything and say what is missing, suspicious or not excited
    Check(check::Check),
    /// What a robot is: degrees of freedom, masses, elastic joints, effects, modes at rest
    Info(info::Info),
    /// Simulate a robot under torques or behind a controller
    Simulate(simulate::Simulate),
    /// Error per joint and signal against the noise floor; where and when the model fails
    Compare(compare::Compare),
    /// Which effect is missing, how sure, its rivals, and what would separate them
    Diagnose(diagnose::Diagnose),
    /// Add effects to a robot, with start values
    Add(add::Add),
    /// Estimate the parameters; error before and after
    Fit(fit::Fit),
    /// Diagnose, add and fit until nothing is left that the catalogue explains
    Discover(discover::Discover),
    /// How often the search would accept an effect on surrogates of these runs, where nothing is missing
    Trial(trial::Trial),
    /// Natural frequencies, damping and mode shapes at rest, and what takes part in each
    Modes(modes::Modes),
    /// Frequency response from one signal to another, with resonances and antiresonances
    Frf(frf::Frf),
    /// How far the tool gives way to a force or moment: compliance, stiffness, deflection under a load
    Stiffness(stiffness::Stiffness),
    /// A, B, C, D with names, for python-control, MATLAB and everybody else
    Linearize(linearize::Linearize),
    /// List the catalogue, or show one effect
    Effects(effects::Effects),
    /// Write the page: verdict, ladder and views in one HTML file
    Report(report::Report),
}

impl Command {
    /// Does what was asked.
    pub fn run(self) -> Result<ExitCode, CliError> {
        let console = Console { json: self.json, quiet: self.quiet };
        match self.verb {
            Verb::Check(check) => return check.run(&console),
            Verb::Demo(demo) => demo.run(&console)?,
            Verb::Info(info) => info.run(&console)?,
            Verb::Simulate(simulate) => simulate.run(&console)?,
            Verb::Compare(compare) => compare.run(&console)?,
            Verb::Diagnose(diagnose) => diagnose.run(&console)?,
            Verb::Add(add) => add.run(&console)?,
            Verb::Fit(fit) => fit.run(&console)?,
            Verb::Discover(discover) => discover.run(&console)?,
            Verb::Trial(trial) => trial.run(&console)?,
            Verb::Modes(modes) => modes.run(&console)?,
            Verb::Frf(frf) => frf.run(&console)?,
            Verb::Stiffness(stiffness) => stiffness.run(&console)?,
            Verb::Linearize(linearize) => linearize.run(&console)?,
            Verb::Effects(effects) => effects.run(&console)?,
            Verb::Report(report) => report.run(&console)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        <Command as clap::CommandFactory>::command().debug_assert();
    }
}
