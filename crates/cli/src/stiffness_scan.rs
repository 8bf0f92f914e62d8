//! `sinew stiffness --scan` and `--along`: many configurations at once.

use clap::Args;
use serde_json::{Value, json};
use sinew_data::{Quantity, RunSpec};
use sinew_linear::{StiffnessPoint, Wrench, configuration_grid, directions};
use sinew_model::Model;
use sinew_report::{number, quantity};

use crate::error::{CliError, did_you_mean};
use crate::position_argument::in_rad;
use crate::table::table;

/// Where to look beside one position.
#[derive(Debug, Args)]
pub(crate) struct Scan {
    /// Over a grid of joints, the others staying at --at: "joint=from..to,joint=from..to"
    #[arg(long, value_name = "J=FROM..TO,…", allow_hyphen_values = true, conflicts_with = "along")]
    scan: Option<String>,
    /// Steps of each joint of the grid
    #[arg(long, value_name = "N", default_value_t = 21, requires = "scan")]
    steps: usize,
    /// Along a run with joint_position.J
    #[arg(long, value_name = "RUN")]
    pub along: Option<RunSpec>,
}

/// Configurations of one command: more would fill the memory before anybody looks at them.
const MOST: usize = 1_000_000;

impl Scan {
    /// The configurations asked for; none for a single position.
    pub fn configurations(&self, at: &[f64], model: &Model) -> Result<Option<Vec<Vec<f64>>>, CliError> {
        if let Some(spec) = &self.along {
            return path(spec, at, model).map(Some);
        }
        let Some(text) = &self.scan else { return Ok(None) };
        let mut ranges: Vec<(usize, f64, f64, usize)> = Vec::new();
        for part in text.split(',') {
            let (dof, from, to) = range(text, part, model)?;
            let place = format!("--scan \"{text}\"");
            if ranges.iter().any(|range| range.0 == dof) {
                let what = format!("joint \"{}\" is named twice", model.dof_name(dof));
                return Err(CliError::usage(place, what, "give every joint one range"));
            }
            in_rad(&place, model, dof, from)?;
            in_rad(&place, model, dof, to)?;
            ranges.push((dof, from, to, self.steps));
        }
        let count = self.steps.checked_pow(ranges.len() as u32).filter(|&n| n <= MOST);
        if count.is_none() || self.steps < 2 {
            let what =
                format!("{} steps for {} joints (allowed 2 … {MOST} positions)", self.steps, ranges.len());
            return Err(CliError::usage("--steps", what, "scan fewer joints or take fewer steps"));
        }
        Ok(Some(configuration_grid(at, &ranges)))
    }
}

fn range(text: &str, part: &str, model: &Model) -> Result<(usize, f64, f64), CliError> {
    let names: Vec<String> = (0..model.nv).map(|dof| model.dof_name(dof).to_owned()).collect();
    let wrong = |what: String, meant: Option<String>| {
        let near = meant.map(|m| format!("{m} ")).unwrap_or_default();
        let help = format!(
            "{near}write joint=from..to, as in {}=-1..1; the joints are {}",
            names[0],
            names.join(", ")
        );
        CliError::usage(format!("--scan \"{text}\""), what, help)
    };
    let Some((joint, range)) = part.split_once('=') else {
        return Err(wrong(format!("\"{part}\" names no range"), None));
    };
    let joint = joint.trim();
    let Some(dof) = names.iter().position(|n| n == joint) else {
        return Err(wrong(format!("no joint \"{joint}\""), did_you_mean(joint, &names)));
    };
    let number = |x: &str| x.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let ends = range.split_once("..").and_then(|(from, to)| Some((number(from)?, number(to)?)));
    let (from, to) =
        ends.ok_or_else(|| wrong(format!("\"{range}\" is not a range of finite numbers"), None))?;
    Ok((dof, from, to))
}

fn path(spec: &RunSpec, at: &[f64], model: &Model) -> Result<Vec<Vec<f64>>, CliError> {
    let run = spec.read(None)?;
    let mut positions: Option<Vec<Vec<f64>>> = None;
    for dof in 0..model.nv {
        let Some(signal) = run.signal(Quantity::JointPosition, model.dof_name(dof)) else { continue };
        let rows = positions.get_or_insert_with(|| vec![at.to_vec(); signal.values.len()]);
        for ((row, value), time) in rows.iter_mut().zip(&signal.values).zip(&run.time) {
            in_rad(&format!("{} at {time} s", run.name), model, dof, *value)?;
            row[dof] = *value;
        }
    }
    positions.ok_or_else(|| {
        let help = format!("give it columns joint_position.J, as joint_position.{}", model.dof_name(0));
        CliError::usage(&run.name, "no joint of the robot has a position in this run", help)
    })
}

// How far it gives way: under the load, or softest per newton.
fn size(point: &StiffnessPoint, load: Option<&Wrench>) -> Option<f64> {
    match load {
        Some(_) => point.deflection.map(|x| x.fixed_rows::<3>(3).norm()),
        None => point
            .compliance_with_gravity
            .filter(|_| point.stable)
            .map(|C| directions(&C).translation[0].compliance),
    }
}

/// One object with all points.
pub(crate) fn object(head: Value, points: &[StiffnessPoint], load: Option<&Wrench>) -> Value {
    let point = |p: &StiffnessPoint| {
        let parts = directions(&p.compliance);
        json!({
            "q": p.q, "tool": p.place, "rank": parts.rank, "condition": parts.condition, "stable": p.stable,
            "translation": parts.translation.map(|a| a.compliance), "rotation": parts.rotation.map(|a| a.compliance),
            "deflection": p.deflection.as_ref().map(|x| x.as_slice()),
            "linear_deflection": load.map(|w| (p.compliance * w).as_slice().to_vec()),
        })
    };
    let mut value = head;
    value["load"] = json!(load.map(|w| w.as_slice()));
    value["points"] = points.iter().map(point).collect();
    value
}

/// Where it gives way most and least.
pub(crate) fn text(link: &str, points: &[StiffnessPoint], load: Option<&Wrench>) -> String {
    let mut known: Vec<(f64, &StiffnessPoint)> =
        points.iter().filter_map(|p| Some((size(p, load)?, p))).collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let what = if load.is_some() { "shift under the load" } else { "shift by 1 N in the softest direction" };
    let mut out = format!("{link}: {} configurations, {what}\n\n", points.len());
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return out + "none of them bears it\n";
    };
    let row = |name: &str, (size, p): &(f64, &StiffnessPoint)| {
        let list = |x: &[f64]| x.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ");
        vec![name.to_owned(), quantity(*size, "m"), format!("({})", list(&p.place)), list(&p.q)]
    };
    let rows = [row("least", first), row("median", &known[known.len() / 2]), row("most", last)];
    out += &table(&["", ">shift", "tool at, m", "q"], rows);
    let ranks: Vec<usize> = points.iter().map(|p| directions(&p.compliance).rank).collect();
    let full = ranks.iter().copied().max().unwrap_or(0);
    let singular = ranks.iter().filter(|&&r| r < full).count();
    out += &format!("\n\nrank {full}, lower in {singular} of them (singular positions)\n");
    if known.len() < points.len() {
        out += &format!("{} of them do not bear it\n", points.len() - known.len());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples;

    fn scan(text: &str, steps: usize) -> Result<Option<Vec<Vec<f64>>>, CliError> {
        let mut arm = samples::planar_arm(2, 1.0, 0.5);
        (arm.joints[0].limits.lower, arm.joints[0].limits.upper) = (-1.0, 1.5);
        let scan = Scan { scan: Some(text.to_owned()), steps, along: None };
        scan.configurations(&[0.5, 0.7], &arm)
    }

    #[test]
    fn a_grid_runs_through_the_joints_named() {
        let grid = scan("joint_2=-1..1", 3).unwrap().unwrap();
        assert_eq!(grid, [[0.5, -1.0], [0.5, 0.0], [0.5, 1.0]]);
        assert_eq!(scan("joint_2=-1..1, joint_1=0..2", 5).unwrap().unwrap().len(), 25);
    }

    #[test]
    fn a_wrong_grid_is_answered_with_the_way_out() {
        for (text, steps, word) in [
            ("joint_3=0..1", 3, "did you mean \"joint_"),
            ("joint_1", 3, "names no range"),
            ("joint_1=0..x", 3, "not a range"),
            ("joint_1=0..nan", 3, "not a range"),
            ("joint_1=0..1", 1, "--steps"),
            ("joint_1=0..1,joint_1=0..1", 3, "\"joint_1\" is named twice"),
            ("joint_1=0..100", 3, "\"100\" is far outside the limits of joint_1, -1 to 1.5 rad"),
            ("joint_1=-90..0", 3, "angles are in rad"),
            ("joint_1=0..1,joint_2=0..1", 100_000, "--steps"),
        ] {
            let message = scan(text, steps).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("help:"), "{message}");
        }
    }
}
