//! The lesson's §5, line by line: links lumped into springs, and joints and links in one map.
//!
//! Convergence to the beam, torsion, stepped beams and arms of two bending links are tests of `sinew-flex-link`.
#![allow(non_snake_case)]

use nalgebra::{DMatrix, DVector};
use sinew_effects::CATALOGUE;
use sinew_flex_link::{base_spring, cartesian_compliance, extend, extended_compliance, tip_stiffness};
use sinew_kinematics::{Axes, compliance, jacobian};
use sinew_model::samples::hanging_link;
use sinew_model::{
    BeamSection, Bending, Following, Inertia, JointShape, JointSpec, LinkId, ModelBuilder, Pose, Robot,
    Vector3,
};
use sinew_plant::{Dynamics, LinkState, Plant, Rates};

const ALGEBRA: f64 = 1e-12;

// The link of Problem 4: length 0.8 m, E I = 1200 N·m², a rod of 2.1 kg/m.
const L: f64 = 0.8;
const EI: f64 = 1200.0;
const BEAM: BeamSection = BeamSection {
    length: L,
    flexural_rigidity: EI,
    torsional_rigidity: None,
    mass_per_length: 2.1,
    polar_inertia_per_length: 0.0,
};

fn near(got: f64, want: f64) {
    assert!((got - want).abs() <= ALGEBRA * want.abs().max(1e-3), "{got} against {want}");
}

// A level rod along x, turning about y, with a tip frame at its end.
fn rod() -> Robot {
    let mut builder = ModelBuilder::new("rod");
    let (mass, across) = (2.1 * L, 2.1 * L.powi(3) / 12.0);
    let inertia = Inertia::at_centre_of_mass(
        mass,
        Vector3::new(L / 2.0, 0.0, 0.0),
        [0.0, across, across, 0.0, 0.0, 0.0],
    );
    builder.link("base", Inertia::default()).link("link", inertia).link("tip", Inertia::default());
    builder.joint(JointSpec::new("joint", JointShape::Revolute, "base", "link").about([0.0, 1.0, 0.0]));
    let at = Pose::from_xyz_rpy([L, 0.0, 0.0], [0.0; 3]);
    builder.joint(JointSpec::new("tip", JointShape::Fixed, "link", "tip").at(at));
    Robot::rigid(builder.build().unwrap())
}

fn bending(bending: Bending) -> Robot {
    let mut robot = rod();
    robot.bending.push(bending);
    robot
}

// Deflection along z and turn about y of the tip under a force along z, the joint locked.
fn tip(robot: &Robot, force: f64) -> (f64, f64) {
    let extended = extend(robot).unwrap();
    let tip = extended.model.link("tip").unwrap();
    let C = cartesian_compliance(&extended, &extended.position(&[0.0]), tip, &DMatrix::zeros(1, 1));
    (force * C[(5, 5)], -force * C[(1, 5)])
}

#[test]
fn problem_4_a_base_spring_gives_the_tip_k_phi_over_l_squared() {
    // F L = k_φ φ, δ = L φ, F/δ = k_φ/L²
    let k = 500.0;
    let (deflection, turn) = tip(&bending(Bending::base_spring(LinkId(1), &['y'], k)), 10.0);
    near(turn, 10.0 * L / k);
    near(deflection, L * turn);
    near(10.0 / deflection, tip_stiffness(k, L));
}

#[test]
fn section_5_1_one_base_spring_matches_the_deflection_and_not_the_slope() {
    let (deflection, slope) =
        tip(&bending(Bending::base_spring(LinkId(1), &['y'], base_spring(EI, L))), 10.0);
    near(deflection, 10.0 * L.powi(3) / (3.0 * EI));
    near(slope, 10.0 * L * L / (3.0 * EI));
    near(1.0 - slope / (10.0 * L * L / (2.0 * EI)), 1.0 / 3.0);
    for n in 1..=32 {
        let (deflection, slope) = tip(&bending(Bending::beam(LinkId(1), &['y'], n, &[BEAM])), 10.0);
        near(deflection, 10.0 * L.powi(3) / (3.0 * EI));
        near(slope, 10.0 * L * L / (2.0 * EI));
    }
}

#[test]
fn section_5_1_springs_at_the_base_and_in_the_middle_add_up_by_their_levers() {
    // δ = F (L²/k₁ + (L/2)²/k₂)
    let (k1, k2) = (900.0, 400.0);
    let springs = Bending {
        stiffness: None,
        stations: vec![0.0, L / 2.0],
        stiffnesses: vec![k1, k2],
        ..Bending::base_spring(LinkId(1), &['y'], 0.0)
    };
    let (deflection, slope) = tip(&bending(springs), 10.0);
    near(deflection, 10.0 * (L * L / k1 + L * L / 4.0 / k2));
    near(slope, 10.0 * (L / k1 + L / 2.0 / k2));
}

#[test]
fn section_5_2_the_extended_jacobian_puts_joints_and_links_into_one_map() {
    // C_x = J_ext K_ext⁻¹ J_extᵀ = J_q K_q⁻¹ J_qᵀ + J_v K_v⁻¹ J_vᵀ
    let robot = bending(Bending::beam(LinkId(1), &['y', 'z'], 3, &[BEAM]));
    let extended = extend(&robot).unwrap();
    let (q, tip) = (extended.position(&[0.4]), extended.model.link("tip").unwrap());
    let joints = DMatrix::from_element(1, 1, 1.0 / 150.0);
    let J = jacobian(&extended.model, &q, tip, Axes::WorldAligned);
    assert_eq!(J.ncols(), 1 + 6);
    let C = cartesian_compliance(&extended, &q, tip, &joints);
    assert_eq!(C, compliance(&J, &extended_compliance(&extended, &joints)));
    let rigid = jacobian(&robot.model, &[0.4], robot.model.link("tip").unwrap(), Axes::WorldAligned);
    let (of_joint, of_link) =
        (compliance(&rigid, &joints), cartesian_compliance(&extended, &q, tip, &DMatrix::zeros(1, 1)));
    assert!((C - of_joint - of_link).amax() < ALGEBRA * C.amax());
}

#[test]
fn section_5_2_a_joint_and_a_base_spring_about_one_axis_are_springs_in_a_row() {
    // 1/k = 1/K + 1/k_φ at the tip: L²/k
    let (K, k_phi) = (150.0, 500.0);
    let robot = bending(Bending::base_spring(LinkId(1), &['y'], k_phi));
    let extended = extend(&robot).unwrap();
    let tip = extended.model.link("tip").unwrap();
    let joints = DMatrix::from_element(1, 1, 1.0 / K);
    let C = cartesian_compliance(&extended, &extended.position(&[0.0]), tip, &joints);
    near(C[(5, 5)], L * L * (1.0 / K + 1.0 / k_phi));
}

// The hanging link of §6 with a base spring, elastic or not, rotor J_m.
fn hanging(stiffness: Option<f64>, k_phi: f64) -> Robot {
    let mut robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4));
    (robot.joints[0].stiffness, robot.joints[0].rotor_inertia) = (stiffness, 0.05);
    robot.bending.push(Bending::base_spring(LinkId(1), &['y'], k_phi));
    robot
}

#[test]
fn section_5_2_a_virtual_joint_without_inertia_makes_the_mass_matrix_singular() {
    let extended = extend(&hanging(Some(150.0), 500.0)).unwrap();
    let M = sinew_rigid::mass_matrix(&extended.model, &[0.0, 0.0]);
    assert!((M[(0, 0)] * M[(1, 1)] - M[(0, 1)] * M[(1, 0)]).abs() < ALGEBRA);
    assert_eq!(extended.virtual_joints[0].following, Following::QuasiStatic);
}

#[test]
fn section_5_2_a_massless_virtual_joint_is_eliminated_and_not_given_an_inertia() {
    // q̈ of the link under a spring of 1/k = 1/K + 1/k_φ: exactly the robot with that joint and a rigid link
    let (K, k_phi) = (150.0, 500.0);
    let series = 1.0 / (1.0 / K + 1.0 / k_phi);
    let mut lumped = Robot::rigid(hanging_link(0.5, 2.0, 0.4));
    (lumped.joints[0].stiffness, lumped.joints[0].rotor_inertia) = (Some(series), 0.05);
    let rates = |robot: &Robot, q: f64, theta: f64| {
        let plant = Plant::new(robot, &CATALOGUE).unwrap();
        let mut dynamics = Dynamics::new(&plant, &plant.parameters());
        let (mut x, mut out) = (LinkState::zero(&plant), Rates::new(&plant));
        (x.q[0], x.qd[0], x.theta[0], x.thetad[0]) = (q, 0.7, theta, -0.2);
        dynamics.forward(&x, &vec![1.3; plant.model().nv], &mut out);
        let stood = dynamics.settled().map(|s| (s.q[0], s.q[1]));
        (out.qdd[0], out.thetadd[0], dynamics.energy(&x), stood)
    };
    for (q, theta) in [(0.0, 0.0), (0.3, 0.35), (-1.1, -1.0)] {
        let (bent, plain) = (rates(&hanging(Some(K), k_phi), q, theta), rates(&lumped, q, theta));
        near(bent.0, plain.0);
        near(bent.1, plain.1);
        near(bent.2, plain.2);
        // the two springs, whose axes point against each other, share the angle by their compliance: k_φ φ = K (θ − q)
        let (joint, phi) = bent.3.unwrap();
        near(joint - phi, q);
        near(k_phi * phi, K * (theta - joint));
    }
}

#[test]
fn section_5_2_a_quasi_static_link_sags_as_the_load_asks() {
    // k_φ φ = m g ℓ sin(q − φ) with the joint held at q, which turns about −y
    let plant = Plant::new(&hanging(None, 60.0), &CATALOGUE).unwrap();
    let rest = plant.rest_position(&plant.parameters(), &[1.0]).unwrap();
    let phi = rest[1];
    near(60.0 * phi, 2.0 * 9.81 * 0.4 * (1.0 - phi).sin());
    assert!(phi.abs() > 0.05);
    // and the elimination finds the same deflection
    let mut dynamics = Dynamics::new(&plant, &plant.parameters());
    let (mut x, mut out) = (LinkState::zero(&plant), Rates::new(&plant));
    x.q[0] = 1.0;
    x.theta[0] = 1.0;
    dynamics.forward(&x, &[0.0, 0.0], &mut out);
    near(dynamics.settled().unwrap().q[1], phi);
}

#[test]
fn section_5_2_condensed_frequencies_are_too_high_by_the_square_of_the_frequency_ratio() {
    // Two oscillators in a row: the second's inertia is left out, first exactly zero, then small.
    let K = DMatrix::from_row_slice(2, 2, &[1000.0, -1000.0, -1000.0, 51_000.0]);
    let slowest = |m: f64| {
        let M = DMatrix::from_diagonal(&DVector::from_row_slice(&[1.0, m]));
        let condensed = sinew_flex_link::condense(&M, &K, &[0]).unwrap();
        let kept = (condensed.stiffness[(0, 0)] / condensed.mass[(0, 0)]).sqrt();
        if m == 0.0 {
            return (kept, 1000.0f64.sqrt() * (50.0f64 / 51.0).sqrt());
        }
        let scaled = DMatrix::from_fn(2, 2, |i, j| K[(i, j)] / (M[(i, i)] * M[(j, j)]).sqrt());
        (kept, scaled.symmetric_eigenvalues().min().sqrt())
    };
    let (kept, exact) = slowest(0.0);
    near(kept, exact);
    for m in [0.1, 0.4] {
        let (kept, exact) = slowest(m);
        let ratio = exact * exact / (51_000.0 / m);
        assert!(kept >= exact && kept / exact - 1.0 < ratio, "{m}: {kept} {exact}");
    }
}
