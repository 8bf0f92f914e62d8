//! A robot's model with its bending links in parts.

use sinew_model::{
    Bending, Extended, Following, Inertia, Joint, JointId, JointKind, Limits, Link, LinkId, Mimic, Model,
    Pose, Robot, Vector3, VirtualJoint,
};

use crate::FlexLinkError;
use crate::chain::{Chain, parent_from_child, unit};
use crate::following::settle;
use crate::share::shares;

/// The model of a robot with its bending links split into rigid parts and virtual joints between them.
///
/// A part begins where a spring stands, and everything that the link carries (fixed links, joints, bodies) rides on the
/// part at whose station it is. The link's own frame stays at its root; a single base spring carries it. With all
/// virtual joints at zero the robot has the same inertias and the same frames as before.
///
/// # Errors
/// If it is not plain which way a link runs, a beam does not fit into its link, or a twist has no rigidity.
///
/// # Example
/// A rod of 0.8 m with two springs about y has a model with two more joints:
/// ```
/// use sinew_model::{Bending, BeamSection, LinkId, Robot, samples};
/// let mut robot = Robot::rigid(samples::planar_arm(1, 1.68, 0.8));
/// let beam = BeamSection {
///     length: 0.8,
///     flexural_rigidity: 1200.0,
///     torsional_rigidity: None,
///     mass_per_length: 2.1,
///     polar_inertia_per_length: 0.0,
/// };
/// robot.bending.push(Bending::beam(LinkId(1), &['y'], 2, &[beam]));
/// let extended = sinew_flex_link::extend(&robot)?;
/// assert_eq!((extended.model.nv, &extended.joints[..]), (3, &[0][..]));
/// assert_eq!(extended.model.dof_name(2), "v.link_1.2");
/// # Ok::<(), sinew_flex_link::FlexLinkError>(())
/// ```
pub fn extend(robot: &Robot) -> Result<Extended, FlexLinkError> {
    if robot.bending.is_empty() {
        return Ok(Extended::rigid(robot.model.clone()));
    }
    let mut build = Build::new(robot)?;
    for id in (0..robot.model.links.len()).map(LinkId) {
        build.place(id);
        if let Some(k) = build.bending.iter().position(|b| b.bending.link == id) {
            build.split(k);
        }
    }
    let mut extended = build.finish();
    settle(robot, &mut extended);
    Ok(extended)
}

/// One bending link while its parts are placed.
struct Splitting<'a> {
    bending: &'a Bending,
    chain: Chain,
    inertia: Vec<Inertia<f64>>,
    // The body of each part and where the link's axes with their origin at the part's beginning stand in it.
    parts: Vec<(Option<JointId>, Pose<f64>)>,
}

struct Build<'a> {
    model: &'a Model,
    bending: Vec<Splitting<'a>>,
    joints: Vec<Joint>,
    links: Vec<Link>,
    // Of each joint of the model: the same one here.
    joint: Vec<Option<JointId>>,
    // For each joint here: whether its inertia is the sum of links; else it is the model's.
    summed: Vec<bool>,
    virtual_joints: Vec<(JointId, VirtualJoint)>,
    names: Vec<(usize, usize)>,
}

impl<'a> Build<'a> {
    fn new(robot: &'a Robot) -> Result<Self, FlexLinkError> {
        let model = &robot.model;
        let mut bending = Vec::new();
        for b in &robot.bending {
            let chain = Chain::new(model, b)?;
            let inertia = shares(model, b, &chain)?;
            bending.push(Splitting { bending: b, chain, inertia, parts: Vec::new() });
        }
        Ok(Self {
            model,
            bending,
            joints: Vec::new(),
            links: Vec::new(),
            joint: vec![None; model.joints.len()],
            summed: Vec::new(),
            virtual_joints: Vec::new(),
            names: Vec::new(),
        })
    }

    /// Puts a link, and the joints that lead to it, on what carries it.
    fn place(&mut self, id: LinkId) {
        let link = &self.model.links[id.0];
        let (mut body, mut pose) = (None, link.body_from_link);
        if let Some(parent) = link.parent {
            let parent_from_child = parent_from_child(self.model, id);
            let (carrier, carrier_from_child) = self.attach(parent, &parent_from_child);
            let fixed = self.model.links[parent.0].body == link.body;
            (body, pose) = if fixed {
                (carrier, carrier_from_child)
            } else {
                let base = self.model.links[parent.0].body;
                (Some(self.joints_to(link.body, base, carrier, carrier_from_child)), link.body_from_link)
            };
        }
        let bends = self.bending.iter().any(|b| b.bending.link == id);
        let inertia = if bends { Inertia::default() } else { link.inertia };
        self.add_inertia(body, &pose, &inertia);
        self.links.push(Link { body, body_from_link: pose, inertia, ..link.clone() });
    }

    // What carries a frame of the link `parent`, and where the frame stands in it.
    fn attach(&self, parent: LinkId, parent_from_child: &Pose<f64>) -> (Option<JointId>, Pose<f64>) {
        let Some(split) = self.bending.iter().find(|b| b.bending.link == parent) else {
            let link = &self.links[parent.0];
            return (link.body, link.body_from_link * *parent_from_child);
        };
        let along = split.chain.along;
        let part = split.chain.part(parent_from_child.translation.dot(along));
        let (body, body_from_part) = split.parts[part];
        let part_from_link = shift(-(along * split.chain.start(part)));
        (body, body_from_part * part_from_link * *parent_from_child)
    }

    // Takes over the joints between two bodies of the model; the first stands on `carrier`.
    fn joints_to(
        &mut self,
        body: Option<JointId>,
        base: Option<JointId>,
        carrier: Option<JointId>,
        placement: Pose<f64>,
    ) -> JointId {
        let mut way = Vec::new();
        let mut next = body;
        while next != base {
            let id = next.expect("a link's joints lead to its parent");
            way.push(id);
            next = self.model.joints[id.0].parent;
        }
        let (mut parent, mut placement) = (carrier, Some(placement));
        for id in way.into_iter().rev() {
            let old = &self.model.joints[id.0];
            // Of a body with parts that bend only what is left here counts.
            let summed = self.bends_within(id);
            let inertia = if summed { Inertia::default() } else { old.inertia };
            let placement = placement.take().unwrap_or(old.placement);
            self.joints.push(Joint { parent, placement, inertia, ..old.clone() });
            self.summed.push(summed);
            parent = Some(JointId(self.joints.len() - 1));
            self.joint[id.0] = parent;
        }
        parent.expect("a moving link has a joint")
    }

    fn bends_within(&self, body: JointId) -> bool {
        self.bending.iter().any(|b| self.model.links[b.bending.link.0].body == Some(body))
    }

    fn add_inertia(&mut self, body: Option<JointId>, body_from_link: &Pose<f64>, inertia: &Inertia<f64>) {
        if let Some(id) = body.filter(|id| self.summed[id.0]) {
            self.joints[id.0].inertia += body_from_link.inertia_to_parent(inertia);
        }
    }

    /// Puts the parts of the link placed last one behind the other.
    fn split(&mut self, k: usize) {
        let id = self.bending[k].bending.link;
        let (mut body, mut pose) = (self.links[id.0].body, self.links[id.0].body_from_link);
        let Splitting { bending, chain, inertia, .. } = &self.bending[k];
        let (bending, chain, inertia) = (*bending, chain.clone(), inertia.clone());
        let mut parts = vec![(body, pose)];
        for (number, spring) in chain.springs.iter().enumerate() {
            let step = chain.start(number + 1) - chain.start(number);
            self.joints.push(Joint {
                name: VirtualJoint::name(&self.links[id.0].name, number + 1),
                kind: JointKind::Revolute { axis: unit(spring.axis) },
                parent: body,
                placement: pose * shift(chain.along * step),
                inertia: Inertia::default(),
                limits: Limits::NONE,
                mimic: None,
                first_q: 0,
                first_dof: 0,
            });
            self.summed.push(true);
            let joint = JointId(self.joints.len() - 1);
            (body, pose) = (Some(joint), Pose::identity());
            parts.push((body, pose));
            let virtual_joint = VirtualJoint {
                dof: 0,
                link: id,
                number: number + 1,
                axis: spring.axis,
                station: spring.station,
                stiffness: spring.stiffness,
                damping: 0.0,
                following: following(bending),
            };
            self.virtual_joints.push((joint, virtual_joint));
        }
        // The link's own frame and inertia are those of the part that carries its origin.
        let home = if chain.carries_all { chain.springs.len() } else { 0 };
        (self.links[id.0].body, self.links[id.0].body_from_link) = parts[home];
        self.links[id.0].inertia = inertia[home];
        for (part, own) in inertia.iter().enumerate() {
            let (body, pose) = parts[part];
            self.add_inertia(body, &pose, own);
            if part != home && *own != Inertia::default() {
                self.names.push((k, part));
            }
        }
        self.bending[k].parts = parts;
    }

    fn finish(mut self) -> Extended {
        // Parts that have mass are links too, behind all others.
        for (k, part) in core::mem::take(&mut self.names) {
            let split = &self.bending[k];
            let (body, body_from_link) = split.parts[part];
            let link = &self.links[split.bending.link.0];
            let name = format!("{}.part.{part}", link.name);
            let inertia = split.inertia[part];
            let parent = Some(split.bending.link);
            self.links.push(Link { name, parent, body, body_from_link, inertia });
        }
        let (mut nq, mut nv) = (0, 0);
        for joint in self.joints.iter_mut().filter(|j| j.mimic.is_none()) {
            (joint.first_q, joint.first_dof) = (nq, nv);
            nq += joint.kind.nq();
            nv += joint.kind.nv();
        }
        let (mut joints, mut positions) = (vec![0; self.model.nv], vec![0; self.model.nq]);
        for (old, new) in self.model.joints.iter().zip(&self.joint) {
            let new = new.expect("every joint leads to a link");
            if let Some(mimic) = old.mimic {
                let leader = self.joint[mimic.leader.0].expect("every joint leads to a link");
                let first = (self.joints[leader.0].first_q, self.joints[leader.0].first_dof);
                let follower = &mut self.joints[new.0];
                (follower.first_q, follower.first_dof) = first;
                follower.mimic = Some(Mimic { leader, ..mimic });
                continue;
            }
            let here = &self.joints[new.0];
            (0..old.kind.nv()).for_each(|k| joints[old.first_dof + k] = here.first_dof + k);
            (0..old.kind.nq()).for_each(|k| positions[old.first_q + k] = here.first_q + k);
        }
        let virtual_joints = self.virtual_joints.into_iter();
        let virtual_joints = virtual_joints
            .map(|(joint, v)| VirtualJoint { dof: self.joints[joint.0].first_dof, ..v })
            .collect();
        let Model { name, gravity, .. } = self.model;
        let (name, gravity) = (name.clone(), *gravity);
        let model = Model { name, joints: self.joints, links: self.links, gravity, nq, nv };
        Extended { model, joints, positions, virtual_joints }
    }
}

fn shift(by: Vector3<f64>) -> Pose<f64> {
    Pose { translation: by, ..Pose::identity() }
}

fn following(bending: &Bending) -> Following {
    let massless = bending.rods().iter().all(|s| s.mass_per_length == 0.0);
    if massless || bending.quasi_static { Following::QuasiStatic } else { Following::Dynamic }
}
