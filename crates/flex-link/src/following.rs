//! Which virtual joints swing, and how they are damped.

use nalgebra::DMatrix;
use sinew_model::{Extended, Following, Robot, VirtualJoint};
use sinew_rigid::mass_matrix;

// Inertia that a joint keeps while all others are free, relative to what it has while they are locked, below which it
// has none.
const MASSLESS: f64 = 1e-10;

/// Finds the virtual joints without inertia and gives each axis of each link its damping.
pub(crate) fn settle(robot: &Robot, extended: &mut Extended) {
    let model = &extended.model;
    let M = mass_matrix(model, &model.zero_position());
    massless(robot, &M, extended);
    damping(robot, &M, extended);
}

// The axis of a link to which a virtual joint belongs.
fn same_axis(extended: &Extended, k: usize, other: usize) -> bool {
    let (a, b) = (&extended.virtual_joints[k], &extended.virtual_joints[other]);
    a.link == b.link && a.axis == b.axis
}

/// A virtual joint that can move without moving any mass, other joints moving as they like, follows its load; and with
/// it the others of its axis.
fn massless(robot: &Robot, M: &DMatrix<f64>, extended: &mut Extended) {
    // Elimination of M with the rotors of rigid joints: what is left on the diagonal is the inertia of a joint while
    // those before it are free.
    let mut rest = M.clone();
    for (k, (joint, &dof)) in robot.joints.iter().zip(&extended.joints).enumerate() {
        if joint.stiffness.is_none() && !robot.couplings.iter().any(|c| c.dofs.contains(&k)) {
            rest[(dof, dof)] += joint.rotor_inertia;
        }
    }
    let mut order = extended.joints.clone();
    let dynamic = |v: &&VirtualJoint| v.following == Following::Dynamic;
    order.extend(extended.virtual_joints.iter().filter(dynamic).map(|v| v.dof));
    for (place, &k) in order.iter().enumerate() {
        let pivot = rest[(k, k)];
        if pivot <= MASSLESS * M[(k, k)] || pivot <= 0.0 {
            if let Some(own) = extended.virtual_joints.iter().position(|v| v.dof == k) {
                for other in 0..extended.virtual_joints.len() {
                    if same_axis(extended, own, other) {
                        extended.virtual_joints[other].following = Following::QuasiStatic;
                    }
                }
            }
            continue;
        }
        for &i in &order[place + 1..] {
            let factor = rest[(i, k)] / pivot;
            for &j in &order[place + 1..] {
                let change = factor * rest[(k, j)];
                rest[(i, j)] -= change;
            }
        }
    }
}

/// Damping in proportion to stiffness, so that the first mode of each axis has the link's ratio.
///
/// ```text
/// D = (2ζ/ω₁) K,   ω₁ of K φ = ω² M φ
/// ```
///
/// M and K are those of the axis alone: the link clamped at its root, everything it carries rigid, all joints at zero.
fn damping(robot: &Robot, M: &DMatrix<f64>, extended: &mut Extended) {
    for k in 0..extended.virtual_joints.len() {
        let all = 0..extended.virtual_joints.len();
        let group: Vec<usize> = all.filter(|&other| same_axis(extended, k, other)).collect();
        if group[0] != k {
            continue;
        }
        let link = extended.virtual_joints[k].link;
        let ratio = robot.bending.iter().find(|b| b.link == link).map_or(0.0, |b| b.damping_ratio);
        let joint = |k: usize| &extended.virtual_joints[group[k]];
        // 1/ω² are the eigenvalues of K^(−½) M K^(−½), which may be zero but not infinite
        let scaled = DMatrix::from_fn(group.len(), group.len(), |i, j| {
            M[(joint(i).dof, joint(j).dof)] / (joint(i).stiffness * joint(j).stiffness).sqrt()
        });
        let slowest = scaled.symmetric_eigenvalues().max().max(0.0).sqrt();
        for &member in &group {
            let v = &mut extended.virtual_joints[member];
            v.damping = 2.0 * ratio * slowest * v.stiffness;
        }
    }
}
