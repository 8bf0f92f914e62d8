//! URDF to model.

use std::path::Path;

use sinew_model::{
    EffectSpec, Inertia, JointShape, JointSpec, Limits, Model, ModelBuilder, ModelError, Place, Pose, Vector3,
};
use urdf_rs::JointType;

use crate::error::read_text;
use crate::plausibility::plausibility_notes;
use crate::xml::{CheckedXml, check_xml};
use crate::{Location, Note, Severity, UrdfError};

/// What a URDF alone says of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfModel {
    /// The mechanism; the root link is fixed to the world, gravity is 9.81 m/s² along −z.
    pub model: Model,
    /// Friction stated by `<dynamics>`, where it is not zero: `viscous_friction` and `coulomb_friction`.
    pub effects: Vec<EffectSpec>,
    /// What is suspicious.
    pub notes: Vec<Note>,
}

/// Reads the URDF file `path`.
///
/// # Errors
/// If the file cannot be read or is no URDF with at least one `<inertial>`; see [`UrdfError`].
pub fn read_urdf(path: &Path) -> Result<UrdfModel, UrdfError> {
    parse_urdf(&read_text(path)?, &path.display().to_string())
}

/// Reads the text of a URDF; `name` stands for the file in messages.
///
/// Revolute, continuous, prismatic, fixed, floating and planar joints, mimic joints, limits and inertias are read;
/// meshes are not. Absent limits mean none. A massless link is no error here, since kinematics does not mind;
/// [`parse_robot`](crate::parse_robot) refuses one that makes the mass matrix singular.
///
/// # Errors
/// As [`read_urdf`], but for the reading of the file.
///
/// # Example
/// ```
/// let urdf = r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="rod"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
///     <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
///   <joint name="pivot" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 -1 0"/>
///     <dynamics damping="0.1"/></joint>
/// </robot>"#;
/// let pendulum = sinew_urdf::parse_urdf(urdf, "pendulum.urdf")?;
/// assert_eq!(pendulum.model.dof("pivot"), Some(0));
/// assert_eq!(pendulum.model.joints[0].inertia.second_moment.yy, 2.0 * 0.5 * 0.5);
/// assert_eq!(pendulum.effects[0].number("viscous"), Some(0.1));
/// # Ok::<(), sinew_urdf::UrdfError>(())
/// ```
pub fn parse_urdf(text: &str, name: &str) -> Result<UrdfModel, UrdfError> {
    Ok(parse_located(text, name)?.0)
}

/// As [`parse_urdf`], with the places of joints for later messages.
pub(crate) fn parse_located(text: &str, file: &str) -> Result<(UrdfModel, CheckedXml), UrdfError> {
    let mut xml = check_xml(file, text)?;
    let urdf = urdf_rs::read_from_string(&xml.text).map_err(|e| UrdfError::NotUrdf {
        at: Location::of(file, text, 0),
        detail: e.to_string(),
        help: "compare it with the URDF specification",
    })?;
    let robot = if urdf.name.is_empty() { stem(file) } else { urdf.name.as_str() };
    if xml.links.values().all(|(_, inertial)| inertial.is_none()) {
        return Err(UrdfError::NoInertia { file: file.to_owned(), robot: robot.to_owned() });
    }
    let model = build(&urdf, robot).map_err(|source| {
        let at = offset_of(&xml, &source).unwrap_or(0);
        UrdfError::Model { at: Location::of(file, text, at), source }
    })?;
    check_size(&model, &xml, file, text)?;
    let mut notes = std::mem::take(&mut xml.notes);
    let effects = friction(&urdf, &model, |joint, statement| {
        let at = xml.joints.get(joint).copied().unwrap_or(0);
        notes.push(Note {
            severity: Severity::Note,
            place: Location::of(file, text, at).to_string(),
            statement,
            help: "state it at a joint with one degree of freedom of its own".to_owned(),
        });
    });
    let place_of = |link: &str| {
        let at = xml.links.get(link).map_or(0, |(link, inertial)| inertial.unwrap_or(*link));
        Location::of(file, text, at).to_string()
    };
    notes.extend(plausibility_notes(&model, file, &place_of));
    Ok((UrdfModel { model, effects, notes }, xml))
}

fn build(urdf: &urdf_rs::Robot, name: &str) -> Result<Model, ModelError> {
    let mut builder = ModelBuilder::new(name);
    for link in &urdf.links {
        let i = &link.inertial;
        let about_centre =
            [i.inertia.ixx, i.inertia.iyy, i.inertia.izz, i.inertia.ixy, i.inertia.ixz, i.inertia.iyz];
        let centred = Inertia::at_centre_of_mass(i.mass.value, Vector3::ZERO, about_centre);
        builder.link(&link.name, pose(&i.origin).inertia_to_parent(&centred));
    }
    for joint in &urdf.joints {
        let shape = match joint.joint_type {
            JointType::Revolute | JointType::Continuous => JointShape::Revolute,
            JointType::Prismatic => JointShape::Prismatic,
            JointType::Floating => JointShape::Floating,
            JointType::Planar => JointShape::Planar,
            // The check of the XML lets no ball joint through.
            JointType::Fixed | JointType::Spherical => JointShape::Fixed,
        };
        let limit = &joint.limit;
        let mut spec = JointSpec::new(&joint.name, shape, &joint.parent.link, &joint.child.link)
            .at(pose(&joint.origin))
            .about(joint.axis.xyz.0);
        spec.limits =
            Limits { lower: limit.lower, upper: limit.upper, velocity: limit.velocity, effort: limit.effort };
        spec.mimic = joint
            .mimic
            .as_ref()
            .map(|m| (m.joint.clone(), m.multiplier.unwrap_or(1.0), m.offset.unwrap_or(0.0)));
        builder.joint(spec);
    }
    builder.build()
}

// Finite numbers can still be so large that their products are not.
fn check_size(model: &Model, xml: &CheckedXml, file: &str, text: &str) -> Result<(), UrdfError> {
    for joint in &model.joints {
        let (i, p) = (&joint.inertia, joint.placement.translation);
        let moment = i.second_moment;
        let size =
            [i.mass, i.first_moment.norm(), moment.xx, moment.yy, moment.zz, p.norm()].iter().sum::<f64>();
        if !size.is_finite() {
            return Err(UrdfError::Value {
                at: Location::of(file, text, xml.joints.get(&joint.name).copied().unwrap_or(0)),
                what: format!(
                    "joint \"{}\": its place or the inertia it moves is beyond all numbers",
                    joint.name
                ),
                got: size.to_string(),
                allowed: "lengths in m, masses in kg".to_owned(),
                help: "check the units",
            });
        }
    }
    Ok(())
}

fn pose(origin: &urdf_rs::Pose) -> Pose<f64> {
    Pose::from_xyz_rpy(origin.xyz.0, origin.rpy.0)
}

// τ = −damping q̇ − friction sign(q̇)
fn friction(urdf: &urdf_rs::Robot, model: &Model, mut ignored: impl FnMut(&str, String)) -> Vec<EffectSpec> {
    let mut effects = Vec::new();
    for joint in &urdf.joints {
        let Some(dynamics) = &joint.dynamics else { continue };
        let stated = [
            ("viscous_friction", "viscous", dynamics.damping),
            ("coulomb_friction", "coulomb", dynamics.friction),
        ];
        for (kind, key, value) in stated.into_iter().filter(|(.., value)| *value != 0.0) {
            if model.dof(&joint.name).is_some() {
                effects.push(EffectSpec::new(kind, Place::Joint(joint.name.clone())).with(key, value));
            } else {
                let name = &joint.name;
                ignored(
                    name,
                    format!("joint \"{name}\": <dynamics> is ignored: it has no coordinate of its own"),
                );
                break;
            }
        }
    }
    effects
}

fn offset_of(xml: &CheckedXml, error: &ModelError) -> Option<usize> {
    match error {
        ModelError::NoSuchLink { joint, .. }
        | ModelError::NoAxis { joint, .. }
        | ModelError::BadMimic { joint, .. } => xml.joints.get(joint).copied(),
        ModelError::Duplicate { what: "links", name, .. } => xml.links.get(name).map(|(at, _)| *at),
        ModelError::Duplicate { name, .. } => xml.joints.get(name).copied(),
        _ => None,
    }
}

fn stem(file: &str) -> &str {
    Path::new(file).file_stem().and_then(|s| s.to_str()).unwrap_or(file)
}
