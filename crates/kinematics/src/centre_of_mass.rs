//! The centre of mass of all moving bodies.

use nalgebra::Matrix3xX;
use sinew_model::{Inertia, Model, Scalar, Vector3};

use crate::{Scratch, Workspace};

/// The centre of mass of all moving bodies in the world, m.
///
/// ```text
/// c = Σ (m p + R h) / Σ m
/// ```
///
/// `q`: nq, rad (m). What is fixed to the world does not count; a robot without mass gives numbers that are not
/// finite. Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
///
/// # Example
/// The middle of a level chain of two one-metre rods:
/// ```
/// let arm = sinew_model::samples::planar_arm(2, 3.0, 1.0);
/// assert_eq!(sinew_kinematics::centre_of_mass(&arm, &[0.0, 0.0]).x, 1.0);
/// ```
pub fn centre_of_mass(model: &Model, q: &[f64]) -> Vector3<f64> {
    let inertia: Vec<_> = model.joints.iter().map(|j| j.inertia).collect();
    centre_of_mass_with(model, &inertia, &mut Workspace::new(model), q)
}

/// [`centre_of_mass`] for any kind of number, with the inertias given, one a joint, without allocation.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn centre_of_mass_with<S: Scalar>(
    model: &Model,
    inertia: &[Inertia<S>],
    ws: &mut Scratch<S>,
    q: &[S],
) -> Vector3<S> {
    assert_eq!(inertia.len(), model.joints.len(), "inertia");
    crate::body_poses_with(model, q, &mut ws.world_from_body);
    let (mut mass, mut moment) = (S::ZERO, Vector3::ZERO);
    for (pose, i) in ws.world_from_body.iter().zip(inertia) {
        mass += i.mass;
        moment += pose.translation * i.mass + pose.rotation * i.first_moment;
    }
    moment * mass.recip()
}

/// How the centre of mass moves with the joints, 3 × nv.
///
/// ```text
/// ċ = J_c(q) q̇
/// ```
///
/// `q`: nq, rad (m). Cost O(n · depth).
///
/// # Panics
/// If `q` has the wrong length.
pub fn centre_of_mass_jacobian(model: &Model, q: &[f64]) -> Matrix3xX<f64> {
    let poses = crate::body_poses(model, q);
    let total: f64 = model.joints.iter().map(|j| j.inertia.mass).sum();
    let mut J = Matrix3xX::zeros(model.nv);
    for (i, carried) in model.joints.iter().enumerate() {
        // share of one body: m ċ_i = Σ m v_k + ω_k × m c_i
        let mass = carried.inertia.mass / total;
        let moment =
            (poses[i].rotation * carried.inertia.first_moment) * (1.0 / total) + poses[i].translation * mass;
        let mut body = Some(i);
        while let Some(j) = body {
            let joint = &model.joints[j];
            for k in 0..joint.kind.nv() {
                let s = poses[j].motion_to_parent(joint.kind.motion(k, joint.multiplier()));
                let v = s.linear * mass + s.angular.cross(moment);
                let mut column = J.column_mut(joint.first_dof + k);
                column += nalgebra::Vector3::from(v.to_array());
            }
            body = joint.parent.map(|p| p.0);
        }
    }
    J
}
