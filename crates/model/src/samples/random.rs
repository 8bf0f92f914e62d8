//! Seeded random robots and states, for laws that must hold for every robot.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::{Inertia, JointKind, JointShape, JointSpec, Matrix3, Model, ModelBuilder, Pose, Vector3, math};

/// A seeded source of numbers (xorshift64*): the same seed gives the same numbers on every machine.
#[derive(Debug, Clone)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The source with this seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Self { state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 };
        random.uniform(0.0, 1.0);
        random
    }

    /// A number between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        let bits = self.state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        low + (high - low) * bits as f64 / (1_u64 << 53) as f64
    }

    /// `n` numbers between −1 and 1.
    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.uniform(-1.0, 1.0)).collect()
    }

    /// A direction of length one.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::new(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let length = v.norm();
            if (0.1..1.0).contains(&length) {
                return v * (1.0 / length);
            }
        }
    }

    /// A pose within a metre of the origin.
    pub fn pose(&mut self) -> Pose<f64> {
        let rotation = Matrix3::rotation(self.direction(), self.uniform(-3.0, 3.0));
        Pose::new(rotation, self.direction() * self.uniform(0.1, 0.6))
    }

    /// The inertia of four points of mass: always physical.
    pub fn inertia(&mut self) -> Inertia<f64> {
        let mut inertia = Inertia::default();
        for _ in 0..4 {
            inertia += Inertia::point(self.uniform(0.2, 1.0), self.direction() * self.uniform(0.05, 0.3));
        }
        inertia
    }

    /// A position of `model`: angles within ±3 rad, floating bases anywhere within a metre.
    pub fn position(&mut self, model: &Model) -> Vec<f64> {
        let mut q = vec![0.0; model.nq];
        for joint in model.joints.iter().filter(|j| j.mimic.is_none()) {
            let i = joint.first_q;
            if joint.kind == JointKind::Floating {
                let axis = self.direction();
                let half = self.uniform(-1.5, 1.5);
                let (s, c) = (math::sin(half), math::cos(half));
                let place = self.direction();
                q[i..i + 7].copy_from_slice(&[
                    place.x,
                    place.y,
                    place.z,
                    s * axis.x,
                    s * axis.y,
                    s * axis.z,
                    c,
                ]);
            } else {
                q[i] = self.uniform(-3.0, 3.0);
            }
        }
        q
    }
}

/// A random tree of `bodies` bodies with joints of every kind, some of which mimic others and some links fixed to
/// others; the same for the same seed.
pub fn random_tree(bodies: usize, seed: u64) -> Model {
    let random = &mut Random::new(seed);
    let mut builder = ModelBuilder::new("random_tree");
    builder.link("link_0", random.inertia());
    let mut leaders: Vec<String> = Vec::new();
    for k in 1..=bodies {
        // Near the last link, so that trees grow deep.
        let parent = random.uniform((k as f64 - 3.0).max(0.0), k as f64) as usize;
        let (name, child) = (format!("joint_{k}"), format!("link_{k}"));
        let shape = match random.uniform(0.0, 10.0) as usize {
            0 => JointShape::Floating,
            1..=3 => JointShape::Prismatic,
            4 if k > 1 => JointShape::Fixed,
            5 if k > 1 => JointShape::Planar,
            _ => JointShape::Revolute,
        };
        let axis = random.direction().to_array();
        let mut joint =
            JointSpec::new(&name, shape, &format!("link_{parent}"), &child).about(axis).at(random.pose());
        if matches!(shape, JointShape::Revolute | JointShape::Prismatic) {
            if !leaders.is_empty() && random.uniform(0.0, 1.0) < 0.08 {
                let leader = leaders[random.uniform(0.0, leaders.len() as f64) as usize].clone();
                joint.mimic = Some((leader, random.uniform(-2.0, 2.0), random.uniform(-0.5, 0.5)));
            } else {
                leaders.push(name);
            }
        }
        builder.link(&child, random.inertia()).joint(joint);
    }
    builder.build().expect("every link hangs on an earlier one")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_trees_have_joints_of_every_kind() {
        let trees: Vec<_> = (0..40).map(|seed| random_tree(10, seed)).collect();
        let joints: Vec<_> = trees.iter().flat_map(|t| &t.joints).collect();
        assert!(joints.iter().any(|j| j.kind == JointKind::Floating && j.parent.is_some()));
        assert!(joints.iter().any(|j| j.mimic.is_some() && j.kind.slides()));
        assert!(trees.iter().any(|t| !t.has_mimic()) && trees.iter().any(|t| t.joints.len() > 10));
        assert_eq!(trees[3], random_tree(10, 3));
    }
}
