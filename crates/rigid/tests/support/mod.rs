//! Reads a robot and numbers for comparison from files.

use nalgebra::{DMatrix, DVector};
use roxmltree::{Document, Node};
use serde_json::Value;
use sinew_model::{Inertia, JointShape, JointSpec, Model, ModelBuilder, Pose};

/// What to make of a description beside its links and joints.
#[derive(Clone, Copy, PartialEq)]
pub enum Reading {
    /// Mimic joints move on their own.
    Independent,
    /// Mimic joints follow their leaders.
    Mimic,
    /// The root link floats; mimic joints move on their own.
    Floating,
}

/// The kinematics and inertias of a URDF, and nothing else of it.
pub fn read_urdf(text: &str, reading: Reading) -> Model {
    let document = Document::parse(text).expect("well-formed XML");
    let robot = document.root_element();
    let named = |tag| robot.children().filter(move |n: &Node| n.has_tag_name(tag) && n.has_attribute("name"));
    let mut builder = ModelBuilder::new("robot");
    for link in named("link") {
        builder.link(name(link), child(link, "inertial").map_or_else(Inertia::default, inertia));
    }
    let links_of = |joint, tag| child(joint, tag).and_then(|n| n.attribute("link")).unwrap();
    let joints: Vec<Node> = named("joint").filter(|n| n.has_attribute("type")).collect();
    for &node in &joints {
        let shape = match node.attribute("type").unwrap() {
            "fixed" => JointShape::Fixed,
            "prismatic" => JointShape::Prismatic,
            "revolute" | "continuous" => JointShape::Revolute,
            other => panic!("joint type {other}"),
        };
        let mut joint = JointSpec::new(name(node), shape, links_of(node, "parent"), links_of(node, "child"));
        joint = joint.at(origin(node));
        let axis = child(node, "axis").and_then(|n| n.attribute("xyz"));
        joint = joint.about(axis.map_or([1.0, 0.0, 0.0], three));
        if let (Reading::Mimic, Some(mimic)) = (reading, child(node, "mimic"))
            && shape != JointShape::Fixed
        {
            let number = |key, default| mimic.attribute(key).map_or(default, |x| x.parse().unwrap());
            let leader = mimic.attribute("joint").unwrap().to_owned();
            joint.mimic = Some((leader, number("multiplier", 1.0), number("offset", 0.0)));
        }
        builder.joint(joint);
    }
    if reading == Reading::Floating {
        let is_child = |link| joints.iter().any(|&j| links_of(j, "child") == link);
        let root = named("link").map(name).find(|&link| !is_child(link)).expect("a root");
        builder.link("world of the base", Inertia::default());
        builder.joint(JointSpec::new("floating base", JointShape::Floating, "world of the base", root));
    }
    builder.build().expect("a tree")
}

/// A list of numbers of a state.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// A list of numbers as a vector.
pub fn vector(value: &Value) -> DVector<f64> {
    DVector::from_vec(numbers(value))
}

/// A list of rows.
pub fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().expect("rows").iter().map(numbers).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn name<'a>(node: Node<'a, '_>) -> &'a str {
    node.attribute("name").expect("a name")
}

fn child<'a, 'b>(node: Node<'a, 'b>, tag: &'static str) -> Option<Node<'a, 'b>> {
    node.children().find(|n| n.has_tag_name(tag))
}

fn three(text: &str) -> [f64; 3] {
    let numbers: Vec<f64> = text.split_whitespace().map(|x| x.parse().expect("a number")).collect();
    numbers.try_into().expect("three numbers")
}

fn origin(node: Node) -> Pose<f64> {
    let origin = child(node, "origin");
    let get = |key| origin.and_then(|n| n.attribute(key)).map_or([0.0; 3], three);
    Pose::from_xyz_rpy(get("xyz"), get("rpy"))
}

fn inertia(node: Node) -> Inertia<f64> {
    let get = |tag, key: &str| {
        child(node, tag).and_then(|n| n.attribute(key)).map_or(0.0, |x| x.trim().parse().expect("a number"))
    };
    let moment = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].map(|key| get("inertia", key));
    let about_centre = Inertia::at_centre_of_mass(get("mass", "value"), [0.0; 3].into(), moment);
    origin(node).inertia_to_parent(&about_centre)
}
