//! Robots from mesh-free URDF files.

use std::path::Path;

use sinew_model::{Inertia, JointKind, JointShape, JointSpec, Model, ModelBuilder};

/// The model of a URDF file; a root link with mass moves freely.
pub fn read(path: &Path) -> Result<Model, String> {
    let read = sinew_urdf::read_urdf(path).map_err(|error| error.to_string())?;
    let model = read.model;
    if model.links[0].inertia.mass == 0.0 {
        return Ok(model);
    }
    free(&model).map_err(|error| error.to_string())
}

/// The same robot on a floating base.
fn free(model: &Model) -> Result<Model, sinew_model::ModelError> {
    let mut builder = ModelBuilder::new(&model.name);
    builder.link("world", Inertia::default());
    for link in &model.links {
        builder.link(&link.name, link.inertia);
    }
    let root = &model.links[0].name;
    builder.joint(JointSpec::new("floating_base", JointShape::Floating, "world", root));
    for link in &model.links[1..] {
        let Some(body) = link.body else {
            let placed = JointSpec::new(&format!("{}_fixed", link.name), JointShape::Fixed, root, &link.name);
            builder.joint(placed.at(link.body_from_link));
            continue;
        };
        // every link carried with another one is fixed to the one that begins the body
        let joint = &model.joints[body.0];
        let begins = model.links.iter().find(|l| l.body == Some(body)).expect("a body has a link");
        if begins.name != link.name {
            let name = format!("{}_fixed", link.name);
            let placed = JointSpec::new(&name, JointShape::Fixed, &begins.name, &link.name);
            builder.joint(placed.at(link.body_from_link));
            continue;
        }
        let parent = match joint.parent {
            None => root,
            Some(p) => &model.links.iter().find(|l| l.body == Some(p)).expect("a body has a link").name,
        };
        let (shape, axis) = match joint.kind {
            JointKind::Revolute { axis } => (JointShape::Revolute, axis),
            JointKind::Prismatic { axis } => (JointShape::Prismatic, axis),
            JointKind::Floating => (JointShape::Floating, [0.0, 0.0, 1.0].into()),
        };
        let spec = JointSpec::new(&joint.name, shape, parent, &link.name);
        builder.joint(spec.at(joint.placement).about(axis.to_array()));
    }
    let mut free = builder.build()?;
    free.gravity = model.gravity;
    Ok(free)
}

/// True if the first joint moves freely.
pub fn is_free(model: &Model) -> bool {
    model.joints.first().is_some_and(|joint| joint.kind.nv() == 6)
}
