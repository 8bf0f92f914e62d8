//! Accelerations of links and motors under motor torques.

use nalgebra::DVector;
use sinew_model::Scalar;
use sinew_rigid::forward_dynamics_with;

use crate::{ElasticJoints, Workspace};

impl ElasticJoints {
    /// Accelerations of links and motors that the motor torques `tau_m` produce.
    ///
    /// ```text
    /// q̈ = M⁻¹ (τ_j − C q̇ − g),   θ̈ = B⁻¹ (τ_m − τ_j);   in rigid joints q̈ = θ̈ with B on M's diagonal
    /// ```
    ///
    /// `q`: nq, rad (m). `qd`, `theta`, `thetad`, `tau_m`: nv. Returns (q̈, θ̈): nv each. Cost O(n).
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
        self.forward_dynamics_with(
            ws,
            q,
            qd,
            theta,
            thetad,
            tau_m,
            qdd.as_mut_slice(),
            thetadd.as_mut_slice(),
        );
        (qdd, thetadd)
    }

    /// [`ElasticJoints::forward_dynamics`] for any kind of number, into `qdd` and `thetadd`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn forward_dynamics_with<S: Scalar>(
        &self,
        ws: &mut Workspace<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_m: &[S],
        qdd: &mut [S],
        thetadd: &mut [S],
    ) {
        let nv = self.model.nv;
        assert_eq!((tau_m.len(), thetadd.len()), (nv, nv), "tau_m, thetadd");
        // τ_j = K (θ − q) + D (θ̇ − q̇), or τ_m in rigid joints
        self.spring_torque_with(q, qd, theta, thetad, &mut ws.tau);
        for dof in (0..nv).filter(|&dof| !self.elastic[dof]) {
            ws.tau[dof] = tau_m[dof];
        }
        // q̈ = M⁻¹ (τ_j − C q̇ − g)
        let bodies = Workspace::bodies(self, &ws.inertia, &ws.armature);
        forward_dynamics_with(&bodies, &mut ws.scratch, q, qd, &ws.tau, qdd);
        // θ̈ = B⁻¹ (τ_m − τ_j)
        for dof in 0..nv {
            let alone = (tau_m[dof] - ws.tau[dof]) / self.rotor[dof];
            thetadd[dof] = if self.elastic[dof] { alone } else { qdd[dof] };
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
