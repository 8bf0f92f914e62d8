//! URDF and sidecar together.

use std::path::{Path, PathBuf};

use sinew_model::{JointId, Robot};

use crate::assembly::assemble;
use crate::error::read_text;
use crate::grammar::{SidecarTable, read_table};
use crate::pivots::joint_without_inertia;
use crate::source::Source;
use crate::urdf::parse_located;
use crate::xml::CheckedXml;
use crate::{Location, Note, Severity, Sidecar, UrdfError};

/// A robot with the document that it can be written back to.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// What URDF and sidecar say together.
    pub robot: Robot,
    /// The sidecar's text; a new one if there was none.
    pub sidecar: Sidecar,
    /// What is suspicious.
    pub notes: Vec<Note>,
}

/// Reads a robot from its sidecar (`….toml`) or from its URDF; `arm.urdf` takes `arm.sinew.toml` along if it lies
/// beside it, and is a rigid robot otherwise.
///
/// # Errors
/// If a file cannot be read, or says what cannot be: place, value, allowed values and a way out are in the message.
pub fn read_robot(path: &Path) -> Result<RobotFile, UrdfError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let text = read_text(path)?;
        let file = path.display().to_string();
        let table = read_table(&file, &text)?;
        let (urdf, at) = urdf_of(path, &table, Source { file: &file, text: &text })?;
        let no_urdf = |source| UrdfError::NoUrdf { at, path: urdf.clone(), source };
        let urdf_text = std::fs::read_to_string(&urdf).map_err(no_urdf)?;
        let mut robot = join(&urdf_text, &urdf.display().to_string(), &text, &file)?;
        robot.sidecar = robot.sidecar.at(path);
        return Ok(robot);
    }
    let urdf = read_text(path)?;
    let name = path.display().to_string();
    let beside = path.with_extension("sinew.toml");
    if !beside.exists() {
        let file_name = path.file_name().unwrap_or_default().to_string_lossy();
        let text = Sidecar::new_for(&file_name).text();
        let mut robot = join(&urdf, &name, &text, &beside.display().to_string())?;
        robot.sidecar = robot.sidecar.at(&beside);
        return Ok(robot);
    }
    let text = read_text(&beside)?;
    let mut robot = join(&urdf, &name, &text, &beside.display().to_string())?;
    robot.sidecar = robot.sidecar.at(&beside);
    let table = read_table(robot.sidecar.file(), &text)?;
    let source = Source { file: robot.sidecar.file(), text: &text };
    let (named, at) = urdf_of(&beside, &table, source)?;
    if named.canonicalize().ok() != path.canonicalize().ok() {
        robot.notes.push(Note {
            severity: Severity::Warning,
            place: at.to_string(),
            statement: format!("the sidecar is for {}, but is used for {}", named.display(), path.display()),
            help: "name the sidecar instead of the URDF, or correct its urdf".to_owned(),
        });
    }
    Ok(robot)
}

/// Reads a robot from two texts; `name` is the robot's file name without ending, for messages.
///
/// # Errors
/// As [`read_robot`], but for the reading of files.
///
/// # Example
/// ```
/// let urdf = r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="rod"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
///     <inertia ixx="0" iyy="0.1" izz="0.1"/></inertial></link>
///   <joint name="pivot" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 -1 0"/></joint>
/// </robot>"#;
/// let sidecar = "format = 1\n[joints.pivot]\nstiffness = 150.0 # N·m/rad\nrotor_inertia = 0.05\n";
/// let file = sinew_urdf::parse_robot(urdf, sidecar, "pendulum")?;
/// assert_eq!(file.robot.joints[0].stiffness, Some(150.0));
///
/// let misspelt = "format = 1\n[joints.pivto]\nstiffness = 150.0\n";
/// let error = sinew_urdf::parse_robot(urdf, misspelt, "pendulum").unwrap_err().to_string();
/// assert!(error.starts_with("pendulum.sinew.toml:2:9: no joint \"pivto\""));
/// assert!(error.ends_with("help: did you mean \"pivot\"?"));
/// # Ok::<(), sinew_urdf::UrdfError>(())
/// ```
pub fn parse_robot(urdf: &str, sidecar: &str, name: &str) -> Result<RobotFile, UrdfError> {
    join(urdf, &format!("{name}.urdf"), sidecar, &format!("{name}.sinew.toml"))
}

fn join(urdf: &str, urdf_file: &str, text: &str, file: &str) -> Result<RobotFile, UrdfError> {
    let (read, xml) = parse_located(urdf, urdf_file)?;
    let source = Source { file, text };
    let table = read_table(file, text)?;
    let sidecar = Sidecar::parse(text, file)?;
    let mut notes = read.notes;
    let robot = assemble(read.model, read.effects, &table, source, &mut notes)?;
    check_regular(&robot, &xml, urdf_file, urdf)?;
    Ok(RobotFile { robot, sidecar, notes })
}

// B of a rigid joint adds to M's diagonal; behind a spring it does not.
fn check_regular(robot: &Robot, xml: &CheckedXml, file: &str, text: &str) -> Result<(), UrdfError> {
    let elastic = |dof: usize| {
        robot.joints[dof].stiffness.is_some() || robot.couplings.iter().any(|c| c.dofs.contains(&dof))
    };
    let rotor: Vec<f64> = (0..robot.model.nv)
        .map(|dof| if elastic(dof) { 0.0 } else { robot.joints[dof].rotor_inertia })
        .collect();
    let Some(JointId(k)) = joint_without_inertia(&robot.model, &rotor) else { return Ok(()) };
    let joint = &robot.model.joints[k];
    let planar = joint.name.rsplit_once('.').and_then(|(name, _)| xml.joints.get(name));
    let at = xml.joints.get(&joint.name).or(planar).copied().unwrap_or(0);
    let link = robot.model.links.iter().find(|l| l.body == Some(JointId(k)));
    Err(UrdfError::Singular {
        at: Location::of(file, text, at),
        joint: joint.name.clone(),
        link: link.map_or_else(String::new, |l| l.name.clone()),
        elastic: elastic(joint.first_dof),
    })
}

fn urdf_of(path: &Path, table: &SidecarTable, source: Source) -> Result<(PathBuf, Location), UrdfError> {
    let Some(urdf) = &table.urdf else {
        return Err(UrdfError::Missing {
            at: source.at(0..0),
            what: "urdf".to_owned(),
            help: "write urdf = \"FILE.urdf\", relative to the sidecar's folder".to_owned(),
        });
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok((folder.join(urdf.get_ref()), source.at(urdf.span())))
}
