//! The centre of mass of all moving bodies.

use alloc::vec::Vec;

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
pub fn centre_of_mass_with<S: Scalar>(
    model: &Model,
    inertia: &[Inertia<S>],
    ws: &mut Scratch<S>,
    q: &[S],
) -> Vector3<S> {
    assert_eq!(inertia.len(), model.joints.len(), "inertia");
    ws.poses(model, q);
    let (mut mass, mut moment) = (S::ZERO, Vector3::ZERO);
    let rows = ws.mechanism.segments().iter().zip(&ws.world[1..]);
    for ((segment, pose), i) in rows.zip(inertia) {
        mass += i.mass;
        moment += pose.translation * i.mass + pose.rotation * segment.vector_from_link(i.first_moment);
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
    let mut J = Matrix3xX::zeros(model.nv);
    let inertia: Vec<_> = model.joints.iter().map(|j| j.inertia).collect();
    centre_of_mass_jacobian_with(model, &inertia, &mut Workspace::new(model), q, J.as_mut_slice());
    J
}

/// [`centre_of_mass_jacobian`] for any kind of number, with the inertias given, one a joint, without allocation, into
/// the 3 × nv numbers of `J` by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn centre_of_mass_jacobian_with<S: Scalar>(
    model: &Model,
    inertia: &[Inertia<S>],
    ws: &mut Scratch<S>,
    q: &[S],
    J: &mut [S],
) {
    assert_eq!((inertia.len(), J.len()), (model.joints.len(), 3 * model.nv), "inertia, J");
    ws.poses(model, q);
    J.fill(S::ZERO);
    let segments = ws.mechanism.segments();
    let total = inertia.iter().fold(S::ZERO, |sum, i| sum + i.mass);
    for (carried, i) in inertia.iter().enumerate() {
        // share of one body: m ċ_i = Σ m v_k + ω_k × m c_i
        let pose = &ws.world[carried + 1];
        let first_moment = segments[carried].vector_from_link(i.first_moment);
        let mass = i.mass / total;
        let moment = (pose.rotation * first_moment) * total.recip() + pose.translation * mass;
        let mut row = carried + 1;
        while row > 0 {
            let segment = &segments[row - 1];
            for k in 0..segment.nv() {
                let s = segment.axis(k, &ws.world[row]);
                let v = s.linear * mass + s.angular.cross(moment);
                let first = 3 * (segment.first_dof + k);
                for (entry, x) in J[first..first + 3].iter_mut().zip(v.to_array()) {
                    *entry += x;
                }
            }
            row = segment.parent;
        }
    }
}
