//! A robot with the values that a fit found.

use sinew_model::{EffectSpec, Place, Robot};

/// The robot with these effects stated: springs and rotors in its joints, all others in its list.
pub(crate) fn with_effects(robot: &Robot, effects: &[EffectSpec]) -> Robot {
    let mut robot = robot.clone();
    for effect in effects {
        if !set_joint(&mut robot, effect) {
            let same = |e: &EffectSpec| e.kind == effect.kind && e.place == effect.place;
            match robot.effects.iter_mut().find(|e| same(e)) {
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
}
