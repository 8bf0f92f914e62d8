//! Compliances of many configurations at once, in vector registers.

use alloc::vec::Vec;

use nalgebra::DMatrix;
use sinew_model::side_by_side::{count, gather, scatter, zeros};
use sinew_model::{Lanes, LinkId, Model, Scalar, side_by_side};

use crate::jacobian::columns;
use crate::{Axes, Scratch, Workspace};

/// Numbers of a compliance.
const SIZE: usize = 36;

/// Scratch space of [`compliance_batch_into`]; nothing is allocated after `new`.
///
/// Belongs to the model it was made of.
#[derive(Debug, Clone)]
pub struct ComplianceWorkspace {
    room: Room,
}

type Room = sinew_model::side_by_side::Room<Lane<8>, Lane<4>, One>;

#[derive(Debug, Clone)]
struct Lane<const N: usize> {
    scratch: Scratch<Lanes<N>>,
    q: Vec<Lanes<N>>,
    J: Vec<Lanes<N>>,
}

#[derive(Debug, Clone)]
struct One {
    scratch: Workspace,
    J: Vec<f64>,
}

impl ComplianceWorkspace {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        let one = || One { scratch: Workspace::new(model), J: alloc::vec![0.0; 6 * model.nv] };
        Self { room: Room::new(|| Lane::new(model), || Lane::new(model), one) }
    }
}

impl<const N: usize> Lane<N> {
    fn new(model: &Model) -> Self {
        Self { scratch: Scratch::new(model), q: zeros(model.nq), J: zeros(6 * model.nv) }
    }
}

/// [`compliance`](crate::compliance) of a link in many configurations, at the link's origin in world axes.
///
/// ```text
/// C_k = J(q_k) K⁻¹ J(q_k)ᵀ
/// ```
///
/// `q`: count × nq numbers, one configuration after the other. `K_inverse`: nv × nv, symmetric, zero rows for joints that
/// do not give way; only its upper triangle is read. Returns 36 × count: each column is one C.
///
/// # Panics
/// If `q` is not a whole number of configurations, `K_inverse` has the wrong size or there is no such link.
///
/// # Example
/// Stretched out level, a rod of one metre on 100 N·m/rad gives way upward; upright it gives way sideways:
/// ```
/// use nalgebra::DMatrix;
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let springs = DMatrix::from_row_slice(2, 2, &[0.01, 0.0, 0.0, 0.0]);
/// let q = [0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0];
/// let C = sinew_kinematics::compliance_batch(&arm, arm.last_link(), &springs, &q);
/// let entry = |row: usize, column: usize| row + 6 * column;
/// assert_eq!((C[(entry(5, 5), 0)], C[(entry(3, 3), 1)]), (0.01, 0.01));
/// ```
pub fn compliance_batch(model: &Model, link: LinkId, K_inverse: &DMatrix<f64>, q: &[f64]) -> DMatrix<f64> {
    let mut C = DMatrix::zeros(SIZE, count(q, model.nq));
    let mut ws = ComplianceWorkspace::new(model);
    compliance_batch_into(model, &mut ws, link, K_inverse, q, C.as_mut_slice());
    C
}

/// [`compliance_batch`] without allocation, into the count × 36 numbers of `C`.
///
/// # Panics
/// If a slice or `K_inverse` has the wrong size or there is no such link.
pub fn compliance_batch_into(
    model: &Model,
    ws: &mut ComplianceWorkspace,
    link: LinkId,
    K_inverse: &DMatrix<f64>,
    q: &[f64],
    C: &mut [f64],
) {
    assert_eq!(K_inverse.shape(), (model.nv, model.nv), "K_inverse");
    assert_eq!(C.len(), SIZE * count(q, model.nq), "C");
    run(&mut ws.room, model, link, K_inverse, q, C);
}

side_by_side! {
    fn run(model: &Model, link: LinkId, K_inverse: &DMatrix<f64>, q: &[f64], C: &mut [f64]), in_lanes, one_by_one
}

#[inline(always)]
fn in_lanes<const N: usize>(
    lane: &mut Lane<N>,
    model: &Model,
    link: LinkId,
    K_inverse: &DMatrix<f64>,
    q: &[f64],
    C: &mut [f64],
) {
    for first in (0..count(q, model.nq)).step_by(N) {
        gather(q, first, &mut lane.q);
        columns(model, &mut lane.scratch, &lane.q, link, Axes::WorldAligned, &mut lane.J);
        scatter(&sandwich(&lane.J, K_inverse), first, C);
    }
}

fn one_by_one(ws: &mut One, model: &Model, link: LinkId, K_inverse: &DMatrix<f64>, q: &[f64], C: &mut [f64]) {
    for (q, C) in q.chunks_exact(model.nq.max(1)).zip(C.chunks_exact_mut(SIZE)) {
        columns(model, &mut ws.scratch, q, link, Axes::WorldAligned, &mut ws.J);
        C.copy_from_slice(&sandwich(&ws.J, K_inverse));
    }
}

// C = Σ c_ab (J_a J_bᵀ + J_b J_aᵀ)/(1 + δ_ab) over a ≤ b: symmetric by construction
#[inline(always)]
fn sandwich<S: Scalar>(J: &[S], K_inverse: &DMatrix<f64>) -> [S; SIZE] {
    let mut C = [S::ZERO; SIZE];
    for b in 0..K_inverse.ncols() {
        let to = &J[6 * b..6 * b + 6];
        for a in 0..=b {
            let c = K_inverse[(a, b)];
            if c == 0.0 {
                continue;
            }
            let from = &J[6 * a..6 * a + 6];
            for j in 0..6 {
                let (x, y) = (to[j] * c, from[j] * c);
                for i in 0..=j {
                    C[i + 6 * j] += if a == b { from[i] * x } else { from[i] * x + to[i] * y };
                }
            }
        }
    }
    for j in 0..6 {
        for i in 0..j {
            C[j + 6 * i] = C[i + 6 * j];
        }
    }
    C
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{compliance, jacobian};
    use sinew_model::samples::{Random, random_tree};

    #[test]
    fn each_configuration_is_the_same_as_alone() {
        let model = random_tree(7, 5);
        let mut random = Random::new(2);
        let q: Vec<f64> = (0..21).flat_map(|_| random.position(&model)).collect();
        // Coupled springs, and a joint that does not give way.
        let mut springs =
            DMatrix::from_fn(model.nv, model.nv, |i, j| 0.1 / (1.0 + (i as f64 - j as f64).abs()));
        springs.row_mut(1).fill(0.0);
        springs.column_mut(1).fill(0.0);
        let all = compliance_batch(&model, model.last_link(), &springs, &q);
        for (q, C) in q.chunks(model.nq).zip(all.column_iter()) {
            let J = jacobian(&model, q, model.last_link(), Axes::WorldAligned);
            let alone = compliance(&J, &springs);
            let error = C.iter().zip(alone.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-14 * alone.amax(), "{error}");
        }
    }
}
