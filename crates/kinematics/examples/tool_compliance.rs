//! Where the tool of an arm is, how it moves, and how far elastic joints let it give way.
#![allow(non_snake_case)]

use nalgebra::{DMatrix, DVector, Vector6};
use sinew_kinematics::{Axes, compliance, jacobian, link_pose};
use sinew_model::samples;

fn main() {
    // Three rods of half a metre; the tool is the frame of the third.
    let arm = samples::planar_arm(3, 2.0, 0.5);
    let (tool, q) = (arm.last_link(), [0.3, 0.6, -0.4]);
    let p = link_pose(&arm, &q, tool).translation;
    println!("tool at x = {:.4} m, z = {:.4} m", p.x, p.z);

    let J = jacobian(&arm, &q, tool, Axes::WorldAligned);
    println!("1 rad/s of the first joint moves it at {:.4} m/s forward, {:.4} m/s up", J[(3, 0)], J[(5, 0)]);

    // Gears of 5000, 3000 and 1000 N·m/rad under a load of 50 N downward.
    let softness = DVector::from_vec(vec![1.0 / 5000.0, 1.0 / 3000.0, 1.0 / 1000.0]);
    let C = compliance(&J, &DMatrix::from_diagonal(&softness));
    let sag = C * Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -50.0);
    println!("50 N downward move it by {:.2} mm down and {:.2} mm sideways", -1e3 * sag[5], 1e3 * sag[3]);
}
