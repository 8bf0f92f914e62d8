//! The rotors of the complete model on the turning links: all in the world's axes, where moments only add.

use nalgebra::DMatrix;
use sinew_model::{Matrix3, Scalar, Segment, SegmentKind, Vector3};

use crate::rotors::Rotor;
use crate::{ElasticJoints, Scratch};

/// How a segment turns, and what the rotors in its subtree take.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn<S> {
    pub(crate) rotation: Matrix3<S>,
    /// ω.
    pub(crate) velocity: Vector3<S>,
    /// α.
    pub(crate) acceleration: Vector3<S>,
    /// n, the moment that the segment and its subtree must hand to the rotors.
    pub(crate) moment: Vector3<S>,
    /// ∂n/∂ω where everything before the segment turns.
    pub(crate) slope: Matrix3<S>,
}

impl<S: Scalar> Turn<S> {
    pub(crate) fn still() -> Self {
        let o = Vector3::ZERO;
        let slope = Matrix3 { rows: [o; 3] };
        Self { rotation: Matrix3::identity(), velocity: o, acceleration: o, moment: o, slope }
    }
}

/// A rotor in the world's axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spin<S> {
    /// u, its axis.
    pub(crate) axis: Vector3<S>,
    /// ω × u.
    pub(crate) swing: Vector3<S>,
    /// h = B/N² u·ω + B/N θ̇, its angular momentum.
    pub(crate) momentum: S,
}

impl<S: Scalar> Spin<S> {
    pub(crate) fn still() -> Self {
        Self { axis: Vector3::ZERO, swing: Vector3::ZERO, momentum: S::ZERO }
    }
}

impl ElasticJoints {
    /// The inertial coupling between links and rotors, nv × nv, kg·m² (kg·m): row: link, column: motor.
    ///
    /// ```text
    /// T = ½ q̇ᵀ Mc(q) q̇ + q̇ᵀ S(q) θ̇ + ½ θ̇ᵀ B θ̇,   S_ki = B_i/N_i a_iᵀ J_ω,carrier(i),k
    /// ```
    ///
    /// `q`: nq, rad (m). Zero in the reduced model, in columns of rigid joints, and of rotors that the base carries.
    ///
    /// # Panics
    /// If `q` has the wrong length.
    ///
    /// # Example
    /// A rotor of 0.02 kg·m² (reflected, gear ratio 10) on the first of two parallel links turns with that link:
    /// ```
    /// use sinew_flex_joint::{ElasticJoints, SpinInertia};
    /// use sinew_model::{Robot, samples::planar_arm};
    /// let mut robot = Robot::rigid(planar_arm(2, 1.5, 0.4));
    /// for joint in &mut robot.joints {
    ///     (joint.stiffness, joint.rotor_inertia, joint.gear_ratio) = (Some(100.0), 0.02, Some(10.0));
    /// }
    /// let S = ElasticJoints::complete(&robot, SpinInertia::BesideLinks)?.rotor_coupling(&[0.3, 0.4]);
    /// approx::assert_relative_eq!(S[(0, 1)], 0.02 / 10.0, max_relative = 1e-12);
    /// assert_eq!([S[(0, 0)], S[(1, 0)], S[(1, 1)]], [0.0; 3]);
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    /// Source: De Luca, Book, *Robots with flexible elements*, Springer Handbook of Robotics, 2nd ed., 2016, chapter 11.
    pub fn rotor_coupling(&self, q: &[f64]) -> DMatrix<f64> {
        let nv = self.model.nv;
        assert_eq!(q.len(), self.model.nq, "q");
        let mut ws = Scratch::<f64>::new(self);
        self.turn(&mut ws, q, &vec![0.0; nv]);
        let mut S = DMatrix::zeros(nv, nv);
        for rotor in &self.rotors {
            let u = ws.turn[rotor.row].rotation * rotor.axis;
            self.each_axis_below(&ws.turn, rotor.row, |dof, z| {
                S[(dof, rotor.dof)] += z.dot(u) * rotor.coupling;
            });
        }
        S
    }

    /// The mass matrix that the links show, nv × nv, kg·m²: with what rotors add to it.
    ///
    /// ```text
    /// reduced: M + B of rigid joints;   complete: Mc
    /// ```
    ///
    /// `q`: nq, rad (m). With S of [`ElasticJoints::rotor_coupling`] and B the kinetic energy of everything.
    ///
    /// # Panics
    /// If `q` has the wrong length.
    pub fn link_mass_matrix(&self, q: &[f64]) -> DMatrix<f64> {
        let mut M = sinew_rigid::mass_matrix(&self.links, q);
        for dof in (0..self.model.nv).filter(|&dof| !self.elastic[dof]) {
            M[(dof, dof)] += self.rotor_inertia[dof];
        }
        // links without the spin of their rotors: S B⁻¹ Sᵀ in both readings
        let S = self.rotor_coupling(q);
        for rotor in &self.rotors {
            let column = S.column(rotor.dof);
            M += column * column.transpose() / self.rotor_inertia[rotor.dof];
        }
        M
    }

    /// Rotations and angular velocities of the segments that carry rotors.
    #[inline(always)]
    pub(crate) fn turn<S: Scalar>(&self, ws: &mut Scratch<S>, q: &[S], qd: &[S]) {
        let Scratch { at, turn, .. } = ws;
        self.mechanism.read(q, at);
        for &k in &self.carriers {
            let segment = &self.mechanism.segments()[k];
            let own = self.mechanism.pose(k, q, at).rotation;
            let rotation = if segment.parent == 0 { own } else { turn[segment.parent].rotation * own };
            let velocity = turn[segment.parent].velocity + turned(segment, &rotation, qd);
            (turn[k + 1].rotation, turn[k + 1].velocity) = (rotation, velocity);
        }
    }

    /// Axes and momenta of the rotors.
    #[inline(always)]
    pub(crate) fn spin<S: Scalar>(&self, ws: &mut Scratch<S>, thetad: &[S]) {
        for (rotor, spin) in self.rotors.iter().zip(&mut ws.spin) {
            let Turn { rotation, velocity, .. } = &ws.turn[rotor.row];
            let u = *rotation * Vector3::constant(rotor.axis);
            spin.axis = u;
            spin.swing = velocity.cross(u);
            spin.momentum = rotor.momentum(u, *velocity, thetad);
        }
    }

    /// Takes the moments that the rotors need from the joints' torques; those of segments become those of subtrees.
    #[inline(always)]
    pub(crate) fn hand_moments_down<S: Scalar>(&self, turn: &mut [Turn<S>], tau: &mut [S]) {
        for &k in self.carriers.iter().rev() {
            let segment = &self.mechanism.segments()[k];
            // τ = τ − z·n
            along_axes(segment, &turn[k + 1], |dof, torque| tau[dof] -= torque);
            let n = turn[k + 1].moment;
            turn[segment.parent].moment += n;
        }
    }

    /// Angular accelerations of the segments that carry rotors.
    ///
    /// ```text
    /// α = α_parent + ω_parent × (ω − ω_parent) + z q̈
    /// ```
    #[inline(always)]
    pub(crate) fn accelerate<S: Scalar>(&self, turn: &mut [Turn<S>], qdd: &[S]) {
        for &k in &self.carriers {
            let segment = &self.mechanism.segments()[k];
            let (parent, own) = (&turn[segment.parent], &turn[k + 1]);
            let swung = parent.velocity.cross(own.velocity);
            let acceleration = parent.acceleration + swung + turned(segment, &own.rotation, qdd);
            turn[k + 1].acceleration = acceleration;
        }
    }

    /// Calls `f` with the degree of freedom and the axis of every joint that turns the segment of `row`.
    #[inline(always)]
    pub(crate) fn each_axis_below<S: Scalar>(
        &self,
        turn: &[Turn<S>],
        mut row: usize,
        mut f: impl FnMut(usize, Vector3<S>),
    ) {
        while row > 0 {
            let segment = &self.mechanism.segments()[row - 1];
            for l in 0..turning_axes(segment) {
                f(segment.first_dof + l, axis(segment, l, &turn[row].rotation));
            }
            row = segment.parent;
        }
    }

    /// True if some rotor rides on a moving link.
    pub(crate) fn has_moving_rotors(&self) -> bool {
        !self.rotors.is_empty()
    }
}

/// The segments that carry rotors and those that carry them, in order.
pub(crate) fn carriers(segments: &[Segment], rotors: &[Rotor]) -> Vec<usize> {
    let mut carries = vec![false; segments.len() + 1];
    for rotor in rotors {
        let mut row = rotor.row;
        while row > 0 {
            carries[row] = true;
            row = segments[row - 1].parent;
        }
    }
    (0..segments.len()).filter(|&k| carries[k + 1]).collect()
}

/// Calls `f` with each degree of freedom that turns a segment and the component of its moment along it.
#[inline(always)]
pub(crate) fn along_axes<S: Scalar>(segment: &Segment, turn: &Turn<S>, mut f: impl FnMut(usize, S)) {
    for l in 0..turning_axes(segment) {
        f(segment.first_dof + l, axis(segment, l, &turn.rotation).dot(turn.moment));
    }
}

/// Axes of a segment that turn it.
#[inline(always)]
pub(crate) fn turning_axes(segment: &Segment) -> usize {
    match segment.kind {
        SegmentKind::Turning => 1,
        SegmentKind::Sliding => 0,
        SegmentKind::Free => 3,
    }
}

/// Axis `l` of a segment with this rotation.
#[inline(always)]
pub(crate) fn axis<S: Scalar>(segment: &Segment, l: usize, rotation: &Matrix3<S>) -> Vector3<S> {
    let [a, b, c] = rotation.rows;
    match (segment.kind, l) {
        (SegmentKind::Turning, _) => Vector3::new(a.z, b.z, c.z) * S::constant(segment.ratio),
        (SegmentKind::Sliding, _) => Vector3::ZERO,
        (SegmentKind::Free, 0) => Vector3::new(a.x, b.x, c.x),
        (SegmentKind::Free, 1) => Vector3::new(a.y, b.y, c.y),
        (SegmentKind::Free, _) => Vector3::new(a.z, b.z, c.z),
    }
}

/// Σ z x over the axes of a segment.
#[inline(always)]
fn turned<S: Scalar>(segment: &Segment, rotation: &Matrix3<S>, x: &[S]) -> Vector3<S> {
    let dof = segment.first_dof;
    match segment.kind {
        SegmentKind::Turning => {
            let [a, b, c] = rotation.rows;
            Vector3::new(a.z, b.z, c.z) * (x[dof] * segment.ratio)
        }
        SegmentKind::Sliding => Vector3::ZERO,
        SegmentKind::Free => *rotation * Vector3::new(x[dof], x[dof + 1], x[dof + 2]),
    }
}
