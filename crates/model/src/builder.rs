//! Puts a model together, link by link and joint by joint.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use alloc::collections::BTreeMap;

use crate::{
    Inertia, Joint, JointId, JointKind, Limits, Link, LinkId, Mimic, Model, ModelError, Pose, Vector3,
};

/// How a joint of a description moves, before fixed joints are merged and planar ones are split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointShape {
    /// Does not move: the child is merged into the parent's body.
    Fixed,
    /// Turns about the axis.
    Revolute,
    /// Slides along the axis.
    Prismatic,
    /// Moves freely.
    Floating,
    /// Slides in the plane normal to the axis and turns about it: three joints `NAME.x`, `NAME.y`, `NAME.rotation`.
    Planar,
}

/// A joint of a description.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSpec {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub shape: JointShape,
    /// The link it stands on.
    pub parent: String,
    /// The link it carries.
    pub child: String,
    /// The child's frame at zero position in the parent link's frame.
    pub origin: Pose<f64>,
    /// Axis in the child frame; any length but zero.
    pub axis: Vector3<f64>,
    /// Its range.
    pub limits: Limits,
    /// Leader, multiplier and offset, if it follows another joint.
    pub mimic: Option<(String, f64, f64)>,
}

impl JointSpec {
    /// A joint about or along z without limits; the other fields are public.
    pub fn new(name: &str, shape: JointShape, parent: &str, child: &str) -> Self {
        Self {
            name: name.to_owned(),
            shape,
            parent: parent.to_owned(),
            child: child.to_owned(),
            origin: Pose::identity(),
            axis: Vector3 { x: 0.0, y: 0.0, z: 1.0 },
            limits: Limits::NONE,
            mimic: None,
        }
    }
    /// The same joint at another place of the parent link.
    pub fn at(mut self, origin: Pose<f64>) -> Self {
        self.origin = origin;
        self
    }
    /// The same joint about or along another axis.
    pub fn about(mut self, axis: [f64; 3]) -> Self {
        self.axis = axis.into();
        self
    }
}

/// Collects links and joints in any order and builds the [`Model`].
///
/// # Example
/// A pendulum of 2 kg on a rod of half a metre:
/// ```
/// use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, Vector3};
/// let mut builder = ModelBuilder::new("pendulum");
/// builder.link("base", Inertia::default());
/// builder.link("rod", Inertia::point(2.0, Vector3::new(0.5, 0.0, 0.0)));
/// builder.joint(JointSpec::new("pivot", JointShape::Revolute, "base", "rod").about([0.0, -1.0, 0.0]));
/// let model = builder.build()?;
/// assert_eq!((model.nv, model.joints[0].name.as_str()), (1, "pivot"));
/// # Ok::<(), sinew_model::ModelError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct ModelBuilder {
    name: String,
    links: Vec<(String, Inertia<f64>)>,
    joints: Vec<JointSpec>,
}

impl ModelBuilder {
    /// An empty description of the robot called `name`.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }
    /// Adds a link with its inertia in its own frame.
    pub fn link(&mut self, name: &str, inertia: Inertia<f64>) -> &mut Self {
        self.links.push((name.to_owned(), inertia));
        self
    }
    /// Adds a joint.
    pub fn joint(&mut self, joint: JointSpec) -> &mut Self {
        self.joints.push(joint);
        self
    }

    /// Checks the description and builds the model: depth first from the root, siblings in the order given,
    /// fixed links merged.
    ///
    /// # Errors
    /// If names repeat or are unknown, the links are no tree, an axis is null or a mimic has no usable leader.
    pub fn build(&self) -> Result<Model, ModelError> {
        self.check_names()?;
        let root = self.root()?;
        let mut build = Build { description: self, joints: Vec::new(), links: Vec::new(), nq: 0, nv: 0 };
        build.add_link(root, None, None, Pose::identity())?;
        if build.links.len() != self.links.len() {
            let reached = |name: &String| build.links.iter().any(|l| &l.name == name);
            let lost =
                self.links.iter().find(|(name, _)| !reached(name)).map_or("", |(name, _)| name.as_str());
            return Err(self.not_a_tree(format!("link \"{lost}\" is not connected to the root")));
        }
        build.resolve_mimics()?;
        let Build { joints, links, nq, nv, .. } = build;
        let gravity = Vector3 { x: 0.0, y: 0.0, z: -9.81 };
        Ok(Model { name: self.name.clone(), joints, links, gravity, nq, nv })
    }

    fn check_names(&self) -> Result<(), ModelError> {
        let mut links = BTreeMap::new();
        for (name, _) in &self.links {
            if links.insert(name.as_str(), ()).is_some() {
                return Err(self.duplicate("links", name));
            }
        }
        let mut joints = BTreeMap::new();
        for joint in &self.joints {
            if joints.insert(joint.name.as_str(), ()).is_some() {
                return Err(self.duplicate("joints", &joint.name));
            }
            for link in [&joint.parent, &joint.child] {
                if !links.contains_key(link.as_str()) {
                    return Err(ModelError::NoSuchLink {
                        robot: self.name.clone(),
                        joint: joint.name.clone(),
                        link: link.clone(),
                    });
                }
            }
            let Vector3 { x, y, z } = joint.axis;
            let length = joint.axis.norm();
            if joint.shape != JointShape::Fixed && !(length > 0.0 && length.is_finite()) {
                return Err(ModelError::NoAxis { joint: joint.name.clone(), x, y, z });
            }
        }
        Ok(())
    }

    fn root(&self) -> Result<&str, ModelError> {
        let mut parents: BTreeMap<&str, &str> = BTreeMap::new();
        for joint in &self.joints {
            if let Some(other) = parents.insert(&joint.child, &joint.name) {
                let detail = format!(
                    "link \"{}\" is the child of both \"{other}\" and \"{}\"",
                    joint.child, joint.name
                );
                return Err(self.not_a_tree(detail));
            }
        }
        let mut roots = self.links.iter().map(|(n, _)| n.as_str()).filter(|n| !parents.contains_key(n));
        match (roots.next(), roots.next()) {
            (Some(root), None) => Ok(root),
            (Some(a), Some(b)) => Err(self.not_a_tree(format!("\"{a}\" and \"{b}\" both have no parent"))),
            _ => Err(self.not_a_tree("there is no root link".to_owned())),
        }
    }

    fn duplicate(&self, what: &'static str, name: &str) -> ModelError {
        ModelError::Duplicate { robot: self.name.clone(), what, name: name.to_owned() }
    }

    fn not_a_tree(&self, detail: String) -> ModelError {
        ModelError::NotATree { robot: self.name.clone(), detail }
    }
}

struct Build<'a> {
    description: &'a ModelBuilder,
    joints: Vec<Joint>,
    links: Vec<Link>,
    nq: usize,
    nv: usize,
}

impl Build<'_> {
    fn add_link(
        &mut self,
        name: &str,
        parent: Option<LinkId>,
        body: Option<JointId>,
        place: Pose<f64>,
    ) -> Result<(), ModelError> {
        let description = self.description;
        let own =
            description.links.iter().find(|(n, _)| n == name).map_or_else(Inertia::default, |(_, i)| *i);
        if let Some(id) = body {
            self.joints[id.0].inertia += place.inertia_to_parent(&own);
        }
        let here = Some(LinkId(self.links.len()));
        self.links.push(Link { name: name.to_owned(), parent, body, body_from_link: place, inertia: own });
        for joint in description.joints.iter().filter(|j| j.parent == name) {
            let placement = place * joint.origin;
            if joint.shape == JointShape::Fixed {
                self.add_link(&joint.child, here, body, placement)?;
            } else {
                let id = self.add_joint(joint, body, placement);
                self.add_link(&joint.child, here, Some(id), Pose::identity())?;
            }
        }
        Ok(())
    }

    fn add_joint(&mut self, spec: &JointSpec, parent: Option<JointId>, placement: Pose<f64>) -> JointId {
        let axis = spec.axis * (1.0 / spec.axis.norm());
        match spec.shape {
            JointShape::Planar => {
                // Two slides and a turn: massless in between, the body on the last.
                let (x, y) = axis.normals();
                let first = self.push(spec, ".x", JointKind::Prismatic { axis: x }, parent, placement);
                let slide = JointKind::Prismatic { axis: y };
                let second = self.push(spec, ".y", slide, Some(first), Pose::identity());
                self.push(spec, ".rotation", JointKind::Revolute { axis }, Some(second), Pose::identity())
            }
            JointShape::Prismatic => self.push(spec, "", JointKind::Prismatic { axis }, parent, placement),
            JointShape::Floating => self.push(spec, "", JointKind::Floating, parent, placement),
            JointShape::Fixed | JointShape::Revolute => {
                self.push(spec, "", JointKind::Revolute { axis }, parent, placement)
            }
        }
    }

    fn push(
        &mut self,
        spec: &JointSpec,
        suffix: &str,
        kind: JointKind,
        parent: Option<JointId>,
        placement: Pose<f64>,
    ) -> JointId {
        let follows = spec.mimic.is_some();
        self.joints.push(Joint {
            name: format!("{}{suffix}", spec.name),
            kind,
            parent,
            placement,
            inertia: Inertia::default(),
            limits: spec.limits,
            mimic: None,
            first_q: self.nq,
            first_dof: self.nv,
        });
        if !follows {
            self.nq += kind.nq();
            self.nv += kind.nv();
        }
        JointId(self.joints.len() - 1)
    }

    // Leaders may come later in the tree; a chain of followers ends at its first leader.
    fn resolve_mimics(&mut self) -> Result<(), ModelError> {
        let specs: BTreeMap<&str, &JointSpec> =
            self.description.joints.iter().map(|j| (j.name.as_str(), j)).collect();
        for k in 0..self.joints.len() {
            let name = self.joints[k].name.clone();
            let Some((first, mut multiplier, mut offset)) =
                specs.get(name.as_str()).and_then(|j| j.mimic.clone())
            else {
                continue;
            };
            let bad = |detail: &str| ModelError::BadMimic {
                joint: name.clone(),
                leader: first.clone(),
                detail: detail.to_owned(),
            };
            let mut leader = first.clone();
            for _ in 0..self.joints.len() {
                let Some((next, m, o)) = specs.get(leader.as_str()).and_then(|j| j.mimic.clone()) else {
                    break;
                };
                offset += multiplier * o;
                multiplier *= m;
                leader = next;
            }
            let position = self.joints.iter().position(|j| j.name == leader);
            let Some(position) = position else { return Err(bad("there is no such movable joint")) };
            let target = &self.joints[position];
            if specs.get(leader.as_str()).is_some_and(|j| j.mimic.is_some()) {
                return Err(bad("the joints mimic each other in a circle"));
            }
            if target.kind.nv() != 1 || self.joints[k].kind.nv() != 1 {
                return Err(bad("both joints must have one degree of freedom"));
            }
            let (first_q, first_dof) = (target.first_q, target.first_dof);
            let joint = &mut self.joints[k];
            joint.mimic = Some(Mimic { leader: JointId(position), multiplier, offset });
            (joint.first_q, joint.first_dof) = (first_q, first_dof);
        }
        Ok(())
    }
}
