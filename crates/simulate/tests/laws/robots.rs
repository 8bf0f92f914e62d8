//! Robots that several tests share.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, Place, Robot, samples};
use sinew_plant::Plant;

/// The lesson's joint: K 150, D 0.5, B 0.05, and its two viscous frictions.
pub fn lesson() -> Robot {
    let mut robot = lossless(150.0);
    robot.joints[0].damping = 0.5;
    let at_joint = |kind| EffectSpec::new(kind, Place::Joint("joint".into()));
    robot.effects.push(at_joint("link_viscous_friction").with("viscous", 0.02));
    robot.effects.push(at_joint("viscous_friction").with("viscous", 0.01));
    robot
}

/// The lesson's joint without any loss.
pub fn lossless(stiffness: f64) -> Robot {
    let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(stiffness);
    robot.joints[0].rotor_inertia = 0.05;
    robot
}

/// Two equal rods with elastic joints and motor friction.
pub fn arm() -> Robot {
    let mut robot = Robot::rigid(samples::planar_arm(2, 3.0, 0.4));
    for (dof, (stiffness, damping, rotor)) in [(2000.0, 1.0, 0.3), (800.0, 0.5, 0.1)].into_iter().enumerate()
    {
        let joint = &mut robot.joints[dof];
        joint.stiffness = Some(stiffness);
        joint.damping = damping;
        joint.rotor_inertia = rotor;
        let place = || Place::Joint(format!("joint_{}", dof + 1));
        robot.effects.push(EffectSpec::new("viscous_friction", place()).with("viscous", 0.4));
        let coulomb = EffectSpec::new("coulomb_friction", place()).with("coulomb", 0.8);
        robot.effects.push(coulomb.with("smoothing_velocity", 1e-3));
    }
    robot
}

/// √(mean of squares).
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), x| (sum + x * x, n + 1.0));
    f64::sqrt(sum / n)
}

pub fn plant(robot: &Robot) -> Plant {
    Plant::new(robot, &CATALOGUE).unwrap()
}

/// The signal of the first joint at the sample nearest to `t`.
pub fn value_at(run: &Run, quantity: Quantity, t: f64) -> f64 {
    let k = run.time.partition_point(|&s| s < t - 1e-9);
    run.signals.iter().find(|s| s.quantity == quantity).unwrap().values[k]
}
