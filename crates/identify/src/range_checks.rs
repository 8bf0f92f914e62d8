//! Positions, speeds, springs and currents beside what the URDF and the sidecar state: another unit, an offset, another joint.

use std::f64::consts::TAU;

use sinew_data::{Note, Quantity, Run, Severity};
use sinew_model::{Joint, JointKind, Robot};

use crate::comparison::range;

// Share of the samples that may lie outside, and what counts as inside beyond the limits, as a share of their distance.
const MOST_OUTSIDE: f64 = 0.01;
const BEYOND: f64 = 0.02;
// Motion by the distance of the limits from which positions that would be inside in degrees are degrees.
const WIDER: f64 = 1.5;
// Distance from zero by that of the farther limit from which positions may be in degrees.
const FAR: f64 = 3.0;
// Speed by the limit of the URDF that is told; many a URDF states one that is none.
const FASTER: f64 = 1.5;
// Seconds over which a speed is taken: encoder steps are no speed.
const OVER: f64 = 0.05;
// A speed that joints of robots hardly have, rad/s; told where the URDF states no limit.
const HARDLY: f64 = 20.0;
// A position that stands still while the other of its joint moves by so much, rad, is no deflection.
const STILL: f64 = 0.5;
// Share of a turn by which a jump of a turn may miss it.
const ALMOST: f64 = 0.03;
// Torque by the URDF's limit of effort that is told.
const STRONGER: f64 = 1.5;
// Deflection, rad, beyond which a joint is hardly one with an elastic gear.
const SOFT: f64 = 1.0;

/// What is suspicious about the positions of a run: more than 1 % of them outside of the limits that the URDF states, or
/// half as fast again as its limit of velocity; of torques that are half as large again as its limit of effort, in up to 1 % of a run; of a spring that the logged torques would bend by more than a radian; of a
/// motor current without a torque constant; of a spring without a rotor. A motion much wider than these limits, where degrees would explain it, is an error.
///
/// A turning joint without a limit of velocity is told from 20 rad/s on. A position that never changes while the other of its
/// joint moves by half a radian is an error.
pub fn range_checks(robot: &Robot, runs: &[Run]) -> Vec<Note> {
    let model = &robot.model;
    let joints = || (0..model.nv).map(|dof| &model.joints[model.joint_of_dof(dof).0]);
    let positions = [Quantity::MotorPosition, Quantity::JointPosition];
    let of_run = |run: &Run| -> Vec<Note> {
        joints()
            .flat_map(|j| {
                let moves = positions.map(|q| outside(run, j, q).or_else(|| too_fast(run, j, q)));
                moves.into_iter().chain([too_strong(run, j)])
            })
            .flatten()
            .collect()
    };
    let soft = runs.iter().flat_map(|run| (0..model.nv).filter_map(|dof| too_soft(robot, run, dof)));
    let idle = runs.iter().flat_map(|run| (0..model.nv).filter_map(|dof| idle_current(robot, run, dof)));
    let still = runs.iter().flat_map(|run| joints().filter_map(|joint| stands_still(run, joint)));
    let light = (0..model.nv).filter_map(|dof| without_rotor(robot, dof));
    runs.iter().flat_map(of_run).chain(soft).chain(idle).chain(still).chain(light).collect()
}

// Torques that the URDF's drive does not have: another unit, or readings that are none. Many a URDF states a limit that is none, so
// that a log that is mostly above it is not told.
fn too_strong(run: &Run, joint: &Joint) -> Option<Note> {
    let limit = joint.limits.effort;
    let values = &run.signal(Quantity::MotorTorque, &joint.name)?.values;
    let beyond: Vec<usize> = (0..values.len()).filter(|&k| values[k].abs() > STRONGER * limit).collect();
    let is_some = limit.is_finite() && limit > 0.0 && !beyond.is_empty();
    let largest = beyond.iter().copied().max_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs()))?;
    let statement = format!(
        "motor_torque.{}: {} of {} samples are beyond {STRONGER} times the URDF's limit of effort ({limit}), here {:.4}",
        joint.name,
        beyond.len(),
        values.len(),
        values[largest]
    );
    let help = "compare the unit of the column with the log's, leave out readings that are none, or correct the URDF's limit".to_owned();
    let is_few = (beyond.len() as f64) < MOST_OUTSIDE * values.len() as f64;
    (is_some && is_few).then(|| Note {
        severity: Severity::Warning,
        place: run.place_of(largest),
        statement,
        help,
    })
}

// A motor current of which nobody says what torque it is.
fn idle_current(robot: &Robot, run: &Run, dof: usize) -> Option<Note> {
    let joint = robot.model.dof_name(dof);
    let has = |quantity| run.signal(quantity, joint).is_some();
    let is_idle = has(Quantity::MotorCurrent)
        && !has(Quantity::MotorTorque)
        && robot.joints[dof].torque_constant.is_none();
    is_idle.then(|| Note {
        severity: Severity::Warning,
        place: run.name.clone(),
        statement: format!(
            "motor_current.{joint} is left out: the sidecar states no torque_constant of joint \"{joint}\""
        ),
        help: format!("write torque_constant, N·m at the joint per A, into [joints.{joint}]"),
    })
}

// An encoder of a joint that shows nothing of what the other shows.
fn stands_still(run: &Run, joint: &Joint) -> Option<Note> {
    let of =
        |quantity| run.signal(quantity, &joint.name).map(|signal| (signal.name(), range(&signal.values)));
    let (motor, link) = (of(Quantity::MotorPosition)?, of(Quantity::JointPosition)?);
    let ((still, moves_not), (other, moves)) = if motor.1 < link.1 { (motor, link) } else { (link, motor) };
    let is_dead = !joint.kind.slides() && moves_not == 0.0 && moves > STILL;
    let statement = format!("{still} stands still in the whole run, while {other} moves by {moves:.3} rad");
    let help = "leave the column out: the joint's other encoder goes without it".to_owned();
    is_dead.then(|| Note { severity: Severity::Error, place: run.name.clone(), statement, help })
}

// A spring with nothing on the motor's side: its motion there is that of no mass.
fn without_rotor(robot: &Robot, dof: usize) -> Option<Note> {
    let (name, joint) = (robot.model.dof_name(dof), &robot.joints[dof]);
    let is_bare = joint.stiffness.is_some() && joint.rotor_inertia <= 0.0;
    is_bare.then(|| Note {
        severity: Severity::Warning,
        place: format!("[joints.{name}]"),
        statement: format!("joint \"{name}\" has a spring and no rotor: nothing moves on the motor's side, and no torque says anything of the spring"),
        help: "state rotor_inertia, kg·m², the gear ratio squared times the rotor's own".to_owned(),
    })
}

// A spring that the logged torques would bend further than any gear lets it: a stiffness in another unit.
fn too_soft(robot: &Robot, run: &Run, dof: usize) -> Option<Note> {
    let joint = &robot.model.joints[robot.model.joint_of_dof(dof).0];
    let stiffness = robot.joints[dof].stiffness.filter(|k| *k > 0.0 && !joint.kind.slides())?;
    let torque = run.signal(Quantity::MotorTorque, &joint.name)?;
    let largest = torque.values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let statement = format!(
        "the spring of joint \"{}\", {stiffness} N·m/rad, gives way by {:.1} rad under the largest torque of the log ({largest:.3} N·m)",
        joint.name,
        largest / stiffness
    );
    let help = "state stiffness in N·m/rad, seen from the link side of the gear".to_owned();
    (largest / stiffness > SOFT).then(|| Note {
        severity: Severity::Warning,
        place: run.name.clone(),
        statement,
        help,
    })
}

// A clock or a position in another unit.
fn too_fast(run: &Run, joint: &Joint, quantity: Quantity) -> Option<Note> {
    let limit = joint.limits.velocity;
    let values = &run.signal(quantity, &joint.name)?.values;
    let is_limited = limit.is_finite() && limit > 0.0;
    if !is_limited && joint.kind.slides() {
        return None;
    }
    let apart = ((OVER / run.period()).round() as usize).clamp(1, values.len() - 1);
    let changes = values.iter().zip(&values[apart..]).map(|(a, b)| (b - a).abs());
    let times = run.time.iter().zip(&run.time[apart..]).map(|(a, b)| b - a);
    let mut speeds: Vec<f64> = changes.zip(times).map(|(x, t)| x / t).collect();
    let rank = ((1.0 - MOST_OUTSIDE) * (speeds.len() - 1) as f64) as usize;
    let (_, speed, _) = speeds.select_nth_unstable_by(rank, f64::total_cmp);
    let times = *speed / limit;
    let (is_told, beside, help) = match is_limited {
        true => (
            times > FASTER,
            format!("{times:.2} times the URDF's limit of velocity ({limit})"),
            "compare the units of time and position with the log's, and the URDF's limit with the robot's",
        ),
        false => (
            *speed > HARDLY,
            "fast for a joint of a robot".to_owned(),
            "compare the units of time and position with the log's: they are s and rad",
        ),
    };
    let statement =
        format!("{quantity}.{}: 1 % of it is faster than {speed:.3} a second, {beside}", joint.name);
    let severity = Severity::Warning;
    is_told.then(|| Note { severity, place: run.name.clone(), statement, help: help.to_owned() })
}

fn outside(run: &Run, joint: &Joint, quantity: Quantity) -> Option<Note> {
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    let width = upper - lower;
    let values = &run.signal(quantity, &joint.name)?.values;
    if width < 0.0 {
        let statement =
            format!("the URDF's limits of joint \"{}\" are no range ({lower} to {upper})", joint.name);
        let help = "exchange lower and upper".to_owned();
        return Some(Note { severity: Severity::Warning, place: run.name.clone(), statement, help });
    }
    if !(width.is_finite() && width > 0.0) {
        return None;
    }
    let inside = (lower - BEYOND * width)..(upper + BEYOND * width);
    let share = |scale: f64| {
        values.iter().filter(|x| !inside.contains(&(scale * **x))).count() as f64 / values.len().max(1) as f64
    };
    let out = share(1.0);
    if out <= MOST_OUTSIDE {
        return None;
    }
    let turns = matches!(joint.kind, JointKind::Revolute { .. });
    let degrees = std::f64::consts::PI / 180.0;
    let (least, most) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    // Small angles are inside in degrees, too, whatever they are.
    let is_far = least.abs().max(most.abs()) > FAR * lower.abs().max(upper.abs());
    let in_degrees = turns && is_far && share(degrees) <= MOST_OUTSIDE;
    let turn = TAU * (0.5 * (least + most - lower - upper) / TAU).round();
    let is_turned = turns && turn != 0.0 && values.iter().all(|x| inside.contains(&(x - turn)));
    let wraps = turns && values.windows(2).any(|x| ((x[1] - x[0]).abs() - TAU).abs() < ALMOST * TAU);
    // A zero elsewhere makes no motion wider than the limits.
    let severity = if in_degrees && !wraps && most - least > WIDER * width {
        Severity::Error
    } else {
        Severity::Warning
    };
    let help = if wraps {
        "it jumps by a whole turn from one sample to the next: take the turns off after the jump (unwrap it)"
            .to_owned()
    } else if is_turned {
        format!(
            "{turn:.4} rad, whole turns, away all would be inside: take them off by the column's offset in the map"
        )
    } else if in_degrees {
        format!(
            "in degrees all would be inside: if that is what they are, multiply the column's scale in the map (1 without one) by {degrees}"
        )
    } else {
        "compare unit, sign and zero of the column with the URDF, and the URDF's limits with the robot's"
            .to_owned()
    };
    let statement = format!(
        "{quantity}.{}: {:.0} % of it lies outside the URDF's limits of {lower:.4} to {upper:.4} (it goes from {least:.4} to {most:.4})",
        joint.name,
        100.0 * out
    );
    Some(Note { severity, place: run.name.clone(), statement, help })
}

#[cfg(test)]
mod tests {
    use sinew_data::Signal;
    use sinew_model::samples;

    use super::*;

    #[test]
    fn a_clock_in_another_unit_makes_joints_faster_than_they_are() {
        let mut model = samples::pendulum(1.0, 0.5);
        let name = model.joints[0].name.clone();
        model.joints[0].limits.velocity = 2.0;
        let robot = Robot::rigid(model);
        let run = |step: f64| {
            let time: Vec<f64> = (0..500).map(|k| step * k as f64).collect();
            let values = (0..500).map(|k| (0.02 * k as f64).sin()).collect();
            Run::new("run".to_owned(), time, vec![Signal::new(Quantity::MotorPosition, &name, values)])
                .unwrap()
        };
        assert!(range_checks(&robot, &[run(0.01)]).is_empty());
        assert!(range_checks(&robot, &[run(0.005)])[0].statement.contains("2.00 times"));
    }

    #[test]
    fn a_spring_of_another_unit_is_told() {
        let mut robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        robot.joints[0].rotor_inertia = 0.2;
        let name = robot.model.joints[0].name.clone();
        let torque = Signal::new(Quantity::MotorTorque, &name, vec![0.0, -9.0, 3.0]);
        let run = Run::new("run".to_owned(), vec![0.0, 1.0, 2.0], vec![torque]).unwrap();
        let mut told = |stiffness: f64| {
            robot.joints[0].stiffness = Some(stiffness);
            range_checks(&robot, std::slice::from_ref(&run))
        };
        assert!(told(1800.0).is_empty());
        assert!(told(1.8)[0].statement.contains("gives way by 5.0 rad"));
    }

    #[test]
    fn a_spring_without_a_rotor_is_told() {
        let mut robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        robot.joints[0].stiffness = Some(1800.0);
        let told = range_checks(&robot, &[]);
        assert!(told.len() == 1 && told[0].statement.contains("a spring and no rotor"), "{told:?}");
        robot.joints[0].rotor_inertia = 0.2;
        assert!(range_checks(&robot, &[]).is_empty());
    }

    #[test]
    fn few_torques_beyond_the_drive_are_told_and_a_limit_that_is_none_is_not() {
        let mut model = samples::pendulum(1.0, 0.5);
        let name = model.joints[0].name.clone();
        model.joints[0].limits.effort = 30.0;
        let robot = Robot::rigid(model);
        let told = |beyond: usize| {
            let time: Vec<f64> = (0..1000).map(|k| 0.01 * k as f64).collect();
            let values = (0..1000).map(|k| if k < beyond { 100.0 } else { 5.0 }).collect();
            let torque = Signal::new(Quantity::MotorTorque, &name, values);
            range_checks(&robot, &[Run::new("run".to_owned(), time, vec![torque]).unwrap()])
        };
        assert!(told(0).is_empty());
        assert!(told(5)[0].statement.contains("5 of 1000 samples"));
        assert!(told(500).is_empty());
    }

    #[test]
    fn a_current_without_a_torque_constant_is_told() {
        let mut robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        let name = robot.model.joints[0].name.clone();
        let current = Signal::new(Quantity::MotorCurrent, &name, vec![0.0, 1.0, 2.0]);
        let run = Run::new("run".to_owned(), vec![0.0, 1.0, 2.0], vec![current]).unwrap();
        let told = range_checks(&robot, std::slice::from_ref(&run));
        assert!(told.len() == 1 && told[0].statement.contains("states no torque_constant"), "{told:?}");
        robot.joints[0].torque_constant = Some(12.0);
        assert!(range_checks(&robot, &[run]).is_empty());
    }

    #[test]
    fn degrees_are_outside_and_told_as_degrees() {
        let mut model = samples::pendulum(1.0, 0.5);
        let name = model.joints[0].name.clone();
        (model.joints[0].limits.lower, model.joints[0].limits.upper) = (-1.0, 1.0);
        let robot = Robot::rigid(model);
        let run = |values: Vec<f64>| {
            let time = (0..values.len()).map(|k| k as f64).collect();
            Run::new("run".to_owned(), time, vec![Signal::new(Quantity::MotorPosition, &name, values)])
                .unwrap()
        };
        assert!(range_checks(&robot, &[run(vec![-0.9, 0.0, 1.0])]).is_empty());
        let told = range_checks(&robot, &[run(vec![-50.0, 0.0, 50.0])]);
        assert!(told[0].statement.contains("67 %") && told[0].help.contains("in degrees"));
        assert_eq!(told[0].severity, Severity::Error);
        assert_eq!(range_checks(&robot, &[run(vec![1.5, 2.0, 3.5])])[0].severity, Severity::Warning);
        assert!(range_checks(&robot, &[run(vec![8.0, 9.0, 100.0])])[0].help.contains("zero"));
        // Half a radian beyond the limits, and a turn beyond.
        assert!(range_checks(&robot, &[run(vec![-0.5, 1.5, 0.0])])[0].help.contains("zero"));
        assert!(range_checks(&robot, &[run(vec![5.5, 6.0, 7.0])])[0].help.contains("whole turns"));
        let mut robot = robot.clone();
        (robot.model.joints[0].limits.lower, robot.model.joints[0].limits.upper) = (1.0, -1.0);
        assert!(range_checks(&robot, &[run(vec![0.0, 0.5])])[0].statement.contains("no range (1 to -1)"));
    }
}
