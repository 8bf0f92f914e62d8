//! What the lines of the catalogue are made of: places, sensors and rivals.

use sinew_effect::{Ask, Card, Effect, Entry, PlaceKind, Rival, Sensor, Site};
use sinew_model::{JointId, LinkId, Pose, Setting};

type Build = fn(&Ask) -> Result<Box<dyn Effect>, String>;

/// A line for an effect that acts at a joint.
pub(crate) const fn at_joint(card: &'static Card, build: Build) -> Entry {
    Entry { card, place: PlaceKind::Joint, words: &[], hinge: None, build }
}

/// A line for an effect that acts at a link.
pub(crate) const fn at_link(card: &'static Card, build: Build) -> Entry {
    Entry { card, place: PlaceKind::Link, words: &[], hinge: None, build }
}

/// A line for an effect of the whole robot.
pub(crate) const fn at_robot(card: &'static Card, build: Build) -> Entry {
    Entry { card, place: PlaceKind::Robot, words: &[], hinge: None, build }
}

/// Another cause that looks alike under common motion.
pub(crate) const fn rival(name: &'static str, experiment: &'static str) -> Rival {
    Rival { name, structural: false, experiment, sensors: &[] }
}

/// Another cause that no motion separates.
pub(crate) const fn twin(name: &'static str, experiment: &'static str) -> Rival {
    Rival { name, structural: true, experiment, sensors: &[] }
}

/// A rival whose experiment needs a sensor of the link's position.
pub(crate) const fn by_link_encoder(rival: Rival) -> Rival {
    Rival { sensors: &[Sensor::JointPosition], ..rival }
}

/// A rival whose experiment needs a sensor of the link's position or of the torque behind the gear.
pub(crate) const fn by_link_sensor(rival: Rival) -> Rival {
    Rival { sensors: &[Sensor::JointPosition, Sensor::JointTorque], ..rival }
}

/// The degree of freedom that was asked for.
pub(crate) fn dof(ask: &Ask) -> Result<usize, String> {
    match ask.site {
        Site::Dof(dof) => Ok(dof),
        _ => Err("acts at a joint".to_owned()),
    }
}

/// The link that was asked for.
pub(crate) fn link(ask: &Ask) -> Result<LinkId, String> {
    match ask.site {
        Site::Link(link) => Ok(link),
        _ => Err("acts at a link".to_owned()),
    }
}

/// The moving body that carries `link`, and the link's frame in it.
pub(crate) fn body_of(ask: &Ask, link: LinkId) -> Result<(JointId, Pose<f64>), String> {
    let link = &ask.model.links[link.0];
    match link.body {
        Some(body) => Ok((body, link.body_from_link)),
        None => Err(format!("link \"{}\" does not move (it is fixed to the world)", link.name)),
    }
}

/// The degree of freedom of the effect's own hinge.
pub(crate) fn hinge(ask: &Ask) -> Result<usize, String> {
    ask.hinge.ok_or_else(|| "needs a plant that gives it a joint of its own".to_owned())
}

/// The sensor that the word `signal` names, or `default` where it says nothing.
pub(crate) fn sensor(ask: &Ask, default: Sensor) -> Result<Sensor, String> {
    match ask.spec.get("signal") {
        None => Ok(default),
        Some(Setting::Word(word)) if word == "motor_torque" => Ok(Sensor::MotorTorque),
        Some(Setting::Word(word)) if word == "joint_position" => Ok(Sensor::JointPosition),
        Some(Setting::Word(word)) if word == "joint_torque" => Ok(Sensor::JointTorque),
        Some(other) => Err(format!(
            "`signal` must be \"motor_torque\", \"joint_position\" or \"joint_torque\" (got {other:?})"
        )),
    }
}
