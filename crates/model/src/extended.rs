//! A model whose bending links stand in parts, with virtual joints between them.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::{LinkId, Model};

/// How a virtual joint follows its load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Following {
    /// It has inertia of its own and swings.
    Dynamic,
    /// It has none, or is said to have none: its spring is in balance with the load at every instant.
    QuasiStatic,
}

/// A joint that stands for the bending of a link: a spring to zero and a damper, no motor and no friction.
///
/// ```text
/// τ = −K q_v − D q̇_v
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualJoint {
    /// Its degree of freedom in the extended model.
    pub dof: usize,
    /// The link that bends.
    pub link: LinkId,
    /// Its number along the link, over springs and axes, from 1.
    pub number: usize,
    /// The axis of the link frame that it turns about: 'x', 'y' or 'z'.
    pub axis: char,
    /// Where it stands along the link, m from the link's origin.
    pub station: f64,
    /// K, N·m/rad.
    pub stiffness: f64,
    /// D, N·m·s/rad.
    pub damping: f64,
    /// How it follows its load.
    pub following: Following,
}

/// A model with the virtual joints of its bending links among its joints.
///
/// Links keep their places; parts of links that bend follow after them. Joints keep their order, and virtual joints
/// stand between them where the tree has them: `joints` says which degree of freedom is which.
#[derive(Debug, Clone, PartialEq)]
pub struct Extended {
    /// The mechanism, virtual joints included.
    pub model: Model,
    /// For each degree of freedom of the robot, the same one here.
    pub joints: Vec<usize>,
    /// For each number of a position of the robot, the same one here.
    pub positions: Vec<usize>,
    /// The virtual joints, link by link.
    pub virtual_joints: Vec<VirtualJoint>,
}

impl Extended {
    /// A robot without links that bend.
    pub fn rigid(model: Model) -> Self {
        let (joints, positions) = ((0..model.nv).collect(), (0..model.nq).collect());
        Self { model, joints, positions, virtual_joints: Vec::new() }
    }

    /// The position with the robot's own joints at `q` and the virtual joints at zero.
    ///
    /// # Panics
    /// If `q` has the wrong length.
    pub fn position(&self, q: &[f64]) -> Vec<f64> {
        assert_eq!(q.len(), self.positions.len(), "q");
        let mut all = vec![0.0; self.model.nq];
        self.positions.iter().zip(q).for_each(|(&place, &q)| all[place] = q);
        all
    }

    /// The coordinate's name, `v.LINK.K`.
    pub fn coordinate(&self, joint: &VirtualJoint) -> String {
        VirtualJoint::name(&self.model.links[joint.link.0].name, joint.number)
    }
}

impl VirtualJoint {
    /// The name of the joint that is the `number`-th of `link`, and of its coordinate: `v.LINK.K`.
    ///
    /// ```
    /// assert_eq!(sinew_model::VirtualJoint::name("forearm", 2), "v.forearm.2");
    /// ```
    pub fn name(link: &str, number: usize) -> String {
        format!("v.{link}.{number}")
    }
}
