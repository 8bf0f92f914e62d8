//! Natural frequencies, mode shapes, and what damping makes of them.

use core::f64::consts::TAU;

use faer::{Mat, Side, c64};
use sinew_plant::Plant;

use crate::participation::Energies;
use crate::poles::{ORDINARY, Poles, ZERO_POLE};
use crate::state_space::Mechanical;
use crate::{Described, Equilibrium, LinearError, Options, Share};

/// A natural mode of a robot at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// ω² of the undamped robot, (rad/s)²; exactly zero for a motion that meets no stiffness, negative for one
    /// that falls over.
    pub omega_squared: f64,
    /// ω, rad/s; zero unless ω² is positive.
    pub omega: f64,
    /// ω/2π, Hz.
    pub frequency: f64,
    /// ζ of its poles; above one if they are real, none if it has no restoring force.
    pub damping_ratio: Option<f64>,
    /// The poles of the damped robot that belong to it, rad/s.
    pub poles: Vec<c64>,
    /// True if no pole is in the right half plane.
    pub stable: bool,
    /// The shape by coordinate (`q.J` on the link side, `theta.J` on the motor side, `v.LINK.K` of a link that bends), with φᵀMφ = 1 and its
    /// largest entry positive.
    pub shape: Vec<(String, f64)>,
    /// Where its potential energy is: springs, gravity, effects; the largest first, empty for a motion that meets no
    /// stiffness.
    pub participation: Vec<Share>,
    /// Where its kinetic energy is: links and motors; the largest first.
    pub motion: Vec<Share>,
}

// |ω²| below this share of the largest is rounding.
const ZERO: f64 = 1e-12;
// |Im λ| and Re λ below these shares of the largest are rounding.
const REAL: f64 = 1e-10;
const STABLE: f64 = 1e-9;

/// The modes of `plant` with parameters `p` at rest with links at `q`, slowest first.
///
/// ```text
/// K φ = ω² M φ,   φ over [q; θ of elastic joints; virtual joints],   φᵀ M φ = 1
/// ```
///
/// M and K are those of the whole robot, rotors, springs and gravity included. Each pole of the damped robot goes
/// to the mode whose shape it shares most. Lag and delay of drives are no part of a mode.
///
/// # Errors
/// As [`linearize`](crate::linearize), if M is not positive definite, or the eigenvalues do not check.
///
/// # Panics
/// If `p` or `q` has the wrong length.
///
/// # Example
/// A hanging link swings with ω² = m g l/J:
/// ```
/// use sinew_model::{Robot, samples::hanging_link};
/// use sinew_plant::Plant;
/// let robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4));
/// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let modes = sinew_linear::modes(&plant, &[], &[0.0]).unwrap();
/// assert!((modes[0].omega_squared - 2.0 * 9.81 * 0.4 / 0.5).abs() < 1e-12);
/// assert_eq!(modes[0].participation[0].part, "gravity");
/// ```
pub fn modes(plant: &Plant, p: &[f64], q: &[f64]) -> Result<Vec<Mode>, LinearError> {
    Ok(modes_with(plant, p, q, &Options::default())?.modes)
}

/// The modes of a robot, and what was put in place of effects that are not linear.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Slowest first.
    pub modes: Vec<Mode>,
    /// Where the robot rests.
    pub at: Equilibrium,
    /// The effects that are not linear over the amplitude of interest.
    pub described: Vec<Described>,
}

/// [`modes`] with another treatment of effects that are not linear.
///
/// # Errors
/// As [`modes`], and if such an effect is to be refused.
///
/// # Panics
/// If `p` or `q` has the wrong length.
pub fn modes_with(plant: &Plant, p: &[f64], q: &[f64], options: &Options) -> Result<Modes, LinearError> {
    let mechanical = Mechanical::new(plant, p, q, options)?;
    let mut energies = Energies::new(plant, p, &mechanical);
    let layout = &mechanical.linearizer.layout;
    let (n, A) = (layout.positions(), &mechanical.matrices.A);
    let Undamped { omega_squared, shapes, .. } = undamped_by(plant, &energies, &mechanical)?;
    let poles = Poles::of(A)?;
    let owned = shared_out(&poles, &energies.mass, &shapes);
    let fastest = poles.values.iter().map(|l| l.norm()).fold(ORDINARY, f64::max);
    let stiffest = omega_squared.iter().fold(ORDINARY * ORDINARY, |s: f64, w| s.max(w.abs()));
    let names = layout.position_names(plant);
    let potential = energies.potential(&shapes, stiffest);
    let mut mode = |(k, participation): (usize, Vec<Share>)| {
        let omega_squared = omega_squared[k];
        let settle = |l: c64| {
            let zero = omega_squared == 0.0 && l.norm() < ZERO_POLE * fastest;
            if zero { c64::new(0.0, 0.0) } else { l }
        };
        let poles: Vec<c64> = owned[k].iter().map(|&l| settle(l)).collect();
        let omega = omega_squared.max(0.0).sqrt();
        let shape: Vec<f64> = (0..n).map(|i| shapes[(i, k)]).collect();
        Mode {
            omega_squared,
            omega,
            frequency: omega / TAU,
            damping_ratio: damping_ratio(&poles, REAL * fastest),
            stable: poles.iter().all(|l| l.re <= STABLE * fastest),
            poles,
            participation,
            motion: energies.kinetic(&shape),
            shape: names.iter().cloned().zip(shape).collect(),
        }
    };
    let modes = potential.into_iter().enumerate().map(&mut mode).collect();
    Ok(Modes { modes, at: mechanical.at.clone(), described: mechanical.described.clone() })
}

/// The undamped modes by themselves.
pub(crate) struct Undamped {
    /// ω², ascending.
    pub omega_squared: Vec<f64>,
    /// Mass-normalised shapes in columns.
    pub shapes: Mat<f64>,
    /// M.
    pub mass: Mat<f64>,
}

impl Undamped {
    /// The number of modes up to the last that meets no stiffness.
    pub fn free(&self) -> usize {
        self.omega_squared.iter().rposition(|w| *w == 0.0).map_or(0, |k| k + 1)
    }
}

/// The undamped modes of a linear model.
pub(crate) fn undamped_of(
    plant: &Plant,
    p: &[f64],
    mechanical: &Mechanical,
) -> Result<Undamped, LinearError> {
    undamped_by(plant, &Energies::new(plant, p, mechanical), mechanical)
}

fn undamped_by(plant: &Plant, energies: &Energies, mechanical: &Mechanical) -> Result<Undamped, LinearError> {
    let n = mechanical.linearizer.layout.positions();
    // At rest M q̈ = −K x, so K = −M ∂q̈/∂x; symmetric but for rounding where all forces are conservative.
    let raw = -(&energies.mass * mechanical.matrices.A.submatrix(n, 0, n, n));
    let K = Mat::from_fn(n, n, |i, j| 0.5 * (raw[(i, j)] + raw[(j, i)]));
    let (omega_squared, shapes) = undamped(&energies.mass, &K)
        .ok_or_else(|| LinearError::Massless { robot: plant.model().name.clone() })?;
    Ok(Undamped { omega_squared, shapes, mass: energies.mass.clone() })
}

// ω², ascending, and mass-normalised shapes in columns; none if M is not definite.
fn undamped(M: &Mat<f64>, K: &Mat<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = M.nrows();
    // M = L Lᵀ,   W = L⁻¹ K L⁻ᵀ,   W u = ω² u,   φ = L⁻ᵀ u
    let cholesky = M.llt(Side::Lower).ok()?;
    let L = cholesky.L();
    let mut half = K.clone();
    L.solve_lower_triangular_in_place(&mut half);
    let mut W = half.transpose().to_owned();
    L.solve_lower_triangular_in_place(&mut W);
    let eigen = W.self_adjoint_eigen(Side::Lower).ok()?;
    let values: Vec<f64> = (0..n).map(|k| eigen.S().column_vector()[k]).collect();
    let largest = values.iter().fold(ORDINARY * ORDINARY, |s: f64, v| s.max(v.abs()));
    let mut shapes = eigen.U().to_owned();
    L.transpose().solve_upper_triangular_in_place(&mut shapes);
    for k in 0..n {
        let column = (0..n).map(|i| shapes[(i, k)]);
        let peak = column.fold(0.0, |s: f64, x| if x.abs() > s.abs() { x } else { s });
        for i in 0..n {
            shapes[(i, k)] *= peak.signum();
        }
    }
    let values = values.into_iter().map(|v| if v.abs() <= ZERO * largest { 0.0 } else { v });
    Some((values.collect(), shapes))
}

// The poles of each mode, two at most: whole pairs and single real poles, each to the mode whose shape its motion
// shares most, the clearest first.
fn shared_out(poles: &Poles, M: &Mat<f64>, shapes: &Mat<f64>) -> Vec<Vec<c64>> {
    let n = M.nrows();
    let fastest = poles.values.iter().map(|l| l.norm()).fold(0.0, f64::max);
    let weights = shapes.transpose() * M;
    let mut claims = Vec::new();
    for (k, pole) in poles.values.iter().enumerate() {
        if pole.im < -REAL * fastest {
            continue;
        }
        // c = Φᵀ M v: the motion of the pole as a sum of shapes
        let share = |mode: usize| {
            let c: c64 = (0..n).map(|i| poles.vectors[(i, k)] * weights[(mode, i)]).sum();
            c.norm_sqr()
        };
        let shares: Vec<f64> = (0..n).map(share).collect();
        let total: f64 = shares.iter().sum();
        claims.extend((0..n).map(|mode| (shares[mode] / total, k, mode)));
    }
    claims.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut given = vec![false; poles.values.len()];
    let mut owned = vec![Vec::new(); n];
    for (_, k, mode) in claims {
        let pole = poles.values[k];
        let pair = pole.im > REAL * fastest;
        let room = 2 - owned[mode].len();
        if given[k] || room < if pair { 2 } else { 1 } {
            continue;
        }
        given[k] = true;
        owned[mode].push(pole);
        if pair {
            owned[mode].push(pole.conj());
        }
    }
    owned
}

// ζ = −(λ₁ + λ₂)/(2 √(λ₁ λ₂)) for a conjugate pair or two real poles of one sign.
fn damping_ratio(poles: &[c64], real: f64) -> Option<f64> {
    let &[a, b] = poles else { return None };
    let (sum, product) = (a + b, a * b);
    (product.re > real * real).then(|| -sum.re / (2.0 * product.re.sqrt()))
}
