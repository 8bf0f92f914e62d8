//! Puts model and sidecar together into a robot.

use serde_spanned::Spanned;
use sinew_model::{EffectSpec, JointSettings, LinkId, Model, Robot, Trust, Vector3};

use crate::bending::bending;
use crate::coupling::couplings;
use crate::effects::effects;
use crate::grammar::{JointTable, SidecarTable};
use crate::source::{Domain, Source};
use crate::{Note, Severity, UrdfError};

/// The robot of `model` with the friction of its URDF and what the sidecar says.
pub(crate) fn assemble(
    model: Model,
    friction: Vec<EffectSpec>,
    table: &SidecarTable,
    source: Source,
    notes: &mut Vec<Note>,
) -> Result<Robot, UrdfError> {
    check_format(table, source)?;
    let mut robot = Robot::rigid(model);
    if let Some(gravity) = &table.gravity {
        let g = three(gravity, "gravity", source)?;
        robot.model.gravity = Vector3 { x: g[0], y: g[1], z: g[2] };
    }
    if let Some(tool) = &table.tool {
        robot.tool = require_link(&robot.model, tool, source)?;
    }
    if let Some(known) = &table.known {
        robot.trust = trust(known, source)?;
    }
    for (name, entry) in &table.joints.0 {
        let dof = require_dof(&robot.model, name, source)?;
        robot.joints[dof] = joint_settings(&robot.model, name.get_ref(), entry, source)?;
    }
    robot.couplings = couplings(&robot, &table.couplings, source)?;
    warn_of_idle_damping(&robot, table, source, notes);
    robot.bending = bending(&robot.model, &table.links, source)?;
    let stated = effects(&robot.model, &table.effects, source)?;
    // The sidecar wins over the URDF.
    let overruled = |f: &EffectSpec| stated.iter().any(|e| e.kind == f.kind && e.place == f.place);
    robot.effects = friction.into_iter().filter(|f| !overruled(f)).collect();
    robot.effects.extend(stated);
    Ok(robot)
}

/// `format = 1` must be there.
pub(crate) fn check_format(table: &SidecarTable, source: Source) -> Result<(), UrdfError> {
    let help = "write format = 1; a later format needs a later version of the program";
    match &table.format {
        None => Err(UrdfError::Missing {
            at: source.at(0..0),
            what: "format".to_owned(),
            help: "write format = 1 at the top".to_owned(),
        }),
        Some(format) if format.get_ref().0 == 1.0 => Ok(()),
        Some(format) => {
            let got = format.get_ref().0.to_string();
            Err(source.value(format.span(), "format: not known".to_owned(), got, "1", help))
        }
    }
}

fn joint_settings(
    model: &Model,
    name: &str,
    table: &JointTable,
    source: Source,
) -> Result<JointSettings, UrdfError> {
    let number = |value: &Option<Spanned<_>>, key: &str, domain| {
        value.as_ref().map(|v| source.number(v, &format!("joints.{name}.{key}"), domain)).transpose()
    };
    let size = |value, key| number(value, key, Domain::Positive);
    let not_negative = |value, key| number(value, key, Domain::NotNegative);
    let rotor_axis = match &table.rotor_axis {
        None => None,
        Some(axis) => {
            let key = format!("joints.{name}.rotor_axis");
            let a = three(axis, &key, source)?;
            if a == [0.0; 3] {
                let help = "give its direction, or leave the key out for the joint's own axis";
                let what = format!("{key}: no direction");
                return Err(source.value(axis.span(), what, "[0, 0, 0]".to_owned(), "not null", help));
            }
            Some(a)
        }
    };
    let carried_by = table.carried_by.as_ref().map(|l| require_link(model, l, source)).transpose()?;
    Ok(JointSettings {
        stiffness: size(&table.stiffness, "stiffness")?,
        damping: not_negative(&table.damping, "damping")?.unwrap_or(0.0),
        rotor_inertia: not_negative(&table.rotor_inertia, "rotor_inertia")?.unwrap_or(0.0),
        gear_ratio: size(&table.gear_ratio, "gear_ratio")?,
        torque_constant: size(&table.torque_constant, "torque_constant")?,
        rotor_axis,
        carried_by,
        stiffness_std: not_negative(&table.stiffness_std, "stiffness_std")?,
        damping_std: not_negative(&table.damping_std, "damping_std")?,
        rotor_inertia_std: not_negative(&table.rotor_inertia_std, "rotor_inertia_std")?,
    })
}

fn warn_of_idle_damping(robot: &Robot, table: &SidecarTable, source: Source, notes: &mut Vec<Note>) {
    for (name, _) in &table.joints.0 {
        let Some(dof) = robot.model.dof(name.get_ref()) else { continue };
        let joint = &robot.joints[dof];
        if joint.damping > 0.0 && joint.stiffness.is_none() {
            notes.push(Note {
                severity: Severity::Warning,
                place: source.at(name.span()).to_string(),
                statement: format!(
                    "joint \"{}\" has damping across a spring but no stiffness",
                    name.get_ref()
                ),
                help: "state its stiffness; friction in a rigid joint is the effect viscous_friction"
                    .to_owned(),
            });
        }
    }
}

fn trust(known: &Spanned<String>, source: Source) -> Result<Trust, UrdfError> {
    match known.get_ref().as_str() {
        "exact" => Ok(Trust::Exact),
        "nominal" => Ok(Trust::Nominal),
        "unknown" => Ok(Trust::Unknown),
        word => Err(UrdfError::UnknownName {
            at: source.at(known.span()),
            what: "word",
            name: word.to_owned(),
            scope: "for known".to_owned(),
            known: ["exact", "nominal", "unknown"].map(str::to_owned).to_vec(),
        }),
    }
}

/// Exactly three finite numbers.
pub(crate) fn three(
    list: &Spanned<Vec<crate::grammar::Number>>,
    key: &str,
    source: Source,
) -> Result<[f64; 3], UrdfError> {
    let values = source.numbers(list, key)?;
    <[f64; 3]>::try_from(values).map_err(|v| {
        let what = format!("{key}: not a vector");
        source.value(list.span(), what, format!("{} numbers", v.len()), "3 numbers", "write [x, y, z]")
    })
}

/// The link called `name`.
pub(crate) fn require_link(
    model: &Model,
    name: &Spanned<String>,
    source: Source,
) -> Result<LinkId, UrdfError> {
    model.link(name.get_ref()).ok_or_else(|| UrdfError::UnknownName {
        at: source.at(name.span()),
        what: "link",
        name: name.get_ref().clone(),
        scope: format!("in robot \"{}\"", model.name),
        known: model.links.iter().map(|l| l.name.clone()).collect(),
    })
}

/// The degree of freedom of the joint called `name`.
pub(crate) fn require_dof(model: &Model, name: &Spanned<String>, source: Source) -> Result<usize, UrdfError> {
    model.dof(name.get_ref()).ok_or_else(|| UrdfError::UnknownName {
        at: source.at(name.span()),
        what: "joint",
        name: name.get_ref().clone(),
        scope: format!("with one degree of freedom of its own in robot \"{}\"", model.name),
        known: model.joints.iter().map(|j| &j.name).filter(|j| model.dof(j).is_some()).cloned().collect(),
    })
}
