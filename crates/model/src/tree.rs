//! The model: a tree of joints and the links they carry.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::{Inertia, Joint, JointId, ModelError, Pose, Vector3};

/// The place of a link in [`Model::links`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId(pub usize);

/// A link of the URDF: a named frame on a moving body or on the world, with its own share of the inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name in the URDF.
    pub name: String,
    /// The link that it is fixed to or moves against; none for the root.
    pub parent: Option<LinkId>,
    /// The joint whose body carries it; none for the world.
    pub body: Option<JointId>,
    /// The link's frame in the frame of that body (of the world).
    pub body_from_link: Pose<f64>,
    /// Its own inertia in its own frame; zero where the URDF states none.
    pub inertia: Inertia<f64>,
}

/// A robot's mechanism. Never changes after it is built; joints stand in topological order, parents first.
///
/// The world is the frame of the root link; its gravity is `gravity`.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The robot's name.
    pub name: String,
    /// Movable joints, parents before children.
    pub joints: Vec<Joint>,
    /// All links, the root first.
    pub links: Vec<Link>,
    /// Acceleration of gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Numbers in a position.
    pub nq: usize,
    /// Degrees of freedom.
    pub nv: usize,
}

impl Model {
    /// The joint called `name`.
    pub fn joint(&self, name: &str) -> Option<JointId> {
        self.joints.iter().position(|j| j.name == name).map(JointId)
    }

    /// The link called `name`.
    pub fn link(&self, name: &str) -> Option<LinkId> {
        self.links.iter().position(|l| l.name == name).map(LinkId)
    }

    /// The mass of all that moves, kg.
    pub fn moving_mass(&self) -> f64 {
        self.joints.iter().map(|joint| joint.inertia.mass).sum()
    }

    /// The degree of freedom of the joint called `name`, if it has exactly one of its own.
    pub fn dof(&self, name: &str) -> Option<usize> {
        let joint = &self.joints[self.joint(name)?.0];
        (joint.mimic.is_none() && joint.kind.nv() == 1).then_some(joint.first_dof)
    }

    /// The joint to which degree of freedom `dof` belongs.
    ///
    /// # Panics
    /// If `dof >= nv`.
    pub fn joint_of_dof(&self, dof: usize) -> JointId {
        assert!(dof < self.nv, "dof {dof}: the model has {} degrees of freedom", self.nv);
        let owns = |j: &Joint| j.mimic.is_none() && (j.first_dof..j.first_dof + j.kind.nv()).contains(&dof);
        JointId(self.joints.iter().position(owns).expect("every degree of freedom has a joint"))
    }

    /// The name of the joint to which degree of freedom `dof` belongs.
    ///
    /// # Panics
    /// If `dof >= nv`.
    pub fn dof_name(&self, dof: usize) -> &str {
        &self.joints[self.joint_of_dof(dof).0].name
    }

    /// True if some joint mimics another.
    pub fn has_mimic(&self) -> bool {
        self.joints.iter().any(|j| j.mimic.is_some())
    }

    /// The link at the end of the longest chain of joints; of equals, the last in the tree.
    pub fn last_link(&self) -> LinkId {
        let depth = |link: &Link| {
            let mut depth = 0;
            let mut body = link.body;
            while let Some(id) = body {
                depth += 1;
                body = self.joints[id.0].parent;
            }
            depth
        };
        let deepest = self.links.iter().map(depth).max().unwrap_or(0);
        LinkId(self.links.iter().rposition(|l| depth(l) == deepest).unwrap_or(0))
    }

    /// A position with every joint at zero and floating bases at the world's origin.
    pub fn zero_position(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.nq];
        for joint in self.joints.iter().filter(|j| j.kind.nq() == 7) {
            q[joint.first_q + 6] = 1.0;
        }
        q
    }

    /// The same mechanism under another gravity.
    pub fn with_gravity(mut self, gravity: Vector3<f64>) -> Self {
        self.gravity = gravity;
        self
    }

    /// The joint called `name`, or the error that says which names there are.
    pub fn require_dof(&self, name: &str) -> Result<usize, ModelError> {
        self.dof(name).ok_or_else(|| ModelError::NoSuchJoint {
            robot: self.name.clone(),
            joint: name.to_owned(),
            known: self.joints.iter().filter(|j| j.mimic.is_none()).map(|j| j.name.clone()).collect(),
        })
    }
}
