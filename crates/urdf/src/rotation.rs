//! Roll, pitch and yaw of a rotation, exact to rounding everywhere.

use sinew_model::Matrix3;

/// URDF's fixed-axis angles of R = R_z(yaw) R_y(pitch) R_x(roll).
///
/// Roll is read off R_z(−yaw) R, so that it completes whatever yaw was chosen, also where pitch is ±π/2 and only
/// the sum or difference of the two has a meaning.
pub(crate) fn roll_pitch_yaw(r: &Matrix3<f64>) -> [f64; 3] {
    let [x, y, z] = r.rows;
    // cos(pitch) = |(R11, R21)|
    let yaw = y.x.atan2(x.x);
    let pitch = (-z.x).atan2(x.x.hypot(y.x));
    let (s, c) = yaw.sin_cos();
    // [R_z(−yaw) R]_2 = (0, cos roll, −sin roll)
    let roll = (s * x.z - c * y.z).atan2(c * y.y - s * x.y);
    [roll, pitch, yaw]
}

/// The angles of the quaternion (x, y, z, w) of any length but zero.
pub(crate) fn angles_of_quaternion(q: [f64; 4]) -> Option<[f64; 3]> {
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    let [x, y, z, w] = q.map(|v| v / length);
    Some(roll_pitch_yaw(&Matrix3::from_quaternion(x, y, z, w)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::Pose;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_angles_of_a_rotation_give_it_back_also_near_the_poles() {
        for pitch in [0.0, 1.2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 - 1e-9, 1e-7 - FRAC_PI_2, FRAC_PI_2 - 1e-4] {
            for (roll, yaw) in [(0.0, 0.0), (0.3, -2.9), (-3.1, 0.7), (1.5, 1.5)] {
                let r = Pose::from_xyz_rpy([0.0; 3], [roll, pitch, yaw]).rotation;
                let back = Pose::from_xyz_rpy([0.0; 3], roll_pitch_yaw(&r)).rotation;
                let worst = (r - back).rows.iter().map(|v| v.norm()).fold(0.0, f64::max);
                assert!(worst < 1e-15, "{roll} {pitch} {yaw}: {worst}");
            }
        }
    }

    #[test]
    fn half_a_turn_about_z_is_the_quaternion_0_0_1_0() {
        let [roll, pitch, yaw] = angles_of_quaternion([0.0, 0.0, 2.0, 0.0]).unwrap();
        assert_eq!((roll, pitch, yaw.abs()), (0.0, 0.0, std::f64::consts::PI));
        assert_eq!(angles_of_quaternion([0.0; 4]), None);
    }
}
