//! Robots that several tests share.

use sinew_effects::CATALOGUE;
use sinew_linear::{Mode, modes};
use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot, Vector3};
use sinew_plant::Plant;

/// Two uniform rods (3 kg, 0.5 m; 2 kg, 0.4 m) in the x–z plane with elastic joints.
pub fn planar_2r() -> Robot {
    let mut builder = ModelBuilder::new("planar_2r");
    builder.link("base", Inertia::default());
    let rod = |mass: f64, length: f64| {
        let about = mass * length * length / 12.0;
        let centre = Vector3::new(length / 2.0, 0.0, 0.0);
        Inertia::at_centre_of_mass(mass, centre, [1e-3, about, about, 0.0, 0.0, 0.0])
    };
    builder.link("upper", rod(3.0, 0.5));
    builder.link("lower", rod(2.0, 0.4));
    let joint = |name, parent, child, x| {
        let spec = JointSpec::new(name, JointShape::Revolute, parent, child).about([0.0, -1.0, 0.0]);
        spec.at(Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]))
    };
    builder.joint(joint("shoulder", "base", "upper", 0.0));
    builder.joint(joint("elbow", "upper", "lower", 0.5));
    let mut robot = Robot::rigid(builder.build().unwrap());
    for (joint, (stiffness, damping, rotor)) in
        robot.joints.iter_mut().zip([(150.0, 0.5, 0.05), (100.0, 0.3, 0.03)])
    {
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(stiffness), damping, rotor);
    }
    robot
}

pub fn plant(robot: &Robot) -> Plant {
    Plant::new(robot, &CATALOGUE).unwrap()
}

pub fn modes_of(robot: &Robot, q: &[f64]) -> Vec<Mode> {
    let plant = plant(robot);
    modes(&plant, &plant.parameters(), q).unwrap()
}
