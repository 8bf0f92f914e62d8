//! What is checked before any physics: a failed check refuses the runs, a suspicion is the first finding.

use sinew_data::{Note, Quantity, Repeat, Run, Severity, check_run};
use sinew_effect::{Catalogue, Requirement};
use sinew_model::{EffectSpec, Place, Robot, nearest};

use crate::base::scope;
use crate::comparison::Prepared;
use crate::range_checks::range_checks;
use crate::record::{Sensors, all_have};
use crate::report::Finding;
use crate::tolerance::with_tolerance;
use crate::torque_checks::{torque_notes, turned_notes};
use crate::{IdentifyError, Options};

/// What every comparison and every search begins with: the robot as its runs measure it, the runs made ready, and what is
/// told before anything else.
///
/// # Errors
/// If a run lacks the signals or fails a check.
pub(crate) fn begun(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
) -> Result<(Robot, Prepared, Vec<Finding>), IdentifyError> {
    let unlocated = unlocated(robot, runs).into_iter().collect();
    suspicions(unlocated, options)?;
    let mut unknown = suspicions(strangers(robot, runs).into_iter().collect(), options)?;
    unknown.iter_mut().for_each(|finding| finding.joint = unknown_joints(robot, runs).join(", "));
    let (robot, mut findings) = as_measured(robot, catalogue, runs);
    findings.extend(unknown);
    let prepared = Prepared::new(&robot, runs, options)?;
    findings.extend(uncompared(&robot, &prepared.sensors));
    findings.extend(in_some_runs(&robot, runs));
    findings.extend(checked(&robot, catalogue, runs, &prepared, options)?);
    let (robot, finding) = with_tolerance(robot, catalogue, &prepared, options)?;
    findings.splice(0..0, finding);
    findings.extend(prepared.repeats.iter().map(|repeat| repeated(repeat, runs)));
    Ok((robot, prepared, findings))
}

/// What is suspicious about runs that nothing is fitted to, beside those that something is.
///
/// # Errors
/// If one of them fails a check, or lacks what the others have.
pub(crate) fn of_unseen(
    robot: &Robot,
    catalogue: &Catalogue,
    [runs, unseen]: [&[Run]; 2],
    options: &Options,
) -> Result<Vec<Finding>, IdentifyError> {
    if unseen.is_empty() {
        return Ok(Vec::new());
    }
    let robot = as_measured(robot, catalogue, runs).0;
    let mut notes: Vec<Note> = unseen.iter().flat_map(check_run).collect();
    notes.extend(range_checks(&robot, unseen));
    // What cannot be compared at all is told where it is compared.
    if let Ok(prepared) = Prepared::new(&robot, runs, options) {
        unseen.iter().try_for_each(|run| prepared.sensors.are_all_in(&robot, run))?;
        let all = Vec::from_iter(runs.iter().chain(unseen));
        notes.extend(turned_notes(&robot, catalogue, &all, &prepared, options));
    }
    suspicions(notes, options)
}

/// What of these runs is compared: how long they are, which signals, what is not seen in them.
///
/// # Errors
/// If they cannot be compared at all: nothing to compare, too short, nothing moves.
pub fn readiness(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
) -> Result<String, IdentifyError> {
    let robot = as_measured(robot, catalogue, runs).0;
    let prepared = Prepared::new(&robot, runs, options)?;
    Ok(scope(&robot, &prepared.sensors, runs))
}

/// The robot with the joints that no run measures held still and without the springs before links seen alone, and the
/// findings that say so.
pub(crate) fn as_measured(robot: &Robot, catalogue: &Catalogue, runs: &[Run]) -> (Robot, Vec<Finding>) {
    let (robot, still) = held(robot, runs);
    let (robot, behind) = seen_from_links(robot, catalogue, runs);
    (robot, still.into_iter().chain(behind).collect())
}

// The robot without the springs between motors whose position no run has and links whose position is imposed instead, and
// the finding that says so.
fn seen_from_links(robot: Robot, catalogue: &Catalogue, runs: &[Run]) -> (Robot, Option<Finding>) {
    let name = |dof: usize| robot.model.dof_name(dof);
    let has = |quantity, dof: usize| all_have(runs, quantity, name(dof));
    let is_behind = |&dof: &usize| has(Quantity::JointPosition, dof) && !has(Quantity::MotorPosition, dof);
    let is_sprung = |&dof: &usize| {
        robot.joints[dof].stiffness.is_some() || robot.couplings.iter().any(|c| c.dofs.contains(&dof))
    };
    let behind: Vec<usize> = (0..robot.model.nv).filter(is_behind).filter(is_sprung).collect();
    if behind.is_empty() {
        return (robot, None);
    }
    let names: Vec<&str> = behind.iter().map(|&dof| name(dof)).collect();
    let statement = format!(
        "no motor position of {} in the runs: the link's is imposed and the spring before it left out, which holds well below its antiresonance",
        listed(&names)
    );
    let finding = Finding::of_data(names.join(", "), "", statement);
    let needs_spring = |spec: &EffectSpec| {
        let card = catalogue.find(&spec.kind).map(|entry| entry.card);
        card.is_some_and(|card| card.requires.contains(&Requirement::Elastic))
    };
    let places: Vec<Place> = names.iter().map(|name| Place::Joint((*name).to_owned())).collect();
    let mut rigid = robot.clone();
    behind.iter().for_each(|&dof| rigid.joints[dof].stiffness = None);
    rigid.couplings.retain(|c| !c.dofs.iter().any(|dof| behind.contains(dof)));
    rigid.effects.retain(|spec| !(places.contains(&spec.place) && needs_spring(spec)));
    (rigid, Some(finding))
}

// Suspicions about runs, as findings; `prepared`: the same runs. The first check that fails outright is an error, unless
// the options go on all the same.
fn checked(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    prepared: &Prepared,
    options: &Options,
) -> Result<Vec<Finding>, IdentifyError> {
    let mut notes: Vec<Note> = runs.iter().flat_map(check_run).collect();
    notes.extend(range_checks(robot, runs));
    notes.extend(torque_notes(robot, catalogue, runs, prepared, options));
    suspicions(notes, options)
}

fn suspicions(mut notes: Vec<Note>, options: &Options) -> Result<Vec<Finding>, IdentifyError> {
    notes.retain(|n| n.severity != Severity::Note);
    if let Some(fatal) = notes.iter().find(|n| n.severity == Severity::Error && !options.force) {
        let help = format!("{}; or go on all the same with --force", fatal.help);
        return Err(IdentifyError::run(&fatal.place, fatal.statement.clone(), help));
    }
    notes.sort_by_key(|n| n.severity);
    Ok(notes.into_iter().map(finding).collect())
}

/// A joint whose torque varies in a run that does not tell where the joint is: an error, since it is not held at zero, as the others
/// are of which a run has no position.
pub fn unlocated(robot: &Robot, runs: &[Run]) -> Option<Note> {
    let varies = |values: &[f64]| values.iter().any(|x| x.is_finite() && *x != values[0]);
    let is_driven = |run: &Run, joint: &str| {
        let torques = [Quantity::MotorTorque, Quantity::MotorCurrent, Quantity::JointTorque];
        torques.iter().any(|q| run.signal(*q, joint).is_some_and(|signal| varies(&signal.values)))
    };
    let is_lost = |run: &Run, joint: &str| !is_located(run, joint) && is_driven(run, joint);
    let names: Vec<&str> = (0..robot.model.nv).map(|dof| robot.model.dof_name(dof)).collect();
    let of = |run: &Run| -> Vec<&str> {
        let shows_others = names.iter().any(|joint| is_located(run, joint));
        names.iter().copied().filter(|joint| shows_others && is_lost(run, joint)).collect()
    };
    let (run, joints) = runs.iter().map(|run| (run, of(run))).find(|(_, joints)| !joints.is_empty())?;
    let joint = joints[0];
    Some(Note {
        severity: Severity::Error,
        place: run.name.clone(),
        statement: format!("a torque of {} varies, and no position tells where it is", listed(&joints)),
        help: format!(
            "log motor_position.{joint} or joint_position.{joint}; if it stands still, leave its torque out"
        ),
    })
}

fn is_located(run: &Run, joint: &str) -> bool {
    [Quantity::MotorPosition, Quantity::JointPosition].iter().any(|q| run.signal(*q, joint).is_some())
}

/// Joints that runs name and the robot does not have: nothing of them is compared. An error if one may be a joint of the robot that
/// its run does not name: the same in another spelling, or, if its position is logged, any that moves the tool.
pub fn strangers(robot: &Robot, runs: &[Run]) -> Option<Note> {
    let names = unknown_joints(robot, runs);
    names.first()?;
    let known: Vec<String> = (0..robot.model.nv).map(|dof| robot.model.dof_name(dof).to_owned()).collect();
    // What a run names, and the joint that may be meant.
    let misspelt = |run: &Run| {
        let joints = run.joints();
        let is_free = |name: &str, joint: &str| !joints.contains(&joint) && !differ_in_digits(name, joint);
        let meant = |name: &str| nearest(name, &known).filter(|joint| is_free(name, joint));
        names.iter().filter(|name| joints.contains(name)).find_map(|name| Some((*name, meant(name)?)))
    };
    let under_another_name = |run: &Run| {
        let joints = run.joints();
        let own = to_tool(robot).find(|joint| !joints.contains(joint))?;
        let other = names.iter().find(|name| joints.contains(*name) && is_located(run, name))?;
        Some((*other, own))
    };
    let statement = format!(
        "the runs name {}, which robot \"{}\" does not have: nothing of {} is compared",
        listed(&names),
        robot.model.name,
        if names.len() == 1 { "it" } else { "them" }
    );
    let (severity, help) = match runs.iter().find_map(misspelt) {
        Some((name, joint)) => (
            Severity::Error,
            format!("write \"{joint}\" for \"{name}\" in the header of the run or in the columns map"),
        ),
        None => match runs.iter().find_map(under_another_name) {
            Some((name, joint)) => (
                Severity::Error,
                format!(
                    "nothing is logged of \"{joint}\": if that is \"{name}\", write so in the header of the run or in the columns map; if it stood still, leave the columns of \"{name}\" out"
                ),
            ),
            None => (Severity::Warning, format!("its joints are {}", known.join(", "))),
        },
    };
    let has_one = |run: &&Run| run.joints().iter().any(|joint| names.contains(joint));
    let of: Vec<&str> = runs.iter().filter(has_one).map(|run| run.name.as_str()).collect();
    Some(Note { severity, place: of.join(", "), statement, help })
}

// The joints that move the tool.
fn to_tool(robot: &Robot) -> impl Iterator<Item = &str> {
    let joints = &robot.model.joints;
    let last = robot.model.links[robot.tool.0].body;
    let chain = std::iter::successors(last, |joint| joints[joint.0].parent);
    let own = chain.filter(|joint| joints[joint.0].mimic.is_none() && joints[joint.0].kind.nv() == 1);
    own.map(|joint| joints[joint.0].name.as_str())
}

// What runs name as joints and the robot does not have, each once.
fn unknown_joints<'a>(robot: &Robot, runs: &'a [Run]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for name in runs.iter().flat_map(Run::joints) {
        if robot.model.joint(name).is_none() && !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

// Two joints of a chain, not one in two spellings.
fn differ_in_digits(a: &str, b: &str) -> bool {
    let digits = |name: &str| name.chars().filter(char::is_ascii_digit).collect::<String>();
    digits(a) != digits(b)
}

// Joints that move and of which nothing shows what the model says of them.
fn uncompared(robot: &Robot, sensors: &Sensors) -> Option<Finding> {
    let is_compared = |dof: usize| sensors.channels.iter().any(|c| c.dof == dof);
    let hidden = sensors.moving().filter(|&dof| !is_compared(dof));
    let names: Vec<&str> = hidden.map(|dof| robot.model.dof_name(dof)).collect();
    let statement = format!(
        "nothing of {} is compared, since not every run has a torque of it: what is missing there does not show",
        listed(&names)
    );
    (!names.is_empty()).then(|| Finding::of_data(names.join(", "), "", statement))
}

// Columns that some runs have and others do not.
fn in_some_runs(robot: &Robot, runs: &[Run]) -> Option<Finding> {
    const COMPARED: [Quantity; 5] = [
        Quantity::MotorPosition,
        Quantity::MotorTorque,
        Quantity::MotorCurrent,
        Quantity::JointPosition,
        Quantity::JointTorque,
    ];
    let has = |run: &Run, quantity, joint: &str| run.signal(quantity, joint).is_some();
    let columns =
        (0..robot.model.nv).flat_map(|dof| COMPARED.map(|quantity| (quantity, robot.model.dof_name(dof))));
    let differs = |&(quantity, joint): &(Quantity, &str)| {
        let any = runs.iter().any(|run| has(run, quantity, joint));
        any && !all_have(runs, quantity, joint)
    };
    let partial: Vec<(Quantity, &str)> = columns.filter(differs).collect();
    let (quantity, joint) = *partial.first()?;
    let lacks = runs.iter().find(|run| !has(run, quantity, joint)).map_or("", |run| &run.name);
    let others = match partial.len() {
        1 => String::new(),
        n => format!(" ({} more columns are in some runs only)", n - 1),
    };
    let statement = format!("{quantity}.{joint} is not compared, since run {lacks} lacks it{others}");
    Some(Finding::of_data(joint.to_owned(), quantity.name(), statement))
}

// What a motion that occurs twice is good for.
fn repeated(repeat: &Repeat, runs: &[Run]) -> Finding {
    let (name, statement) = (&runs[repeat.first].name, repeat.statement(runs));
    let statement = format!(
        "{name}: {statement}: no model explains what differs between the two, and it counts as noise"
    );
    Finding::of_data(String::new(), "", statement)
}

// The robot with the joints of which some run has no position held at zero, and the finding that says so.
fn held(robot: &Robot, runs: &[Run]) -> (Robot, Option<Finding>) {
    let model = &robot.model;
    let floats = |dof: usize| model.joints[model.joint_of_dof(dof).0].kind.nv() > 1;
    let seen = |dof: usize| {
        let positions = [Quantity::MotorPosition, Quantity::JointPosition];
        floats(dof) || positions.into_iter().any(|q| all_have(runs, q, model.dof_name(dof)))
    };
    let still: Vec<usize> = (0..model.nv).filter(|&dof| !seen(dof)).collect();
    if still.is_empty() || still.len() == model.nv {
        return (robot.clone(), None);
    }
    let names: Vec<&str> = still.iter().map(|&dof| model.dof_name(dof)).collect();
    let statement = format!("no position of {} in the runs: taken as held at zero", listed(&names));
    let finding = Finding::of_data(names.join(", "), "", statement);
    (robot.held(&still), Some(finding))
}

/// Joints in words: all of a few, the first of many.
///
/// ```
/// assert_eq!(sinew_identify::listed(&["j1"]), "joint \"j1\"");
/// assert_eq!(sinew_identify::listed(&["j1", "j2"]), "the joints \"j1\", \"j2\"");
/// assert_eq!(sinew_identify::listed(&["a", "b", "c", "d", "e"]), "5 joints (\"a\", \"b\", \"c\", \"d\" …)");
/// ```
pub fn listed(joints: &[&str]) -> String {
    const SHOWN: usize = 4;
    let first = joints.iter().take(SHOWN).map(|j| format!("\"{j}\"")).collect::<Vec<_>>().join(", ");
    match joints.len() {
        1 => format!("joint {first}"),
        n if n <= SHOWN => format!("the joints {first}"),
        n => format!("{n} joints ({first} …)"),
    }
}

fn finding(note: Note) -> Finding {
    // `QUANTITY.JOINT` at the end of the place or at the start of the statement.
    let words = note.place.rsplit([' ', ':']).next().into_iter().chain(note.statement.split([' ', ':']));
    let named = words.filter_map(|w| w.split_once('.')).find(|(quantity, _)| quantity.contains('_'));
    let (signal, joint) = named.unwrap_or(("", ""));
    Finding::of_data(joint.to_owned(), signal, format!("{}: {}", note.place, note.statement))
}

#[cfg(test)]
mod tests {
    use sinew_data::Signal;
    use sinew_effects::CATALOGUE;
    use sinew_model::{JointSettings, samples};

    use super::*;

    #[test]
    fn a_joint_that_the_robot_does_not_have_is_told_with_the_one_that_may_be_meant() {
        let run = |joint: &str| {
            let signal = Signal::new(Quantity::MotorTorque, joint, vec![0.0; 3]);
            Run::new("run".to_owned(), vec![0.0, 1.0, 2.0], vec![signal]).unwrap()
        };
        let two = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        assert_eq!(strangers(&two, &[run("joint_2")]), None);
        // Another spelling in one of two runs; of a joint that nothing else shows; a joint that is another one.
        let told = |names: &[&str]| {
            let runs: Vec<Run> = names.iter().map(|name| run(name)).collect();
            let note = strangers(&two, &runs).unwrap();
            (note.severity, note.help)
        };
        assert_eq!(told(&["joint_2", "joint2"]).0, Severity::Error);
        let (severity, help) = told(&["joint_1", "joint2"]);
        assert!(
            severity == Severity::Error && help.starts_with("write \"joint_2\" for \"joint2\""),
            "{help}"
        );
        assert_eq!(told(&["joint_1", "joint_3"]).0, Severity::Warning);
        // … unless it moves and nothing is known of one that moves the tool.
        let mut moved = run("wrist");
        moved.signals[0].quantity = Quantity::MotorPosition;
        moved.signals.extend(run("joint_1").signals);
        let note = strangers(&two, &[moved]).unwrap();
        let asks = note.help.starts_with("nothing is logged of \"joint_2\": if that is \"wrist\"");
        assert!(note.severity == Severity::Error && asks, "{note}");
    }

    #[test]
    fn a_joint_that_is_driven_is_somewhere() {
        let two = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let signal =
            |quantity, joint: &str, torque: f64| Signal::new(quantity, joint, vec![1.0, torque, 1.0]);
        let told = |torque: f64| {
            let signals = vec![
                signal(Quantity::MotorPosition, "joint_1", 2.0),
                signal(Quantity::MotorTorque, "joint_2", torque),
            ];
            unlocated(&two, &[Run::new("run".to_owned(), vec![0.0, 1.0, 2.0], signals).unwrap()])
        };
        assert_eq!(told(1.0), None);
        let note = told(2.0).unwrap();
        assert!(note.severity == Severity::Error && note.help.contains("motor_position.joint_2"), "{note}");
    }

    #[test]
    fn a_column_that_some_runs_lack_is_told() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let run = |name: &str, quantities: &[Quantity]| {
            let signal = |quantity: &Quantity| Signal::new(*quantity, "joint_2", vec![0.0; 3]);
            let signals = quantities.iter().map(signal).collect();
            Run::new(name.to_owned(), vec![0.0, 1.0, 2.0], signals).unwrap()
        };
        let both = [Quantity::MotorPosition, Quantity::MotorTorque];
        assert_eq!(in_some_runs(&robot, &[run("a", &both), run("b", &both)]), None);
        let told = in_some_runs(&robot, &[run("a", &both), run("b", &both[..1])]).unwrap().statement;
        assert_eq!(told, "motor_torque.joint_2 is not compared, since run b lacks it");
    }

    // A spring between an imposed link and itself would swing where nothing does.
    #[test]
    fn a_joint_whose_motor_is_not_seen_keeps_no_spring() {
        let model = samples::planar_arm(2, 4.0, 0.5);
        let joints: Vec<String> = (0..2).map(|dof| model.dof_name(dof).to_owned()).collect();
        let spring = JointSettings { stiffness: Some(9e3), rotor_inertia: 0.4, ..JointSettings::default() };
        let at = |kind: &str, dof: usize| EffectSpec::new(kind, Place::Joint(joints[dof].clone()));
        let robot = Robot {
            joints: vec![spring.clone(), spring],
            effects: vec![
                at("backlash", 0).with("half_width", 1e-4),
                at("link_coulomb_friction", 0).with("coulomb", 1.0),
                at("backlash", 1).with("half_width", 1e-4),
            ],
            ..Robot::rigid(model)
        };
        let signal = |quantity, dof: usize| Signal::new(quantity, &joints[dof], vec![0.0; 3]);
        let positions = [(Quantity::JointPosition, 0), (Quantity::MotorPosition, 1)];
        let signals = positions.map(|(quantity, dof)| signal(quantity, dof)).to_vec();
        let run = Run::new("run".to_owned(), vec![0.0, 1.0, 2.0], signals).unwrap();
        let (rigid, finding) = seen_from_links(robot.clone(), &CATALOGUE, &[run]);
        assert_eq!(rigid.joints[0].stiffness, None);
        assert_eq!(rigid.joints[1], robot.joints[1]);
        assert_eq!(rigid.effects, robot.effects[1..]);
        assert!(finding.unwrap().statement.contains(&joints[0]));
    }
}
