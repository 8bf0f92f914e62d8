//! Forward dynamics' share of the rotors of the complete model, each link in its own axes, where a rotor's axis never turns.

use sinew_model::{Matrix3, Scalar, Segment, SegmentKind, Vector3};

use crate::{ElasticJoints, Scratch};

/// How a segment turns, and what the rotors in its subtree take, in its own axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ride<S> {
    /// Parent from segment.
    rotation: Matrix3<S>,
    /// ω.
    velocity: Vector3<S>,
    /// ω_parent × (ω − ω_parent).
    swung: Vector3<S>,
    /// α.
    acceleration: Vector3<S>,
    /// n, the moment that the segment and its subtree must hand to the rotors.
    moment: Vector3<S>,
}

impl<S: Scalar> Ride<S> {
    pub(crate) fn still() -> Self {
        let o = Vector3::ZERO;
        Self { rotation: Matrix3::identity(), velocity: o, swung: o, acceleration: o, moment: o }
    }
}

impl ElasticJoints {
    /// Takes the moments that the rotors need from the torques of the joints, `ws.tau`.
    ///
    /// ```text
    /// ω = R ω_parent + z q̇,   n = Σ (τ_m − τ_j)/N u + h ω × u,   h = B/N (u·ω/N + θ̇)
    /// τ = τ − z·n,   n_parent = n_parent + Rᵀ n
    /// ```
    #[inline(always)]
    pub(crate) fn ride<S: Scalar>(&self, ws: &mut Scratch<S>, q: &[S], qd: &[S], thetad: &[S], tau_m: &[S]) {
        let Scratch { at, ride, tau, tau_j, .. } = ws;
        let segments = self.mechanism.segments();
        self.mechanism.read(q, at);
        for &k in &self.carriers {
            let segment = &segments[k];
            let own = turning(segment, qd);
            // ω = R ω_parent + z q̇
            let rotation = self.mechanism.pose(k, q, at).rotation;
            let (velocity, swung) = match segment.parent {
                0 => (own, Vector3::ZERO),
                parent => {
                    let before = rotation.transpose_mul(ride[parent].velocity);
                    (before + own, before.cross(own))
                }
            };
            ride[k + 1] =
                Ride { rotation, velocity, swung, acceleration: Vector3::ZERO, moment: Vector3::ZERO };
        }
        for rotor in &self.rotors {
            let (u, on) = (Vector3::constant(rotor.axis), &mut ride[rotor.row]);
            // n = (τ_m − τ_j)/N u + h ω × u
            let along = (tau_m[rotor.dof] - tau_j[rotor.dof]) * rotor.ratio;
            let momentum = u.dot(on.velocity) * rotor.spin + thetad[rotor.dof] * rotor.coupling;
            on.moment += u * along + on.velocity.cross(u) * momentum;
        }
        for &k in self.carriers.iter().rev() {
            let (segment, Ride { rotation, moment: n, .. }) = (&segments[k], ride[k + 1]);
            // τ = τ − z·n
            match segment.kind {
                SegmentKind::Turning => tau[segment.first_dof] -= n.z * segment.ratio,
                SegmentKind::Sliding => {}
                SegmentKind::Free => {
                    let dof = segment.first_dof;
                    (tau[dof], tau[dof + 1], tau[dof + 2]) =
                        (tau[dof] - n.x, tau[dof + 1] - n.y, tau[dof + 2] - n.z);
                }
            }
            if segment.parent > 0 {
                ride[segment.parent].moment += rotation * n;
            }
        }
    }

    /// What the links' accelerations take from those of the rotors they carry.
    ///
    /// ```text
    /// α = R α_parent + ω_parent × (ω − ω_parent) + z q̈,   θ̈ = θ̈ − u·α/N
    /// ```
    #[inline(always)]
    pub(crate) fn swing_rotors<S: Scalar>(&self, ws: &mut Scratch<S>, qdd: &[S], thetadd: &mut [S]) {
        let ride = &mut ws.ride;
        for &k in &self.carriers {
            let segment = &self.mechanism.segments()[k];
            let own = turning(segment, qdd);
            ride[k + 1].acceleration = match segment.parent {
                0 => own,
                parent => {
                    ride[k + 1].rotation.transpose_mul(ride[parent].acceleration) + ride[k + 1].swung + own
                }
            };
        }
        for rotor in &self.rotors {
            let u = Vector3::constant(rotor.axis);
            thetadd[rotor.dof] -= u.dot(ride[rotor.row].acceleration) * rotor.ratio;
        }
    }
}

// Σ z x over the axes of a segment, in its own axes.
#[inline(always)]
fn turning<S: Scalar>(segment: &Segment, x: &[S]) -> Vector3<S> {
    let dof = segment.first_dof;
    match segment.kind {
        SegmentKind::Turning => Vector3::new(S::ZERO, S::ZERO, x[dof] * segment.ratio),
        SegmentKind::Sliding => Vector3::ZERO,
        SegmentKind::Free => Vector3::new(x[dof], x[dof + 1], x[dof + 2]),
    }
}
