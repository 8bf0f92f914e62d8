//! Accelerations of links and motors under motor torques.

use nalgebra::DVector;
use sinew_model::{Force, JointId, Scalar, Vector3, wide_forms};
use sinew_rigid::{
    BodyAccelerations, MovingBodies, forward_dynamics_under_into, forward_dynamics_under_with,
};

use crate::{ElasticJoints, Scratch, Workspace};

impl ElasticJoints {
    /// Accelerations of links and motors that the motor torques `tau_m` produce.
    ///
    /// ```text
    /// q̈ = M⁻¹ (τ_j − C q̇ − g),   θ̈ = B⁻¹ (τ_m − τ_j);   in rigid joints q̈ = θ̈ with B on M's diagonal
    /// ```
    ///
    /// `q`: nq, rad (m). `qd`, `theta`, `thetad`, `tau_m`: nv. Returns (q̈, θ̈): nv each. Cost O(n), in the complete model
    /// too: a rotor is free to turn, so its moment on the link that carries it, (τ_m − τ_j)/N about its axis u and its
    /// gyroscopic h ω × u, is known before any acceleration is:
    ///
    /// ```text
    /// M q̈ + C q̇ + g + Σ J_ωᵀ [(τ_m − τ_j)/N u + h ω × u] = τ_j,   B θ̈ = τ_m − τ_j − B/N u·α
    /// ```
    ///
    /// with M of the links without the spin of their rotors, and h = B/N (u·ω/N + θ̇).
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// A motor that is pushed with 1 N·m from rest turns alone at first:
    /// ```
    /// # use sinew_flex_joint::ElasticJoints;
    /// # use sinew_model::{Robot, samples};
    /// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    /// robot.joints[0].stiffness = Some(150.0);
    /// robot.joints[0].rotor_inertia = 0.05;
    /// let arm = ElasticJoints::new(&robot)?;
    /// let (qdd, thetadd) = arm.forward_dynamics(&[0.0], &[0.0], &[0.0], &[0.0], &[1.0]);
    /// assert_eq!((qdd[0], thetadd[0]), (0.0, 1.0 / 0.05));
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    /// Source: Spong, *ASME J. Dynamic Systems, Measurement, and Control* 109(4), 1987.
    pub fn forward_dynamics(
        &self,
        q: &[f64],
        qd: &[f64],
        theta: &[f64],
        thetad: &[f64],
        tau_m: &[f64],
    ) -> (DVector<f64>, DVector<f64>) {
        let (mut qdd, mut thetadd) = (DVector::zeros(self.model.nv), DVector::zeros(self.model.nv));
        let ws = &mut Workspace::new(self);
        let (into_qdd, into_thetadd) = (qdd.as_mut_slice(), thetadd.as_mut_slice());
        self.forward_dynamics_into(ws, q, qd, theta, thetad, tau_m, into_qdd, into_thetadd);
        (qdd, thetadd)
    }

    /// [`ElasticJoints::forward_dynamics`] without allocation, into the nv numbers each of `qdd` and `thetadd`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn forward_dynamics_into(
        &self,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        theta: &[f64],
        thetad: &[f64],
        tau_m: &[f64],
        qdd: &mut [f64],
        thetadd: &mut [f64],
    ) {
        forward(self, ws, q, qd, theta, thetad, tau_m, qdd, thetadd);
    }

    /// [`ElasticJoints::forward_dynamics_into`] for any kind of number.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn forward_dynamics_with<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_m: &[S],
        qdd: &mut [S],
        thetadd: &mut [S],
    ) {
        self.drive_links(ws, q, qd, theta, thetad, tau_m);
        let Scratch { rigid, inertia, armature, tau, tau_j, .. } = ws;
        let bodies = Scratch::bodies(self, inertia, armature);
        let push = |moving: &mut MovingBodies<S>| self.push_carriers(moving, thetad, tau_m, tau_j);
        let carriers = forward_dynamics_under_with(&bodies, rigid, q, qd, tau, push, qdd);
        self.spin_motors(tau_m, tau_j, qdd, &carriers, thetadd);
    }

    /// Torques of the springs and of rigid joints' motors on the links.
    #[inline(always)]
    fn drive_links<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_m: &[S],
    ) {
        let nv = self.model.nv;
        assert_eq!(tau_m.len(), nv, "tau_m");
        // τ_j = K (θ − q) + D (θ̇ − q̇), or τ_m in rigid joints
        self.spring_torque_with(q, qd, theta, thetad, &mut ws.tau_j);
        for dof in 0..nv {
            ws.tau[dof] = if self.elastic[dof] { ws.tau_j[dof] } else { tau_m[dof] };
        }
    }

    /// The torques that move the links: of the springs, of rigid joints' motors, of the rotors they carry. Turning links
    /// and spinning rotors are left in the world's axes for derivatives.
    #[inline(always)]
    pub(crate) fn push_links<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_m: &[S],
    ) {
        self.drive_links(ws, q, qd, theta, thetad, tau_m);
        if !self.has_moving_rotors() {
            return;
        }
        self.turn(ws, q, qd);
        self.spin(ws, thetad);
        let Scratch { turn, spin, tau, tau_j, .. } = ws;
        turn.iter_mut().for_each(|turn| turn.moment = Vector3::ZERO);
        for (rotor, spin) in self.rotors.iter().zip(&*spin) {
            turn[rotor.row].moment += rotor.moment(spin.axis, spin.swing, spin.momentum, tau_m, tau_j);
        }
        self.hand_moments_down(turn, tau);
    }

    /// Pushes the links that carry rotors.
    #[inline(always)]
    fn push_carriers<S: Scalar>(&self, moving: &mut MovingBodies<S>, thetad: &[S], tau_m: &[S], tau_j: &[S]) {
        for rotor in &self.rotors {
            let (u, carrier) = (Vector3::constant(rotor.axis), JointId(rotor.row - 1));
            let w = moving.velocity(carrier).angular;
            let n = rotor.moment(u, w.cross(u), rotor.momentum(u, w, thetad), tau_m, tau_j);
            moving.push(carrier, Force::new(-n, Vector3::ZERO));
        }
    }

    /// Accelerations of the motors, once those of the links are known.
    #[inline(always)]
    fn spin_motors<S: Scalar>(
        &self,
        tau_m: &[S],
        tau_j: &[S],
        qdd: &[S],
        carriers: &BodyAccelerations<S>,
        thetadd: &mut [S],
    ) {
        assert_eq!(thetadd.len(), self.model.nv, "thetadd");
        // θ̈ = B⁻¹ (τ_m − τ_j) − u·α/N
        for dof in 0..self.model.nv {
            let alone = (tau_m[dof] - tau_j[dof]) / self.rotor_inertia[dof];
            thetadd[dof] = if self.elastic[dof] { alone } else { qdd[dof] };
        }
        for rotor in &self.rotors {
            let (u, carrier) = (Vector3::constant(rotor.axis), JointId(rotor.row - 1));
            thetadd[rotor.dof] -= u.dot(carriers.of(carrier).angular) * rotor.ratio;
        }
    }

    /// Torque that springs and dampers hand from motor to link; zero in rigid joints.
    ///
    /// ```text
    /// τ_j = K (θ − q) + D (θ̇ − q̇)
    /// ```
    ///
    /// `q`: nq, rad (m). `qd`, `theta`, `thetad`: nv. Returns τ_j: nv, N·m (N).
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn spring_torque(&self, q: &[f64], qd: &[f64], theta: &[f64], thetad: &[f64]) -> DVector<f64> {
        let mut tau_j = DVector::zeros(self.model.nv);
        self.spring_torque_with(q, qd, theta, thetad, tau_j.as_mut_slice());
        tau_j
    }

    /// [`ElasticJoints::spring_torque`] for any kind of number, into `tau_j`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn spring_torque_with<S: Scalar>(
        &self,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_j: &mut [S],
    ) {
        let nv = self.model.nv;
        assert_eq!((q.len(), tau_j.len()), (self.model.nq, nv), "q, tau_j");
        assert_eq!((qd.len(), theta.len(), thetad.len()), (nv, nv, nv), "qd, theta, thetad");
        tau_j.fill(S::ZERO);
        for s in &self.springs {
            let deflection = theta[s.column] - q[self.position[s.column]];
            let rate = thetad[s.column] - qd[s.column];
            tau_j[s.row] += deflection * s.stiffness + rate * s.damping;
        }
    }
}

wide_forms! {
    avx2,
    fn forward(
        joints: &ElasticJoints,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        theta: &[f64],
        thetad: &[f64],
        tau_m: &[f64],
        qdd: &mut [f64],
        thetadd: &mut [f64],
    ) {
        let Workspace { links, scratch } = ws;
        joints.drive_links(scratch, q, qd, theta, thetad, tau_m);
        let Scratch { rigid, inertia, armature, tau, tau_j, .. } = scratch;
        let push = |moving: &mut MovingBodies<f64>| joints.push_carriers(moving, thetad, tau_m, tau_j);
        let carriers = if joints.armature {
            let bodies = Scratch::bodies(joints, inertia, armature);
            forward_dynamics_under_with(&bodies, rigid, q, qd, tau, push, qdd)
        } else {
            forward_dynamics_under_into(&joints.links, links, q, qd, tau, push, qdd)
        };
        joints.spin_motors(tau_m, tau_j, qdd, &carriers, thetadd);
    }
}
