//! Signs, units and swapped joints: the measured torque beside the torque of the model as it stands, before any physics.

use sinew_data::{Note, Run, Severity};
use sinew_effect::{Catalogue, Sensor};
use sinew_model::Robot;

use crate::Options;
use crate::before::as_measured;
use crate::comparison::Prepared;
use crate::problem::{Candidate, Problem};
use crate::residual::{Layout, ResidualForm};

// A torque whose square the model explains to this share can be judged for sign and size.
const CLEAR: f64 = 0.5;
// A factor between measured and model torque beyond this is no friction.
const FACTOR: f64 = 4.0;
// Two joints are swapped if exchanging them explains this much more, of two.
const SWAP: f64 = 0.4;

/// What is suspicious about the torques of motors and joints: opposite sign, another unit or side of the gear, swapped joints.
///
/// ```text
/// τ_measured ≈ a τ_model + b,   a < 0: sign;   |a| far from one: unit or gear;   R²(i, j) + R²(j, i) ≫ R²(i, i) + R²(j, j): swapped
/// ```
///
/// Empty where nothing can be said: no torque, too short a run, a model that explains little of any joint.
pub fn torque_checks(robot: &Robot, catalogue: &Catalogue, runs: &[Run], options: &Options) -> Vec<Note> {
    let robot = &as_measured(robot, catalogue, runs).0;
    let prepared = Prepared::new(robot, runs, options);
    prepared.map_or_else(|_| Vec::new(), |prepared| torque_notes(robot, catalogue, &prepared, options))
}

/// [`torque_checks`] of runs made ready.
pub(crate) fn torque_notes(
    robot: &Robot,
    catalogue: &Catalogue,
    prepared: &Prepared,
    options: &Options,
) -> Vec<Note> {
    let form = prepared.form(robot);
    let problem = Problem::new(robot, catalogue, &form, options);
    let Ok(model) = Candidate::new(&problem, robot.all_effects()) else { return Vec::new() };
    let residual = model.residual(&problem);
    let sensors = [Sensor::MotorTorque, Sensor::JointTorque];
    sensors
        .into_iter()
        .flat_map(|sensor| of_sensor(robot, prepared, form.layout(), &residual, sensor))
        .collect()
}

fn of_sensor(
    robot: &Robot,
    prepared: &Prepared,
    layout: &Layout,
    residual: &[f64],
    sensor: Sensor,
) -> Vec<Note> {
    let torques: Vec<usize> =
        (0..layout.channels.len()).filter(|&c| layout.channels[c].sensor == sensor).collect();
    let measured: Vec<Vec<f64>> = torques
        .iter()
        .map(|&c| prepared.records.iter().flat_map(|r| r.rows(&r.measured[c])).collect())
        .collect();
    let predicted: Vec<Vec<f64>> = torques
        .iter()
        .zip(&measured)
        .map(|(&c, measured)| {
            let rows = layout.of_channel(c).flat_map(|s| s.first..s.first + s.len);
            measured.iter().zip(rows).map(|(m, k)| m - residual[k]).collect()
        })
        .collect();
    let joint = |i: usize| robot.model.dof_name(layout.channels[torques[i]].dof);
    let place = |i: usize| format!("{}.{}", layout.channels[torques[i]].signal(), joint(i));
    let swapped = swaps(&measured, &predicted);
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
    notes.extend(alone.filter_map(|i| sign_or_size(place(i), &measured[i], &predicted[i])));
    notes
}

// A torque that follows the model's with the wrong sign or size.
fn sign_or_size(place: String, measured: &[f64], predicted: &[f64]) -> Option<Note> {
    let (slope, share) = regression(measured, predicted);
    if share < CLEAR {
        None
    } else if slope < 0.0 {
        let percent = 100.0 * share;
        let statement =
            format!("the torque has the opposite sign of the model's ({percent:.0} % explained by it)");
        let help = "write a negative scale in the columns map, or turn the joint's axis";
        Some(suspicion(Severity::Error, place, statement, help))
    } else if !(1.0 / FACTOR..FACTOR).contains(&slope) {
        let statement = format!("the torque is {slope:.3} times the model's");
        let help = "motor quantities are reflected to the link side (times the gear ratio), in N·m";
        Some(suspicion(Severity::Warning, place, statement, help))
    } else {
        None
    }
}

fn suspicion(severity: Severity, place: String, statement: String, help: &str) -> Note {
    Note { severity, place, statement, help: help.to_owned() }
}

// Pairs whose exchange explains much more.
fn swaps(measured: &[Vec<f64>], predicted: &[Vec<f64>]) -> Vec<(usize, usize)> {
    let share = |i: usize, j: usize| {
        let (slope, share) = regression(&measured[i], &predicted[j]);
        if slope > 0.0 { share } else { 0.0 }
    };
    let n = measured.len();
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
