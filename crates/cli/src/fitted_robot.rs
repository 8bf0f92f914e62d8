//! A robot with the values that a fit found.

use sinew_model::{EffectSpec, Place, Robot};

/// The robot with these effects stated: springs and rotors in its joints, all others in its list.
pub(crate) fn with_effects(robot: &Robot, effects: &[EffectSpec]) -> Robot {
    let mut robot = robot.clone();
    for effect in effects {
        if !set_joint(&mut robot, effect) {
            match robot.effects.iter_mut().find(|e| e.is_same_as(effect)) {
                Some(stated) => stated.clone_from(effect),
                None => robot.effects.push(effect.clone()),
            }
        }
    }
    robot
}

// True if the effect is a spring or a rotor of a joint.
fn set_joint(robot: &mut Robot, effect: &EffectSpec) -> bool {
    let Place::Joint(name) = &effect.place else { return false };
    let Some(dof) = robot.model.dof(name) else { return false };
    let joint = &mut robot.joints[dof];
    match effect.kind.as_str() {
        "joint_elasticity" => {
            joint.stiffness = effect.number("stiffness").or(joint.stiffness);
            joint.damping = effect.number("damping").unwrap_or(joint.damping);
        }
        "rotor_inertia" => joint.rotor_inertia = effect.number("inertia").unwrap_or(joint.rotor_inertia),
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples;

    #[test]
    fn an_effect_stated_again_replaces_the_old_one() {
        let robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        let at = |kind: &str| EffectSpec::new(kind, Place::Joint("pivot".into()));
        let friction = |f| at("coulomb_friction").with("coulomb", f);
        let spring = at("joint_elasticity").with("stiffness", 150.0);
        let robot = with_effects(&robot, &[friction(1.0), spring, friction(2.0)]);
        assert_eq!(robot.effects, [friction(2.0)]);
        assert_eq!(robot.joints[0].stiffness, Some(150.0));
    }

    #[test]
    fn offsets_of_two_sensors_of_a_joint_are_two_effects() {
        let robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        let offset =
            EffectSpec::new("torque_sensor_offset", Place::Joint("pivot".into())).with("offset", 0.4);
        let behind = offset.clone().said("signal", "joint_torque").with("offset", -0.1);
        let robot = with_effects(&robot, &[offset.clone(), behind.clone()]);
        assert_eq!(robot.effects, [offset, behind]);
    }
}
