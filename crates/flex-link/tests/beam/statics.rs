//! Deflection, slope and twist under loads at rest.

use nalgebra::{DMatrix, DVector};
use sinew_flex_link::{base_spring, cartesian_compliance, condense, extend, tip_stiffness};
use sinew_kinematics::{Axes, compliance, jacobian};
use sinew_model::{BeamSection, Bending, Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot};

use crate::robots::{BEAM, Body, Chain, Hinge, cantilever, chain, rod, tip_compliance};

// Sums of a few dozen products.
const ALGEBRA: f64 = 1e-12;

const SECOND: BeamSection =
    BeamSection { length: 0.6, flexural_rigidity: 500.0, mass_per_length: 1.3, ..BEAM };

fn near(got: f64, want: f64, what: &str) {
    assert!((got / want - 1.0).abs() < ALGEBRA, "{what}: {got} against {want}");
}

// C_x of the tip, real joints locked.
fn tip_map(chain: &Chain) -> nalgebra::Matrix6<f64> {
    let n = chain.extended.joints.len();
    cartesian_compliance(
        &chain.extended,
        &chain.extended.position(&chain.q),
        chain.tip,
        &DMatrix::zeros(n, n),
    )
}

#[test]
fn tip_deflection_and_slope_are_those_of_the_beam_from_two_springs_on() {
    let (L, EI, F, T) = (BEAM.length, BEAM.flexural_rigidity, 10.0, 3.0);
    for n in 2..=32 {
        let C = tip_map(&cantilever(n, &['y', 'z'], Body::default()));
        // rows: turns about x, y, z; shifts along x, y, z
        near(F * C[(5, 5)], F * L.powi(3) / (3.0 * EI), "deflection of a force along z");
        near(-F * C[(1, 5)], F * L * L / (2.0 * EI), "slope of a force along z");
        near(F * C[(4, 4)], F * L.powi(3) / (3.0 * EI), "deflection of a force along y");
        near(F * C[(2, 4)], F * L * L / (2.0 * EI), "slope of a force along y");
        near(-T * C[(5, 1)], T * L * L / (2.0 * EI), "deflection of a moment");
        near(T * C[(1, 1)], T * L / EI, "slope of a moment");
    }
}

#[test]
fn one_spring_has_deflection_and_slope_of_a_tip_force_but_not_of_a_moment() {
    let (L, EI) = (BEAM.length, BEAM.flexural_rigidity);
    let [w_F, slope_F, w_T, slope_T] = tip_compliance(&[BEAM], 1);
    near(w_F, L.powi(3) / (3.0 * EI), "deflection");
    near(slope_F, L * L / (2.0 * EI), "slope");
    near(w_T, L * L / (2.0 * EI), "deflection of a moment");
    near(slope_T, 0.75 * L / EI, "slope of a moment: a quarter is missing");
}

#[test]
fn sections_give_the_integrals_over_the_stepped_beam() {
    // F ∫ (L − x)²/EI dx and F ∫ (L − x)/EI dx
    let integral = |power: i32| {
        let piece =
            |a: f64, b: f64, EI: f64| (a.powi(power + 1) - b.powi(power + 1)) / (f64::from(power + 1) * EI);
        piece(1.4, 0.6, 1200.0) + piece(0.6, 0.0, 500.0)
    };
    for n in 1..=32 {
        let [w, slope, _, turn] = tip_compliance(&[BEAM, SECOND], n);
        near(w, integral(2), "deflection");
        near(slope, integral(1), "slope");
        if n > 1 {
            near(turn, integral(0), "slope of a moment");
        }
    }
    // F = 10 N: ../shared/reference/beam/beam.json, stepped_static
    near(10.0 * tip_compliance(&[BEAM, SECOND], 3)[0], 0.008462222222222222, "reference");
    near(10.0 * tip_compliance(&[BEAM, SECOND], 3)[1], 0.010266666666666667, "reference");
}

#[test]
fn any_number_of_springs_twists_as_the_rod_does() {
    for n in 1..=32 {
        let C = tip_map(&cantilever(n, &['x'], Body::default()));
        near(3.0 * C[(0, 0)], 0.006857142857142858, "twist of 3 N·m: T L/GJ");
    }
}

#[test]
fn a_level_beam_sags_by_its_own_weight_as_the_continuous_one_does() {
    // k q = Σ moments of the parts beyond; small angles
    let sag = |n| {
        let chain = cantilever(n, &['y'], Body::default());
        let model = chain.extended.model.clone().with_gravity([0.0, 0.0, -9.81].into());
        let g = sinew_rigid::gravity(&model, &chain.extended.position(&chain.q));
        let J = jacobian(&model, &chain.extended.position(&chain.q), chain.tip, Axes::WorldAligned);
        let turned: Vec<f64> =
            chain.extended.virtual_joints.iter().map(|v| -g[v.dof] / v.stiffness).collect();
        let shift = J * DVector::from_vec(turned);
        (-shift[5], shift[1])
    };
    for n in 2..=32 {
        let (w, slope) = sag(n);
        // w L⁴/8EI, w L³/6EI
        near(w, 0.0008789760000000003, "deflection");
        let error = (slope / 0.0014649600000000004 - 1.0).abs();
        assert!(error < ALGEBRA, "slope with {n} springs: {error:e}");
    }
}

#[test]
fn a_base_spring_has_the_tip_stiffness_of_the_lesson_and_a_third_less_slope() {
    let (L, EI, F) = (BEAM.length, BEAM.flexural_rigidity, 10.0);
    let k = base_spring(EI, L);
    assert_eq!(k, 4500.0);
    near(F / tip_stiffness(k, L), F * L.powi(3) / (3.0 * EI), "deflection");
    near(F * L / k, F * L * L / (3.0 * EI), "slope: a third short of F L²/2EI");
    let mut robot = Robot::rigid(link_on_a_hinge());
    robot.bending.push(Bending::base_spring(robot.model.link("beam").unwrap(), &['y'], k));
    let extended = extend(&robot).unwrap();
    let tip = extended.model.link("tip").unwrap();
    let C = cartesian_compliance(&extended, &extended.position(&[0.0]), tip, &DMatrix::zeros(1, 1));
    near(C[(5, 5)], 1.0 / tip_stiffness(k, L), "deflection of the robot");
}

fn link_on_a_hinge() -> sinew_model::Model {
    let mut builder = ModelBuilder::new("hinged");
    builder.link("base", Inertia::default()).link("beam", rod(&[BEAM])).link("tip", Inertia::default());
    builder.joint(JointSpec::new("hinge", JointShape::Revolute, "base", "beam").about([0.0, 1.0, 0.0]));
    let at = Pose::from_xyz_rpy([BEAM.length, 0.0, 0.0], [0.0; 3]);
    builder.joint(JointSpec::new("tip", JointShape::Fixed, "beam", "tip").at(at));
    builder.build().unwrap()
}

#[test]
fn joint_and_link_compliance_add_up_to_one_map() {
    // C_x = J_q K_q⁻¹ J_qᵀ + J_v K_v⁻¹ J_vᵀ: a spring of the joint and a beam behind it
    let mut robot = Robot::rigid(link_on_a_hinge());
    let link = robot.model.link("beam").unwrap();
    robot.bending.push(Bending::beam(link, &['y', 'z'], 3, &[BEAM]));
    let extended = extend(&robot).unwrap();
    let tip = extended.model.link("tip").unwrap();
    let joint = DMatrix::from_element(1, 1, 1.0 / 3000.0);
    let q = extended.position(&[0.4]);
    let all = cartesian_compliance(&extended, &q, tip, &joint);
    let links = cartesian_compliance(&extended, &q, tip, &DMatrix::zeros(1, 1));
    let J = jacobian(&robot.model, &[0.4], robot.model.link("tip").unwrap(), Axes::WorldAligned);
    let joints = compliance(&J, &joint);
    assert!((all - links - joints).amax() < ALGEBRA * all.amax());
}

#[test]
fn springs_without_inertia_between_condense_to_the_tip_compliance() {
    // A clamped beam with mass at its tip only: all but two coordinates go, and the stiffness that stays is that of
    // the tip's deflection and slope.
    let chain = chain(&[(Hinge::Locked(0.0), vec![BEAM])], Body::default(), &[Body::default()], &['y'], 6);
    let (_, K) = chain.matrices();
    let J = jacobian(&chain.extended.model, &chain.extended.position(&[]), chain.tip, Axes::WorldAligned);
    let tip = DMatrix::from_fn(2, 6, |i, k| J[([5, 1][i], k)]);
    // coordinates: the tip's two, and the first four joints; q = T [tip; rest]
    let last = tip.columns(4, 2).into_owned().try_inverse().unwrap();
    let mut T = DMatrix::zeros(6, 6);
    T.view_mut((4, 0), (2, 2)).copy_from(&last);
    T.view_mut((0, 2), (4, 4)).fill_with_identity();
    T.view_mut((4, 2), (2, 4)).copy_from(&(-&last * tip.columns(0, 4)));
    let stiffness = T.transpose() * K * &T;
    let condensed = condense(&DMatrix::zeros(6, 6), &stiffness, &[0, 1]).unwrap();
    let compliance = condensed.stiffness.try_inverse().unwrap();
    let (L, EI) = (BEAM.length, BEAM.flexural_rigidity);
    near(compliance[(0, 0)], L.powi(3) / (3.0 * EI), "deflection");
    near(-compliance[(0, 1)], L * L / (2.0 * EI), "slope");
    near(compliance[(1, 1)], L / EI, "slope of a moment");
}

#[test]
fn an_upright_beam_buckles_under_eulers_load() {
    // P = π² EI/4L²: the load along the beam at which K − P G has no stiffness left, G = −∂g/∂q of a unit weight at the tip
    let load = |n: usize| {
        let light = BeamSection { mass_per_length: 1e-9, ..BEAM };
        let tip = Body { mass: 1.0, inertia: 0.0 };
        let chain = chain(&[(Hinge::Locked(0.0), vec![light])], Body::default(), &[tip], &['y'], n);
        let model = chain.extended.model.clone().with_gravity([-1.0, 0.0, 0.0].into());
        let (_, K) = chain.matrices();
        let weight = |k: usize, angle: f64| {
            let mut q = chain.extended.position(&chain.q);
            q[k] = angle;
            sinew_rigid::gravity(&model, &q)
        };
        // step: far above rounding, its cube far below the answer
        let h = 1e-4;
        let columns: Vec<_> = (0..n).map(|k| (weight(k, -h) - weight(k, h)) / (2.0 * h)).collect();
        let scale = DMatrix::from_diagonal(&K.diagonal().map(|k| k.sqrt().recip()));
        let G = &scale * DMatrix::from_columns(&columns) * &scale;
        (0.5 * (&G + G.transpose())).symmetric_eigenvalues().max().recip()
    };
    let exact = core::f64::consts::PI.powi(2) * BEAM.flexural_rigidity / (4.0 * BEAM.length * BEAM.length);
    let error = |n: usize| load(n) / exact - 1.0;
    let order = (error(8) / error(16)).log2();
    assert!(error(16).abs() < 1e-3 && (1.9..2.1).contains(&order), "order {order}");
}
