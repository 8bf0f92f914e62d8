//! Models of lower order.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use crate::lyapunov::{lyapunov, sign};
use crate::poles::{Poles, balance};
use crate::{LinearError, StateSpace};

/// A model of lower order, and what was lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduced {
    /// The model; its states are `r.1`, `r.2`, … and have no meaning of their own.
    pub model: StateSpace,
    /// The Hankel singular values of the stable part, the largest first: what each state contributes.
    pub hankel: Vec<f64>,
    /// States kept as they are because they are not stable: rigid-body motions and what falls over.
    pub kept: usize,
    /// Bound of the largest gain of the error at any frequency, ‖G − Gᵣ‖∞ ≤ 2 Σ σ of what was dropped, in the units
    /// of the outputs by those of the inputs.
    pub bound: f64,
}

// Poles with more than this share of the fastest to the left die out; nearer ones may be a double zero, which rounding
// moves by its root.
const STABLE: f64 = 1e-6;

/// Balanced truncation to `order` states.
///
/// ```text
/// A P + P Aᵀ + B Bᵀ = 0,   Aᵀ Q + Q A + Cᵀ C = 0,   σ² = eigenvalues of P Q
/// T⁻¹ P T⁻ᵀ = Tᵀ Q T = diag σ;   the states with the smallest σ are dropped
/// ```
///
/// The unstable and the free part (poles right of the imaginary axis, or within a millionth of the fastest pole of it) is
/// split off first and kept as it is.
/// Inputs and outputs weigh as their units make them: choose those that matter with [`StateSpace::part`], and scale
/// them where units are mixed. Dead times pass through.
///
/// # Errors
/// If the order is less than the part that must be kept or not less than the number of states, or a Gramian does not check.
///
/// # Panics
/// If `linear` is of discrete time.
///
/// Source: Moore, IEEE Trans. Automatic Control 26(1), 1981; Glover, Int. J. Control 39(6), 1984 (the bound); Laub,
/// Heath, Paige, Ward, IEEE Trans. Automatic Control 32(2), 1987 (the square-root algorithm).
pub fn balanced_truncation(linear: &StateSpace, order: usize) -> Result<Reduced, LinearError> {
    assert!(linear.sample_time.is_none(), "linear: a system of continuous time");
    let n = linear.A.nrows();
    let scale = balance(&linear.A);
    let A = Mat::from_fn(n, n, |i, j| linear.A[(i, j)] * scale[j] / scale[i]);
    let B = Mat::from_fn(n, linear.B.ncols(), |i, j| linear.B[(i, j)] / scale[i]);
    let C = Mat::from_fn(linear.C.nrows(), n, |i, j| linear.C[(i, j)] * scale[j]);
    let split = split(&A)?;
    let kept = n - split.stable;
    if order < kept || order >= n {
        return Err(LinearError::Order { got: order, least: kept, states: n });
    }
    // T⁻¹ A T = diag(A_s, A_u)
    let lu = split.basis.partial_piv_lu();
    let (At, Bt) = (lu.solve(&(&A * &split.basis)), lu.solve(&B));
    let Ct = &C * &split.basis;
    let s = split.stable;
    let block = |r: usize, c: usize, h: usize, w: usize| At.submatrix(r, c, h, w).to_owned();
    let (As, Au) = (block(0, 0, s, s), block(s, s, kept, kept));
    let (Bs, Bu) = (Bt.submatrix(0, 0, s, B.ncols()).to_owned(), Bt.submatrix(s, 0, kept, B.ncols()));
    let (Cs, Cu) = (Ct.submatrix(0, 0, C.nrows(), s).to_owned(), Ct.submatrix(0, s, C.nrows(), kept));
    let L = root(&lyapunov(&As, &Bs)?);
    let R = root(&lyapunov(&As.transpose().to_owned(), &Cs.transpose().to_owned())?);
    // Rᵀ L = U Σ Vᵀ,   T = L V Σ^(−½),   T⁻¹ = Σ^(−½) Uᵀ Rᵀ
    let hankel_map = R.transpose() * &L;
    let size = || LinearError::Gramian { size: s, residual: f64::NAN, allowed: 0.0 };
    let svd = hankel_map.svd().map_err(|_| size())?;
    let sigma: Vec<f64> = (0..s).map(|k| svd.S().column_vector()[k]).collect();
    let wanted = order - kept;
    // States that nothing reaches or shows cannot be balanced; they are no part of the answer either.
    let rank = sigma.iter().take_while(|v| **v > f64::EPSILON * s as f64 * sigma[0]).count();
    let r = wanted.min(rank);
    let half = |k: usize| sigma[k].sqrt();
    let V = Mat::from_fn(s, r, |i, k| svd.V()[(i, k)] / half(k));
    let U = Mat::from_fn(s, r, |i, k| svd.U()[(i, k)] / half(k));
    let (T, back) = (&L * V, (R * U).transpose().to_owned());
    let (Ar, Br, Cr) = (&back * &As * &T, &back * &Bs, &Cs * &T);
    let states = r + kept;
    let model = StateSpace {
        states: (1..=states).map(|k| format!("r.{k}")).collect(),
        A: Mat::from_fn(states, states, |i, j| match (i < r, j < r) {
            (true, true) => Ar[(i, j)],
            (false, false) => Au[(i - r, j - r)],
            _ => 0.0,
        }),
        B: Mat::from_fn(states, B.ncols(), |i, j| if i < r { Br[(i, j)] } else { Bu[(i - r, j)] }),
        C: Mat::from_fn(C.nrows(), states, |i, j| if j < r { Cr[(i, j)] } else { Cu[(i, j - r)] }),
        ..linear.clone()
    };
    let bound = 2.0 * sigma[r..].iter().sum::<f64>();
    Ok(Reduced { model, hankel: sigma, kept, bound })
}

// A basis whose first columns span the motions that die out.
struct Split {
    basis: Mat<f64>,
    stable: usize,
}

fn split(A: &Mat<f64>) -> Result<Split, LinearError> {
    let n = A.nrows();
    let poles = Poles::of(A)?.values;
    let fastest = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let left = |re: f64| re < -STABLE * fastest;
    let stable = poles.iter().filter(|p| left(p.re)).count();
    if stable == n {
        return Ok(Split { basis: Mat::identity(n, n), stable });
    }
    // A line between the two: halfway, in logarithm, from the tolerance to the slowest that dies out.
    let slowest = poles.iter().filter(|p| left(p.re)).map(|p| -p.re).fold(f64::INFINITY, f64::min);
    let line = if stable == 0 { 0.0 } else { (STABLE * fastest * slowest).sqrt() };
    let unsplit = || LinearError::Gramian { size: n, residual: f64::NAN, allowed: 0.0 };
    if stable == 0 {
        return Ok(Split { basis: Mat::identity(n, n), stable });
    }
    let shifted = Mat::from_fn(n, n, |i, j| A[(i, j)] + if i == j { line } else { 0.0 });
    let S = sign(&shifted).ok_or_else(unsplit)?;
    // Projectors ½ (1 ∓ sign) onto what dies out and what does not.
    let basis = |toward: f64, count: usize| -> Result<Mat<f64>, LinearError> {
        let P = Mat::from_fn(n, n, |i, j| 0.5 * (f64::from(i == j) + toward * S[(i, j)]));
        let svd = P.svd().map_err(|_| unsplit())?;
        Ok(svd.U().submatrix(0, 0, n, count).to_owned())
    };
    let (dies, stays) = (basis(-1.0, stable)?, basis(1.0, n - stable)?);
    let basis = Mat::from_fn(n, n, |i, j| if j < stable { dies[(i, j)] } else { stays[(i, j - stable)] });
    Ok(Split { basis, stable })
}

// L of P = L Lᵀ for a semidefinite P.
fn root(P: &Mat<f64>) -> Mat<f64> {
    let n = P.nrows();
    match P.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) => {
            let value = |k: usize| eigen.S().column_vector()[k].max(0.0).sqrt();
            Mat::from_fn(n, n, |i, k| eigen.U()[(i, k)] * value(k))
        }
        // Checked Gramians are finite and symmetric.
        Err(_) => Mat::zeros(n, n),
    }
}

impl StateSpace {
    /// The same system with some inputs and outputs only, by name and in this order; none for all.
    ///
    /// # Errors
    /// If there is no such signal.
    pub fn part(&self, inputs: &[String], outputs: &[String]) -> Result<Self, LinearError> {
        let places = |wanted: &[String], known: &[String]| -> Result<Vec<usize>, LinearError> {
            if wanted.is_empty() {
                return Ok((0..known.len()).collect());
            }
            let place = |name: &String| {
                let place = known.iter().position(|k| k == name);
                place.ok_or_else(|| crate::transfer::no_signal(name, known))
            };
            wanted.iter().map(place).collect()
        };
        let (columns, rows) = (places(inputs, &self.inputs)?, places(outputs, &self.outputs)?);
        let (n, m, p) = (self.A.nrows(), columns.len(), rows.len());
        Ok(Self {
            inputs: columns.iter().map(|&j| self.inputs[j].clone()).collect(),
            outputs: rows.iter().map(|&i| self.outputs[i].clone()).collect(),
            B: Mat::from_fn(n, m, |i, j| self.B[(i, columns[j])]),
            C: Mat::from_fn(p, n, |i, j| self.C[(rows[i], j)]),
            D: Mat::from_fn(p, m, |i, j| self.D[(rows[i], columns[j])]),
            input_delay: columns.iter().map(|&j| self.input_delay[j]).collect(),
            output_delay: rows.iter().map(|&i| self.output_delay[i]).collect(),
            ..self.clone()
        })
    }
}
