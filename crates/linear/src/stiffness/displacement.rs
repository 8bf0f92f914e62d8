//! From one pose to another, as a turn and a shift in the base's axes.

use nalgebra::{Rotation3, UnitQuaternion, Vector6};
use sinew_model::Pose;

/// [rotation vector; translation] that leads from one pose to another, in the axes of the base.
///
/// ```text
/// turn = log(R R₀ᵀ),   shift = p − p₀
/// ```
pub(crate) fn displacement(from: &Pose<f64>, to: &Pose<f64>) -> Vector6<f64> {
    let turn = to.rotation * from.rotation.transpose();
    let rows = turn.rows.map(|row| row.to_array());
    let matrix = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)).scaled_axis();
    let shift = to.translation - from.translation;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::{Matrix3, Vector3};

    #[test]
    fn small_and_large_turns_come_back() {
        for angle in [1e-9, 1e-4, 1.0, 3.0] {
            let from = Pose::from_xyz_rpy([0.1, 0.2, 0.3], [0.4, 0.5, 0.6]);
            let axis = Vector3::new(0.6, 0.0, 0.8);
            let turned = Matrix3::rotation(axis, angle) * from.rotation;
            let to = Pose::new(turned, from.translation + Vector3::new(1.0, 2.0, 3.0));
            let d = displacement(&from, &to);
            let want = Vector6::new(0.6 * angle, 0.0, 0.8 * angle, 1.0, 2.0, 3.0);
            assert!((d - want).amax() < 2e-15 * (1.0 + angle), "{angle}: {d}");
        }
    }
}
