//! Model to URDF.

use std::fmt::Write;

use sinew_model::{Inertia, Joint, JointId, JointKind, LinkId, Model, Pose};

use crate::rotation::roll_pitch_yaw;
use crate::xml::{escaped, spaced};

/// The text of a URDF that reads back to the same model, to rounding (1e-12).
///
/// Links, inertias, joints, limits and mimics are written; fixed joints get the names `LINK_fixed`. A URDF has no
/// place for gravity.
///
/// # Example
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 1.0, 0.5);
/// let back = sinew_urdf::parse_urdf(&sinew_urdf::write_urdf(&arm), "arm.urdf")?.model;
/// assert_eq!(back.joints[1].placement, arm.joints[1].placement);
/// # Ok::<(), sinew_urdf::UrdfError>(())
/// ```
pub fn write_urdf(model: &Model) -> String {
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&model.name));
    for (k, link) in model.links.iter().enumerate() {
        write_link(&mut text, &link.name, &link.inertia);
        if k > 0 {
            write_joint(&mut text, model, LinkId(k));
        }
    }
    text.push_str("</robot>\n");
    text
}

fn write_link(text: &mut String, name: &str, inertia: &Inertia<f64>) {
    let name = escaped(name);
    if *inertia == Inertia::default() {
        put(text, format_args!("  <link name=\"{name}\"/>\n"));
        return;
    }
    let i = inertia.second_moment_about_centre();
    let centre = spaced(&inertia.centre_of_mass().to_array());
    put(text, format_args!("  <link name=\"{name}\">\n    <inertial>\n      <origin xyz=\"{centre}\"/>\n"));
    put(text, format_args!("      <mass value=\"{:?}\"/>\n      <inertia", inertia.mass));
    for (key, value) in
        [("ixx", i.xx), ("ixy", i.xy), ("ixz", i.xz), ("iyy", i.yy), ("iyz", i.yz), ("izz", i.zz)]
    {
        put(text, format_args!(" {key}=\"{value:?}\""));
    }
    put(text, format_args!("/>\n    </inertial>\n  </link>\n"));
}

// The joint above a link: the one that moves its body if it is the body's own link, else a fixed one.
fn write_joint(text: &mut String, model: &Model, id: LinkId) {
    let link = &model.links[id.0];
    let name = escaped(&link.name);
    let own = own_link(model, link.body);
    if own != Some(id) {
        let parent = &model.links[own.unwrap_or(LinkId(0)).0].name;
        put(text, format_args!("  <joint name=\"{name}_fixed\" type=\"fixed\">\n"));
        write_place(text, parent, &name, &link.body_from_link);
        put(text, format_args!("  </joint>\n"));
        return;
    }
    let mut joint = &model.joints[link.body.expect("a body's own link has a body").0];
    let axis = match joint.kind {
        JointKind::Revolute { axis } | JointKind::Prismatic { axis } => axis.to_array(),
        JointKind::Floating => [1.0, 0.0, 0.0],
    };
    let mut kind = kind_name(joint);
    let mut joint_name = joint.name.as_str();
    // A planar joint was split into two slides and a turn, of which only the last carries a link.
    while let Some(parent) = joint.parent.filter(|p| own_link(model, Some(*p)).is_none()) {
        kind = "planar";
        joint_name = joint_name.trim_end_matches(".rotation");
        joint = &model.joints[parent.0];
    }
    let parent = &model.links[own_link(model, joint.parent).unwrap_or(LinkId(0)).0].name;
    put(text, format_args!("  <joint name=\"{}\" type=\"{kind}\">\n", escaped(joint_name)));
    write_place(text, parent, &name, &joint.placement);
    put(text, format_args!("    <axis xyz=\"{}\"/>\n", spaced(&axis)));
    write_limit(text, joint);
    if let Some(mimic) = joint.mimic {
        let leader = escaped(&model.joints[mimic.leader.0].name);
        put(text, format_args!("    <mimic joint=\"{leader}\""));
        put(text, format_args!(" multiplier=\"{:?}\" offset=\"{:?}\"/>\n", mimic.multiplier, mimic.offset));
    }
    put(text, format_args!("  </joint>\n"));
}

fn write_place(text: &mut String, parent: &str, child: &str, pose: &Pose<f64>) {
    let (xyz, rpy) = (pose.translation.to_array(), roll_pitch_yaw(&pose.rotation));
    put(text, format_args!("    <origin xyz=\"{}\" rpy=\"{}\"/>\n", spaced(&xyz), spaced(&rpy)));
    put(text, format_args!("    <parent link=\"{}\"/>\n    <child link=\"{child}\"/>\n", escaped(parent)));
}

fn write_limit(text: &mut String, joint: &Joint) {
    let l = joint.limits;
    let stated = [("lower", l.lower), ("upper", l.upper), ("velocity", l.velocity), ("effort", l.effort)];
    if stated.iter().any(|(_, value)| value.is_finite()) {
        put(text, format_args!("    <limit"));
        for (key, value) in stated.into_iter().filter(|(_, value)| value.is_finite()) {
            put(text, format_args!(" {key}=\"{value:?}\""));
        }
        put(text, format_args!("/>\n"));
    }
}

fn kind_name(joint: &Joint) -> &'static str {
    let unbounded = joint.limits.lower == f64::NEG_INFINITY && joint.limits.upper == f64::INFINITY;
    match joint.kind {
        JointKind::Revolute { .. } if unbounded => "continuous",
        JointKind::Revolute { .. } => "revolute",
        JointKind::Prismatic { .. } => "prismatic",
        JointKind::Floating => "floating",
    }
}

// The first link of a body stands at its frame; the world's is the root.
fn own_link(model: &Model, body: Option<JointId>) -> Option<LinkId> {
    model.links.iter().position(|l| l.body == body).map(LinkId)
}

fn put(text: &mut String, part: std::fmt::Arguments) {
    text.write_fmt(part).expect("a string takes any text");
}
