//! The XML behind a URDF: checked with line and column, then written out again in the plain form that urdf-rs reads.
//!
//! urdf-rs knows no positions, refuses a repeated `<origin>` or a `<limit>` without velocity, cannot tell an absent
//! `<inertial>` or limit from one of zeros, drops words among numbers and stumbles over visuals that have nothing to
//! do with dynamics. So only what dynamics needs is passed on, each number checked and each default written out.

use std::collections::HashMap;

use roxmltree::{Document, Node};

use crate::rotation::angles_of_quaternion;
use crate::xml_reader::Checker;
use crate::{Location, Note, UrdfError};

/// A checked URDF: canonical text, and where things stand in the original.
pub(crate) struct CheckedXml {
    pub text: String,
    pub notes: Vec<Note>,
    /// Byte offset of each `<link>`, and of its `<inertial>` if it has one.
    pub links: HashMap<String, (usize, Option<usize>)>,
    /// Byte offset of each `<joint>`.
    pub joints: HashMap<String, usize>,
}

const JOINT_TYPES: [&str; 6] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar"];

/// Checks `text`, the content of `file`.
pub(crate) fn check_xml(file: &str, text: &str) -> Result<CheckedXml, UrdfError> {
    let document = Document::parse(text).map_err(|e| syntax(file, text, &e))?;
    let root = document.root_element();
    let mut checker = Checker {
        file,
        source: text,
        checked: CheckedXml {
            text: String::new(),
            notes: Vec::new(),
            links: HashMap::new(),
            joints: HashMap::new(),
        },
    };
    checker.robot(root)?;
    Ok(checker.checked)
}

fn syntax(file: &str, text: &str, error: &roxmltree::Error) -> UrdfError {
    let position = error.pos();
    let at = match error {
        roxmltree::Error::UnclosedRootNode | roxmltree::Error::NoRootNode => {
            Location::of(file, text, text.trim_end().len())
        }
        _ => Location { file: file.into(), line: position.row, column: position.col },
    };
    let detail = error.to_string().replace(&format!(" at {position}"), "");
    let help = if text.contains("xacro:") {
        "this is a xacro file: expand it first, `xacro FILE > robot.urdf`"
    } else {
        "close every element and quote every attribute"
    };
    UrdfError::Syntax { at, language: "XML", detail, help }
}

impl Checker<'_> {
    fn robot(&mut self, root: Node) -> Result<(), UrdfError> {
        if root.tag_name().name() != "robot" {
            let detail = format!("the root element is <{}> (allowed: <robot>)", root.tag_name().name());
            let help = "name a URDF file; SDF, MJCF and COLLADA need a converter first";
            return Err(UrdfError::NotUrdf { at: self.at(root), detail, help });
        }
        let is_macro = |n: &Node| n.tag_name().namespace().is_some_and(|s| s.ends_with("/xacro"));
        if let Some(node) = root.children().find(is_macro) {
            let detail = format!("it holds the unexpanded macro <xacro:{}>", node.tag_name().name());
            let help = "expand it first: xacro FILE.xacro > FILE.urdf";
            return Err(UrdfError::NotUrdf { at: self.at(node), detail, help });
        }
        let name = root.attribute("name").unwrap_or_default();
        self.write(format_args!("<robot name=\"{}\">\n", escaped(name)));
        let space = root.tag_name().namespace();
        for node in root.children().filter(|n| n.is_element() && n.tag_name().namespace() == space) {
            match node.tag_name().name() {
                "link" => self.link(node)?,
                "joint" => self.joint(node)?,
                _ => {}
            }
        }
        self.write(format_args!("</robot>\n"));
        Ok(())
    }

    fn link(&mut self, node: Node) -> Result<(), UrdfError> {
        let name = self.word(node, "name", "<link>")?;
        let what = format!("link \"{name}\"");
        let inertial = self.first(node, "inertial", &what);
        let places = (node.range().start, inertial.map(|n| n.range().start));
        self.checked.links.entry(name.clone()).or_insert(places);
        self.write(format_args!("<link name=\"{}\">", escaped(&name)));
        if let Some(inertial) = inertial {
            self.write(format_args!("<inertial>"));
            self.origin(inertial, &what)?;
            let mass = self.required(inertial, "mass", &what)?;
            let value = self.number(mass, "value", None, &what)?;
            if value < 0.0 {
                let help = "a mass is never negative";
                return Err(self.bad(mass, format!("{what}: negative mass"), value, "≥ 0, kg", help));
            }
            self.write(format_args!("<mass value=\"{value:?}\"/><inertia"));
            let inertia = self.required(inertial, "inertia", &what)?;
            for key in ["ixx", "iyy", "izz"] {
                let value = self.number(inertia, key, None, &what)?;
                self.write(format_args!(" {key}=\"{value:?}\""));
            }
            for key in ["ixy", "ixz", "iyz"] {
                let value = self.number(inertia, key, Some(0.0), &what)?;
                self.write(format_args!(" {key}=\"{value:?}\""));
            }
            self.write(format_args!("/></inertial>"));
        }
        self.write(format_args!("</link>\n"));
        Ok(())
    }

    fn joint(&mut self, node: Node) -> Result<(), UrdfError> {
        let name = self.word(node, "name", "<joint>")?;
        let what = format!("joint \"{name}\"");
        self.checked.joints.entry(name.clone()).or_insert(node.range().start);
        let kind = self.word(node, "type", &what)?;
        if !JOINT_TYPES.contains(&kind.as_str()) {
            let allowed = JOINT_TYPES.join(", ");
            let help = "write a ball joint as three revolute joints";
            return Err(self.bad(
                node,
                format!("{what}: unknown type"),
                format!("\"{kind}\""),
                &allowed,
                help,
            ));
        }
        self.write(format_args!("<joint name=\"{}\" type=\"{kind}\">", escaped(&name)));
        self.origin(node, &what)?;
        for key in ["parent", "child"] {
            let element = self.required(node, key, &what)?;
            let link = self.word(element, "link", &what)?;
            self.write(format_args!("<{key} link=\"{}\"/>", escaped(&link)));
        }
        let axis = match self.first(node, "axis", &what) {
            Some(axis) => self.numbers(axis, "xyz", [1.0, 0.0, 0.0], &what)?,
            None => [1.0, 0.0, 0.0],
        };
        self.write(format_args!("<axis xyz=\"{}\"/>", spaced(&axis)));
        self.limit(node, &kind, &what)?;
        self.dynamics(node, &what)?;
        self.mimic(node, &kind, &what)?;
        self.write(format_args!("</joint>\n"));
        Ok(())
    }

    // Absent limits mean none. A revolute joint without lower and upper would be locked if they meant zero.
    fn limit(&mut self, node: Node, kind: &str, what: &str) -> Result<(), UrdfError> {
        let limit = self.first(node, "limit", what);
        let mut values = [f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY];
        if let Some(limit) = limit {
            for (value, key) in values.iter_mut().zip(["lower", "upper", "velocity", "effort"]) {
                if limit.has_attribute(key) {
                    *value = self.real(limit, key, what)?;
                }
            }
        }
        let bounded = limit.is_some_and(|l| l.has_attribute("lower") || l.has_attribute("upper"));
        if matches!(kind, "revolute" | "prismatic") && !bounded {
            let statement = format!("{what}: {kind} without lower and upper limit: taken as unlimited");
            self.note(
                limit.unwrap_or(node),
                statement,
                "state <limit lower=… upper=…> or make it continuous",
            );
        }
        let [mut lower, mut upper, velocity, effort] = values;
        if kind == "continuous" {
            (lower, upper) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        self.write(format_args!(
            "<limit lower=\"{lower:?}\" upper=\"{upper:?}\" velocity=\"{velocity:?}\" effort=\"{effort:?}\"/>"
        ));
        Ok(())
    }

    fn dynamics(&mut self, node: Node, what: &str) -> Result<(), UrdfError> {
        let Some(dynamics) = self.first(node, "dynamics", what) else { return Ok(()) };
        self.write(format_args!("<dynamics"));
        for key in ["damping", "friction"] {
            let value = self.number(dynamics, key, Some(0.0), what)?;
            if value < 0.0 {
                let help = "friction takes energy out: state its size";
                return Err(self.bad(dynamics, format!("{what}: negative {key}"), value, "≥ 0", help));
            }
            self.write(format_args!(" {key}=\"{value:?}\""));
        }
        self.write(format_args!("/>"));
        Ok(())
    }

    fn mimic(&mut self, node: Node, kind: &str, what: &str) -> Result<(), UrdfError> {
        let Some(mimic) = self.first(node, "mimic", what) else { return Ok(()) };
        if kind == "fixed" {
            let statement = format!("{what}: fixed, yet it mimics another: the <mimic> is ignored");
            self.note(mimic, statement, "remove the <mimic>, or give the joint a type that moves");
            return Ok(());
        }
        let leader = self.word(mimic, "joint", what)?;
        let multiplier = self.number(mimic, "multiplier", Some(1.0), what)?;
        let offset = self.number(mimic, "offset", Some(0.0), what)?;
        self.write(format_args!(
            "<mimic joint=\"{}\" multiplier=\"{multiplier:?}\" offset=\"{offset:?}\"/>",
            escaped(&leader)
        ));
        Ok(())
    }

    fn origin(&mut self, node: Node, what: &str) -> Result<(), UrdfError> {
        let Some(origin) = self.first(node, "origin", what) else { return Ok(()) };
        let xyz = self.numbers(origin, "xyz", [0.0; 3], what)?;
        // URDF 1.1 may state a quaternion instead.
        let rpy = if origin.has_attribute("quat_xyzw") && !origin.has_attribute("rpy") {
            let q = self.numbers(origin, "quat_xyzw", [0.0; 4], what)?;
            let help = "state the four numbers x y z w of a unit quaternion";
            let got = spaced(&q);
            let bad = || self.bad(origin, format!("{what}: quat_xyzw is null"), got, "not null", help);
            angles_of_quaternion(q).ok_or_else(bad)?
        } else {
            self.numbers(origin, "rpy", [0.0; 3], what)?
        };
        self.write(format_args!("<origin xyz=\"{}\" rpy=\"{}\"/>", spaced(&xyz), spaced(&rpy)));
        Ok(())
    }
}

/// Numbers between spaces, each the shortest that reads back to itself.
pub(crate) fn spaced(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ")
}

/// Text as it may stand in a quoted attribute.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
