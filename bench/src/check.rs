//! Compares torques, mass matrices and accelerations with a file of expected ones.

use std::path::Path;

use sinew_model::Model;
use sinew_rigid::{forward_dynamics, inverse_dynamics, mass_matrix};

/// Largest error allowed, by one and the largest expected entry.
const TOLERANCE: f64 = 1e-7;

/// Reads `ROBOT.check` beside `ROBOT.urdf` if there is one; says on the error stream how far the results are from it.
///
/// The file holds the count of states, nq and nv, then for each state q, q̇, q̈, τ and M by rows, with a floating
/// base's velocity and torque in the order [linear; angular].
pub fn compare(model: &Model, urdf: &Path) {
    let Ok(text) = std::fs::read_to_string(urdf.with_extension("check")) else { return };
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().unwrap_or(f64::NAN));
    let mut take = |n: usize| -> Vec<f64> { numbers.by_ref().take(n).collect() };
    let head = take(3);
    let (nq, nv) = (model.nq, model.nv);
    if head.len() < 3 || (head[1] as usize, head[2] as usize) != (nq, nv) {
        eprintln!("check {}: positions in other numbers, not compared", model.name);
        return;
    }
    // place in the file of each degree of freedom
    let turned = |dof: usize| if crate::robot::is_free(model) && dof < 6 { (dof + 3) % 6 } else { dof };
    let (mut errors, mut scales) = ([0.0f64; 3], [0.0f64; 3]);
    for _ in 0..head[0] as usize {
        let q = take(nq);
        let [qd, qdd, tau] = [0; 3].map(|_| {
            let given = take(nv);
            (0..nv).map(|dof| given[turned(dof)]).collect::<Vec<f64>>()
        });
        let M = take(nv * nv);
        let mut compare = |k: usize, got: f64, want: f64| {
            errors[k] = errors[k].max((got - want).abs());
            scales[k] = scales[k].max(want.abs());
        };
        let got = [inverse_dynamics(model, &q, &qd, &qdd), forward_dynamics(model, &q, &qd, &tau)];
        let matrix = mass_matrix(model, &q);
        for i in 0..nv {
            compare(0, got[0][i], tau[i]);
            compare(2, got[1][i], qdd[i]);
            (0..nv).for_each(|j| compare(1, matrix[(i, j)], M[nv * turned(i) + turned(j)]));
        }
    }
    for (k, what) in ["rnea", "crba", "aba"].into_iter().enumerate() {
        let verdict = if errors[k] <= TOLERANCE * (1.0 + scales[k]) { "ok" } else { "MISMATCH" };
        eprintln!("check {:8} {what:6} sinew max|err| = {:.2e} {verdict}", model.name, errors[k]);
    }
}
