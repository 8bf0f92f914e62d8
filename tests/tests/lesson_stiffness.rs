//! §4 of the lesson and Problem 3, line by line: what they state, and where they had to be corrected (`docs/errata.md`).
#![allow(non_snake_case)]

use nalgebra::DVector;
use sinew_effects::CATALOGUE;
use sinew_kinematics::{Axes, jacobian};
use sinew_linear::{
    CartesianStiffness, Loaded, UnderLoad, Wrench, cartesian_stiffness, directions, equilibrium_under_load,
    stiffness_of,
};
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Coupling, Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot, Vector3};
use sinew_plant::Plant;

/// Rounding of a few operations on numbers of size one.
const ALGEBRA: f64 = 1e-12;

fn told(robot: &Robot, q: &[f64]) -> CartesianStiffness {
    let plant = Plant::new(robot, &CATALOGUE).unwrap();
    cartesian_stiffness(&plant, &plant.parameters(), q, robot.tool).unwrap()
}

fn held(robot: &Robot, q: &[f64], load: Wrench) -> Loaded {
    let plant = Plant::new(robot, &CATALOGUE).unwrap();
    let p = plant.parameters();
    let unloaded = cartesian_stiffness(&plant, &p, q, robot.tool).unwrap();
    match equilibrium_under_load(&plant, &p, &unloaded, robot.tool, &load).unwrap() {
        UnderLoad::Holds(there) => *there,
        UnderLoad::GivesWay(critical) => panic!("{critical:?}"),
    }
}

fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

// Level rods of half a metre, weightless, with springs.
fn arm(springs: &[f64]) -> Robot {
    let mut robot = Robot::rigid(planar_arm(springs.len(), 1.0, 0.5).with_gravity(Vector3::ZERO));
    for (joint, &K) in robot.joints.iter_mut().zip(springs) {
        joint.stiffness = Some(K);
    }
    robot
}

#[test]
fn section_4_joint_torque_is_the_transposed_jacobian_times_the_wrench() {
    // τ = Jᵀ F, seen at the springs: K_q (q − q₀) is what the loaded springs carry.
    let robot = arm(&[800.0, 500.0, 300.0]);
    let q = [0.3, 0.6, -0.9];
    let load = Wrench::new(0.0, 2.0, 0.0, 15.0, 0.0, -25.0);
    let there = held(&robot, &q, load);
    let torque = there.jacobian.transpose() * load;
    for (k, K) in [800.0, 500.0, 300.0].into_iter().enumerate() {
        near(K * (there.q[k] - q[k]), torque[k], 1e-11);
    }
}

#[test]
fn section_4_deflections_are_joint_springs_seen_through_the_jacobian() {
    // δτ = K_q δq, δx = J δq, δτ = Jᵀ δF ⇒ δx = J K_q⁻¹ Jᵀ δF, and C_x is symmetric and never negative.
    let robot = arm(&[800.0, 500.0, 300.0]);
    let mut random = Random::new(4);
    for _ in 0..20 {
        let q = random.vector(3);
        let told = told(&robot, &q);
        let J = jacobian(&robot.model, &q, robot.tool, Axes::WorldAligned);
        let F = Wrench::from_vec(random.vector(6));
        let dq = (J.transpose() * F).component_div(&DVector::from_vec(vec![800.0, 500.0, 300.0]));
        assert!((told.compliance * F - &J * dq).amax() < ALGEBRA);
        assert_eq!(told.compliance, told.compliance.transpose());
        assert!(F.dot(&(told.compliance * F)) >= 0.0);
    }
}

#[test]
fn section_4_the_joint_stiffness_may_hold_transmissions_and_gravity() {
    // "including effects of transmission stiffness and possibly gravity linearization"
    let mut robot = arm(&[1.0, 1.0]);
    let K = [900.0, 120.0, 120.0, 700.0];
    robot.couplings.push(Coupling { dofs: vec![0, 1], stiffness: K.to_vec(), damping: vec![0.0; 4] });
    let q = [0.4, -0.2];
    assert_eq!(told(&robot, &q).joint_stiffness.as_slice(), K);
    assert_eq!(told(&robot, &q).gravity_stiffness.amax(), 0.0);
    robot.model.gravity = Vector3::new(0.0, 0.0, -9.81);
    let heavy = told(&robot, &q);
    // ∂g/∂q of level rods, m = 1 kg, centres half way.
    let (s1, s12) = (0.4_f64.sin(), 0.2_f64.sin());
    let outer = -9.81 * 0.25 * s12;
    let want = [-9.81 * (0.25 + 0.5) * s1 + outer, outer, outer, outer];
    for (a, b) in heavy.gravity_stiffness.iter().zip(want) {
        near(*a, b, ALGEBRA * 10.0);
    }
    let J = &heavy.jacobian;
    let sum = &heavy.joint_stiffness + &heavy.gravity_stiffness;
    let want = J * sum.try_inverse().unwrap() * J.transpose();
    assert!((heavy.compliance_with_gravity.unwrap() - want).amax() < ALGEBRA);
}

// Two turning joints whose tool stands above the first one: rows [turn; rise] of J are −[1 1; 0 1]; and four sliding and
// turning springs that take the other directions, so that K_x exists.
fn problem_3(stiffness: [f64; 2]) -> Robot {
    let mut builder = ModelBuilder::new("problem_3");
    let names = ["ground", "x", "y", "rx", "rz", "out", "back", "tool"];
    for name in names {
        builder.link(name, Inertia::point(1.0, Vector3::new(0.1, 0.1, 0.1)));
    }
    let joint = |name, shape, parent, child, axis| JointSpec::new(name, shape, parent, child).about(axis);
    let along = |x| Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
    builder.joint(joint("slide_x", JointShape::Prismatic, "ground", "x", [1.0, 0.0, 0.0]));
    builder.joint(joint("slide_y", JointShape::Prismatic, "x", "y", [0.0, 1.0, 0.0]));
    builder.joint(joint("turn_x", JointShape::Revolute, "y", "rx", [1.0, 0.0, 0.0]));
    builder.joint(joint("turn_z", JointShape::Revolute, "rx", "rz", [0.0, 0.0, 1.0]));
    builder.joint(joint("first", JointShape::Revolute, "rz", "out", [0.0, -1.0, 0.0]));
    builder.joint(joint("second", JointShape::Revolute, "out", "back", [0.0, -1.0, 0.0]).at(along(1.0)));
    builder.joint(JointSpec::new("flange", JointShape::Fixed, "back", "tool").at(along(-1.0)));
    let mut robot = Robot::rigid(builder.build().unwrap().with_gravity(Vector3::ZERO));
    let springs = [512.0, 512.0, 512.0, 512.0, stiffness[0], stiffness[1]];
    for (joint, K) in robot.joints.iter_mut().zip(springs) {
        joint.stiffness = Some(K);
    }
    robot
}

#[test]
fn problem_3_compliance_and_stiffness_in_exact_entries() {
    // Powers of two: every entry of C_x is exact.
    let (k1, k2) = (256.0, 64.0);
    let told = told(&problem_3([k1, k2]), &[0.0; 6]);
    let (turn, rise) = (1, 5);
    let J = &told.jacobian;
    assert_eq!([J[(turn, 4)], J[(turn, 5)], J[(rise, 4)], J[(rise, 5)]], [-1.0, -1.0, 0.0, -1.0]);
    let C = told.compliance;
    assert_eq!(
        [C[(turn, turn)], C[(turn, rise)], C[(rise, rise)]],
        [1.0 / k1 + 1.0 / k2, 1.0 / k2, 1.0 / k2]
    );
    // K_x = [k1, −k1; −k1, k1 + k2]: even diagonal springs couple the directions of the tool.
    let K = stiffness_of(&C).expect("six springs");
    for (entry, want) in [(K[(turn, turn)], k1), (K[(turn, rise)], -k1), (K[(rise, rise)], k1 + k2)] {
        near(entry, want, ALGEBRA * k1);
    }
    // det C_x = 1/(k1 k2)
    assert_eq!(C[(turn, turn)] * C[(rise, rise)] - C[(turn, rise)] * C[(turn, rise)], 1.0 / (k1 * k2));
}

#[test]
fn section_4_without_an_inverse_there_is_a_compliance_with_rank_and_stiff_directions() {
    // Two joints in a plane: rank 2, four wrenches that move nothing, and no stiffness.
    let two = told(&arm(&[800.0, 500.0]), &[0.3, 0.9]);
    let parts = directions(&two.compliance);
    assert_eq!((parts.rank, parts.stiff.len(), stiffness_of(&two.compliance)), (2, 4, None));
    // Three joints stretched out: a force along the arm moves nothing, though rank was 3 when it was bent.
    let robot = arm(&[800.0, 500.0, 300.0]);
    // The tool is the frame at the start of the third rod, so two shifts and one turn.
    let bent = directions(&told(&robot, &[0.3, 0.9, 0.2]).compliance);
    let straight = told(&robot, &[0.3, 0.0, 0.0]);
    let stretched = directions(&straight.compliance);
    assert_eq!((bent.rank, stretched.rank), (3, 2));
    let along = Wrench::new(0.0, 0.0, 0.0, 0.3_f64.cos(), 0.0, 0.3_f64.sin());
    assert!((straight.compliance * along).amax() < 1e-15);
    for w in &stretched.stiff {
        assert!((straight.compliance * w).amax() < 1e-12 * straight.compliance.amax());
    }
    assert_eq!(stiffness_of(&straight.compliance), None);
}

#[test]
fn section_4_the_dropped_term_is_the_geometric_stiffness_under_load() {
    // δτ = Jᵀ δF + (δJ)ᵀ F: one joint, k (α − α₀) = F l cos α with F upward at radius l.
    let (k, l, F) = (100.0, 1.0, 60.0);
    let mut robot = Robot::rigid(planar_arm(2, 1.0, l).with_gravity(Vector3::ZERO));
    robot.joints[0].stiffness = Some(k);
    let there = held(&robot, &[0.5, 0.0], Wrench::new(0.0, 0.0, 0.0, 0.0, 0.0, F));
    let angle = there.q[0];
    near(k * (angle - 0.5), F * l * angle.cos(), 1e-11);
    // K_G = ∂(Jᵀ F)/∂q = −F l sin α;   dz/dF = (l cos α)²/(k + F l sin α)
    near(there.geometric_stiffness[(0, 0)], -F * l * angle.sin(), ALGEBRA * F);
    let rise = (l * angle.cos()).powi(2);
    near(there.compliance[(5, 5)], rise / (k + F * l * angle.sin()), ALGEBRA);
    near(there.classical_compliance[(5, 5)], rise / k, ALGEBRA);
    // Here the lesson's map is wrong by F l sin α/k.
    let wrong = there.classical_compliance[(5, 5)] / there.compliance[(5, 5)] - 1.0;
    near(wrong, F * l * angle.sin() / k, ALGEBRA * 10.0);
    assert!(wrong > 0.4, "{wrong}");
    // Without a load it is right.
    let unloaded = held(&robot, &[0.5, 0.0], Wrench::zeros());
    assert_eq!(unloaded.compliance, unloaded.classical_compliance);
}

#[test]
fn section_4_with_six_joints_the_stiffness_is_the_congruence_of_chen_and_kao() {
    // K_x = J⁻ᵀ (K_q − K_G) J⁻¹
    let robot = problem_3([256.0, 64.0]);
    let there = held(&robot, &[0.0, 0.0, 0.1, -0.2, 0.3, 0.4], Wrench::new(0.0, 0.0, 0.0, 20.0, -10.0, 15.0));
    let J = there.jacobian.fixed_columns::<6>(0).into_owned();
    let inverse = J.try_inverse().expect("six joints, not singular");
    let middle = &there.joint_stiffness - &there.geometric_stiffness;
    let want = inverse.transpose() * middle * inverse;
    let K = stiffness_of(&there.compliance).expect("six springs");
    assert!((K - want).amax() < 1e-10 * K.amax());
    let old = stiffness_of(&there.classical_compliance).unwrap();
    assert!((old - K).amax() > 0.01 * K.amax());
}
