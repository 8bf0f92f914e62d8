//! Joints and links in one compliance map.

use nalgebra::{DMatrix, Matrix6};
use sinew_kinematics::{Axes, compliance, jacobian};
use sinew_model::{Extended, LinkId};

/// The stiffness matrix of joints and virtual joints, nv × nv of the extended model.
///
/// ```text
/// K_ext = diag(K, k_v) in the extended model's order
/// ```
///
/// `joints`: K of the robot's own joints, in their order, N·m/rad.
///
/// # Panics
/// If the size does not match.
pub fn extended_stiffness(extended: &Extended, joints: &DMatrix<f64>) -> DMatrix<f64> {
    spread(extended, joints, |k| k)
}

/// The compliance matrix of joints and virtual joints, nv × nv of the extended model.
///
/// `joints`: K⁻¹ of the robot's own joints, in their order, rad/(N·m); locked joints have zero rows.
///
/// # Panics
/// If the size does not match.
pub fn extended_compliance(extended: &Extended, joints: &DMatrix<f64>) -> DMatrix<f64> {
    spread(extended, joints, f64::recip)
}

fn spread(extended: &Extended, joints: &DMatrix<f64>, own: fn(f64) -> f64) -> DMatrix<f64> {
    let n = extended.joints.len();
    assert_eq!(joints.shape(), (n, n), "joints: n × n for {n} degrees of freedom");
    let mut all = DMatrix::zeros(extended.model.nv, extended.model.nv);
    for (i, &row) in extended.joints.iter().enumerate() {
        for (j, &column) in extended.joints.iter().enumerate() {
            all[(row, column)] = joints[(i, j)];
        }
    }
    for v in &extended.virtual_joints {
        all[(v.dof, v.dof)] = own(v.stiffness);
    }
    all
}

/// The Cartesian compliance of a link through joints and bending links, unloaded.
///
/// ```text
/// C_x = J_ext K_ext⁻¹ J_extᵀ
/// ```
///
/// `q`: nq of the extended model. `joints`: K⁻¹ of the robot's own joints. Axes of the world at the link's origin.
/// Returns 6 × 6 from [moment; force] to [turn; shift].
///
/// # Panics
/// If a size does not match.
///
/// # Example
/// A base spring of 100 N·m/rad in series with a joint of 100 N·m/rad, the tip two metres away:
/// ```
/// use nalgebra::DMatrix;
/// use sinew_model::{Bending, LinkId, Robot, samples};
/// let mut robot = Robot::rigid(samples::planar_arm(2, 1.0, 2.0));
/// robot.bending.push(Bending::base_spring(LinkId(1), &['y'], 100.0));
/// let extended = sinew_flex_link::extend(&robot)?;
/// let joints = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![0.01, 0.0]));
/// let q = extended.position(&[0.0, 0.0]);
/// let C = sinew_flex_link::cartesian_compliance(&extended, &q, LinkId(2), &joints);
/// approx::assert_relative_eq!(C[(5, 5)], 2.0 * 2.0 * (0.01 + 0.01), max_relative = 1e-14);
/// # Ok::<(), sinew_flex_link::FlexLinkError>(())
/// ```
pub fn cartesian_compliance(
    extended: &Extended,
    q: &[f64],
    link: LinkId,
    joints: &DMatrix<f64>,
) -> Matrix6<f64> {
    let J = jacobian(&extended.model, q, link, Axes::WorldAligned);
    compliance(&J, &extended_compliance(extended, joints))
}
