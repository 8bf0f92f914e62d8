//! `EFFECT@PLACE` on the command line.

use sinew_effect::{Entry, PlaceKind, Role, Screening, Written};
use sinew_effects::CATALOGUE;
use sinew_identify::EPISODE;
use sinew_model::{EffectSpec, Place, Robot, Setting};
use sinew_plant::{Plant, PlantError};
use sinew_rigid::mass_matrix;

use crate::error::{CliError, did_you_mean};
use crate::inputs::{RUNS, ends};

/// The catalogue's line of an effect.
pub(crate) fn entry(name: &str) -> Result<&'static Entry, CliError> {
    CATALOGUE.find(name).ok_or_else(|| {
        if name == EPISODE {
            return no_law();
        }
        let known: Vec<&str> = CATALOGUE.entries.iter().map(|e| e.card.name).collect();
        let help =
            did_you_mean(name, &known).unwrap_or_else(|| "`sinew effects` lists all of them".to_owned());
        CliError::usage(name, "no effect of the catalogue", help)
    })
}

/// A word of `--add`, which takes all that follow it: no run.
pub(crate) fn effect_word(word: &str) -> Result<String, String> {
    match ends(word, RUNS) {
        true => Err("is a run, and EFFECT@PLACE is wanted here: write the runs before --add".to_owned()),
        false => Ok(word.to_owned()),
    }
}

/// Why there is no page of an episode and nothing to add.
fn no_law() -> CliError {
    let help = "there is nothing to add to a model: fit runs without that time, RUN@FROM..TO";
    CliError::usage(EPISODE, "acted once, in one run, and is no effect of the catalogue", help)
}

/// The effect that `EFFECT@PLACE[,KEY=VALUE…]` names, with the values stated there and no others.
///
/// # Errors
/// If the catalogue does not have it, it cannot act there, or a value is not one.
pub(crate) fn effect(argument: &str, robot: &Robot) -> Result<EffectSpec, CliError> {
    let mut parts = argument.split(',');
    let head = parts.next().unwrap_or_default();
    let (name, place) = head.split_once('@').map_or((head, None), |(n, p)| (n, Some(p.to_owned())));
    let entry = entry(name)?;
    let place = match (entry.place, place) {
        (PlaceKind::Robot, None) => Place::Robot,
        (PlaceKind::Joint, Some(place)) => Place::Joint(place),
        (PlaceKind::Link, Some(place)) => Place::Link(place),
        (PlaceKind::Robot, Some(_)) => {
            return Err(CliError::usage(head, "acts on the whole robot", format!("write {name}")));
        }
        (kind, None) => {
            let kind = format!("{kind:?}").to_lowercase();
            let help = format!("write {name}@{}", kind.to_uppercase());
            return Err(CliError::usage(head, format!("acts at a {kind}"), help));
        }
    };
    let mut spec = EffectSpec::new(name, place);
    for part in parts {
        let setting = setting(part, entry)?;
        if spec.settings.iter().any(|(key, _)| *key == setting.0) {
            let what = format!("\"{}\" is stated twice", setting.0);
            return Err(CliError::usage(argument, what, "leave one of them out"));
        }
        spec.settings.push(setting);
    }
    Plant::with_effects(robot, std::slice::from_ref(&spec), &CATALOGUE).map_err(plant_error)?;
    Ok(spec)
}

/// The effects that these name, none of which the robot has or is named twice.
///
/// # Errors
/// As of [`effect`], and if there is one already.
pub(crate) fn new_effects(arguments: &[String], robot: &Robot) -> Result<Vec<EffectSpec>, CliError> {
    let stated = robot.all_effects();
    let mut new: Vec<EffectSpec> = Vec::new();
    for argument in arguments {
        let spec = effect(argument, robot)?;
        if stated.iter().chain(&new).any(|e| e.is_same_as(&spec)) {
            let what = "the robot has this effect already".to_owned();
            let help = "leave it out: `sinew fit` estimates the parameters of all that the robot has";
            return Err(CliError::usage(argument, what, help));
        }
        new.push(spec);
    }
    Ok(new)
}

/// Writes the start value of every parameter that the effect does not state: strengths 0, shapes their usual value.
///
/// A spring cannot be written at strength zero, which is K = ∞; it starts with its motor-held resonance in the middle
/// of the usual range.
///
/// ```text
/// K = (2π f)² M_ii
/// ```
pub(crate) fn with_start_values(mut spec: EffectSpec, robot: &Robot) -> EffectSpec {
    let Some(entry) = CATALOGUE.find(&spec.kind) else { return spec };
    for parameter in entry.card.parameters {
        if spec.get(parameter.key).is_some() || parameter.is_stated() {
            continue;
        }
        match (parameter.written, parameter.component) {
            (Written::Plain, None)
                if parameter.role == Role::Strength && usual_swing(&spec, entry, robot).is_some() =>
            {
                let strength = usual_swing(&spec, entry, robot).unwrap_or_default();
                spec = spec.with(parameter.key, strength);
            }
            (Written::Plain, None) => spec = spec.with(parameter.key, parameter.start()),
            (Written::Plain, Some(_)) => {
                let alike = entry.card.parameters.iter().filter(|p| p.key == parameter.key);
                let zeros: Vec<f64> = alike.map(|p| p.start()).collect();
                spec = spec.with_numbers(parameter.key, &zeros);
            }
            (Written::Reciprocal, _) => {
                if let Some(stiffness) = usual_stiffness(&spec, entry, robot) {
                    spec = spec.with(parameter.key, stiffness);
                }
            }
        }
    }
    spec
}

// A part that swings starts with its usual share of the inertia, or with share/(I ω²).
fn usual_swing(spec: &EffectSpec, entry: &Entry, robot: &Robot) -> Option<f64> {
    let Screening::Swing { hertz, shares: &[share, ..] } = entry.card.screening else { return None };
    if entry.card.parameters[0].unit != "rad/(N·m)" {
        return Some(share);
    }
    let mass = mass_matrix(&robot.model, &robot.model.zero_position());
    let inertia = match &spec.place {
        Place::Joint(joint) => mass.diagonal()[robot.model.dof(joint)?],
        _ => mass.diagonal().max(),
    };
    let omega = core::f64::consts::TAU * hertz[hertz.len() / 2];
    Some(share / (inertia * omega * omega))
}

fn usual_stiffness(spec: &EffectSpec, entry: &Entry, robot: &Robot) -> Option<f64> {
    let (Screening::Resonance { hertz }, Place::Joint(joint)) = (entry.card.screening, &spec.place) else {
        return None;
    };
    let dof = robot.model.dof(joint)?;
    let inertia = mass_matrix(&robot.model, &robot.model.zero_position())[(dof, dof)];
    let omega = core::f64::consts::TAU * hertz[hertz.len() / 2];
    Some(omega * omega * inertia)
}

fn setting(text: &str, entry: &Entry) -> Result<(String, Setting), CliError> {
    let parameters = entry.card.parameters;
    let known = || {
        let one_by_one = parameters.iter().filter(|p| p.component.is_none()).map(|p| p.key);
        let keys = one_by_one.chain(entry.words.iter().copied());
        format!("keys of {} are {}", entry.card.name, keys.collect::<Vec<_>>().join(", "))
    };
    let Some((key, value)) = text.split_once('=') else {
        return Err(CliError::usage(text, "no KEY=VALUE", known()));
    };
    let setting = if entry.words.contains(&key) {
        Setting::Word(value.to_owned())
    } else if parameters.iter().any(|p| p.key == key && p.component.is_none()) {
        let number = value.parse().ok().filter(|x: &f64| x.is_finite());
        Setting::Number(number.ok_or_else(|| {
            CliError::usage(text, format!("not a number (got \"{value}\")"), "write KEY=NUMBER, SI")
        })?)
    } else {
        return Err(CliError::usage(text, format!("unknown key \"{key}\""), known()));
    };
    Ok((key.to_owned(), setting))
}

fn plant_error(error: PlantError) -> CliError {
    CliError::Plant { file: "EFFECT@PLACE".to_owned(), source: Box::new(error) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples;

    fn robot() -> Robot {
        Robot::rigid(samples::planar_arm(2, 1.0, 0.5))
    }

    #[test]
    fn a_strength_starts_at_zero_and_a_shape_at_its_usual_value() {
        let spec = effect("stribeck_friction@joint_1", &robot()).unwrap();
        let spec = with_start_values(spec, &robot());
        assert_eq!(spec.number("stribeck"), Some(0.0));
        assert!(spec.number("stribeck_velocity").unwrap() > 0.0);
    }

    #[test]
    fn a_new_spring_is_finite() {
        let spec = effect("joint_elasticity@joint_2", &robot()).unwrap();
        let stiffness = with_start_values(spec, &robot()).number("stiffness").unwrap();
        assert!(stiffness > 1.0 && stiffness.is_finite());
    }

    #[test]
    fn every_effect_of_the_catalogue_gets_start_values_it_takes_itself() {
        for entry in CATALOGUE.entries {
            let argument = match entry.place {
                PlaceKind::Joint => format!("{}@joint_2", entry.card.name),
                PlaceKind::Link => format!("{}@link_2", entry.card.name),
                PlaceKind::Robot => entry.card.name.to_owned(),
            };
            let Ok(spec) = effect(&argument, &robot()) else { continue };
            let spec = with_start_values(spec, &robot());
            let made = Plant::with_effects(&robot(), &[spec], &CATALOGUE);
            assert!(made.is_ok(), "{argument}: {}", made.unwrap_err());
        }
    }

    #[test]
    fn values_can_be_stated_and_wrong_ones_are_refused() {
        let spec = effect("coulomb_friction@joint_1,coulomb=2.5", &robot()).unwrap();
        assert_eq!(spec.number("coulomb"), Some(2.5));
        let message = |text: &str| effect(text, &robot()).unwrap_err().to_string();
        assert!(message("coulomb_friction@joint_1,culomb=2").contains("unknown key \"culomb\""));
        assert!(
            message("coulomb_friction@joint_1,coulomb=1,coulomb=2").contains("\"coulomb\" is stated twice")
        );
        assert!(message("coulomb_friction@joint_1,coulomb=x").contains("not a number"));
        assert!(message("coulomb_friction").contains("acts at a joint"));
        assert!(message("payload@joint_1").contains("whole robot"));
        assert!(message("coulomb_friction@elbow").contains("joint_1"));
        assert!(message("friction@joint_1").contains("no effect of the catalogue"));
        assert!(message("coulom_friction@joint_1").contains("did you mean \"coulomb_friction\"?"));
    }
}
