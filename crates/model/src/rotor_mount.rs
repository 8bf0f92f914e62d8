//! Where the rotor of a joint rides.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;

use crate::{Joint, JointId, JointKind, Link, Model, Robot, Vector3};

/// The moving body that carries a rotor, and the rotor's axis in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorMount {
    /// The body, by the joint that moves it.
    pub body: JointId,
    /// Unit vector about which the rotor turns with its joint, in the joint's frame.
    pub axis: Vector3<f64>,
}

/// Why the axis of a rotor is not known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownRotorAxis {
    /// The joint that the rotor drives.
    pub joint: String,
    /// What is wrong.
    pub reason: String,
    /// The key of the joint's settings that mends it.
    pub key: &'static str,
}

impl Robot {
    /// Where the rotor of a degree of freedom rides; none where that is the world.
    ///
    /// The carrier is `carried_by`, or the parent of the joint; the axis is `rotor_axis` in the frame of the carrying
    /// link, or the joint's own.
    ///
    /// # Errors
    /// If the axis cannot be told in the frame of the carrier, or is null.
    ///
    /// # Panics
    /// If `dof` is no degree of freedom.
    ///
    /// # Example
    /// ```
    /// use sinew_model::{JointId, Robot, samples};
    /// let robot = Robot::rigid(samples::planar_arm(2, 1.0, 0.5));
    /// assert_eq!(robot.rotor_mount(0), Ok(None)); // the base carries the first motor
    /// assert_eq!(robot.rotor_mount(1).unwrap().unwrap().body, JointId(0)); // the first link the second
    /// ```
    pub fn rotor_mount(&self, dof: usize) -> Result<Option<RotorMount>, UnknownRotorAxis> {
        let (model, settings) = (&self.model, &self.joints[dof]);
        let joint = &model.joints[model.joint_of_dof(dof).0];
        let carrier = settings.carried_by.map(|link| &model.links[link.0]);
        let Some(body) = carrier.map_or(joint.parent, |link| link.body) else { return Ok(None) };
        let unknown = |reason: String, key| Err(UnknownRotorAxis { joint: joint.name.clone(), reason, key });
        let axis = match (settings.rotor_axis, carrier) {
            (Some(axis), Some(link)) => link.body_from_link.rotation * Vector3::from(axis),
            (Some(axis), None) => {
                let mut frames = model.links.iter().filter(|link| link.body == Some(body));
                let first =
                    frames.next().map_or(joint.placement.rotation, |link| link.body_from_link.rotation);
                let differs = |link: &Link| link.body_from_link.rotation != first;
                if frames.any(differs) {
                    let reason =
                        format!("body \"{}\" has links in several directions", model.body_name(body));
                    return unknown(reason, "`carried_by`, the link in whose frame `rotor_axis` is told,");
                }
                first * Vector3::from(axis)
            }
            (None, _) if joint.parent == Some(body) => joint.placement.rotation * joint_axis(joint),
            (None, _) => {
                let reason = format!("\"{}\" does not carry the joint itself", model.body_name(body));
                return unknown(reason, "`rotor_axis`, in the frame of the carrying link,");
            }
        };
        let length = axis.norm();
        if !(length > 0.0 && length.is_finite()) {
            return unknown("it has no direction".to_owned(), "`rotor_axis`");
        }
        Ok(Some(RotorMount { body, axis: axis * (1.0 / length) }))
    }
}

impl Model {
    /// The name of the first link that stands on a body, or of the joint that moves it.
    ///
    /// # Panics
    /// If there is no such body.
    pub fn body_name(&self, body: JointId) -> &str {
        let link = self.links.iter().find(|link| link.body == Some(body));
        link.map_or(&self.joints[body.0].name, |link| &link.name)
    }
}

fn joint_axis(joint: &Joint) -> Vector3<f64> {
    match joint.kind {
        JointKind::Revolute { axis } | JointKind::Prismatic { axis } => axis,
        JointKind::Floating => Vector3::ZERO,
    }
}
