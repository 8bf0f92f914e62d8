//! Rotors that ride on moving links.

use nalgebra::Matrix3;
use sinew_model::{Inertia, JointId, Mechanism, Model, Robot, RotorMount, Scalar, Symmetric3, Vector3};

use crate::FlexJointError;

/// What the link inertias of a robot's description hold of the rotors that ride on the links, beside their masses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpinInertia {
    /// Not their inertia about their own axes: that stands in B alone (De Luca and Book).
    ///
    /// ```text
    /// Mc = M + S B⁻¹ Sᵀ + B of rigid joints
    /// ```
    #[default]
    BesideLinks,
    /// All of it, as if the rotors were locked to the links.
    ///
    /// ```text
    /// Mc = M + B of rigid joints
    /// ```
    InLinks,
}

/// A rotor on a moving link.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rotor {
    /// The degree of freedom it drives.
    pub(crate) dof: usize,
    /// The segment that carries it, as a row of tables whose first is the world's.
    pub(crate) row: usize,
    /// Its axis in the frame of that segment.
    pub(crate) axis: Vector3<f64>,
    /// B/N: angular momentum by rate of the motor, reflected to the link side.
    pub(crate) coupling: f64,
    /// B/N²: its inertia about its axis.
    pub(crate) spin: f64,
    /// 1/N.
    pub(crate) ratio: f64,
}

impl Rotor {
    /// h = B/N² u·ω + B/N θ̇, its angular momentum, about its axis `u` on a link that turns with `w`.
    #[inline(always)]
    pub(crate) fn momentum<S: Scalar>(&self, u: Vector3<S>, w: Vector3<S>, thetad: &[S]) -> S {
        u.dot(w) * self.spin + thetad[self.dof] * self.coupling
    }
    /// n = (τ_m − τ_j)/N u + h ω × u, what its link must hand to it; `swing`: ω × u.
    #[inline(always)]
    pub(crate) fn moment<S: Scalar>(
        &self,
        u: Vector3<S>,
        swing: Vector3<S>,
        momentum: S,
        tau_m: &[S],
        tau_j: &[S],
    ) -> Vector3<S> {
        u * ((tau_m[self.dof] - tau_j[self.dof]) * self.ratio) + swing * momentum
    }
}

/// The rotors of elastic joints that moving links carry, and the bodies without their spin.
pub(crate) fn mount(
    robot: &Robot,
    elastic: &[bool],
    mechanism: &Mechanism,
    spin: SpinInertia,
) -> Result<(Vec<Rotor>, Model), FlexJointError> {
    let (mut rotors, mut links) = (Vec::new(), robot.model.clone());
    for dof in (0..elastic.len()).filter(|&dof| elastic[dof]) {
        let Some(RotorMount { body, axis }) = robot.rotor_mount(dof)? else { continue };
        let settings = &robot.joints[dof];
        let N = settings.gear_ratio.ok_or_else(|| FlexJointError::NoGearRatio {
            joint: robot.model.dof_name(dof).to_owned(),
            carrier: robot.model.body_name(body).to_owned(),
        })?;
        let B = settings.rotor_inertia;
        if spin == SpinInertia::InLinks {
            // I = I − B/N² a aᵀ
            let moment = &mut links.joints[body.0].inertia.second_moment;
            *moment = *moment + outer(axis).scaled(-B / (N * N));
        }
        let axis = mechanism.segments()[body.0].vector_from_link(axis);
        rotors.push(Rotor { dof, row: body.0 + 1, axis, coupling: B / N, spin: B / (N * N), ratio: 1.0 / N });
    }
    for (k, (with, without)) in robot.model.joints.iter().zip(&links.joints).enumerate() {
        let (before, left) = (smallest_moment(&with.inertia), smallest_moment(&without.inertia));
        if left < before.min(0.0) - ROUNDING * trace(&with.inertia) {
            let link = robot.model.body_name(JointId(k)).to_owned();
            return Err(FlexJointError::RotorsOutweighLink { link, got: left });
        }
    }
    Ok((rotors, links))
}

/// Of moments of inertia, relative to their sum.
const ROUNDING: f64 = 1e-12;

fn outer(a: Vector3<f64>) -> Symmetric3<f64> {
    let (x, y, z) = (a.x, a.y, a.z);
    Symmetric3 { xx: x * x, yy: y * y, zz: z * z, xy: x * y, xz: x * z, yz: y * z }
}

fn trace(inertia: &Inertia<f64>) -> f64 {
    let s = inertia.second_moment;
    s.xx + s.yy + s.zz
}

/// The smallest principal moment of inertia about the centre of mass.
fn smallest_moment(inertia: &Inertia<f64>) -> f64 {
    let c = inertia.second_moment_about_centre();
    Matrix3::new(c.xx, c.xy, c.xz, c.xy, c.yy, c.yz, c.xz, c.yz, c.zz).symmetric_eigenvalues().min()
}
