//! `sinew check`: what is missing or suspicious, before any physics.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;
use sinew_data::{Note, Quantity, Run, RunSpec, Severity, check_run, find_repeats};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, range_checks, readiness, strangers, torque_checks, unlocated};
use sinew_model::Robot;

use crate::console::Console;
use crate::error::CliError;
use crate::inputs::{self, Columns};

/// Arguments of `sinew check`.
#[derive(Debug, Args)]
pub(crate) struct Check {
    /// Sidecar or URDF
    robot: PathBuf,
    /// Measured runs, each FILE or FILE@FROM..TO; FILE#N: the Nth recording of a file
    #[arg(value_name = "RUN")]
    runs: Vec<RunSpec>,
    #[command(flatten)]
    columns: Columns,
}

/// The answer: `ok` unless a problem is an error; notes do not count as problems.
#[derive(Debug, Serialize)]
struct Answer {
    ok: bool,
    /// What of the runs the other commands compare.
    #[serde(skip_serializing_if = "Option::is_none")]
    scope: Option<String>,
    problems: Vec<Note>,
    notes: Vec<Note>,
}

impl Check {
    pub fn run(&self, console: &Console) -> Result<ExitCode, CliError> {
        let file = inputs::robot(&self.robot)?;
        let mut runs = Vec::new();
        let mut unreadable = Vec::new();
        for run in self.columns.read_each(&self.runs)? {
            match run {
                Ok(run) => runs.push(run),
                Err(error) => unreadable.push(error),
            }
        }
        if self.runs.len() == 1
            && let Some(only) = unreadable.pop()
        {
            return Err(only);
        }
        let mut all: Vec<Note> = file.notes.iter().map(of_robot).collect();
        all.extend(unreadable.iter().map(of_reading));
        for run in &runs {
            all.extend(run.notes.iter().cloned());
            all.extend(missing(&file.robot, run));
            all.extend(check_run(run));
        }
        all.extend(strangers(&file.robot, &runs));
        all.extend(unlocated(&file.robot, &runs));
        let is_refused = all.iter().any(|n| n.severity == Severity::Error);
        let mut scope = None;
        if !runs.is_empty() && !is_refused {
            match readiness(&file.robot, &CATALOGUE, &runs, &Options::default()) {
                Ok(compared) => scope = Some(compared),
                Err(error) => all.push(of_reading(&CliError::from(error))),
            }
        }
        all.extend(repeats(&runs));
        all.extend(range_checks(&file.robot, &runs));
        all.extend(torque_checks(&file.robot, &CATALOGUE, &runs, &Options::default()));
        let (notes, mut problems): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|n| n.severity == Severity::Note);
        problems.sort_by_key(|n| n.severity);
        let ok = problems.iter().all(|n| n.severity != Severity::Error);
        let answer = Answer { ok, scope: scope.filter(|_| ok), problems, notes };
        console.answer(&answer, || text(&answer))?;
        Ok(match answer.ok {
            _ if !unreadable.is_empty() => ExitCode::from(2),
            true => ExitCode::SUCCESS,
            false => ExitCode::from(1),
        })
    }
}

fn text(answer: &Answer) -> String {
    let mut out = String::new();
    for note in answer.problems.iter().chain(&answer.notes) {
        out += &format!("{note}\n");
    }
    if let Some(scope) = &answer.scope {
        out += &format!("{scope}\n");
    }
    let errors = answer.problems.iter().filter(|n| n.severity == Severity::Error).count();
    let warnings = answer.problems.len() - errors;
    let word = if answer.ok { "usable" } else { "not usable" };
    let notes = answer.notes.len();
    out + &format!(
        "{word}: {}, {}, {}\n",
        count(errors, "error"),
        count(warnings, "warning"),
        count(notes, "note")
    )
}

fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

fn of_robot(note: &sinew_urdf::Note) -> Note {
    let severity = match note.severity {
        sinew_urdf::Severity::Warning => Severity::Warning,
        sinew_urdf::Severity::Note => Severity::Note,
    };
    Note { severity, place: note.place.clone(), statement: note.statement.clone(), help: note.help.clone() }
}

// Why a run could not be read: `place: statement`, and the way out in a line of its own.
fn of_reading(error: &CliError) -> Note {
    let text = error.to_string();
    let (what, help) = text.split_once("\n  help: ").unwrap_or((&text, "correct the file"));
    let (place, statement) = what.split_once(": ").unwrap_or(("run", what));
    let [place, statement, help] = [place, statement, help].map(str::to_owned);
    Note { severity: Severity::Error, place, statement, help }
}

// What a comparison needs and the run does not have, and what it has and the robot does not.
fn missing(robot: &Robot, run: &Run) -> Vec<Note> {
    let names: Vec<&str> = (0..robot.model.nv).map(|dof| robot.model.dof_name(dof)).collect();
    let mut notes = Vec::new();
    let mut tell = |severity, statement: String, help: String| {
        notes.push(Note { severity, place: run.name.clone(), statement, help });
    };
    if names.is_empty() {
        let statement = format!("robot \"{}\" has no joint that moves", robot.model.name);
        tell(
            Severity::Error,
            statement,
            "give the URDF's joints a type that moves: revolute, continuous, prismatic".to_owned(),
        );
        return notes;
    }
    let measured = run.joints();
    let (seen, unseen): (Vec<usize>, Vec<usize>) =
        (0..names.len()).partition(|&dof| measured.contains(&names[dof]) || names.len() == 1);
    if !unseen.is_empty() {
        let unseen: Vec<&str> = unseen.iter().map(|&dof| names[dof]).collect();
        let joints = sinew_identify::listed(&unseen);
        let statement = format!("no position of {joints}: the other commands take that as held at zero");
        let severity = if seen.is_empty() { Severity::Error } else { Severity::Warning };
        tell(severity, statement, "log what moved; fix the rest in the URDF (type=\"fixed\")".to_owned());
    }
    let positions = [Quantity::MotorPosition, Quantity::JointPosition];
    let moves = |dof: usize| positions.into_iter().any(|q| run.signal(q, names[dof]).is_some());
    let any_moves = (0..names.len()).any(moves);
    for dof in seen {
        let joint = names[dof];
        let has = |quantity| run.signal(quantity, joint).is_some();
        if !moves(dof) {
            let (severity, taken) = match any_moves {
                true => (Severity::Warning, "the other commands take it as held at zero"),
                false => (Severity::Error, "its motion cannot be imposed on the model"),
            };
            let statement = format!("no position of joint \"{joint}\": {taken}");
            tell(severity, statement, format!("log motor_position.{joint} or joint_position.{joint}"));
        }
        if robot.joints[dof].stiffness.is_some() && moves(dof) && !has(Quantity::MotorPosition) {
            let statement = format!(
                "no motor position of the elastic joint \"{joint}\": the other commands impose the link's and leave the spring before it out"
            );
            tell(Severity::Warning, statement, format!("log motor_position.{joint}"));
        }
        let torques = [Quantity::MotorTorque, Quantity::MotorCurrent, Quantity::JointTorque];
        if !torques.iter().any(|q| has(*q)) {
            let statement =
                format!("no torque of joint \"{joint}\": its friction and inertia cannot be seen");
            tell(Severity::Warning, statement, format!("log motor_torque.{joint}"));
        }
        if robot.joints[dof].stiffness.is_some() && !has(Quantity::JointPosition) {
            let statement = format!(
                "no link-side position of the elastic joint \"{joint}\": its spring is seen only through the torque"
            );
            tell(
                Severity::Note,
                statement,
                format!("log joint_position.{joint} if the joint has a second encoder"),
            );
        }
    }
    notes
}

// A part that repeats a fitted command is not unseen.
fn repeats(runs: &[Run]) -> Vec<Note> {
    let note = |r: &sinew_data::Repeat| Note {
        severity: Severity::Warning,
        place: runs[r.first].name.clone(),
        statement: r.statement(runs),
        help: "do not fit one and check on the other: that is no unseen motion".to_owned(),
    };
    find_repeats(runs).iter().map(note).collect()
}
