//! Load tests as a table: where the robot stood, what pushed, how far its tool gave way.

use std::path::Path;

use nalgebra::Vector6;
use sinew_data::{DataError, read_text};
use sinew_linear::{LoadTest, Wrench};
use sinew_model::{JointKind, LinkId, Model};
use sinew_report::number;

use crate::error::{CliError, did_you_mean};

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    Joint(usize),
    /// A component of [moment; force].
    Load(usize),
    /// A component of [rotation vector; shift].
    Deflection(usize),
}

/// One row of the table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    q: Vec<f64>,
    load: Wrench,
    deflection: [Option<f64>; 6],
}

impl Row {
    /// The test of this row, each measured component with the standard deviation of its kind: [turns, shifts].
    pub fn test(&self, std: [f64; 2]) -> LoadTest {
        let std_of = |k: usize| if self.deflection[k].is_some() { std[k / 3] } else { f64::INFINITY };
        LoadTest {
            q: self.q.clone(),
            load: self.load,
            deflection: Vector6::from_fn(|k, _| self.deflection[k].unwrap_or(0.0)),
            std: Vector6::from_fn(|k, _| std_of(k)),
        }
    }

    // What the load does on its way, J; none if it acts along something that was not measured.
    fn work(&self) -> Option<f64> {
        let loaded = (0..6).filter(|&k| self.load[k] != 0.0);
        loaded.map(|k| Some(self.load[k] * self.deflection[k]?)).sum()
    }

    /// Whether a turn and whether a shift was measured.
    pub fn kinds(&self) -> [bool; 2] {
        [0, 3].map(|first| self.deflection[first..first + 3].iter().any(Option::is_some))
    }
}

/// What is told of loads that do work below zero in all, as no springs let them.
///
/// ```text
/// wᵀ x = wᵀ C w > 0
/// ```
pub(crate) fn against_the_load(rows: &[Row]) -> Option<String> {
    let work: f64 = rows.iter().filter_map(Row::work).sum();
    (work < 0.0).then(|| {
        format!(
            "the link moves against its loads (they do {} J in all), which no springs do\n  help: look at the signs of the loads and of the deflections, both in the axes of the base",
            number(work)
        )
    })
}

// Nobody bends a joint by so much, rad, to see how stiff it is.
const MUCH: f64 = 0.1;

/// What is told of deflections that are too large to be in m and rad: shifts of a tenth of what lies between the first joint and the
/// link, turns of 0.1 rad.
pub(crate) fn too_large(rows: &[Row], model: &Model, link: LinkId) -> Option<String> {
    let largest = |first: usize| {
        let all = rows.iter().flat_map(|row| &row.deflection[first..first + 3]).flatten();
        all.fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    let (turn, shift) = (largest(0), largest(3));
    let of = |what: &str, got: f64, unit: &str, against: &str| {
        format!(
            "a {what} of {} {unit} is very much for a load test{against}\n  help: shifts are in m, turns in rad",
            number(got)
        )
    };
    if let Some(reach) = reach(model, link).filter(|reach| shift > MUCH * reach) {
        let against = format!(" (from the first joint to the link it is {} m)", number(reach));
        return Some(of("shift", shift, "m", &against));
    }
    (turn > MUCH).then(|| of("turn", turn, "rad", ""))
}

// The length of all that lies between the first joint and the link, m; none if not all of the joints turn.
fn reach(model: &Model, link: LinkId) -> Option<f64> {
    let link = &model.links[link.0];
    let (mut length, mut body) = (link.body_from_link.translation.norm(), link.body);
    while let Some(id) = body {
        let joint = &model.joints[id.0];
        if !matches!(joint.kind, JointKind::Revolute { .. }) {
            return None;
        }
        // The first joint stands where it stands.
        length += joint.parent.map_or(0.0, |_| joint.placement.translation.norm());
        body = joint.parent;
    }
    Some(length)
}

/// The load tests in the file at `path`, unpacked if it is gzip. Joints without a column stay at `at`; an empty deflection was not measured.
///
/// # Errors
/// Names file, line and column of what cannot be read, and what may stand there.
pub(crate) fn read(path: &Path, at: &[f64], model: &Model) -> Result<Vec<Row>, CliError> {
    let file = path.display().to_string();
    let broken = |source: csv::Error| {
        let place = match source.position() {
            Some(p) => format!("{file}:{}", p.line()),
            None => file.clone(),
        };
        CliError::usage(place, format!("cannot be read ({source})"), "give a CSV file with a line of names")
    };
    let text = read_text(path).map_err(|source| match source {
        DataError::Missing { .. } => {
            CliError::usage(&file, "no such file", "check the path; load tests are a .csv or .csv.gz file")
        }
        other => other.into(),
    })?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let names: Vec<String> = reader.headers().map_err(broken)?.iter().map(str::to_owned).collect();
    let columns = columns(&file, &names, model)?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(0, |p| p.line());
        let mut row = Row { q: at.to_vec(), load: Wrench::zeros(), deflection: [None; 6] };
        for ((column, name), text) in columns.iter().zip(&names).zip(&record) {
            let number = text.parse().ok().filter(|x: &f64| x.is_finite());
            let wrong = |empty: &str| {
                let what = format!("\"{name}\" is \"{text}\" (allowed a finite number{empty})");
                CliError::usage(format!("{file}:{line}"), what, "leave the row out if it was not measured")
            };
            match (*column, number) {
                (Column::Deflection(k), _) if text.is_empty() => row.deflection[k] = None,
                (Column::Deflection(_), None) => return Err(wrong(", or nothing if not measured")),
                (_, None) => return Err(wrong("")),
                (Column::Deflection(k), Some(x)) => row.deflection[k] = Some(x),
                (Column::Load(k), Some(x)) => row.load[k] = x,
                (Column::Joint(dof), Some(x)) => row.q[dof] = x,
            }
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(CliError::usage(file, "no load test in it", "one row for each load"));
    }
    Ok(rows)
}

fn columns(file: &str, names: &[String], model: &Model) -> Result<Vec<Column>, CliError> {
    let axes = ["x", "y", "z"];
    let of = |quantity: &str, first: usize, make: fn(usize) -> Column| -> Vec<(String, Column)> {
        (0..3).map(|k| (format!("{quantity}.{}", axes[k]), make(first + k))).collect()
    };
    let joint = |dof: usize| (format!("joint_position.{}", model.dof_name(dof)), Column::Joint(dof));
    let known: Vec<(String, Column)> = [
        (0..model.nv).map(joint).collect(),
        of("tool_force", 3, Column::Load),
        of("tool_moment", 0, Column::Load),
        of("tool_shift", 3, Column::Deflection),
        of("tool_turn", 0, Column::Deflection),
    ]
    .concat();
    let all: Vec<String> = known.iter().map(|(name, _)| name.clone()).collect();
    let mut columns = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let Some((_, column)) = known.iter().find(|(known, _)| known == name) else {
            let columns = || format!("the columns are {}", all.join(", "));
            let help = did_you_mean(name, &all).unwrap_or_else(columns);
            return Err(CliError::usage(format!("{file}:1"), format!("no quantity \"{name}\""), help));
        };
        if names[..k].contains(name) {
            let what = format!("the column \"{name}\" stands there twice");
            return Err(CliError::usage(format!("{file}:1"), what, "leave one of them out"));
        }
        columns.push(*column);
    }
    for (needed, has, example) in [
        (
            "load",
            columns.iter().any(|c| matches!(c, Column::Load(_))),
            "tool_force.z in N, tool_moment.x in N·m",
        ),
        (
            "deflection",
            columns.iter().any(|c| matches!(c, Column::Deflection(_))),
            "tool_shift.z in m, tool_turn.x in rad",
        ),
    ] {
        if !has {
            let what = format!("no column of a {needed} (it has {})", names.join(", "));
            let help = format!(
                "give it {example}, in base axes; what is not there is {}",
                match needed {
                    "load" => "zero",
                    _ => "not measured",
                }
            );
            return Err(CliError::usage(format!("{file}:1"), what, help));
        }
    }
    Ok(columns)
}
