//! `[[couplings]]`: transmissions with a full stiffness matrix.

use std::collections::HashMap;

use serde_spanned::Spanned;
use sinew_model::{Coupling, Robot};

use crate::UrdfError;
use crate::assembly::require_dof;
use crate::definite::is_positive;
use crate::grammar::{CouplingTable, Number};
use crate::source::{Source, shown};

// Two entries typed by hand may differ by rounding.
const SYMMETRIC: f64 = 1e-9;
// A semidefinite matrix may have eigenvalues that rounding makes negative.
const ROUNDING: f64 = 1e-12;

/// Checks the couplings of a robot whose joints' own springs are already read.
pub(crate) fn couplings(
    robot: &Robot,
    tables: &[CouplingTable],
    source: Source,
) -> Result<Vec<Coupling>, UrdfError> {
    let mut seen: HashMap<usize, u32> = HashMap::new();
    tables.iter().map(|table| coupling(robot, table, source, &mut seen)).collect()
}

fn coupling(
    robot: &Robot,
    table: &CouplingTable,
    source: Source,
    seen: &mut HashMap<usize, u32>,
) -> Result<Coupling, UrdfError> {
    let names = table.joints.get_ref();
    let n = names.len();
    if n < 2 {
        let help = "a single joint has its stiffness in [joints.J]";
        let what = "couplings.joints: nothing to couple".to_owned();
        return Err(source.value(table.joints.span(), what, format!("{n} joints"), "two or more", help));
    }
    let mut dofs = Vec::with_capacity(n);
    for name in names {
        let dof = require_dof(&robot.model, name, source)?;
        let at = source.at(name.span());
        if let Some(first) = seen.insert(dof, at.line) {
            let what = format!("joint \"{}\" is coupled", name.get_ref());
            return Err(UrdfError::Twice {
                at,
                what,
                first,
                help: "put all joints that act on each other in one coupling",
            });
        }
        if let Some(k) = robot.joints[dof].stiffness {
            let what = format!("joint \"{}\" is coupled and has a stiffness of its own", name.get_ref());
            let help = "move it to the coupling's diagonal";
            return Err(source.value(name.span(), what, shown(k), "one of the two", help));
        }
        dofs.push(dof);
    }
    let stiffness = matrix(&table.stiffness, "couplings.stiffness", n, source)?;
    if !is_positive(&stiffness, n, 0.0) {
        return Err(indefinite(&table.stiffness, "couplings.stiffness: not positive definite", source));
    }
    let damping = match &table.damping {
        None => vec![0.0; n * n],
        Some(rows) => {
            let damping = matrix(rows, "couplings.damping", n, source)?;
            let largest = damping.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
            if !is_positive(&damping, n, n as f64 * ROUNDING * largest) {
                return Err(indefinite(rows, "couplings.damping: not positive semidefinite", source));
            }
            damping
        }
    };
    Ok(Coupling { dofs, stiffness, damping })
}

type Rows = Spanned<Vec<Vec<Number>>>;

// n × n, finite, symmetric.
fn matrix(rows: &Rows, key: &str, n: usize, source: Source) -> Result<Vec<f64>, UrdfError> {
    let bad = |what: &str, got: String, allowed: &str, help: &'static str| {
        source.value(rows.span(), format!("{key}: {what}"), got, allowed, help)
    };
    let values: Vec<f64> = rows.get_ref().iter().flatten().map(|x| x.0).collect();
    if rows.get_ref().len() != n || rows.get_ref().iter().any(|row| row.len() != n) {
        let lengths: Vec<_> = rows.get_ref().iter().map(|r| r.len().to_string()).collect();
        let got =
            format!("rows of {}", if lengths.is_empty() { "nothing".to_owned() } else { lengths.join(", ") });
        let allowed = format!("{n} rows of {n}");
        return Err(bad("wrong size", got, &allowed, "give one row for each joint, in the order of joints"));
    }
    if let Some(x) = values.iter().find(|x| !x.is_finite()) {
        return Err(bad("not finite", shown(*x), "finite numbers", "state every entry"));
    }
    let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for i in 0..n {
        for j in 0..i {
            let (a, b) = (values[i * n + j], values[j * n + i]);
            if (a - b).abs() > SYMMETRIC * largest {
                let got = format!("{a:?} and {b:?} in rows {} and {}", i + 1, j + 1);
                return Err(bad(
                    "not symmetric",
                    got,
                    "equal entries",
                    "write the same number on both sides of the diagonal",
                ));
            }
        }
    }
    Ok(values)
}

fn indefinite(rows: &Rows, what: &str, source: Source) -> UrdfError {
    let shown: Vec<Vec<f64>> = rows.get_ref().iter().map(|r| r.iter().map(|x| x.0).collect()).collect();
    let help = "no motion may release energy: enlarge the diagonal or reduce the coupling";
    source.value(rows.span(), what.to_owned(), format!("{shown:?}"), "positive eigenvalues", help)
}
