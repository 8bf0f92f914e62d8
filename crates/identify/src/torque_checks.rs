//! Signs, units and swapped joints: measured torques and deflections beside those of the model as it stands, before any physics.

use sinew_data::{Note, Run, Severity};
use sinew_effect::{Catalogue, Sensor};
use sinew_model::Robot;

use crate::Options;
use crate::arrangement::{Beginning, Followed, arrangement_notes};
use crate::before::as_measured;
use crate::comparison::{Prepared, range};
use crate::position_units::unit_notes;
use crate::problem::{Candidate, Problem};
use crate::record::{Channel, Record};
use crate::residual::ResidualForm;
use crate::spread::std;

// A torque whose square the model explains to this share can be judged for sign and size.
const CLEAR: f64 = 0.5;
// A factor between measured and model torque beyond this is no friction.
const FACTOR: f64 = 4.0;
// … and outside of these no model of the robot, where the model's torque varies by this share of the largest one or more:
// beside the rotor of a geared joint its link's inertia may be little, and nothing where a URDF has none.
const BELIEVABLE: std::ops::Range<f64> = 1.0 / 30.0..300.0;
const WEIGHTY: f64 = 0.02;
// A deflection that follows the model's backwards to this share, by about as much, is of two encoders in each other's place.
const BACKWARDS: f64 = 0.7;
// A torque that stays the same within this share of it is no measurement, if its joint moves by so much (rad, m) and friction
// explains no more than this share of what the motion takes.
const SAME: f64 = 1e-9;
const MOVES: f64 = 0.05;
const FRICTION: f64 = 0.5;
// Two joints are swapped if exchanging them explains this much more, of two.
const SWAP: f64 = 0.4;

/// What is suspicious about the torques of motors and joints: opposite sign, another unit or side of the gear, swapped joints;
/// about the two encoders of a joint: exchanged. A torque that never changes although the motion takes another is an error.
///
/// ```text
/// τ_measured ≈ a τ_model + b,   a < 0: sign;   |a| far from one: unit or gear;   R²(i, j) + R²(j, i) ≫ R²(i, i) + R²(j, j): swapped
/// (θ − q)_measured ≈ a (θ − q)_model + b,   a ≈ −1: encoders exchanged
/// ```
///
/// Where the torques of motors do not follow the model, whether they would with positions in another unit, or if positions or whole
/// joints were turned about or exchanged, by the first seconds. Empty where nothing can be said: no torque, too short a run, a model that explains little
/// of any joint.
pub fn torque_checks(robot: &Robot, catalogue: &Catalogue, runs: &[Run], options: &Options) -> Vec<Note> {
    let robot = &as_measured(robot, catalogue, runs).0;
    let Ok(prepared) = Prepared::new(robot, runs, options) else { return Vec::new() };
    torque_notes(robot, catalogue, runs, &prepared, options)
}

/// [`torque_checks`] of runs made ready.
pub(crate) fn torque_notes(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    prepared: &Prepared,
    options: &Options,
) -> Vec<Note> {
    // How the torques of motors follow the model in a run.
    let explained = |run: &Run| {
        let compared = compared_alone(robot, catalogue, run, prepared, options)?;
        Some(compared.iter().filter(|c| c.channel.sensor == Sensor::MotorTorque).map(followed).collect())
    };
    let beginning = Beginning::of(runs, explained);
    let in_another_unit =
        beginning.as_ref().map_or_else(Vec::new, |first| unit_notes(robot, first, explained));
    if !in_another_unit.is_empty() {
        return in_another_unit;
    }
    let compared = compared(robot, catalogue, prepared, options);
    let of = |sensor: Sensor| compared.iter().filter(move |c| c.channel.sensor == sensor);
    let mut notes: Vec<Note> = [Sensor::MotorTorque, Sensor::JointTorque]
        .into_iter()
        .flat_map(|sensor| of_sensor(robot, of(sensor).collect()))
        .chain(of(Sensor::MotorTorque).filter_map(|torque| dead(robot, torque)))
        .chain(of(Sensor::JointPosition).filter_map(|deflection| exchanged(robot, deflection)))
        .collect();
    let none_is_wrong = |notes: &[Note]| notes.iter().all(|note| note.severity != Severity::Error);
    if none_is_wrong(&notes) && runs.len() > 1 {
        notes.extend(turned_notes(robot, catalogue, &Vec::from_iter(runs), prepared, options));
    }
    if let Some(first) = beginning.filter(|_| none_is_wrong(&notes)) {
        notes.extend(arrangement_notes(robot, &first, explained));
    }
    notes
}

/// Torques that are turned about in some runs, beside others that follow the model: the sign of a column changed between them.
/// `prepared`: the sensors and scales of all.
pub(crate) fn turned_notes(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[&Run],
    prepared: &Prepared,
    options: &Options,
) -> Vec<Note> {
    // Run, channel, slope and share.
    let mut torques: Vec<(&Run, Channel, (f64, f64))> = Vec::new();
    for run in runs {
        let compared = compared_alone(robot, catalogue, run, prepared, options).unwrap_or_default();
        let of_torque = compared.iter().filter(|c| c.channel.sensor != Sensor::JointPosition);
        torques.extend(of_torque.map(|c| (*run, c.channel, regression(&c.measured, &c.predicted))));
    }
    let follows = |channel: Channel| {
        torques.iter().any(|(_, other, (slope, share))| *other == channel && *slope > 0.0 && *share > CLEAR)
    };
    let turned = |(run, channel, found): &(&Run, Channel, (f64, f64))| {
        let joint = robot.model.dof_name(channel.dof);
        let place = || format!("{}: {}.{joint}", run.name, channel.signal());
        follows(*channel).then(|| turned_about(place(), *found)).flatten()
    };
    torques.iter().filter_map(turned).collect()
}

// One run of several by itself.
fn compared_alone(
    robot: &Robot,
    catalogue: &Catalogue,
    run: &Run,
    prepared: &Prepared,
    options: &Options,
) -> Option<Vec<Compared>> {
    let (runs, sensors) = (std::slice::from_ref(run), prepared.sensors.clone());
    let prepared = Prepared::with(robot, runs, sensors, prepared.scales).ok()?;
    Some(compared(robot, catalogue, &prepared, options))
}

// A torque, or a deflection θ − q where a link's position is measured, and the same by the model as it stands.
struct Compared {
    channel: Channel,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    /// Positions and velocities of its joint.
    position: Vec<f64>,
    velocity: Vec<f64>,
}

// All channels; none of a robot that is no plant.
fn compared(robot: &Robot, catalogue: &Catalogue, prepared: &Prepared, options: &Options) -> Vec<Compared> {
    let form = prepared.form(robot);
    let problem = Problem::new(robot, catalogue, &form, options);
    let Ok(model) = Candidate::new(&problem, robot.all_effects()) else { return Vec::new() };
    let (layout, residual) = (form.layout(), model.residual(&problem));
    let of = |(c, channel): (usize, &Channel)| {
        let rows = |series: &dyn Fn(&Record) -> Vec<f64>| prepared.records.iter().flat_map(series).collect();
        let measured: Vec<f64> = rows(&|r| r.rows(&r.measured[c]));
        let left = layout.of_channel(c).flat_map(|s| &residual[s.first..s.first + s.len]);
        let predicted: Vec<f64> = measured.iter().zip(left).map(|(m, left)| m - left).collect();
        let position: Vec<f64> = rows(&|r| r.rows(&r.theta[channel.dof]));
        let velocity = rows(&|r| r.rows(&r.thetad[channel.dof]));
        let deflection = |q: &[f64]| position.iter().zip(q).map(|(theta, q)| theta - q).collect();
        let (measured, predicted) = match channel.sensor {
            Sensor::JointPosition => (deflection(&measured), deflection(&predicted)),
            _ => (measured, predicted),
        };
        Compared { channel: *channel, measured, predicted, position, velocity }
    };
    layout.channels.iter().enumerate().map(of).collect()
}

// The encoders of motor and link in each other's place.
fn exchanged(robot: &Robot, deflection: &Compared) -> Option<Note> {
    let (slope, share) = regression(&deflection.measured, &deflection.predicted);
    let joint = robot.model.dof_name(deflection.channel.dof);
    let statement = format!(
        "the spring of \"{joint}\" bends backwards: motor_position − joint_position is {slope:.2} times the model's ({:.0} % explained by it)",
        100.0 * share
    );
    let help =
        format!("exchange the columns of motor_position.{joint} and joint_position.{joint} in the map");
    let place = format!("{}.{joint}", deflection.channel.signal());
    let is_backwards = share > BACKWARDS && (1.0 / FACTOR..FACTOR).contains(&-slope);
    is_backwards.then(|| suspicion(Severity::Error, place, statement, &help))
}

// A torque that stays the same to the last digit although the motion takes another: a column that nobody fills. Of a joint
// without a drive, or one that is driven by a step, the model asks for what friction takes.
fn dead(robot: &Robot, torque: &Compared) -> Option<Note> {
    let &value = torque.measured.first()?;
    let (joint, range) = (robot.model.dof_name(torque.channel.dof), range(&torque.position));
    let is_constant = torque.measured.iter().all(|x| (x - value).abs() <= SAME * value.abs());
    let asked = std(&torque.predicted);
    if !is_constant || asked == 0.0 || range < MOVES || by_friction(torque) > FRICTION {
        return None;
    }
    let statement = format!(
        "{value:.4} throughout, although \"{joint}\" moves by {range:.3}, which takes a torque that varies by {asked:.3} (standard deviation)"
    );
    let help = "leave the column out of the run, or log the torque that drives the joint";
    Some(suspicion(Severity::Error, format!("{}.{joint}", torque.channel.signal()), statement, help))
}

// The share of the model's torque about its mean that a friction of which the model knows nothing takes from a joint without a
// drive: against sign and size of the velocity.
fn by_friction(torque: &Compared) -> f64 {
    let velocity = &torque.velocity;
    let signs: Vec<f64> = velocity.iter().map(|v| v.signum()).collect();
    let against = |y: &[f64], x: &[f64]| Some(regression(y, x)).filter(|(slope, _)| *slope < 0.0);
    let (slope, share) = against(&torque.predicted, &signs).unwrap_or_default();
    let left: Vec<f64> = torque.predicted.iter().zip(&signs).map(|(p, s)| p - slope * s).collect();
    share + (1.0 - share) * against(&left, velocity).unwrap_or_default().1
}

fn followed(torque: &Compared) -> Followed {
    let (slope, share) = regression(&torque.measured, &torque.predicted);
    Followed { dof: torque.channel.dof, slope, share: share.copysign(slope) }
}

fn of_sensor(robot: &Robot, torques: Vec<&Compared>) -> Vec<Note> {
    let joint = |i: usize| robot.model.dof_name(torques[i].channel.dof);
    let place = |i: usize| format!("{}.{}", torques[i].channel.signal(), joint(i));
    let swapped = swaps(&torques);
    let mut notes: Vec<Note> = swapped
        .iter()
        .map(|&(i, j)| {
            let statement = format!(
                "the torques of \"{}\" and \"{}\" look exchanged, or their positions: each torque fits the other's model",
                joint(i),
                joint(j)
            );
            let help = "exchange the two columns of torques in the map, or those of positions: `sinew compare --force` tells which leaves less";
            suspicion(Severity::Error, place(i), statement, help)
        })
        .collect();
    let alone = (0..torques.len()).filter(|i| !swapped.iter().any(|(a, b)| a == i || b == i));
    let sizes: Vec<f64> = torques.iter().map(|torque| std(&torque.predicted)).collect();
    let largest = sizes.iter().fold(0.0f64, |m, x| m.max(*x));
    let is_weighty = |i: usize| sizes[i] > WEIGHTY * largest;
    notes.extend(alone.filter_map(|i| sign_or_size(place(i), torques[i], is_weighty(i))));
    notes
}

// A torque that follows the model's with the wrong sign or size.
fn sign_or_size(place: String, torque: &Compared, is_weighty: bool) -> Option<Note> {
    let (slope, share) = regression(&torque.measured, &torque.predicted);
    if share < CLEAR {
        None
    } else if slope < 0.0 {
        turned_about(place, (slope, share))
    } else if !(1.0 / FACTOR..FACTOR).contains(&slope) {
        let statement = format!("the torque is {slope:.3} times the model's");
        let help = format!(
            "motor quantities are in N·m and reflected to the link side (times the gear ratio): multiply the column's scale in the map by what is missing, about {:.3}, or name currents motor_current; positions that are not in rad or m do the same",
            1.0 / slope
        );
        let is_no_model = is_weighty && !BELIEVABLE.contains(&slope);
        let severity = if is_no_model { Severity::Error } else { Severity::Warning };
        Some(suspicion(severity, place, statement, &help))
    } else {
        None
    }
}

// A torque that follows the model's backwards, by its slope and the share that is explained.
fn turned_about(place: String, (slope, share): (f64, f64)) -> Option<Note> {
    let percent = 100.0 * share;
    let statement =
        format!("the torque has the opposite sign of the model's ({percent:.0} % explained by it)");
    let help = "write a negative scale in the columns map, or turn the joint's axis";
    (share >= CLEAR && slope < 0.0).then(|| suspicion(Severity::Error, place, statement, help))
}

fn suspicion(severity: Severity, place: String, statement: String, help: &str) -> Note {
    Note { severity, place, statement, help: help.to_owned() }
}

// Pairs whose exchange explains much more.
fn swaps(torques: &[&Compared]) -> Vec<(usize, usize)> {
    let share = |i: usize, j: usize| {
        let (slope, share) = regression(&torques[i].measured, &torques[j].predicted);
        if slope > 0.0 { share } else { 0.0 }
    };
    let n = torques.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    pairs
        .filter(|&(i, j)| {
            let crossed = share(i, j).min(share(j, i));
            crossed > CLEAR && share(i, j) + share(j, i) > share(i, i) + share(j, j) + SWAP
        })
        .collect()
}

// Slope of y on x about their means, and the share of y's variance it explains.
fn regression(y: &[f64], x: &[f64]) -> (f64, f64) {
    let n = y.len().max(1) as f64;
    let (my, mx) = (y.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in y.iter().zip(x) {
        xy += (a - my) * (b - mx);
        xx += (b - mx) * (b - mx);
        yy += (a - my) * (a - my);
    }
    if xx > 0.0 && yy > 0.0 { (xy / xx, xy * xy / (xx * yy)) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use sinew_data::Quantity;
    use sinew_effects::CATALOGUE;
    use sinew_model::samples;

    use super::*;
    use crate::arrangement::tests::run;

    #[test]
    fn a_torque_that_never_changes_is_refused_and_a_joint_without_a_drive_is_not() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let told = |torque: &dyn Fn(usize, f64) -> f64| {
            let mut run = run(&robot);
            let name = robot.model.dof_name(1).to_owned();
            let torques =
                run.signals.iter_mut().find(|s| s.quantity == Quantity::MotorTorque && s.place == name);
            let torques = &mut torques.unwrap().values;
            torques.iter_mut().enumerate().for_each(|(k, x)| *x = torque(k, *x));
            torque_checks(&robot, &CATALOGUE, &[run], &Options::default())
        };
        let dead = |notes: &[Note]| notes.iter().any(|n| n.statement.contains("throughout"));
        assert!(dead(&told(&|_, _| 0.0)) && dead(&told(&|_, _| 2.5)));
        assert!(!dead(&told(&|_, x| x)) && !dead(&told(&|k, _| if k < 9 { 1.0 } else { 0.0 })));
    }
}
