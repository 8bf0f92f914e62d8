//! A robot some of whose joints are held still.

use alloc::vec::Vec;

use crate::{Coupling, Joint, JointId, JointKind, Model, Place, Pose, Robot, Setting};

impl Model {
    /// The same mechanism with some degrees of freedom held at zero: what they carry is fixed to the body before them,
    /// and joints that mimic them stand still too.
    ///
    /// # Panics
    /// If a degree of freedom belongs to a joint that floats, or is beyond `nv`.
    ///
    /// # Example
    /// The second link of a planar arm, its mass of 1.5 kg at its centre 0.2 m from the joint, held straight:
    /// ```
    /// use sinew_model::samples;
    /// let arm = samples::planar_arm(2, 1.5, 0.4);
    /// let held = arm.held(&[1]);
    /// assert_eq!((held.nv, held.joints[0].inertia.mass), (1, 3.0));
    /// assert_eq!(held.dof_name(0), arm.dof_name(0));
    /// ```
    pub fn held(&self, dofs: &[usize]) -> Model {
        let zero = self.zero_position();
        let mut model = Model { joints: Vec::new(), nq: 0, nv: 0, ..self.clone() };
        // By joint: the body that carries it now (none for the world), and its frame there.
        let mut carried: Vec<(Option<JointId>, Pose<f64>)> = Vec::with_capacity(self.joints.len());
        // By joint: its place among those that are left.
        let mut kept: Vec<Option<JointId>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let is_held = dofs.contains(&joint.first_dof);
            assert!(!is_held || joint.kind != JointKind::Floating, "joint \"{}\" floats", joint.name);
            let (body, place) = joint.parent.map_or((None, Pose::identity()), |p| carried[p.0]);
            if is_held {
                let place = place * joint.pose(&zero);
                if let Some(body) = body {
                    model.joints[body.0].inertia += place.inertia_to_parent(&joint.inertia);
                }
                carried.push((body, place));
                kept.push(None);
            } else {
                let id = JointId(model.joints.len());
                let mimic = joint.mimic.map(|m| {
                    let leader = kept[m.leader.0].expect("what mimics a held joint is held");
                    crate::Mimic { leader, ..m }
                });
                let (first_q, first_dof) = match mimic {
                    Some(m) => (model.joints[m.leader.0].first_q, model.joints[m.leader.0].first_dof),
                    None => (model.nq, model.nv),
                };
                if mimic.is_none() {
                    model.nq += joint.kind.nq();
                    model.nv += joint.kind.nv();
                }
                let placement = place * joint.placement;
                model.joints.push(Joint {
                    parent: body,
                    placement,
                    mimic,
                    first_q,
                    first_dof,
                    ..joint.clone()
                });
                carried.push((Some(id), Pose::identity()));
                kept.push(Some(id));
            }
        }
        for link in &mut model.links {
            if let Some(body) = link.body {
                let (body, place) = carried[body.0];
                (link.body, link.body_from_link) = (body, place * link.body_from_link);
            }
        }
        model
    }
}

impl Robot {
    /// The same robot with some degrees of freedom held at zero. Effects of held joints, of links that no longer move and
    /// of what a held joint would have caused elsewhere are left out; a coupling keeps the joints that move.
    ///
    /// # Panics
    /// As [`Model::held`].
    pub fn held(&self, dofs: &[usize]) -> Robot {
        let model = self.model.held(dofs);
        let moves = |dof: &usize| !dofs.contains(dof);
        let now = |dof: usize| dof - dofs.iter().filter(|&&d| d < dof).count();
        let joints = (0..self.model.nv).filter(moves).map(|dof| self.joints[dof].clone()).collect();
        let couplings = self.couplings.iter().map(|c| {
            let n = c.dofs.len();
            let left: Vec<usize> = (0..n).filter(|&k| moves(&c.dofs[k])).collect();
            let part = |matrix: &[f64]| {
                left.iter().flat_map(|&i| left.iter().map(move |&j| matrix[i * n + j])).collect()
            };
            Coupling {
                dofs: left.iter().map(|&k| now(c.dofs[k])).collect(),
                stiffness: part(&c.stiffness),
                damping: part(&c.damping),
            }
        });
        let couplings = couplings.filter(|c| !c.dofs.is_empty()).collect();
        let stays = |place: &Place| match place {
            Place::Joint(name) => model.dof(name).is_some(),
            Place::Link(name) => model.link(name).is_some_and(|l| model.links[l.0].body.is_some()),
            Place::Robot => true,
        };
        let caused = |from: Option<&Setting>| match from {
            Some(Setting::Word(joint)) => model.dof(joint).is_some(),
            _ => true,
        };
        let effects = self.effects.iter().filter(|e| stays(&e.place) && caused(e.get("from")));
        let effects = effects.cloned().collect();
        let bending = self.bending.clone();
        Robot { model, joints, couplings, bending, effects, tool: self.tool, trust: self.trust }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::{EffectSpec, Inertia, LinkId, samples};

    // World pose of a link at a position, by composing joints.
    fn pose(model: &Model, link: LinkId, q: &[f64]) -> Pose<f64> {
        let link = &model.links[link.0];
        let mut pose = link.body_from_link;
        let mut body = link.body;
        while let Some(id) = body {
            pose = model.joints[id.0].pose(q) * pose;
            body = model.joints[id.0].parent;
        }
        pose
    }

    #[test]
    fn links_stand_where_they_stood_and_no_mass_is_lost() {
        let arm = samples::planar_arm(4, 1.5, 0.4);
        let held = arm.held(&[1, 2]);
        let (q, short) = ([0.3, 0.0, 0.0, -0.7], [0.3, -0.7]);
        assert_eq!((held.nv, held.joints.len()), (2, 2));
        for link in 0..arm.links.len() {
            let (a, b) = (pose(&arm, LinkId(link), &q), pose(&held, LinkId(link), &short));
            assert!((a.translation - b.translation).norm() < 1e-12, "{link}");
        }
        // About the world, all moving bodies together.
        let total = |model: &Model, q: &[f64]| {
            let mut sum = Inertia::<f64>::default();
            for k in 0..model.joints.len() {
                let mut place = Pose::identity();
                let mut body = Some(JointId(k));
                while let Some(id) = body {
                    place = model.joints[id.0].pose(q) * place;
                    body = model.joints[id.0].parent;
                }
                sum += place.inertia_to_parent(&model.joints[k].inertia);
            }
            sum
        };
        let (a, b) = (total(&arm, &q), total(&held, &short));
        assert!((a.mass - b.mass).abs() < 1e-12 && (a.first_moment - b.first_moment).norm() < 1e-12);
        assert!((a.second_moment.zz - b.second_moment.zz).abs() < 1e-12);
    }

    #[test]
    fn what_a_held_joint_has_is_left_out() {
        let mut robot = Robot::rigid(samples::planar_arm(3, 1.5, 0.4));
        let joint = |dof: usize| Place::Joint(robot.model.dof_name(dof).into());
        let effects =
            [0, 1, 2].map(|dof| EffectSpec::new("viscous_friction", joint(dof)).with("viscous", 1.0));
        robot.effects = effects.to_vec();
        robot.couplings.push(Coupling {
            dofs: [0, 1, 2].to_vec(),
            stiffness: (0..9).map(f64::from).collect(),
            damping: [0.0; 9].to_vec(),
        });
        let held = robot.held(&[1]);
        let places: Vec<_> = held.effects.iter().map(|e| e.place.clone()).collect();
        assert_eq!(places, [joint(0), joint(2)]);
        assert_eq!(
            (&held.couplings[0].dofs[..], &held.couplings[0].stiffness[..]),
            (&[0, 1][..], &[0.0, 2.0, 6.0, 8.0][..])
        );
    }

    #[test]
    fn a_held_base_leaves_its_link_with_the_world() {
        let held = samples::planar_arm(2, 1.5, 0.4).held(&[0]);
        assert_eq!((held.nv, held.joints[0].parent), (1, None));
        assert!(held.links[1].body.is_none() && held.links[2].body.is_some());
    }
}
