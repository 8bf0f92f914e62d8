//! A virtual joint that is put into a tree.

use alloc::format;
use alloc::string::String;

use crate::{
    Extended, Following, Inertia, Joint, JointId, JointKind, Limits, LinkId, Pose, Symmetric3, Vector3,
    VirtualJoint,
};

/// A joint that the URDF does not have, which gives way: where it stands and what it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// The link that it belongs to.
    pub link: LinkId,
    /// What it carries.
    pub carries: Carried,
    /// The axis that it turns about: of the joint's frame for a part of a body, of the world's for the robot.
    pub axis: Vector3<f64>,
}

/// What a hinge carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carried {
    /// The whole robot: the hinge stands at the world's origin.
    Robot,
    /// A part of a body that swings against the rest of it about the origin of the body's joint.
    PartOf(JointId),
}

/// The inertia that a swinging part begins with, as a share of its body's: the effect that it belongs to gives it more,
/// and the mass matrix stays regular where the effect is absent.
const LEAST: f64 = 1e-6;
/// The inertia of a base that nothing moves, kg·m²: the effect that it belongs to takes it back.
const IMMOVABLE: f64 = 1e9;

impl Extended {
    /// The same with one more virtual joint, and its degree of freedom. Its spring is its effect's business.
    ///
    /// Joints keep their order; a hinge that carries the robot stands before all of them, one that carries a part of a
    /// body behind.
    ///
    /// # Errors
    /// If the hinge carries a robot that floats.
    ///
    /// # Example
    /// ```
    /// use sinew_model::{Carried, Extended, Hinge, LinkId, Vector3, samples};
    /// let arm = Extended::rigid(samples::planar_arm(2, 1.5, 0.4));
    /// let hinge = Hinge { link: LinkId(0), carries: Carried::Robot, axis: Vector3::new(0.0, 1.0, 0.0) };
    /// let (arm, dof) = arm.hinged(&hinge)?;
    /// assert_eq!((dof, &arm.joints[..], arm.model.dof_name(0)), (0, &[1, 2][..], "v.base.1"));
    /// # Ok::<(), String>(())
    /// ```
    pub fn hinged(mut self, hinge: &Hinge) -> Result<(Self, usize), String> {
        let model = &mut self.model;
        if model.nq != model.nv {
            return Err(format!(
                "robot \"{}\" floats: its base stands on nothing that gives way",
                model.name
            ));
        }
        let number = 1 + self.virtual_joints.iter().filter(|v| v.link == hinge.link).count();
        let own = match hinge.carries {
            Carried::Robot => {
                let second_moment =
                    Symmetric3 { xx: IMMOVABLE, yy: IMMOVABLE, zz: IMMOVABLE, ..Symmetric3::default() };
                Inertia { second_moment, ..Inertia::default() }
            }
            Carried::PartOf(body) => model.joints[body.0].inertia.scaled(LEAST),
        };
        let mut joint = Joint {
            name: VirtualJoint::name(&model.links[hinge.link.0].name, number),
            kind: JointKind::Revolute { axis: hinge.axis },
            parent: None,
            placement: Pose::identity(),
            inertia: own,
            limits: Limits::NONE,
            mimic: None,
            first_q: 0,
            first_dof: 0,
        };
        let dof = match hinge.carries {
            Carried::PartOf(body) => {
                joint.parent = Some(body);
                (joint.first_q, joint.first_dof) = (model.nq, model.nv);
                model.joints.push(joint);
                model.nv
            }
            Carried::Robot => {
                for other in &mut model.joints {
                    other.parent = Some(other.parent.map_or(JointId(0), |p| JointId(p.0 + 1)));
                    (other.first_q, other.first_dof) = (other.first_q + 1, other.first_dof + 1);
                    if let Some(mimic) = &mut other.mimic {
                        mimic.leader = JointId(mimic.leader.0 + 1);
                    }
                }
                for link in &mut model.links {
                    // What was fixed to the world rides on the base now.
                    link.body = Some(link.body.map_or(JointId(0), |b| JointId(b.0 + 1)));
                }
                model.joints.insert(0, joint);
                self.joints.iter_mut().chain(&mut self.positions).for_each(|dof| *dof += 1);
                self.virtual_joints.iter_mut().for_each(|v| v.dof += 1);
                0
            }
        };
        (model.nq, model.nv) = (model.nq + 1, model.nv + 1);
        self.virtual_joints.push(VirtualJoint {
            dof,
            link: hinge.link,
            number,
            axis: letter(hinge.axis),
            station: 0.0,
            stiffness: 0.0,
            damping: 0.0,
            following: Following::Dynamic,
        });
        Ok((self, dof))
    }
}

// The letter of the axis that a direction is nearest to.
fn letter(axis: Vector3<f64>) -> char {
    let sizes = [axis.x.abs(), axis.y.abs(), axis.z.abs()];
    let largest = (0..3).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b])).unwrap_or(0);
    ['x', 'y', 'z'][largest]
}
