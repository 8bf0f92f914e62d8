//! A planar two-link arm with elastic joints against an independent simulation.
//!
//! Pinocchio 4.1.0's dynamics in SciPy's DOP853 at tolerance 1e-13, 21 November 2026; LSODA at 1e-12 differs from
//! it by 6e-10.

use sinew_data::Quantity;
use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, Pose, Robot, Vector3};
use sinew_simulate::{Options, Simulated, Start, Tolerance, Torques, simulate};

use crate::robots::plant;

const SECONDS: f64 = 2.0;
const START: [f64; 2] = [-1.3, 0.2];
const BALANCED: [f64; 2] = [-1.2575186845274229, 0.21779911180473965];
// The state after two seconds: q, θ, q̇, θ̇ by joint; the work of the motors and what was lost.
const END: [(Quantity, [f64; 2]); 4] = [
    (Quantity::JointPosition, [-0.6438086406520689, -1.2892829524673797]),
    (Quantity::MotorPosition, [-0.582304729304403, -1.2767939667088273]),
    (Quantity::JointVelocity, [1.0791505876546923, 1.3476034257608842]),
    (Quantity::MotorVelocity, [1.0989728938495338, 1.3374179069789538]),
];
const WORK: f64 = 7.166943753696493;
const LOST: f64 = 0.008316490091424402;

// Two uniform rods, 3 kg and 0.5 m, 2 kg and 0.4 m.
fn arm() -> Robot {
    let mut builder = ModelBuilder::new("planar_2r");
    builder.link("base", Inertia::default());
    let rod = |mass: f64, length: f64| {
        let about = mass * length * length / 12.0;
        Inertia::at_centre_of_mass(
            mass,
            Vector3::new(length / 2.0, 0.0, 0.0),
            [1e-3, about, about, 0.0, 0.0, 0.0],
        )
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

// τ = hold + offset + size sin(speed t + phase), each sample holding its mean over the sample.
fn torque(dof: usize, t: f64, period: f64) -> f64 {
    let hold = [6.372197320886569, 1.7799111804739658][dof];
    let (offset, size, speed, phase) = [(0.3, 2.0, 4.0, 0.0), (0.1, 0.8, 7.0, 0.7)][dof];
    let integral = (speed * t + phase).cos() - (speed * (t + period) + phase).cos();
    hold + offset + size * integral / (speed * period)
}

fn run(samples: u32) -> Simulated {
    let plant = plant(&arm());
    let p = plant.parameters();
    let period = SECONDS / f64::from(samples);
    let mut options = Options::new(&plant, SECONDS, period);
    options.start = Start::balanced(&plant, &p, &START).unwrap();
    options.tolerance = Tolerance { relative: 1e-12, absolute: 1e-13 };
    let tau = |dof| options.times.iter().map(|&t| torque(dof, t, period)).collect();
    let mut drive = Torques { time: options.times.clone(), tau: vec![tau(0), tau(1)] };
    simulate(&plant, &p, &mut drive, &options).unwrap()
}

#[test]
fn the_arm_moves_as_in_an_independent_simulation() {
    // A hold that keeps the mean is right to the second order of the period; two periods give the fourth.
    let (coarse, fine) = (run(5000), run(10_000));
    let limit = |of: &dyn Fn(&Simulated) -> f64| (4.0 * of(&fine) - of(&coarse)) / 3.0;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 5e-9, "{a} {b}");
    for (quantity, end) in END {
        for (joint, exact) in ["shoulder", "elbow"].into_iter().zip(end) {
            near(limit(&|s| *s.run.signal(quantity, joint).unwrap().values.last().unwrap()), exact);
        }
    }
    near(limit(&|s| s.audit.work_in), WORK);
    near(limit(&|s| s.audit.dissipated), LOST);
    for (joint, theta) in ["shoulder", "elbow"].into_iter().zip(BALANCED) {
        near(fine.run.signal(Quantity::MotorPosition, joint).unwrap().values[0], theta);
    }
}
