//! Links that bend: linear models, modes and their names.

use core::f64::consts::FRAC_PI_2;

use sinew_linear::{Linearizer, linearize, modes};
use sinew_model::{BeamSection, Bending, Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot, Vector3};
use sinew_plant::{Dynamics, Plant, Rates, State};

use crate::robots::plant;

const BEAM: BeamSection = BeamSection {
    length: 0.8,
    flexural_rigidity: 120.0,
    torsional_rigidity: None,
    mass_per_length: 2.1,
    polar_inertia_per_length: 0.0,
};

fn rod(mass: f64, length: f64) -> Inertia<f64> {
    let about = mass * length * length / 12.0;
    Inertia::at_centre_of_mass(
        mass,
        Vector3::new(length / 2.0, 0.0, 0.0),
        [1e-4, about, about, 0.0, 0.0, 0.0],
    )
}

// A stiff upper arm, a forearm that bends in one plane, a hand.
fn arm(springs: usize, stiffness: f64, rotor: f64) -> Robot {
    let mut builder = ModelBuilder::new("bender");
    builder.link("base", Inertia::default()).link("upper_arm", rod(3.0, 0.5));
    builder.link("forearm", rod(BEAM.mass_per_length * BEAM.length, BEAM.length)).link("hand", rod(0.7, 0.1));
    let joint = |name: &str, parent: &str, child: &str, x: f64| {
        let spec = JointSpec::new(name, JointShape::Revolute, parent, child).about([0.0, -1.0, 0.0]);
        spec.at(Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]))
    };
    builder.joint(joint("shoulder", "base", "upper_arm", 0.0));
    builder.joint(joint("elbow", "upper_arm", "forearm", 0.5));
    builder.joint(joint("wrist", "forearm", "hand", BEAM.length));
    let mut robot = Robot::rigid(builder.build().unwrap());
    for joint in &mut robot.joints {
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(stiffness), 0.4, rotor);
    }
    let forearm = robot.model.link("forearm").unwrap();
    let mut bending = Bending::beam(forearm, &['y'], springs, &[BEAM]);
    bending.damping_ratio = 0.01;
    robot.bending.push(bending);
    robot
}

// [q, θ, v] of a state, and its rates.
fn flat(plant: &Plant, link: &[f64], motor: &[f64]) -> Vec<f64> {
    let joints = plant.joints().iter().map(|&d| link[d]);
    let motors = plant.joints().iter().filter(|&&d| plant.elastic()[d]).map(|&d| motor[d]);
    joints.chain(motors).chain(plant.virtual_joints().iter().map(|v| link[v.dof])).collect()
}

#[test]
fn virtual_joints_follow_the_motors_by_name() {
    let plant = plant(&arm(3, 2000.0, 0.2));
    let linear = linearize(&plant, &plant.parameters(), &[-0.3, 0.4, 0.1]).unwrap();
    let positions = [
        "q.shoulder",
        "q.elbow",
        "q.wrist",
        "theta.shoulder",
        "theta.elbow",
        "theta.wrist",
        "v.forearm.1",
        "v.forearm.2",
        "v.forearm.3",
    ];
    assert_eq!(linear.states[..9], positions);
    assert_eq!(linear.states[15..], ["vd.forearm.1", "vd.forearm.2", "vd.forearm.3"]);
    assert_eq!(linear.inputs.len(), 3);
    assert_eq!(linear.outputs.len(), 15);
    // It sags, and rests there.
    assert!(plant.virtual_joints().iter().all(|v| linear.at.q[v.dof] != 0.0));
    let p = plant.parameters();
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    let mut x = State::zero(&plant);
    (x.q, x.theta) = (linear.at.q.clone(), linear.at.theta.clone());
    dynamics.forward(&x, &linear.at.tau_m, &mut rates);
    assert!(rates.qdd.iter().chain(&rates.thetadd).all(|a| a.abs() < 1e-9), "{rates:?}");
}

#[test]
fn models_of_bending_arms_are_the_derivatives_of_the_equations() {
    let plant = plant(&arm(2, 2000.0, 0.2));
    let p = plant.parameters();
    let nv = plant.model().nv;
    let mut x = State::zero(&plant);
    for dof in 0..nv {
        x.q[dof] = 0.2 * (dof as f64 + 1.0).sin();
        x.qd[dof] = 0.7 * (dof as f64).cos();
        x.theta[dof] = x.q[dof] + if plant.elastic()[dof] { 0.01 } else { 0.0 };
        x.thetad[dof] = x.qd[dof] + if plant.elastic()[dof] { 0.1 } else { 0.0 };
    }
    let tau = vec![3.0; nv];
    let model = Linearizer::new(&plant, &p).at(&x, &tau).clone();
    let n = model.A.nrows() / 2;
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    let mut accelerations = |x: &State<f64>| {
        dynamics.forward(x, &tau, &mut rates);
        flat(&plant, &rates.qdd, &rates.thetadd)
    };
    let joints = plant.joints().to_vec();
    let bends: Vec<usize> = plant.virtual_joints().iter().map(|v| v.dof).collect();
    let h = 1e-6;
    for column in 0..2 * n {
        let mut moved = |sign: f64| {
            let mut x = x.clone();
            let (link, motor) =
                if column < n { (&mut x.q, &mut x.theta) } else { (&mut x.qd, &mut x.thetad) };
            match column % n {
                k if k < 3 => link[joints[k]] += sign * h,
                k if k < 6 => motor[joints[k - 3]] += sign * h,
                k => {
                    link[bends[k - 6]] += sign * h;
                    motor[bends[k - 6]] += sign * h;
                }
            }
            accelerations(&x)
        };
        let (plus, minus) = (moved(1.0), moved(-1.0));
        for row in 0..n {
            let difference = (plus[row] - minus[row]) / (2.0 * h);
            let exact = model.A[(n + row, column)];
            assert!(
                (exact - difference).abs() < 1e-8 * model.A.norm_max(),
                "[{row}, {column}]: {exact} {difference}"
            );
        }
    }
}

// The forearm clamped by joints that nothing turns: Euler and Bernoulli's cantilever with the hand as its tip.
#[test]
fn a_clamped_forearm_bends_and_its_mode_says_so() {
    let mut robot = arm(8, 1e9, 1e9);
    // No hand to speak of.
    robot.model = {
        let mut builder = ModelBuilder::new("cantilever");
        builder.link("base", Inertia::default());
        builder.link("forearm", rod(BEAM.mass_per_length * BEAM.length, BEAM.length));
        builder
            .joint(JointSpec::new("elbow", JointShape::Revolute, "base", "forearm").about([0.0, -1.0, 0.0]));
        builder.build().unwrap().with_gravity(Vector3::ZERO)
    };
    robot.joints.truncate(1);
    robot.bending[0].link = robot.model.link("forearm").unwrap();
    robot.tool = robot.model.last_link();
    let plant = plant(&robot);
    let modes = modes(&plant, &plant.parameters(), &[0.0]).unwrap();
    let exact = (1.8751040687119611f64 / BEAM.length).powi(2)
        * (BEAM.flexural_rigidity / BEAM.mass_per_length).sqrt();
    let first = modes.iter().find(|m| m.omega > 1.0).unwrap();
    assert!((first.omega / exact - 1.0).abs() < 1e-3, "{} {exact}", first.omega);
    assert_eq!(first.participation[0].part, "forearm bending");
    assert!(first.participation[0].share > 0.999, "{first:?}");
    assert_eq!(first.motion[0].part, "forearm");
    assert!((first.damping_ratio.unwrap() - 0.01).abs() < 1e-3, "{first:?}");
}

#[test]
fn joints_and_links_share_the_modes_of_a_hanging_arm() {
    let plant = plant(&arm(3, 2000.0, 0.2));
    let modes = modes(&plant, &plant.parameters(), &[-FRAC_PI_2, 0.0, 0.0]).unwrap();
    let parts = |m: &sinew_linear::Mode| m.participation.iter().map(|s| s.share.abs()).sum::<f64>();
    assert!(modes.iter().all(|m| m.stable && (parts(m) - 1.0).abs() < 1e-3));
    let bent = |m: &&sinew_linear::Mode| m.participation[0].part == "forearm bending";
    let sprung = |m: &&sinew_linear::Mode| m.participation[0].part.ends_with(" spring");
    assert!(modes.iter().any(|m| bent(&m)) && modes.iter().any(|m| sprung(&m)));
}
