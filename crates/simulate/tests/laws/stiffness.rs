//! Stiff joints: the rigid limit, and the work that fast modes cost.

use sinew_data::Quantity;
use sinew_model::Robot;
use sinew_simulate::{Method, Options, Simulated, Start, Torques, Work, simulate};

use crate::robots::{lesson, lossless, plant};

fn run(robot: &Robot, seconds: f64, method: Method) -> Simulated {
    let plant = plant(robot);
    let mut options = Options::new(&plant, seconds, 1e-3);
    options.method = method;
    simulate(&plant, &plant.parameters(), &mut Torques::constant(&[1.0]), &options).unwrap()
}

fn position(run: &Simulated) -> &[f64] {
    &run.run.signal(Quantity::JointPosition, "joint").unwrap().values
}

#[test]
fn stiff_joints_give_back_the_rigid_robot_as_one_over_k() {
    let mut rigid = lesson();
    rigid.joints[0].stiffness = None;
    let rigid = run(&rigid, 2.0, Method::Explicit);
    let error = |stiffness: f64| {
        let mut robot = lesson();
        robot.joints[0].stiffness = Some(stiffness);
        let elastic = run(&robot, 2.0, Method::Explicit);
        position(&elastic).iter().zip(position(&rigid)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [1e3, 1e4, 1e5].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log10();
        assert!((order - 1.0).abs() < 0.1, "{errors:?}");
    }
}

// ω = 31 600 rad/s, ζ = 0.0016: a mode that is fast but oscillates.
fn weakly_damped() -> Robot {
    let mut robot = lossless(1e6);
    robot.joints[0].rotor_inertia = 1e-3;
    robot.joints[0].damping = 0.1;
    robot
}

#[test]
fn a_stiff_weakly_damped_joint_gets_through_by_every_method() {
    let runs = [Method::Auto, Method::Explicit, Method::Stiff].map(|m| run(&weakly_damped(), 0.05, m));
    for other in &runs[1..] {
        for (a, b) in position(&runs[0]).iter().zip(position(other)) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }
    // An oscillation is no case for the stiff method.
    let [auto, explicit, stiff] = runs.map(|r| r.work.evaluations);
    assert!(explicit < stiff && auto < 2 * explicit, "{auto} {explicit} {stiff}");
}

#[test]
fn a_fast_over_damped_joint_is_handed_to_the_stiff_method() {
    let mut robot = weakly_damped();
    robot.joints[0].damping = 1e3;
    let [auto, explicit] = [Method::Auto, Method::Explicit].map(|m| run(&robot, 0.1, m));
    for (a, b) in position(&auto).iter().zip(position(&explicit)) {
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
    assert!(10 * auto.work.evaluations < explicit.work.evaluations, "{:?} {:?}", auto.work, explicit.work);
}

#[test]
fn a_smooth_joint_costs_one_step_a_sample() {
    let Work { steps, evaluations, rejected } = run(&lesson(), 2.0, Method::Auto).work;
    assert!((2000..2010).contains(&steps) && rejected == 0, "{steps} {rejected}");
    // Twelve stages, the new rate, three for dense output; and the library's first guess.
    assert!(evaluations <= 16 * steps + 10, "{evaluations}");
}

#[test]
fn a_balanced_robot_stays_where_it_is() {
    let mut robot = Robot::rigid(sinew_model::samples::planar_arm(2, 3.0, 0.4));
    for joint in &mut robot.joints {
        (joint.stiffness, joint.rotor_inertia) = (Some(500.0), 0.1);
    }
    let plant = plant(&robot);
    let p = plant.parameters();
    let mut options = Options::new(&plant, 1.0, 1e-2);
    options.start = Start::balanced(&plant, &p, &[0.3, -0.5]).unwrap();
    let sag = options.start.theta[0] - 0.3;
    // Level forearm torque m g l/2 and so on: g₁ = mgl (3/2 cos q₁ + ½ cos(q₁+q₂)), g₂ = ½ mgl cos(q₁+q₂)
    let (weight, elbow) = (3.0 * 9.81 * 0.4, 0.5 * (0.3f64 - 0.5).cos());
    let gravity = [weight * (1.5 * 0.3f64.cos() + elbow), weight * elbow];
    assert!((sag * 500.0 - gravity[0]).abs() < 1e-9);
    let held = simulate(&plant, &p, &mut Torques::constant(&gravity), &options).unwrap();
    for quantity in [Quantity::JointVelocity, Quantity::MotorVelocity] {
        let values = &held.run.signal(quantity, "joint_1").unwrap().values;
        assert!(values.iter().all(|v| v.abs() < 1e-9));
    }
}
