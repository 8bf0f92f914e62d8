//! The arms of the recognition suite.

use sinew_model::{
    EffectSpec, Inertia, JointSettings, JointShape, JointSpec, Model, ModelBuilder, Place, Pose, Robot,
    Vector3,
};

/// An arm with its scale: what is a large torque in each joint.
pub struct Arm {
    /// The arm as its owner describes it.
    pub robot: Robot,
    /// Torque scale of each joint, N·m: its Coulomb friction.
    pub torque: Vec<f64>,
    /// Standard deviation of a torque sample of each joint, N·m.
    pub torque_noise: Vec<f64>,
    /// A plain payload, kg.
    pub payload: f64,
    /// Reach of the motion from the centre, rad, and top speed, rad/s.
    pub amplitude: f64,
    /// Top speed, rad/s.
    pub speed: f64,
}

/// Motor turns a joint turn of every arm.
pub(crate) const GEAR_RATIO: f64 = 50.0;

impl Arm {
    /// The arms of the suite by name: the number of their joints, with `-rigid` behind it without springs.
    pub fn named(name: &str) -> Option<Self> {
        let (joints, is_rigid) = name.strip_suffix("-rigid").map_or((name, false), |joints| (joints, true));
        let mut arm = match joints {
            "1" => one_joint(),
            "2" => two_joints(),
            "6" => six_joints(),
            _ => return None,
        };
        let springs = arm.robot.joints.iter_mut().filter(|_| is_rigid);
        springs.for_each(|joint| (joint.stiffness, joint.damping) = (None, 0.0));
        Some(arm)
    }
}

/// One vertical joint: inertia 2.0, rotor 1.2 kg·m², spring 8000 N·m/rad, gravity 29 N·m.
pub fn one_joint() -> Arm {
    let mut builder = ModelBuilder::new("one_joint");
    builder.link("base", Inertia::default());
    // m c = 2.956 kg·m, I = 2.0 kg·m² about the joint
    let (mass, centre) = (8.0, 0.3695);
    let about = 2.0 - mass * centre * centre;
    let arm =
        Inertia::at_centre_of_mass(mass, Vector3::new(centre, 0.0, 0.0), [0.02, about, about, 0.0, 0.0, 0.0]);
    builder.link("arm", arm).link("tool", Inertia::default());
    builder.joint(JointSpec::new("joint_1", JointShape::Revolute, "base", "arm").about([0.0, -1.0, 0.0]));
    let flange = Pose::from_xyz_rpy([0.7, 0.0, 0.0], [0.0; 3]);
    builder.joint(JointSpec::new("flange", JointShape::Fixed, "arm", "tool").at(flange));
    let model = builder.build().expect("one link is a tree");
    let joints = vec![spring(8000.0, 8.0, 1.2)];
    let robot = Robot { joints, effects: friction(&model, &[4.0], &[6.0]), ..Robot::rigid(model) };
    Arm { robot, torque: vec![6.0], torque_noise: vec![0.5], payload: 1.5, amplitude: 0.9, speed: 2.0 }
}

/// Two joints in a vertical plane, links of half a metre.
pub fn two_joints() -> Arm {
    let mut builder = ModelBuilder::new("two_joints");
    builder.link("base", Inertia::default());
    let upper =
        Inertia::at_centre_of_mass(9.0, Vector3::new(0.2, 0.0, 0.0), [0.02, 0.25, 0.25, 0.0, 0.0, 0.0]);
    let fore =
        Inertia::at_centre_of_mass(5.0, Vector3::new(0.18, 0.0, 0.0), [0.01, 0.12, 0.12, 0.0, 0.0, 0.0]);
    builder.link("upper_arm", upper).link("forearm", fore).link("tool", Inertia::default());
    let joint = |name, parent, child, x| {
        let place = Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
        JointSpec::new(name, JointShape::Revolute, parent, child).about([0.0, -1.0, 0.0]).at(place)
    };
    builder.joint(joint("shoulder", "base", "upper_arm", 0.0));
    builder.joint(joint("elbow", "upper_arm", "forearm", 0.5));
    let flange = Pose::from_xyz_rpy([0.45, 0.0, 0.0], [0.0; 3]);
    builder.joint(JointSpec::new("flange", JointShape::Fixed, "forearm", "tool").at(flange));
    let model = builder.build().expect("two links are a tree");
    let joints = vec![spring(9000.0, 10.0, 1.5), spring(2500.0, 2.5, 0.4)];
    let robot = Robot { joints, effects: friction(&model, &[5.0, 1.6], &[7.0, 2.5]), ..Robot::rigid(model) };
    Arm {
        robot,
        torque: vec![7.0, 2.5],
        torque_noise: vec![0.5, 0.5],
        payload: 1.5,
        amplitude: 0.8,
        speed: 1.8,
    }
}

/// Six joints of a wrist-partitioned arm: waist, shoulder, elbow, and three crossing wrist axes; reach 0.85 m, 5 kg of
/// forearm and hand.
pub fn six_joints() -> Arm {
    let mut builder = ModelBuilder::new("six_joints");
    builder.link("base", Inertia::default());
    let links = [
        ("turret", 9.0, [0.02, 0.0, 0.10], [0.06, 0.06, 0.05]),
        ("upper_arm", 8.0, [0.18, 0.02, 0.0], [0.03, 0.22, 0.22]),
        ("forearm", 4.0, [0.12, 0.0, 0.02], [0.012, 0.07, 0.07]),
        ("wrist_yaw", 1.2, [0.04, 0.0, 0.01], [0.003, 0.004, 0.004]),
        ("wrist_pitch", 0.9, [0.03, 0.0, 0.0], [0.002, 0.003, 0.003]),
        ("hand", 0.6, [0.04, 0.02, 0.0], [0.001, 0.0015, 0.0015]),
    ];
    for (name, mass, centre, [xx, yy, zz]) in links {
        let centre = Vector3::new(centre[0], centre[1], centre[2]);
        builder.link(name, Inertia::at_centre_of_mass(mass, centre, [xx, yy, zz, 0.0, 0.0, 0.0]));
    }
    builder.link("tool", Inertia::default());
    let joints = [
        ("waist", "base", "turret", [0.0, 0.0, 1.0], [0.0, 0.0, 0.1]),
        ("shoulder", "turret", "upper_arm", [0.0, -1.0, 0.0], [0.05, 0.0, 0.2]),
        ("elbow", "upper_arm", "forearm", [0.0, -1.0, 0.0], [0.45, 0.0, 0.0]),
        ("wrist_1", "forearm", "wrist_yaw", [1.0, 0.0, 0.0], [0.25, 0.0, 0.0]),
        ("wrist_2", "wrist_yaw", "wrist_pitch", [0.0, -1.0, 0.0], [0.1, 0.0, 0.0]),
        ("wrist_3", "wrist_pitch", "hand", [1.0, 0.0, 0.0], [0.08, 0.0, 0.0]),
    ];
    for (name, parent, child, axis, place) in joints {
        let spec = JointSpec::new(name, JointShape::Revolute, parent, child).about(axis);
        builder.joint(spec.at(Pose::from_xyz_rpy(place, [0.0; 3])));
    }
    let flange = Pose::from_xyz_rpy([0.08, 0.0, 0.0], [0.0; 3]);
    builder.joint(JointSpec::new("flange", JointShape::Fixed, "hand", "tool").at(flange));
    let model = builder.build().expect("six links are a tree");
    let joints = vec![
        spring(20_000.0, 20.0, 2.5),
        spring(18_000.0, 18.0, 2.5),
        spring(9000.0, 8.0, 0.9),
        spring(1500.0, 1.0, 0.06),
        spring(1500.0, 1.0, 0.06),
        spring(900.0, 0.6, 0.04),
    ];
    let viscous = [8.0, 8.0, 4.0, 0.8, 0.8, 0.5];
    let coulomb = vec![9.0, 9.0, 5.0, 1.5, 1.5, 1.0];
    let robot = Robot { joints, effects: friction(&model, &viscous, &coulomb), ..Robot::rigid(model) };
    let torque_noise = vec![0.5, 0.5, 0.4, 0.12, 0.12, 0.08];
    Arm { robot, torque: coulomb, torque_noise, payload: 1.0, amplitude: 0.7, speed: 1.6 }
}

pub(crate) fn spring(stiffness: f64, damping: f64, rotor_inertia: f64) -> JointSettings {
    JointSettings {
        stiffness: Some(stiffness),
        damping,
        rotor_inertia,
        gear_ratio: Some(GEAR_RATIO),
        ..JointSettings::default()
    }
}

pub(crate) fn friction(model: &Model, viscous: &[f64], coulomb: &[f64]) -> Vec<EffectSpec> {
    let at = |dof| Place::Joint(model.dof_name(dof).to_owned());
    let viscous = viscous
        .iter()
        .enumerate()
        .map(|(d, &v)| EffectSpec::new("viscous_friction", at(d)).with("viscous", v));
    let coulomb = coulomb
        .iter()
        .enumerate()
        .map(|(d, &c)| EffectSpec::new("coulomb_friction", at(d)).with("coulomb", c));
    viscous.chain(coulomb).collect()
}
