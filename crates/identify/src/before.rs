//! What is checked before any physics: a failed check refuses the runs, a suspicion is the first finding.

use sinew_data::{Note, Run, Severity, check_run};
use sinew_effect::Catalogue;
use sinew_model::Robot;

use crate::comparison::Prepared;
use crate::report::Finding;
use crate::torque_checks::torque_notes;
use crate::{IdentifyError, Options};

/// Suspicions about runs, as findings; `prepared`: the same runs.
///
/// # Errors
/// The first check that fails outright, unless the options go on all the same.
pub(crate) fn checked(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    prepared: &Prepared,
    options: &Options,
) -> Result<Vec<Finding>, IdentifyError> {
    let mut notes: Vec<Note> = runs.iter().flat_map(check_run).collect();
    notes.extend(torque_notes(robot, catalogue, prepared, options));
    notes.retain(|n| n.severity != Severity::Note);
    if let Some(fatal) = notes.iter().find(|n| n.severity == Severity::Error && !options.force) {
        let help = format!("{}; or go on all the same with --force", fatal.help);
        return Err(IdentifyError::run(&fatal.place, fatal.statement.clone(), help));
    }
    notes.sort_by_key(|n| n.severity);
    let still = (0..robot.model.nv).filter(|&dof| prepared.sensors.imposed[dof].is_none());
    Ok(still.map(|dof| held(robot.model.dof_name(dof))).chain(notes.into_iter().map(finding)).collect())
}

// A joint of which no run has a position.
fn held(joint: &str) -> Finding {
    Finding {
        joint: joint.to_owned(),
        signal: String::new(),
        regime: "data".to_owned(),
        statement: format!("{joint}: no position in the runs; taken as held at zero, and not compared"),
        share: 0.0,
    }
}

fn finding(note: Note) -> Finding {
    // `QUANTITY.JOINT` at the end of the place or at the start of the statement.
    let words = note.place.rsplit([' ', ':']).next().into_iter().chain(note.statement.split([' ', ':']));
    let named = words.filter_map(|w| w.split_once('.')).find(|(quantity, _)| quantity.contains('_'));
    let (signal, joint) = named.unwrap_or(("", ""));
    Finding {
        joint: joint.to_owned(),
        signal: signal.to_owned(),
        regime: "data".to_owned(),
        statement: format!("{}: {}", note.place, note.statement),
        share: 0.0,
    }
}
