//! Stiffness along a path and over a grid of configurations.

use nalgebra::{DMatrix, Matrix6, Vector6};
use rayon::prelude::*;
use sinew_kinematics::{ComplianceWorkspace, compliance_batch_into};
use sinew_model::{LinkId, Model};
use sinew_plant::Plant;

use super::{UnderLoad, Wrench, cartesian_stiffness, equilibrium_under_load};
use crate::LinearError;

/// Configurations that one thread takes at a time: its Jacobians and compliances stay in the cache.
const PORTION: usize = 256;

/// J K⁻¹ Jᵀ of a link in many configurations, in vector registers and on all cores.
///
/// `q`: count × nq numbers, one configuration after the other. `K_inverse`: nv × nv, symmetric, zero rows for joints that do
/// not give way. Returns 36 × count: each column is one C by columns. The same numbers to the last bit whatever the
/// number of threads.
///
/// # Panics
/// If `q` is not a whole number of configurations, `K_inverse` has the wrong size or there is no such link.
///
/// # Example
/// Level, a rod of one metre on 100 N·m/rad gives way upward:
/// ```
/// use nalgebra::DMatrix;
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 1.0);
/// let springs = DMatrix::from_row_slice(2, 2, &[0.01, 0.0, 0.0, 0.0]);
/// let C = sinew_linear::compliance_map(&arm, arm.last_link(), &springs, &[0.0; 2000]);
/// assert_eq!((C.shape(), C[(35, 999)]), ((36, 1000), 0.01));
/// ```
pub fn compliance_map(model: &Model, link: LinkId, K_inverse: &DMatrix<f64>, q: &[f64]) -> DMatrix<f64> {
    let count = q.len() / model.nq.max(1);
    assert_eq!(q.len(), count * model.nq, "q");
    let mut C = DMatrix::zeros(36, count);
    let portions = q.par_chunks(PORTION * model.nq.max(1));
    portions.zip(C.as_mut_slice().par_chunks_mut(PORTION * 36)).for_each_init(
        || ComplianceWorkspace::new(model),
        |ws, (q, C)| compliance_batch_into(model, ws, link, K_inverse, q, C),
    );
    C
}

/// A configuration of a path or grid, and how the link gives way there.
#[derive(Debug, Clone, PartialEq)]
pub struct StiffnessPoint {
    /// Link-side positions before any load, rad (m).
    pub q: Vec<f64>,
    /// The link's origin in the base, m.
    pub place: [f64; 3],
    /// J K_q⁻¹ Jᵀ.
    pub compliance: Matrix6<f64>,
    /// J (K_q + ∂g/∂q)⁻¹ Jᵀ.
    pub compliance_with_gravity: Option<Matrix6<f64>>,
    /// True if the robot stays there without load.
    pub stable: bool,
    /// [rotation vector; translation] under the load, by the nonlinear equilibrium; none without a load and where the
    /// robot does not bear it.
    pub deflection: Option<Vector6<f64>>,
}

/// The stiffness in many configurations, one after the other along a path or all over a grid, on all cores.
///
/// `configurations`: one number for each of the plant's joints. With a `load` each point has its nonlinear deflection: a deflection map. The same
/// numbers whatever the number of threads.
///
/// # Errors
/// The first configuration's that has one, as [`cartesian_stiffness`].
///
/// # Panics
/// If a length is wrong or there is no such link.
pub fn stiffness_along(
    plant: &Plant,
    p: &[f64],
    link: LinkId,
    configurations: &[Vec<f64>],
    load: Option<&Wrench>,
) -> Result<Vec<StiffnessPoint>, LinearError> {
    let point = |q: &Vec<f64>| {
        let told = cartesian_stiffness(plant, p, q, link)?;
        let deflection = match load {
            None => None,
            Some(load) => match equilibrium_under_load(plant, p, &told, link, load)? {
                UnderLoad::Holds(there) => Some(there.deflection),
                UnderLoad::GivesWay(_) => None,
            },
        };
        Ok(StiffnessPoint {
            place: told.pose.translation.to_array(),
            compliance: told.compliance,
            compliance_with_gravity: told.compliance_with_gravity,
            stable: told.stable,
            q: told.q,
            deflection,
        })
    };
    // Collected first: of several errors the first in order is told, not the first in time.
    let points: Vec<Result<StiffnessPoint, LinearError>> = configurations.par_iter().map(point).collect();
    points.into_iter().collect()
}

/// Positions on a grid: each degree of freedom named runs through its range in even steps, the last one fastest; all
/// others stay as in `at`.
///
/// # Example
/// ```
/// let grid = sinew_linear::configuration_grid(&[0.0, 5.0, 0.0], &[(0, 0.0, 1.0, 3), (2, -1.0, 1.0, 2)]);
/// assert_eq!(grid.len(), 6);
/// assert_eq!((&grid[0][..], &grid[3][..]), (&[0.0, 5.0, -1.0][..], &[0.5, 5.0, 1.0][..]));
/// ```
pub fn configuration_grid(at: &[f64], ranges: &[(usize, f64, f64, usize)]) -> Vec<Vec<f64>> {
    let mut grid = vec![at.to_vec()];
    for &(place, from, to, steps) in ranges {
        let value = |k: usize| from + (to - from) * k as f64 / (steps.max(2) - 1) as f64;
        let widened = grid.iter().flat_map(|q| {
            (0..steps).map(move |k| {
                let mut q = q.clone();
                q[place] = value(k);
                q
            })
        });
        grid = widened.collect();
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples::{Random, planar_arm};

    #[test]
    fn the_number_of_threads_changes_no_bit() {
        let arm = planar_arm(5, 1.0, 0.3);
        let q = Random::new(4).vector(5 * 1003);
        let springs = DMatrix::from_diagonal_element(5, 5, 1e-3);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| compliance_map(&arm, arm.last_link(), &springs, &q))
        };
        let one = with(1);
        assert_eq!(one, with(3));
        assert_eq!(one, sinew_kinematics::compliance_batch(&arm, arm.last_link(), &springs, &q));
    }
}
