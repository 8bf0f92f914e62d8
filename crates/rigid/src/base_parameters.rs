//! Which combinations of inertial parameters the torques depend on.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};
use sinew_model::samples::Random;
use sinew_model::{Model, math};

use crate::{PARAMETERS, Workspace, regressor_into};

/// The combinations of inertial parameters that torques depend on: the most that torques can tell.
///
/// ```text
/// τ = Y π = Y_leaders (K π)
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BaseParameters {
    /// The groups, in the order of their leaders.
    pub groups: Vec<ParameterGroup>,
    /// Parameters, by column of the regressor, that no torque feels.
    pub unfelt: Vec<usize>,
    // Words for each of the parameters.
    names: Vec<String>,
}

/// Parameters that torques feel only together.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterGroup {
    /// The parameter that stands for the group, by its column in the regressor.
    pub leader: usize,
    /// The others: column and factor.
    pub others: Vec<(usize, f64)>,
}

/// A column whose rest, after those before it are taken out, is this share of itself or less depends on them.
const DEPENDENT: f64 = 1e-8;
/// A factor below this is rounding.
const NOTHING: f64 = 1e-9;
/// Rows for each parameter: enough for chance not to hide a dependence or feign one.
const ROWS: usize = 3;
const WORDS: [&str; PARAMETERS] = [
    "mass",
    "first moment x",
    "first moment y",
    "first moment z",
    "inertia xx",
    "inertia xy",
    "inertia yy",
    "inertia xz",
    "inertia yz",
    "inertia zz",
];

/// The base parameters of a robot, by a rank-revealing QR factorisation of its regressor at seeded random motions.
///
/// Columns are taken from the base to the tip, so a link's parameters lead and those of the links it carries join
/// them.
///
/// # Example
/// A pendulum's torque tells its inertia about the pivot and two first moments:
/// ```
/// let base = sinew_rigid::base_parameters(&sinew_model::samples::pendulum(2.0, 0.5));
/// assert_eq!(base.in_words(), ["first moment x of rod", "first moment z of rod", "inertia yy of rod"]);
/// ```
/// Source: Gautier, *Numerical calculation of the base inertial parameters of robots*, J. Robotic Systems 8(4), 1991.
pub fn base_parameters(model: &Model) -> BaseParameters {
    let W = random_regressor(model);
    let mut base = BaseParameters { groups: Vec::new(), unfelt: Vec::new(), names: names(model) };
    // Q R of the leaders' columns, one after the other
    let (mut Q, mut R): (Vec<DVector<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let largest = W.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
    for (column, w) in W.column_iter().enumerate() {
        let norm = w.norm();
        if norm <= DEPENDENT * largest {
            base.unfelt.push(column);
            continue;
        }
        // orthogonalised twice, or rounding would feign independence
        let (mut rest, mut along) = (w.into_owned(), vec![0.0; Q.len()]);
        for _ in 0..2 {
            for (q, sum) in Q.iter().zip(&mut along) {
                let share = q.dot(&rest);
                rest.axpy(-share, q, 1.0);
                *sum += share;
            }
        }
        let left = rest.norm();
        if left > DEPENDENT * norm {
            along.push(left);
            Q.push(rest / left);
            R.push(along);
            base.groups.push(ParameterGroup { leader: column, others: Vec::new() });
            continue;
        }
        // w = W_leaders x,   R x = Qᵀ w
        for k in (0..R.len()).rev() {
            along[k] /= R[k][k];
            let x = along[k];
            for i in 0..k {
                along[i] -= R[k][i] * x;
            }
        }
        let size = along.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for (group, x) in base.groups.iter_mut().zip(along) {
            if x.abs() > NOTHING * size {
                group.others.push((column, x));
            }
        }
    }
    base
}

impl BaseParameters {
    /// K, groups × 10 n: the values of the groups are K π.
    pub fn matrix(&self) -> DMatrix<f64> {
        let mut K = DMatrix::zeros(self.groups.len(), self.names.len());
        for (row, group) in self.groups.iter().enumerate() {
            K[(row, group.leader)] = 1.0;
            group.others.iter().for_each(|&(column, factor)| K[(row, column)] = factor);
        }
        K
    }

    /// Each group in words, as "inertia zz of upper + 0.25 mass of lower".
    pub fn in_words(&self) -> Vec<String> {
        let words = |group: &ParameterGroup| {
            let mut text = self.names[group.leader].clone();
            for &(column, factor) in &group.others {
                let sign = if factor < 0.0 { '−' } else { '+' };
                let size = math::round(factor.abs() * 1e6) / 1e6;
                let times = if size == 1.0 { String::new() } else { format!("{size} ") };
                text += &format!(" {sign} {times}{}", self.names[column]);
            }
            text
        };
        self.groups.iter().map(words).collect()
    }
}

/// Words for each parameter: what it is, and of which link.
fn names(model: &Model) -> Vec<String> {
    let mut names = Vec::new();
    for (k, joint) in model.joints.iter().enumerate() {
        let link = model.links.iter().find(|link| link.body.is_some_and(|body| body.0 == k));
        let link = link.map_or(&joint.name, |link| &link.name);
        names.extend(WORDS.iter().map(|word| format!("{word} of {link}")));
    }
    names
}

/// Regressors of random motions, one below the other.
fn random_regressor(model: &Model) -> DMatrix<f64> {
    let (nv, columns) = (model.nv, PARAMETERS * model.joints.len());
    let states = (ROWS * columns).div_ceil(nv.max(1));
    let (mut random, mut ws) = (Random::new(1), Workspace::new(model));
    let mut W = DMatrix::zeros(nv * states, columns);
    let mut Y = DMatrix::zeros(nv, columns);
    for state in 0..states {
        let (q, qd, qdd) = (random.position(model), random.vector(nv), random.vector(nv));
        regressor_into(model, &mut ws, &q, &qd, &qdd, Y.as_mut_slice());
        W.rows_mut(nv * state, nv).copy_from(&Y);
    }
    W
}
