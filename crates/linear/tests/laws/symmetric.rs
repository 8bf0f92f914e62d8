//! Robots with equal parts: repeated modes, which generic eigenvalue routines get wrong.

use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, Robot, Vector3};

use crate::robots::modes_of;

// `n` equal hanging links with elastic joints on one base.
pub fn fingers(n: usize) -> Robot {
    let mut builder = ModelBuilder::new("hand");
    builder.link("base", Inertia::default());
    let inertia =
        Inertia::at_centre_of_mass(2.0, Vector3::new(0.0, 0.0, -0.4), [0.0, 0.18, 0.0, 0.0, 0.0, 0.0]);
    for k in 0..n {
        let (joint, link) = (format!("joint_{k}"), format!("finger_{k}"));
        builder.link(&link, inertia);
        builder.joint(JointSpec::new(&joint, JointShape::Revolute, "base", &link).about([0.0, -1.0, 0.0]));
    }
    let mut robot = Robot::rigid(builder.build().unwrap());
    for joint in &mut robot.joints {
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(150.0), 0.5, 0.05);
    }
    robot
}

#[test]
fn equal_fingers_have_the_modes_of_one_each_with_its_own_poles() {
    let one = modes_of(&fingers(1), &[0.2]);
    for n in [2, 7, 14] {
        let many = modes_of(&fingers(n), &vec![0.2; n]);
        assert_eq!(many.len(), 2 * n);
        for (k, mode) in many.iter().enumerate() {
            let single = &one[k / n];
            assert!((mode.omega - single.omega).abs() < 1e-10 * one[1].omega);
            let ratio = |m: &sinew_linear::Mode| m.damping_ratio.unwrap();
            assert!((ratio(mode) - ratio(single)).abs() < 1e-9, "{n} {k}: {mode:?}");
            assert_eq!(mode.poles.len(), 2);
        }
    }
}

#[test]
fn shapes_of_repeated_modes_are_orthogonal() {
    let n = 5;
    let modes = modes_of(&fingers(n), &vec![0.0; n]);
    let weight = |i: usize| if i < n { 0.5 } else { 0.05 };
    for (a, first) in modes.iter().enumerate() {
        for (b, second) in modes.iter().enumerate() {
            let pairs = first.shape.iter().zip(&second.shape).enumerate();
            let product: f64 = pairs.map(|(i, (x, y))| weight(i) * x.1 * y.1).sum();
            // φᵀ M φ = 1
            assert!((product - if a == b { 1.0 } else { 0.0 }).abs() < 1e-12, "{a} {b}: {product}");
        }
    }
}
