//! What is hidden from the model: every effect of the catalogue, in the size of the arm's own torques.

use sinew_effect::{Entry, Requirement};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, Inertia, Place, Robot};

use crate::suite::MEAN_TEMPERATURE;
use crate::{Arm, Sensors};

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

impl Hidden {
    /// True if these sensors can show it.
    pub fn is_seen_by(&self, sensors: Sensors) -> bool {
        let is_one_of = |names: &[&str]| names.contains(&self.effect);
        match sensors {
            Sensors::Full | Sensors::All => true,
            Sensors::Motor | Sensors::Current => !is_one_of(&OF_LINK_ENCODERS),
            Sensors::Link => is_one_of(&BEHIND_THE_GEAR),
        }
    }

    /// True if this arm can have it: where no joint has a spring, nothing that acts in springs or behind them; where one slides,
    /// nothing that goes with its turns.
    pub(crate) fn is_possible_in(&self, arm: &Arm) -> bool {
        let requires =
            |entry: &Entry, all: &[Requirement]| all.iter().any(|r| entry.card.requires.contains(r));
        let model = &arm.robot.model;
        let slides = model.joints[model.joint_of_dof(self.dof).0].kind.slides();
        !CATALOGUE.find(self.effect).is_some_and(|entry| {
            (arm.is_rigid() && requires(entry, &OF_SPRINGS))
                || (slides && requires(entry, &[Requirement::Turning]))
        })
    }
}

const OF_SPRINGS: [Requirement; 4] =
    [Requirement::Elastic, Requirement::Rigid, Requirement::LinkBalance, Requirement::ElasticOrLinkEncoder];

/// Every effect that encoders and torques can see, hidden at degree of freedom `dof` (link effects at the link it
/// moves). What is added has `size` times the strength of a plain one; what is stated is wrong by its full amount.
pub fn hidden_effects(arm: &Arm, dof: usize, size: f64) -> Vec<Hidden> {
    let joint = arm.robot.model.dof_name(dof).to_owned();
    let mut list = added_at_joint(arm, dof, &joint, size);
    list.extend(coupled(arm, dof, &joint, size));
    list.extend(added_to_robot(arm, dof, size));
    list.extend(changed(arm, dof, &joint));
    list.extend(carried(arm, dof, &joint));
    list
}

/// The effects from which cases by chance are drawn: a seed keeps its case when the catalogue grows.
pub(crate) fn effects_by_chance(arm: &Arm, dof: usize, size: f64) -> Vec<Hidden> {
    let mut list = hidden_effects(arm, dof, size);
    list.retain(|h| h.effect != ROTOR_LINK_COUPLING);
    list
}

const ROTOR_LINK_COUPLING: &str = "rotor_link_coupling";

/// True for effects that no motion separates, and for an effect and itself.
pub fn are_twins(a: &str, b: &str) -> bool {
    let says = |of: &str, other: &str| {
        let card = CATALOGUE.find(of).map(|e| e.card);
        card.is_some_and(|c| c.rivals.iter().any(|r| r.structural && r.name == other))
    };
    a == b || says(a, b) || says(b, a)
}

// What only a link encoder beside a motor's shows, and what torque and position behind the gear do.
const OF_LINK_ENCODERS: [&str; 3] = ["position_sensor_offset", "position_sensor_scale", "time_skew"];
const BEHIND_THE_GEAR: [&str; 10] = [
    "payload",
    "link_inertia",
    "link_first_moment",
    "link_viscous_friction",
    "link_coulomb_friction",
    "balancer_spring",
    "contact",
    "base_tilt",
    "base_compliance",
    "link_bending_mode",
];

// Keys that give a shape: they do not shrink with an effect's size.
const SHAPES: [&str; 9] = [
    "reference_temperature",
    "frequency",
    "damping_ratio",
    "stribeck_velocity",
    "bristle_stiffness",
    "smoothing_velocity",
    "yield_deflection",
    "per_turn",
    "position",
];

fn added_at_joint(arm: &Arm, dof: usize, joint: &str, size: f64) -> Vec<Hidden> {
    let f = arm.torque[dof];
    let k = arm.robot.joints[dof].stiffness.unwrap_or(1e4);
    // A large deflection of this spring: five times Coulomb torque.
    let deflection = 5.0 * f / k;
    let with = |effect: &'static str, values: &[(&str, f64)]| {
        let plain = EffectSpec::new(effect, Place::Joint(joint.to_owned()));
        let spec = values
            .iter()
            .fold(plain, |s, (key, v)| s.with(key, if SHAPES.contains(key) { *v } else { size * v }));
        Hidden { effect, place: joint.to_owned(), dof, how: How::Added(spec) }
    };
    let mut contact = with("contact", &[("stiffness", 8.0 * f), ("position", 0.35)]);
    if let How::Added(spec) = contact.how {
        contact.how = How::Added(spec.said("side", "above"));
    }
    vec![
        with("stribeck_friction", &[("stribeck", 0.5 * f), ("stribeck_velocity", 0.06)]),
        with("asymmetric_friction", &[("slope", 0.3 * f)]),
        with("load_dependent_friction", &[("load_coefficient", 0.1)]),
        with("quadratic_viscous_friction", &[("quadratic", 0.3 * f)]),
        with(
            "temperature_dependent_friction",
            &[
                ("viscous_slope", -0.02 * f),
                ("coulomb_slope", -0.01 * f),
                ("reference_temperature", MEAN_TEMPERATURE),
            ],
        ),
        with("presliding_friction", &[("bristle_stiffness", 600.0 * f), ("micro_damping", 3.0 * f)]),
        with("link_viscous_friction", &[("viscous", 0.6 * f)]),
        with("link_coulomb_friction", &[("coulomb", 0.5 * f), ("smoothing_velocity", 1e-3)]),
        with("stiffness_hardening", &[("cubic", 0.5 * k / (deflection * deflection))]),
        with("backlash", &[("half_width", 0.15 * deflection)]),
        with("link_bending_mode", &[("inertia_share", 0.12), ("frequency", 9.0), ("damping_ratio", 0.03)]),
        with("transmission_hysteresis", &[("stiffness", 0.6 * f), ("yield_deflection", 0.1 * deflection)]),
        with(
            "transmission_error",
            &[("sine", 0.06 * deflection), ("cosine", 0.04 * deflection), ("per_turn", 14.0)],
        ),
        with("cogging_torque", &[("sine", 0.2 * f), ("cosine", 0.1 * f), ("per_turn", 24.0)]),
        with("torque_ripple", &[("sine", 0.06), ("cosine", -0.04), ("per_turn", 17.0)]),
        with("balancer_spring", &[("stiffness", 1.2 * f), ("preload", 0.4 * f)]),
        with("torque_constant_error", &[("scale_error", 0.2)]),
        with("actuator_lag", &[("time", 0.004)]),
        with("actuator_delay", &[("time", 0.005)]),
        with("torque_saturation", &[("limit", 9.0 * f / (size * size))]),
        with("torque_sensor_offset", &[("offset", 2.0 * f)]),
        with("position_sensor_offset", &[("offset", 3e-3)]),
        with("position_sensor_scale", &[("scale_error", 0.01)]),
        with("time_skew", &[("time", 0.008)]),
        contact,
    ]
}

/// What follows the turns of the motor at degree of freedom `dof`, many times a turn of the joint: cogging of a pole pair's four
/// teeth, a torque ripple of six commutations, a shaft that runs out, and a flexspline that does twice a turn.
///
/// # Panics
/// Where the joint states no gear ratio.
pub fn turns_of_motor(arm: &Arm, dof: usize, size: f64) -> Vec<Hidden> {
    let joint = arm.robot.model.dof_name(dof).to_owned();
    let ratio = arm.robot.joints[dof].gear_ratio.expect("the arms of the suite state their gear ratios");
    let f = size * arm.torque[dof];
    let k = arm.robot.joints[dof].stiffness.unwrap_or(1e4);
    let with = |effect: &'static str, periods: f64, sine: f64, cosine: f64| {
        let spec = EffectSpec::new(effect, Place::Joint(joint.clone()))
            .with("sine", sine)
            .with("cosine", cosine)
            .with("per_turn", periods * ratio);
        Hidden { effect, place: joint.clone(), dof, how: How::Added(spec) }
    };
    vec![
        with("cogging_torque", 4.0, 0.2 * f, 0.1 * f),
        with("torque_ripple", 6.0, 0.06 * size, -0.04 * size),
        with("transmission_error", 1.0, 0.3 * f / k, 0.2 * f / k),
        with("transmission_error", 2.0, 0.3 * f / k, 0.2 * f / k),
    ]
}

// The neighbour's drive acts at this joint too.
fn coupled(arm: &Arm, dof: usize, joint: &str, size: f64) -> Option<Hidden> {
    let neighbour = dof.checked_sub(1).unwrap_or(dof + 1);
    if neighbour >= arm.robot.model.nv {
        return None;
    }
    let effect = "joint_cross_coupling";
    let spec = EffectSpec::new(effect, Place::Joint(joint.to_owned()))
        .with("coupling", 0.1 * size)
        .said("from", arm.robot.model.dof_name(neighbour));
    Some(Hidden { effect, place: joint.to_owned(), dof, how: How::Added(spec) })
}

// All of the spin of a rotor that a moving link carries, whatever the size asked for: there is no more of it.
fn carried(arm: &Arm, dof: usize, joint: &str) -> Option<Hidden> {
    arm.robot.rotor_mount(dof).ok()??;
    let effect = ROTOR_LINK_COUPLING;
    let spec = EffectSpec::new(effect, Place::Joint(joint.to_owned())).with("scale", 1.0);
    Some(Hidden { effect, place: joint.to_owned(), dof, how: How::Added(spec) })
}

fn added_to_robot(arm: &Arm, dof: usize, size: f64) -> Vec<Hidden> {
    let with = |effect: &'static str, spec: EffectSpec| Hidden {
        effect,
        place: Place::Robot.to_string(),
        dof,
        how: How::Added(spec),
    };
    let mut list = vec![with("payload", payload(arm, size * arm.payload))];
    if arm.robot.model.nv > 1 {
        let tilt =
            EffectSpec::new("base_tilt", Place::Robot).with("about_x", 0.0).with("about_y", size * 0.06);
        list.push(with("base_tilt", tilt));
        // A base that leans by some thousandths of a degree under five times the joint's Coulomb torque, and swings at 11 Hz.
        let soft = EffectSpec::new("base_compliance", Place::Robot)
            .with("compliance", size * 5e-5 / (5.0 * arm.torque[dof]))
            .with("frequency", 11.0)
            .with("damping_ratio", 0.03)
            .said("axis", "y");
        list.push(with("base_compliance", soft));
    }
    list
}

// A point at the tool; where that is on the axis of the only joint, twice as far from it as the link's centre of mass.
fn payload(arm: &Arm, mass: f64) -> EffectSpec {
    let model = &arm.robot.model;
    let plain = EffectSpec::new("payload", Place::Robot).with("mass", mass);
    if model.nv > 1 || model.links[arm.robot.tool.0].body_from_link.translation.norm() > 0.0 {
        return plain;
    }
    let Inertia { first_moment: h, second_moment: i, .. } =
        Inertia::point(mass, model.joints[0].inertia.centre_of_mass() * 2.0);
    let with_moment = plain.with_numbers("first_moment", &[h.x, h.y, h.z]);
    with_moment.with_numbers("inertia", &[i.xx, i.yy, i.zz, i.xy, i.xz, i.yz])
}

fn changed(arm: &Arm, dof: usize, joint: &str) -> Vec<Hidden> {
    let owner = arm.robot.model.links.iter().find(|l| l.body.is_some_and(|b| b.0 == dof));
    let link = owner.map_or("", |l| l.name.as_str());
    let with =
        |effect: &'static str, place: &str, how: How| Hidden { effect, place: place.to_owned(), dof, how };
    vec![
        with("viscous_friction", joint, How::Forgotten(|r, d| forget(r, "viscous_friction", d))),
        with("coulomb_friction", joint, How::Forgotten(|r, d| forget(r, "coulomb_friction", d))),
        with("joint_elasticity", joint, How::Forgotten(|r, d| r.joints[d].stiffness = None)),
        with("joint_stiffness_error", joint, How::Changed(|r, d| scale(&mut r.joints[d].stiffness, 1.6))),
        with("joint_damping_error", joint, How::Changed(|r, d| r.joints[d].damping *= 4.0)),
        with("rotor_inertia", joint, How::Changed(|r, d| r.joints[d].rotor_inertia *= 1.4)),
        with(
            "link_first_moment",
            link,
            How::Changed(|r, d| {
                let body = &mut r.model.joints[d].inertia;
                body.first_moment.x *= 1.35;
            }),
        ),
        with(
            "link_inertia",
            link,
            How::Changed(|r, d| {
                let body = &mut r.model.joints[d].inertia;
                body.second_moment.yy *= 1.5;
            }),
        ),
    ]
}

fn forget(robot: &mut Robot, kind: &str, dof: usize) {
    let joint = robot.model.dof_name(dof).to_owned();
    robot.effects.retain(|e| !(e.kind == kind && e.place == Place::Joint(joint.clone())));
}

fn scale(value: &mut Option<f64>, factor: f64) {
    *value = value.map(|v| v * factor);
}
