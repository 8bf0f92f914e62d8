//! Models of the slowest modes only.

use faer::Mat;
use faer::linalg::solvers::Solve;
use sinew_plant::Plant;

use crate::drives::connect;
use crate::modes::undamped_of;
use crate::state_space::Mechanical;
use crate::{LinearError, Options, StateSpace};

/// The linear model of the `modes` slowest undamped modes; the others follow without inertia, so that the gain at
/// rest is that of the whole robot.
///
/// ```text
/// x = Φ η,   Φᵀ M Φ = 1;   kept η: as they are;   dropped: 0 = A_dk x_k + A_dd x_d + B_d u
/// ```
///
/// States are `mode.1`, …, their rates `moded.1`, …, then own states of effects and lags of drives. Unlike balanced
/// truncation it has no bound of its error, but its states mean something: mode k is that of
/// [`modes`](crate::modes).
///
/// # Errors
/// As [`linearize_with`](crate::linearize_with), and if `modes` is zero or not less than the number of modes, or a
/// dropped mode meets no stiffness.
///
/// # Panics
/// If `p` or `q` has the wrong length.
///
/// Source: Craig, Kurdila, *Fundamentals of Structural Dynamics*, 2nd ed., Wiley 2006, chapter 11 (mode acceleration).
pub fn modal_truncation(
    plant: &Plant,
    p: &[f64],
    q: &[f64],
    options: &Options,
    modes: usize,
) -> Result<StateSpace, LinearError> {
    let mechanical = Mechanical::new(plant, p, q, options)?;
    let whole = connect(plant, p, &mechanical)?;
    let basis = undamped_of(plant, p, &mechanical)?;
    let np = basis.shapes.ncols();
    if modes == 0 || modes >= np {
        return Err(LinearError::Order { got: modes, least: 1, states: np });
    }
    let n = whole.A.nrows();
    // T = diag(Φ, Φ, 1),   T⁻¹ = diag(Φᵀ M, Φᵀ M, 1)
    let back = basis.shapes.transpose() * &basis.mass;
    let spread = |block: &Mat<f64>| {
        Mat::from_fn(n, n, |i, j| match (i / np.max(1), j / np.max(1)) {
            (a, b) if i < 2 * np && j < 2 * np && a == b => block[(i % np, j % np)],
            _ if i >= 2 * np && i == j => 1.0,
            _ => 0.0,
        })
    };
    let (T, inverse) = (spread(&basis.shapes), spread(&back));
    let (A, B, C) = (&inverse * &whole.A * &T, &inverse * &whole.B, &whole.C * &T);
    let slow = |k: usize| k % np < modes;
    let kept: Vec<usize> = (0..n).filter(|&k| k >= 2 * np || slow(k)).collect();
    let dropped: Vec<usize> = (0..2 * np).filter(|&k| !slow(k)).collect();
    let pick = |m: &Mat<f64>, rows: &[usize], columns: &[usize]| {
        Mat::from_fn(rows.len(), columns.len(), |i, j| m[(rows[i], columns[j])])
    };
    let (inputs, outputs): (Vec<usize>, Vec<usize>) = ((0..B.ncols()).collect(), (0..C.nrows()).collect());
    // x_d = −A_dd⁻¹ (A_dk x_k + B_d u)
    let lu = pick(&A, &dropped, &dropped).partial_piv_lu();
    let follow = lu.solve(&pick(&A, &dropped, &kept));
    let pushed = lu.solve(&pick(&B, &dropped, &inputs));
    if !(follow.norm_max().is_finite() && pushed.norm_max().is_finite()) {
        return Err(LinearError::Order { got: modes, least: basis.free(), states: np });
    }
    let (into, seen) = (pick(&A, &kept, &dropped), pick(&C, &outputs, &dropped));
    let name = |k: &usize| match *k {
        k if k < np => format!("mode.{}", k + 1),
        k if k < 2 * np => format!("moded.{}", k - np + 1),
        k => whole.states[k].clone(),
    };
    Ok(StateSpace {
        states: kept.iter().map(name).collect(),
        A: pick(&A, &kept, &kept) - &into * &follow,
        B: pick(&B, &kept, &inputs) - &into * &pushed,
        C: pick(&C, &outputs, &kept) - &seen * &follow,
        D: &whole.D - &seen * &pushed,
        ..whole
    })
}
