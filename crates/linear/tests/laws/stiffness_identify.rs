//! Joint stiffness from load tests: the truth comes back, and what no test shows is said.

use nalgebra::Vector6;
use sinew_linear::{
    Evidence, LoadTest, UnderLoad, Wrench, cartesian_stiffness, equilibrium_under_load, identify_stiffness,
    on_springs,
};
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Pose, Robot, Vector3};

use crate::robots::plant;
use crate::stiffness::{DOWN, six_joints};

const TRUE: [f64; 6] = [900.0, 800.0, 700.0, 600.0, 500.0, 400.0];

// Tests of the robot with its true springs, deflections with noise of the size `std`.
fn tests(
    robot: &Robot,
    count: usize,
    std: Vector6<f64>,
    load: impl Fn(&mut Random) -> Wrench,
) -> Vec<LoadTest> {
    let plant = plant(robot);
    let p = plant.parameters();
    let mut random = Random::new(3);
    (0..count)
        .map(|_| {
            let q: Vec<f64> = random.vector(plant.model().nv);
            let load = load(&mut random);
            let unloaded = cartesian_stiffness(&plant, &p, &q, robot.tool).unwrap();
            let outcome = equilibrium_under_load(&plant, &p, &unloaded, robot.tool, &load).unwrap();
            let UnderLoad::Holds(there) = outcome else { panic!("it bears the load") };
            // The sum of twelve even numbers is nearly normal.
            let mut normal = || random.vector(12).iter().sum::<f64>() / 2.0;
            let noise = Vector6::from_fn(|k, _| if std[k].is_finite() { std[k] * normal() } else { 0.0 });
            LoadTest { q, load, deflection: there.deflection + noise, std }
        })
        .collect()
}

fn any_wrench(random: &mut Random) -> Wrench {
    let v = random.vector(6);
    Wrench::new(v[0], v[1], v[2], 40.0 * v[3], 40.0 * v[4], 40.0 * v[5])
}

#[test]
fn exact_tests_give_back_the_springs_although_gravity_pulls_and_deflections_are_large() {
    let robot = six_joints(Pose::identity(), DOWN);
    let exact = tests(&robot, 8, Vector6::repeat(1e-9), any_wrench);
    // Without noise.
    let plant = plant(&robot);
    let p = plant.parameters();
    let clean: Vec<LoadTest> = exact
        .into_iter()
        .map(|test| {
            let unloaded = cartesian_stiffness(&plant, &p, &test.q, robot.tool).unwrap();
            let UnderLoad::Holds(there) =
                equilibrium_under_load(&plant, &p, &unloaded, robot.tool, &test.load).unwrap()
            else {
                panic!()
            };
            LoadTest { deflection: there.deflection, ..test }
        })
        .collect();
    // The fit is not told the springs.
    let rigid = crate::robots::plant(&Robot { joints: vec![Default::default(); 6], ..robot.clone() });
    let fit = identify_stiffness(&rigid, &[], robot.tool, &[0, 1, 2, 3, 4, 5], &clean).unwrap();
    for (joint, K) in fit.joints.iter().zip(TRUE) {
        let found = joint.stiffness.unwrap();
        assert!((found - K).abs() < 1e-8 * K, "{}: {found} {K}", joint.joint);
    }
    assert!(clean.iter().any(|t| t.deflection.fixed_rows::<3>(3).norm() > 0.02));
    assert!(fit.condition < 100.0 && fit.residual < 1e-3, "{fit:?}");
}

#[test]
fn intervals_hold_the_truth() {
    let robot = six_joints(Pose::identity(), DOWN);
    let std = Vector6::new(2e-5, 2e-5, 2e-5, 1e-5, 1e-5, 1e-5);
    let noisy = tests(&robot, 40, std, any_wrench);
    let plant = plant(&robot);
    let fit =
        identify_stiffness(&plant, &plant.parameters(), robot.tool, &[0, 1, 2, 3, 4, 5], &noisy).unwrap();
    for (joint, K) in fit.joints.iter().zip(TRUE) {
        let z = (joint.compliance.unwrap() - 1.0 / K) / joint.compliance_std;
        assert!(z.abs() < 3.5, "{}: {z}", joint.joint);
        assert!(joint.stiffness_std < 0.02 * K, "{joint:?}");
    }
    assert!((0.8..1.2).contains(&fit.residual), "{}", fit.residual);
    assert_eq!(fit.freedom, 40 * 6 - 6);
}

#[test]
fn joints_that_no_load_twists_are_said_and_given_no_value() {
    // Vertical forces twist no vertical axis, which is added under the arm, and not the last joint, where they act.
    let mut robot = Robot::rigid(planar_arm(3, 1.0, 0.5).with_gravity(Vector3::ZERO));
    robot.joints.iter_mut().for_each(|j| j.stiffness = Some(2000.0));
    let base = nalgebra::Matrix6::from_diagonal(&Vector6::new(
        f64::INFINITY,
        f64::INFINITY,
        3000.0,
        f64::INFINITY,
        f64::INFINITY,
        f64::INFINITY,
    ));
    let robot = on_springs(&robot, &base);
    let down = |random: &mut Random| Wrench::new(0.0, 0.0, 0.0, 0.0, 0.0, -50.0 * random.uniform(0.5, 1.0));
    let mut level = tests(&robot, 6, Vector6::repeat(1e-6), down);
    let plant = plant(&robot);
    let p = plant.parameters();
    let fit = identify_stiffness(&plant, &p, robot.tool, &[0, 1, 2, 3], &level).unwrap();
    let excited: Vec<bool> = fit.joints.iter().map(|j| j.excited).collect();
    assert_eq!(excited, [false, true, true, false], "{fit:?}");
    assert_eq!((fit.joints[0].stiffness, fit.joints[0].compliance), (None, None));
    assert_eq!(fit.condition, f64::INFINITY);
    assert!((fit.joints[1].stiffness.unwrap() - 2000.0).abs() < 20.0, "{fit:?}");
    // Two parallel joints in one position cannot be told apart by one force and one shift.
    level.truncate(1);
    level[0].std =
        Vector6::new(f64::INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY, 1e-6);
    let fit = identify_stiffness(&plant, &p, robot.tool, &[1, 2], &level).unwrap();
    assert!(fit.joints.iter().all(|j| !j.excited), "{fit:?}");
}

#[test]
fn a_rigid_joint_is_fitted_as_zero_compliance_and_gets_no_stiffness_of_chance() {
    let mut robot = six_joints(Pose::identity(), DOWN);
    robot.joints[2].stiffness = None;
    let std = Vector6::repeat(1e-6);
    let noisy = tests(&robot, 20, std, any_wrench);
    let plant = plant(&robot);
    let fit =
        identify_stiffness(&plant, &plant.parameters(), robot.tool, &[0, 1, 2, 3, 4, 5], &noisy).unwrap();
    let rigid = &fit.joints[2];
    assert!(rigid.compliance.unwrap().abs() < 4.0 * rigid.compliance_std, "{rigid:?}");
    assert_eq!(rigid.evidence, Evidence::Rigid, "{rigid:?}");
    assert!(rigid.at_least.unwrap() > 100.0 * TRUE[1] && rigid.stiffness.is_none(), "{rigid:?}");
    assert_eq!(fit.joints[1].evidence, Evidence::Spring);
    assert!((fit.joints[1].stiffness.unwrap() - TRUE[1]).abs() < 4.0 * fit.joints[1].stiffness_std);
}

// A weightless level arm whose tool is two metres from its first joint and one from the next, that sinks by `shift` m under every newton; the second number of a test is
// the error of its shift, m.
fn level(shift: f64, tests: &[(f64, f64)]) -> (Robot, Vec<LoadTest>) {
    let robot = Robot::rigid(planar_arm(3, 1.0, 1.0).with_gravity(Vector3::ZERO));
    let mut std = Vector6::repeat(f64::INFINITY);
    std[5] = 1e-5;
    let test = |&(force, error): &(f64, f64)| LoadTest {
        q: vec![0.0; 3],
        load: Wrench::new(0.0, 0.0, 0.0, 0.0, 0.0, -force),
        deflection: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -force * shift + error),
        std,
    };
    (robot, tests.iter().map(test).collect())
}

#[test]
fn a_joint_that_moves_against_its_load_is_impossible_and_not_rigid() {
    let (robot, tests) = level(-1e-4, &[(10.0, 1e-5), (20.0, -1e-5), (40.0, 0.0)]);
    let fit = identify_stiffness(&plant(&robot), &[], robot.tool, &[0], &tests).unwrap();
    let joint = &fit.joints[0];
    assert_eq!((joint.evidence, joint.stiffness, joint.at_least), (Evidence::Impossible, None, None));
    assert!(joint.compliance.unwrap() < -5.0 * joint.compliance_std, "{joint:?}");
}

#[test]
fn a_joint_whose_share_the_tests_hardly_tell_from_another_is_undetermined_and_not_rigid() {
    // The shift is l² F (4 C₁ + C₂) but for what the arm has sunk: the two are almost one.
    let (robot, tests) = level(1e-4, &[(10.0, 0.0), (20.0, 0.0), (40.0, 0.0)]);
    let fit = identify_stiffness(&plant(&robot), &[], robot.tool, &[0, 1], &tests).unwrap();
    for joint in &fit.joints {
        assert_eq!((joint.evidence, joint.stiffness), (Evidence::Undetermined, None), "{joint:?}");
        let most = joint.compliance.unwrap().max(0.0) + 2.0 * joint.compliance_std;
        assert!((joint.at_least.unwrap() * most - 1.0).abs() < 1e-12, "{joint:?}");
    }
}

#[test]
fn tests_that_measured_nothing_are_refused() {
    let robot = six_joints(Pose::identity(), DOWN);
    let plant = plant(&robot);
    let error = identify_stiffness(&plant, &plant.parameters(), robot.tool, &[0], &[]).unwrap_err();
    assert!(error.to_string().contains("no component"), "{error}");
}
