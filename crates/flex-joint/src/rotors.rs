//! Rotors that ride on moving links.

use nalgebra::Matrix3;
use sinew_model::{
    Inertia, Joint, JointId, JointKind, Link, Mechanism, Model, Robot, Scalar, Symmetric3, Vector3,
};

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
        let Some((body, axis)) = axis_in_body(robot, dof)? else { continue };
        let settings = &robot.joints[dof];
        let N = settings.gear_ratio.ok_or_else(|| FlexJointError::NoGearRatio {
            joint: robot.model.dof_name(dof).to_owned(),
            carrier: body_name(&robot.model, body).to_owned(),
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
            let link = body_name(&robot.model, JointId(k)).to_owned();
            return Err(FlexJointError::RotorsOutweighLink { link, got: left });
        }
    }
    Ok((rotors, links))
}

/// Of moments of inertia, relative to their sum.
const ROUNDING: f64 = 1e-12;

/// The body that carries the rotor of a degree of freedom and the rotor's unit axis in it; none where that is the world.
fn axis_in_body(robot: &Robot, dof: usize) -> Result<Option<(JointId, Vector3<f64>)>, FlexJointError> {
    let (model, settings) = (&robot.model, &robot.joints[dof]);
    let joint = &model.joints[model.joint_of_dof(dof).0];
    let carrier = settings.carried_by.map(|link| &model.links[link.0]);
    let Some(body) = carrier.map_or(joint.parent, |link| link.body) else { return Ok(None) };
    let unknown =
        |reason: String, help| Err(FlexJointError::NoRotorAxis { joint: joint.name.clone(), reason, help });
    let axis = match (settings.rotor_axis, carrier) {
        (Some(axis), Some(link)) => link.body_from_link.rotation * Vector3::from(axis),
        (Some(axis), None) => {
            let mut frames = model.links.iter().filter(|link| link.body == Some(body));
            let first = frames.next().map_or(joint.placement.rotation, |link| link.body_from_link.rotation);
            let differs = |link: &Link| link.body_from_link.rotation != first;
            if frames.any(differs) {
                let reason = format!("body \"{}\" has links in several directions", body_name(model, body));
                return unknown(reason, "`carried_by`, the link in whose frame `rotor_axis` is told,");
            }
            first * Vector3::from(axis)
        }
        (None, _) if joint.parent == Some(body) => joint.placement.rotation * joint_axis(joint),
        (None, _) => {
            let reason = format!("\"{}\" does not carry the joint itself", body_name(model, body));
            return unknown(reason, "`rotor_axis`, in the frame of the carrying link,");
        }
    };
    let length = axis.norm();
    if !(length > 0.0 && length.is_finite()) {
        return unknown("it has no direction".to_owned(), "`rotor_axis`");
    }
    Ok(Some((body, axis * (1.0 / length))))
}

fn joint_axis(joint: &Joint) -> Vector3<f64> {
    match joint.kind {
        JointKind::Revolute { axis } | JointKind::Prismatic { axis } => axis,
        JointKind::Floating => Vector3::ZERO,
    }
}

fn body_name(model: &Model, body: JointId) -> &str {
    let link = model.links.iter().find(|link| link.body == Some(body));
    link.map_or(&model.joints[body.0].name, |link| &link.name)
}

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
