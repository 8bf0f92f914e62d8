//! What is free before any effect is missing: parameters within their tolerances, offsets, one clock.
//!
//! Inertias, friction and springs of the URDF and the sidecar are known to a tolerance, sensors have small offsets,
//! and two encoders of one joint may not be read at the same instant. All this enters every fit as effects with
//! priors. Where the data pull a parameter out of its tolerance, releasing it is a candidate like any other.

use sinew_data::Run;
use sinew_effect::{Catalogue, Sensor};
use sinew_model::{EffectSpec, Inertia, Model, Place, Robot, Setting, Trust};

use crate::record::{Channel, Record, Sensors};

/// Effects of the base besides those that robot and sidecar state.
pub(crate) fn nuisances(
    robot: &Robot,
    catalogue: &Catalogue,
    sensors: &Sensors,
    records: &[Record],
) -> Vec<EffectSpec> {
    let stated = robot.all_effects();
    let is_same = |a: &EffectSpec, b: &EffectSpec| {
        a.kind == b.kind && a.place == b.place && a.get("signal") == b.get("signal")
    };
    let is_stated = |s: &EffectSpec| stated.iter().any(|e| is_same(e, s));
    let mut specs = Vec::new();
    for joint in 0..robot.model.joints.len() {
        specs.extend(inertial(robot, joint));
    }
    for (index, channel) in sensors.channels.iter().enumerate() {
        specs.extend(instrument(robot, channel, records, index));
    }
    specs.retain(|s| catalogue.find(&s.kind).is_some() && !is_stated(s));
    specs
}

/// True for effects that are in every fit and are no finding by themselves.
pub(crate) fn is_nuisance(kind: &str) -> bool {
    is_inertial(kind) || INSTRUMENTS.contains(&kind)
}

/// True for deviations of a body's inertia from what the URDF says.
pub(crate) fn is_inertial(kind: &str) -> bool {
    INERTIAS.contains(&kind)
}

const INERTIAS: [&str; 3] = ["link_mass", "link_first_moment", "link_inertia"];
const INSTRUMENTS: [&str; 3] = ["torque_sensor_offset", "position_sensor_offset", "time_skew"];

/// About how much wider the tolerances of nominal inertias are than those of exact ones.
pub(crate) const EXACT_TO_NOMINAL: f64 = 30.0;

// Tolerances of a URDF's inertias, as shares: mass, first moment, lateral first moment, inertia.
fn tolerances(trust: Trust) -> [f64; 4] {
    match trust {
        Trust::Exact => [0.001; 4],
        Trust::Nominal => [0.03, 0.03, 0.02, 0.05],
        Trust::Unknown => [10.0; 4],
    }
}

/// Stated inertial deviations as the base takes them: of a robot whose inertias are known exactly to that tolerance,
/// whatever a fit wrote beside them. What one fit cannot tell apart has no standard deviation of its own.
pub(crate) fn trusted(robot: &Robot, stated: Vec<EffectSpec>) -> Vec<EffectSpec> {
    if robot.trust != Trust::Exact {
        return stated;
    }
    let own: Vec<EffectSpec> = (0..robot.model.joints.len()).flat_map(|j| inertial(robot, j)).collect();
    let held = |mut spec: EffectSpec| {
        if let Some(exact) = own.iter().find(|e| e.kind == spec.kind && e.place == spec.place) {
            let is_std = |(key, _): &&(String, Setting)| key.ends_with("_std");
            spec.settings.retain(|s| !is_std(&s));
            spec.settings.extend(exact.settings.iter().filter(is_std).cloned());
        }
        spec
    };
    stated.into_iter().map(held).collect()
}

pub(crate) fn inertial(robot: &Robot, joint: usize) -> Vec<EffectSpec> {
    let model = &robot.model;
    // The link that stands in the joint's frame carries the body's deltas.
    let owner = model.links.iter().find(|l| l.body.is_some_and(|b| b.0 == joint));
    let Some(link) = owner else { return Vec::new() };
    let place = || Place::Link(link.name.clone());
    let body = &model.joints[joint].inertia;
    let [mass, first, lateral, second] = tolerances(robot.trust);
    let reach = reach(model, joint);
    let main = body.first_moment.norm();
    let floor = 0.01 / 0.03 * first * body.mass * reach;
    let moment = |component: f64| {
        let along = if main > 0.0 { component.abs() / main } else { 0.0 };
        let share = first * along + lateral * (1.0 - along);
        (share * main).max(floor).max(1e-6)
    };
    let h = body.first_moment;
    let size = inertia_size(body, reach);
    let with = |kind: &str, key: &str, values: Vec<f64>, stds: Vec<f64>| {
        let spec = EffectSpec::new(kind, place());
        spec.with_numbers(key, &values).with_numbers(&format!("{key}_std"), &stds)
    };
    let diagonal = second * size;
    let product = 0.4 * diagonal;
    vec![
        EffectSpec::new("link_mass", place())
            .with("mass", 0.0)
            .with("mass_std", (mass * body.mass).max(1e-6)),
        with("link_first_moment", "first_moment", vec![0.0; 3], vec![moment(h.x), moment(h.y), moment(h.z)]),
        with(
            "link_inertia",
            "inertia",
            vec![0.0; 6],
            vec![diagonal, diagonal, diagonal, product, product, product],
        ),
    ]
}

fn inertia_size(body: &Inertia<f64>, reach: f64) -> f64 {
    let i = body.second_moment;
    i.xx.max(i.yy).max(i.zz).max(1e-3 * body.mass * reach * reach).max(1e-9)
}

// How far the body extends: the distance of its farthest child joint, or twice its centre's, m.
fn reach(model: &Model, joint: usize) -> f64 {
    let children = model.joints.iter().filter(|j| j.parent.is_some_and(|p| p.0 == joint));
    let farthest = children.map(|j| j.placement.translation.norm()).fold(0.0, f64::max);
    farthest.max(2.0 * model.joints[joint].inertia.centre_of_mass().norm()).max(1e-3)
}

// Sample rates, Hz, of logs in which the instant at which a torque acts is not known to a fraction of a row that counts; with
// springs that swing between the samples in faster ones, too.
const TIMED_ROUGHLY: std::ops::Range<f64> = 15.0..200.0;
// Standard deviation of that instant, rows.
const ROUGHLY: f64 = 0.25;

// One offset a sensor; one clock error between the two encoders of a joint, and one of its torque where rows are far apart.
fn instrument(robot: &Robot, channel: &Channel, records: &[Record], index: usize) -> Vec<EffectSpec> {
    let place = || Place::Joint(robot.model.dof_name(channel.dof).to_owned());
    let one = |kind: &str, key: &str, std: f64| {
        EffectSpec::new(kind, place()).with(key, 0.0).with(&format!("{key}_std"), std)
    };
    let period = records.iter().map(|r| r.scales.period).fold(0.0, f64::max);
    match channel.sensor {
        Sensor::MotorTorque | Sensor::JointTorque => {
            let top = records.iter().flat_map(|r| &r.measured[index]).fold(0.0f64, |m, x| m.max(x.abs()));
            let offset = one("torque_sensor_offset", "offset", (0.01 * top).max(1e-6));
            if channel.sensor == Sensor::JointTorque {
                return vec![offset.said("signal", "joint_torque")];
            }
            let skew = || one("time_skew", "time", ROUGHLY * period).said("signal", "motor_torque");
            let in_parts = records.iter().any(|r| r.scales.parts > 1);
            let timed_roughly = in_parts || TIMED_ROUGHLY.contains(&(1.0 / period));
            std::iter::once(offset).chain(timed_roughly.then(skew)).collect()
        }
        Sensor::JointPosition => {
            vec![one("position_sensor_offset", "offset", 3e-4), one("time_skew", "time", period)]
        }
    }
}

/// Notes on the runs that belong to the scope of every verdict.
pub(crate) fn scope(robot: &Robot, sensors: &Sensors, runs: &[Run]) -> String {
    let model = &robot.model;
    let named =
        |list: Vec<usize>| list.iter().map(|&d| model.dof_name(d).to_owned()).collect::<Vec<_>>().join(", ");
    let seconds: f64 = runs.iter().map(Run::duration).sum();
    let list: Vec<String> =
        sensors.channels.iter().map(|c| format!("{}.{}", c.signal(), model.dof_name(c.dof))).collect();
    let held: Vec<usize> = (0..model.nv).filter(|&d| sensors.imposed[d].is_none()).collect();
    let mut text = format!(
        "{} run{} of {seconds:.0} s in all; compared: {}; inertias of the URDF taken as {}",
        runs.len(),
        if runs.len() == 1 { "" } else { "s" },
        list.join(", "),
        match robot.trust {
            Trust::Exact => "exact",
            Trust::Nominal => "nominal (a few per cent)",
            Trust::Unknown => "unknown",
        }
    );
    if !held.is_empty() {
        text.push_str(&format!("; not measured and taken as held at zero: {}", named(held)));
    }
    let torque = |d: usize| sensors.channels.iter().any(|c| c.dof == d && c.sensor == Sensor::MotorTorque);
    let blind: Vec<usize> = (0..model.nv).filter(|&d| sensors.imposed[d].is_some() && !torque(d)).collect();
    if !blind.is_empty() {
        text.push_str(&format!(
            "; without motor torque, motor friction and rotor inertia cannot be seen in {}",
            named(blind)
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_known_exactly_keeps_what_a_fit_wrote() {
        let mut robot = Robot::rigid(sinew_model::samples::planar_arm(1, 1.5, 0.4));
        let link = robot.model.links[1].name.clone();
        let spec = EffectSpec::new("link_mass", Place::Link(link)).with("mass", 0.2).with("mass_std", 1e3);
        assert_eq!(trusted(&robot, vec![spec.clone()])[0].number("mass_std"), Some(1e3));
        robot.trust = Trust::Exact;
        let held = &trusted(&robot, vec![spec])[0];
        assert_eq!((held.number("mass"), held.number("mass_std")), (Some(0.2), Some(0.001 * 1.5)));
    }
}
