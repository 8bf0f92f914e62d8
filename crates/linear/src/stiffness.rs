//! Cartesian compliance and stiffness: how far a link gives way to a wrench while the motors hold.

mod base;
mod directions;
mod displacement;
mod identify;
mod loaded;
mod map;
mod statics;

use nalgebra::{DMatrix, Matrix6, Matrix6xX, Vector6};
use sinew_kinematics::{Axes, compliance, jacobian, link_pose};
use sinew_model::{LinkId, Pose};
use sinew_plant::Plant;

pub use base::on_springs;
pub use directions::{Directions, PrincipalAxis, RANK, directions, stiffness_of};
pub use identify::{Evidence, FittedStiffness, LoadTest, StiffnessFit, identify_stiffness};
pub use loaded::{Critical, Loaded, LossOfStability, UnderLoad, equilibrium_under_load};
pub use map::{StiffnessPoint, compliance_map, configuration_grid, stiffness_along};

use crate::LinearError;
use statics::Statics;

/// A wrench on a link, [moment; force] at its origin in the base's axes, N·m and N.
pub type Wrench = Vector6<f64>;

/// The compliance of a link while the motors hold the robot at rest.
///
/// Wrenches are [moment; force] and displacements [turn; shift], at the link's origin in the base's axes: rad/(N·m),
/// 1/N, m/N. Elastic joints and the springs of bending links give way; rigid joints stand still.
#[derive(Debug, Clone, PartialEq)]
pub struct CartesianStiffness {
    /// The degrees of freedom that give way, by their place in q.
    pub elastic: Vec<usize>,
    /// Their names: `q.J` of joints, `v.LINK.K` of bending links.
    pub coordinates: Vec<String>,
    /// Link-side positions of all degrees of freedom of the plant, bending links under their own weight, rad (m).
    pub q: Vec<f64>,
    /// Motor-side positions: where the motors hold.
    pub theta: Vec<f64>,
    /// The link in the base.
    pub pose: Pose<f64>,
    /// J over the elastic degrees of freedom.
    pub jacobian: Matrix6xX<f64>,
    /// K_q of the springs where they stand, N·m/rad; full where a transmission couples joints.
    pub joint_stiffness: DMatrix<f64>,
    /// ∂g/∂q, and the slope of whatever else pulls at the links (a balancer, a contact), N·m/rad.
    pub gravity_stiffness: DMatrix<f64>,
    /// C_x = J K_q⁻¹ Jᵀ: the springs alone.
    pub compliance: Matrix6<f64>,
    /// J (K_q + ∂g/∂q)⁻¹ Jᵀ: what a small wrench finds; none if gravity has used up the springs.
    pub compliance_with_gravity: Option<Matrix6<f64>>,
    /// True if the robot stays where it is: K_q + ∂g/∂q is positive definite.
    pub stable: bool,
}

/// The compliance of `link` of `plant` with parameters `p`, held at rest with links at `q`.
///
/// ```text
/// δx = J K_q⁻¹ Jᵀ δw,   with gravity   δx = J (K_q + ∂g/∂q)⁻¹ Jᵀ δw
/// ```
///
/// The motors stand where the springs carry gravity, so `q` is where the robot is before any load. K_q is the slope of the
/// springs there: a spring that hardens counts with the slope under its own weight. J has columns for the springs of
/// bending links too: the extended Jacobian and the enlarged stiffness. `q`: one number for each of the plant's
/// [`joints`](Plant::joints), rad (m); bending links take the place that their weight gives them.
///
/// # Errors
/// If the springs cannot carry the links there, or one of them has no stiffness there (a gear inside its gap).
///
/// # Panics
/// If `p` or `q` has the wrong length, or there is no such link.
///
/// # Example
/// A hanging link, m g l = 2·9.81·0.4 N·m, behind a spring of 150 N·m/rad: gravity stiffens it.
/// ```
/// use sinew_model::{Robot, samples::hanging_link};
/// use sinew_plant::Plant;
/// let mut robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4));
/// robot.joints[0].stiffness = Some(150.0);
/// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let told = sinew_linear::cartesian_stiffness(&plant, &plant.parameters(), &[0.0], robot.tool).unwrap();
/// assert!((told.compliance[(1, 1)] - 1.0 / 150.0).abs() < 1e-15);
/// assert!((told.compliance_with_gravity.unwrap()[(1, 1)] - 1.0 / (150.0 + 2.0 * 9.81 * 0.4)).abs() < 1e-15);
/// ```
/// Source: Salisbury, *Active stiffness control of a manipulator in Cartesian coordinates*, CDC 1980.
pub fn cartesian_stiffness(
    plant: &Plant,
    p: &[f64],
    q: &[f64],
    link: LinkId,
) -> Result<CartesianStiffness, LinearError> {
    let q = &plant.rest_position(p, q)?;
    let mut statics = Statics::new(plant, p);
    let theta = statics.motors_that_hold(q)?;
    let torques = statics.torques(q, &theta);
    let model = plant.model();
    let J = jacobian(model, q, link, Axes::WorldAligned);
    let J = J.select_columns(&statics.elastic);
    let K = torques.spring_slope;
    let inverse = K.clone().cholesky().ok_or_else(|| no_stiffness(plant, &statics.elastic, &K))?.inverse();
    let held = &K + &torques.weight_slope;
    Ok(CartesianStiffness {
        coordinates: statics.elastic.iter().map(|&dof| coordinate(plant, dof)).collect(),
        elastic: statics.elastic,
        q: q.to_vec(),
        theta,
        pose: link_pose(model, q, link),
        compliance: compliance(&J, &inverse),
        compliance_with_gravity: through(&J, &held).map(|C| (C + C.transpose()) * 0.5),
        stable: loaded::least_stiffness(&held, &K) > 0.0,
        jacobian: J,
        joint_stiffness: K,
        gravity_stiffness: torques.weight_slope,
    })
}

fn coordinate(plant: &Plant, dof: usize) -> String {
    let bending = plant.virtual_joints().iter().find(|v| v.dof == dof);
    bending.map_or_else(|| format!("q.{}", plant.model().dof_name(dof)), |v| plant.coordinate(v))
}

/// J T⁻¹ Jᵀ; none if T is singular.
fn through(J: &Matrix6xX<f64>, T: &DMatrix<f64>) -> Option<Matrix6<f64>> {
    // Nothing elastic, nothing gives way; the library takes no empty system.
    if T.is_empty() {
        return Some(Matrix6::zeros());
    }
    let answer = T.clone().lu().solve(&J.transpose())?;
    let C = J * answer;
    C.iter().all(|x| x.is_finite()).then_some(C)
}

// Names the joint whose spring is softest.
fn no_stiffness(plant: &Plant, elastic: &[usize], K: &DMatrix<f64>) -> LinearError {
    let softest = (0..elastic.len()).min_by(|&a, &b| K[(a, a)].total_cmp(&K[(b, b)])).unwrap_or(0);
    LinearError::NoStiffness {
        joint: plant.model().dof_name(elastic[softest]).to_owned(),
        stiffness: K[(softest, softest)],
    }
}
