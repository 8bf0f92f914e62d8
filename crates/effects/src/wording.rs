//! The words in which cards are printed.

use sinew_effect::{Card, Energy, Family, Parameter, PlaceKind, Prior, Requirement, Role, Written};

use crate::CATALOGUE;

pub(crate) fn family(family: Family) -> &'static str {
    match family {
        Family::Friction => "friction",
        Family::Transmission => "transmission",
        Family::Inertial => "masses, gravity and springs on links",
        Family::Periodic => "repeats with position",
        Family::Instrument => "motors, drives and sensors",
        Family::Environment => "surroundings",
    }
}

pub(crate) fn energy(energy: Energy) -> &'static str {
    match energy {
        Energy::Dissipates => "only takes energy out",
        Energy::Stores => "keeps energy and gives it back",
        Energy::StoresAndDissipates => "keeps some energy, loses some",
        Energy::Exchanges => "moves energy about",
        Energy::Supplies => "can put energy in",
        Energy::None => "none: an error of a reading",
    }
}

/// Where an effect of the catalogue acts, and the words it reads in a file.
pub(crate) fn place(card: &Card) -> String {
    let Some(entry) = CATALOGUE.find(card.name) else { return String::new() };
    let place = match entry.place {
        PlaceKind::Joint => "a joint (`joint = \"…\"`)",
        PlaceKind::Link => "a link (`link = \"…\"`)",
        PlaceKind::Robot => "the whole robot",
    };
    entry.words.iter().fold(place.to_owned(), |text, word| format!("{text}; reads `{word} = \"…\"`"))
}

pub(crate) fn requirement(requirement: &Requirement) -> String {
    match requirement {
        Requirement::Parent(name) => format!("{name} in the model"),
        Requirement::Elastic => "an elastic joint".to_owned(),
        Requirement::Rigid => "a joint that is rigid in the model, and its motor's position".to_owned(),
        Requirement::LinkBalance => "an elastic joint, or torque measured behind the gear".to_owned(),
        Requirement::LinkEncoder => "a link-side encoder".to_owned(),
        Requirement::ElasticOrLinkEncoder => "an elastic joint or a link-side encoder".to_owned(),
        Requirement::MotorTorque => "a measured motor torque".to_owned(),
        Requirement::Torque => "a measured torque, of the motor or behind the gear".to_owned(),
        Requirement::Joints(n) => format!("at least {n} joints"),
        Requirement::Temperature { .. } => "a logged temperature of the joint that changes".to_owned(),
        Requirement::Turning => "a joint that turns".to_owned(),
        Requirement::CarriedRotor => "a rotor on a moving link, its gear ratio and its axis known".to_owned(),
    }
}

pub(crate) fn role(parameter: &Parameter) -> &'static str {
    match (parameter.role, parameter.written) {
        (Role::Strength, Written::Plain) => "strength",
        (Role::Strength, Written::Reciprocal) => "strength, as its reciprocal",
        (Role::Shape { .. }, _) => "shape",
        (Role::Stated, _) => "stated, never fitted",
        (Role::Optional, _) => "fitted if its std is stated",
    }
}

pub(crate) fn range(parameter: &Parameter) -> String {
    match parameter.range {
        (f64::NEG_INFINITY, f64::INFINITY) => "any".to_owned(),
        (0.0, f64::INFINITY) => "≥ 0".to_owned(),
        (low, high) => format!("{low} … {high}"),
    }
}

pub(crate) fn prior(parameter: &Parameter) -> String {
    match (parameter.role, parameter.prior) {
        (Role::Stated | Role::Optional, _) => "–".to_owned(),
        (_, Prior::Share(share)) => format!("± {} %", (1000.0 * share).round() / 10.0),
        (_, Prior::Absolute(std)) if parameter.unit == "–" => format!("± {std}"),
        (_, Prior::Absolute(std)) => format!("± {std} {}", parameter.unit),
        (_, Prior::Factor(log)) => format!("× or ÷ {:.1}", log.exp()),
        (_, Prior::Free) => "free".to_owned(),
    }
}

/// The letter of what files hold.
pub(crate) fn symbol(parameter: &Parameter) -> &'static str {
    match parameter.written {
        Written::Plain => parameter.symbol,
        Written::Reciprocal => parameter.symbol.trim_start_matches("1/"),
    }
}
