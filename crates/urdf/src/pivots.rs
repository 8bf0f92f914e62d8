//! Whether the mass matrix is regular: the pivots of the articulated-body algorithm.

use sinew_model::{ArticulatedInertia, JointId, JointKind, Model};

// A pivot below this share of the largest diagonal element is rounding.
const ROUNDING: f64 = 1e-15;

/// The first joint whose pivot vanishes in every tried configuration, so that the mass matrix is singular.
///
/// ```text
/// d = Sᵀ I^A S + B
/// ```
///
/// `rotor`: B of each degree of freedom that a rotor moves rigidly with the joint, kg·m². A joint that others mimic
/// moves their inertia as well and is let through; so is a floating joint whose body has mass.
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 7.3.
pub(crate) fn joint_without_inertia(model: &Model, rotor: &[f64]) -> Option<JointId> {
    // Bodies may line up at zero: a second, generic configuration tells.
    let mut generic = model.zero_position();
    for joint in model.joints.iter().filter(|j| j.kind.nq() == 1) {
        generic[joint.first_q] = 0.3 + 0.7 * joint.first_q as f64;
    }
    let at_zero = pivots(model, &model.zero_position(), rotor);
    let elsewhere = pivots(model, &generic, rotor);
    let largest = at_zero.iter().chain(&elsewhere).fold(0.0f64, |m, (_, own)| m.max(*own));
    let leads = |k: usize| model.joints.iter().any(|j| j.mimic.is_some_and(|m| m.leader == JointId(k)));
    let vanishes = |k: usize| at_zero[k].0.max(elsewhere[k].0) <= ROUNDING * largest;
    let counts = |k: usize| model.joints[k].mimic.is_none() && !leads(k);
    (0..model.joints.len()).rev().find(|k| counts(*k) && vanishes(*k)).map(JointId)
}

// Each joint's pivot, and its share of the rigid subtree's inertia for scale.
fn pivots(model: &Model, q: &[f64], rotor: &[f64]) -> Vec<(f64, f64)> {
    let count = model.joints.len();
    let bodies = || model.joints.iter().map(|j| ArticulatedInertia::rigid(&j.inertia)).collect::<Vec<_>>();
    let (mut articulated, mut composite) = (bodies(), bodies());
    let mut pivots = vec![(0.0, 0.0); count];
    for k in (0..count).rev() {
        let joint = &model.joints[k];
        let mut passed = Some(articulated[k]);
        if joint.kind == JointKind::Floating {
            // It passes nothing on; its own pivots stand or fall with the mass.
            pivots[k] = (articulated[k].linear.xx, articulated[k].linear.xx);
            passed = None;
        } else if joint.mimic.is_none() {
            let s = joint.axis::<f64>();
            let b = rotor[joint.first_dof];
            // u = I^A S,   d = Sᵀ u + B
            let u = articulated[k].times(s);
            let d = u.dot(s) + b;
            pivots[k] = (d, composite[k].times(s).dot(s) + b);
            if d > 0.0 {
                passed = Some(articulated[k].without(u, 1.0 / d));
            }
        }
        if let Some(parent) = joint.parent {
            let pose = joint.pose(q);
            composite[parent.0] = composite[parent.0].plus(&composite[k].to_parent(&pose));
            if let Some(passed) = passed {
                articulated[parent.0] = articulated[parent.0].plus(&passed.to_parent(&pose));
            }
        }
    }
    pivots
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::{Inertia, JointShape, JointSpec, ModelBuilder, Pose, Vector3, samples};

    #[test]
    fn an_arm_with_inertia_everywhere_is_regular() {
        assert_eq!(joint_without_inertia(&samples::planar_arm(5, 1.0, 0.3), &[0.0; 5]), None);
    }

    #[test]
    fn a_massless_last_link_is_singular_until_a_rotor_turns_with_it() {
        let mut builder = ModelBuilder::new("arm");
        builder
            .link("base", Inertia::default())
            .link("rod", Inertia::point(1.0, Vector3::new(0.5, 0.0, 0.0)));
        builder.link("tip", Inertia::default());
        builder.joint(JointSpec::new("a", JointShape::Revolute, "base", "rod"));
        builder.joint(JointSpec::new("b", JointShape::Revolute, "rod", "tip"));
        let model = builder.build().unwrap();
        assert_eq!(joint_without_inertia(&model, &[0.0, 0.0]), Some(JointId(1)));
        assert_eq!(joint_without_inertia(&model, &[0.0, 1e-3]), None);
    }

    #[test]
    fn two_joints_on_one_line_with_nothing_between_are_singular() {
        let mut builder = ModelBuilder::new("arm");
        builder.link("base", Inertia::default()).link("ring", Inertia::default());
        builder.link("rod", Inertia::point(1.0, Vector3::new(0.5, 0.0, 0.0)));
        builder.joint(JointSpec::new("a", JointShape::Revolute, "base", "ring"));
        let lifted = Pose::from_xyz_rpy([0.0, 0.0, 0.2], [0.0; 3]);
        builder.joint(JointSpec::new("b", JointShape::Revolute, "ring", "rod").at(lifted));
        assert_eq!(joint_without_inertia(&builder.build().unwrap(), &[0.0; 2]), Some(JointId(0)));
    }

    #[test]
    fn a_planar_joint_with_massless_slides_is_regular() {
        let mut builder = ModelBuilder::new("cart");
        let body =
            Inertia::at_centre_of_mass(1.0, Vector3::new(0.1, 0.0, 0.0), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        builder.link("floor", Inertia::default()).link("cart", body);
        builder.joint(JointSpec::new("a", JointShape::Planar, "floor", "cart"));
        assert_eq!(joint_without_inertia(&builder.build().unwrap(), &[0.0; 3]), None);
    }
}
