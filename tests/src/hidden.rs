//! What is hidden from the model: every effect of the catalogue, in the size of the arm's own torques.

use sinew_model::{EffectSpec, Place, Robot, Setting};

use crate::Arm;

/// How an effect is hidden.
pub enum How {
    /// The truth has it, the model does not.
    Added(EffectSpec),
    /// The truth and the model differ in what the model states: edits the truth.
    Changed(fn(&mut Robot, usize)),
    /// The truth keeps what the model loses: edits the model.
    Forgotten(fn(&mut Robot, usize)),
}

/// One hidden effect.
pub struct Hidden {
    /// Its name in the catalogue.
    pub effect: &'static str,
    /// Its place in words.
    pub place: String,
    /// Degree of freedom.
    pub dof: usize,
    /// How it is hidden.
    pub how: How,
}

/// Every effect that these sensors can see, hidden at degree of freedom `dof` (link effects at the link it moves).
pub fn hidden_effects(arm: &Arm, dof: usize) -> Vec<Hidden> {
    let model = &arm.robot.model;
    let joint = model.dof_name(dof).to_owned();
    let link = model.links.iter().find(|l| l.body.is_some_and(|b| b.0 == dof)).map(|l| l.name.clone());
    let link = link.unwrap_or_default();
    let f = arm.torque[dof];
    let k = arm.robot.joints[dof].stiffness.unwrap_or(1e4);
    // A large deflection of this spring: five times Coulomb torque.
    let deflection = 5.0 * f / k;
    let mut list = Vec::new();
    let mut at_joint = |effect: &'static str, values: &[(&str, f64)]| {
        let spec = values
            .iter()
            .fold(EffectSpec::new(effect, Place::Joint(joint.clone())), |s, (key, v)| s.with(key, *v));
        list.push(Hidden { effect, place: joint.clone(), dof, how: How::Added(spec) });
    };
    at_joint("stribeck_friction", &[("stribeck", 0.5 * f), ("stribeck_velocity", 0.06)]);
    at_joint("asymmetric_friction", &[("slope", 0.3 * f)]);
    at_joint("load_dependent_friction", &[("load_coefficient", 0.1)]);
    at_joint("quadratic_viscous_friction", &[("quadratic", 0.3 * f)]);
    at_joint("presliding_friction", &[("bristle_stiffness", 600.0 * f), ("micro_damping", 3.0 * f)]);
    at_joint("link_viscous_friction", &[("viscous", 0.6 * f)]);
    at_joint("link_coulomb_friction", &[("coulomb", 0.5 * f), ("smoothing_velocity", 1e-3)]);
    at_joint("stiffness_hardening", &[("cubic", 0.5 * k / (deflection * deflection))]);
    at_joint("backlash", &[("half_width", 0.15 * deflection)]);
    at_joint("transmission_hysteresis", &[("stiffness", 0.6 * f), ("yield_deflection", 0.1 * deflection)]);
    at_joint(
        "transmission_error",
        &[("sine", 0.06 * deflection), ("cosine", 0.04 * deflection), ("per_turn", 14.0)],
    );
    at_joint("cogging_torque", &[("sine", 0.2 * f), ("cosine", 0.1 * f), ("per_turn", 24.0)]);
    at_joint("torque_ripple", &[("sine", 0.06), ("cosine", -0.04), ("per_turn", 17.0)]);
    at_joint("balancer_spring", &[("stiffness", 1.2 * f), ("preload", 0.4 * f)]);
    at_joint("torque_constant_error", &[("scale_error", 0.2)]);
    at_joint("actuator_lag", &[("time", 0.004)]);
    at_joint("actuator_delay", &[("time", 0.005)]);
    at_joint("torque_sensor_offset", &[("offset", 2.0 * f)]);
    at_joint("position_sensor_offset", &[("offset", 3e-3)]);
    at_joint("position_sensor_scale", &[("scale_error", 0.01)]);
    at_joint("time_skew", &[("time", 0.008)]);
    let mut contact = EffectSpec::new("contact", Place::Joint(joint.clone()))
        .with("stiffness", 8.0 * f)
        .with("position", 0.35);
    contact.settings.push(("side".to_owned(), Setting::Word("above".to_owned())));
    list.push(Hidden { effect: "contact", place: joint.clone(), dof, how: How::Added(contact) });
    let robot = Place::Robot;
    list.push(Hidden {
        effect: "payload",
        place: robot.to_string(),
        dof,
        how: How::Added(EffectSpec::new("payload", Place::Robot).with("mass", 1.5)),
    });
    if model.nv > 1 {
        let tilt = EffectSpec::new("base_tilt", Place::Robot).with("about_x", 0.0).with("about_y", 0.06);
        list.push(Hidden { effect: "base_tilt", place: robot.to_string(), dof, how: How::Added(tilt) });
    }
    let mut changed = |effect: &'static str, place: &str, how: How| {
        list.push(Hidden { effect, place: place.to_owned(), dof, how });
    };
    changed("viscous_friction", &joint, How::Forgotten(|r, d| forget(r, "viscous_friction", d)));
    changed("coulomb_friction", &joint, How::Forgotten(|r, d| forget(r, "coulomb_friction", d)));
    changed("joint_elasticity", &joint, How::Forgotten(|r, d| r.joints[d].stiffness = None));
    changed("joint_stiffness_error", &joint, How::Changed(|r, d| scale(&mut r.joints[d].stiffness, 1.6)));
    changed("joint_damping_error", &joint, How::Changed(|r, d| r.joints[d].damping *= 4.0));
    changed("rotor_inertia", &joint, How::Changed(|r, d| r.joints[d].rotor_inertia *= 1.4));
    changed(
        "link_first_moment",
        &link,
        How::Changed(|r, d| {
            let body = &mut r.model.joints[d].inertia;
            body.first_moment.x *= 1.35;
        }),
    );
    changed(
        "link_inertia",
        &link,
        How::Changed(|r, d| {
            let body = &mut r.model.joints[d].inertia;
            body.second_moment.yy *= 1.5;
        }),
    );
    list
}

fn forget(robot: &mut Robot, kind: &str, dof: usize) {
    let joint = robot.model.dof_name(dof).to_owned();
    robot.effects.retain(|e| !(e.kind == kind && e.place == Place::Joint(joint.clone())));
}

fn scale(value: &mut Option<f64>, factor: f64) {
    *value = value.map(|v| v * factor);
}
