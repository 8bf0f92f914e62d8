//! A motor pushes with 1 N·m on a hanging link through a spring: prints link and motor position over time.
//!
//! `cargo run -p sinew-flex-joint --example step_response`

use sinew_flex_joint::{ElasticJoints, FlexJointError};
use sinew_model::{Robot, samples};

fn main() -> Result<(), FlexJointError> {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(150.0);
    robot.joints[0].damping = 0.5;
    robot.joints[0].rotor_inertia = 0.05;
    let arm = ElasticJoints::new(&robot)?;

    // Semi-implicit Euler steps of 10 µs: enough for a picture; `sinew-simulate` has better ones.
    let (h, tau_m) = (1e-5, 1.0);
    let (mut q, mut qd, mut theta, mut thetad) = (0.0, 0.0, 0.0, 0.0);
    println!("time [s]   q [rad]    theta [rad]   energy [J]");
    for step in 0..=200_000 {
        if step % 20_000 == 0 {
            let energy = arm.energy(&[q], &[qd], &[theta], &[thetad]);
            println!("{:8.1}   {q:8.5}   {theta:11.5}   {energy:10.5}", h * step as f64);
        }
        let (qdd, thetadd) = arm.forward_dynamics(&[q], &[qd], &[theta], &[thetad], &[tau_m]);
        qd += h * qdd[0];
        thetad += h * thetadd[0];
        q += h * qd;
        theta += h * thetad;
    }
    Ok(())
}
