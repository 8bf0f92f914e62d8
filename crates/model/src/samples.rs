//! Small robots with closed-form answers, for examples and tests.

use alloc::borrow::ToOwned;
use alloc::format;

mod random;

pub use random::{Random, random_tree};

use crate::{Inertia, JointShape, JointSpec, Model, ModelBuilder, Pose, Vector3};

/// A point of `mass` kg on a massless rod of `length` m that turns about −y; level at zero, positive up.
///
/// ```text
/// τ = m l² q̈ + m g l cos q
/// ```
pub fn pendulum(mass: f64, length: f64) -> Model {
    let mut builder = ModelBuilder::new("pendulum");
    builder.link("base", Inertia::default());
    builder.link("rod", Inertia::point(mass, Vector3::new(length, 0.0, 0.0)));
    builder.joint(JointSpec::new("pivot", JointShape::Revolute, "base", "rod").about([0.0, -1.0, 0.0]));
    builder.build().expect("a pendulum is a tree")
}

/// The link of the lesson's one-joint example: inertia `J` kg·m² about the joint, mass and centre distance as given;
/// hangs down at zero, where gravity holds it.
///
/// ```text
/// τ = J q̈ + m g ℓ sin q
/// ```
pub fn hanging_link(inertia: f64, mass: f64, centre: f64) -> Model {
    let mut builder = ModelBuilder::new("hanging_link");
    builder.link("base", Inertia::default());
    let about_centre = [0.0, inertia - mass * centre * centre, 0.0, 0.0, 0.0, 0.0];
    let link = Inertia::at_centre_of_mass(mass, Vector3::new(0.0, 0.0, -centre), about_centre);
    builder.link("link", link);
    builder.joint(JointSpec::new("joint", JointShape::Revolute, "base", "link").about([0.0, -1.0, 0.0]));
    builder.build().expect("one link is a tree")
}

/// A chain of `n` equal uniform rods in the x–z plane, joints `joint_1` … about −y, level at zero.
pub fn planar_arm(n: usize, mass: f64, length: f64) -> Model {
    let mut builder = ModelBuilder::new("planar_arm");
    builder.link("base", Inertia::default());
    let rod = mass * length * length / 12.0;
    for k in 1..=n {
        let parent = if k == 1 { "base".to_owned() } else { format!("link_{}", k - 1) };
        let start = if k == 1 { 0.0 } else { length };
        let centre = Vector3::new(length / 2.0, 0.0, 0.0);
        let inertia = Inertia::at_centre_of_mass(mass, centre, [0.0, rod, rod, 0.0, 0.0, 0.0]);
        builder.link(&format!("link_{k}"), inertia);
        let joint =
            JointSpec::new(&format!("joint_{k}"), JointShape::Revolute, &parent, &format!("link_{k}"));
        builder.joint(joint.about([0.0, -1.0, 0.0]).at(Pose::from_xyz_rpy([start, 0.0, 0.0], [0.0; 3])));
    }
    builder.build().expect("a chain is a tree")
}
