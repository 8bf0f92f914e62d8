//! Builds a two-link arm by hand and prints what the model holds.

#![allow(non_snake_case)]

use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, ModelError, Pose, Vector3};

fn main() -> Result<(), ModelError> {
    let rod = |mass: f64, length: f64| {
        let I = mass * length * length / 12.0;
        let centre = Vector3::new(length / 2.0, 0.0, 0.0);
        Inertia::at_centre_of_mass(mass, centre, [0.0, I, I, 0.0, 0.0, 0.0])
    };
    let mut builder = ModelBuilder::new("arm");
    builder
        .link("base", Inertia::default())
        .link("upper_arm", rod(3.0, 0.5))
        .link("forearm", rod(2.0, 0.4))
        .joint(JointSpec::new("shoulder", JointShape::Revolute, "base", "upper_arm").about([0.0, -1.0, 0.0]))
        .joint(
            JointSpec::new("elbow", JointShape::Revolute, "upper_arm", "forearm")
                .about([0.0, -1.0, 0.0])
                .at(Pose::from_xyz_rpy([0.5, 0.0, 0.0], [0.0; 3])),
        );
    let arm = builder.build()?;
    println!("\"{}\" has {} degrees of freedom", arm.name, arm.nv);
    for joint in &arm.joints {
        let centre = joint.inertia.centre_of_mass();
        println!("{:10} carries {} kg, centre {} m from the joint", joint.name, joint.inertia.mass, centre.x);
    }
    // A wrong name says what would have been right.
    println!("{}", arm.require_dof("elbw").unwrap_err());
    Ok(())
}
