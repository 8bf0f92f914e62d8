//! The robot as one system of first order, and its linear model.

use nalgebra::{DMatrix, DVector};
use sinew_kinematics::position_rate_with;
use sinew_model::{JointKind, Motion, Scalar};

use crate::{ElasticJoints, Scratch, Workspace};

impl ElasticJoints {
    /// Length of the state x = (q, θ, q̇, θ̇): positions of all joints and of the motors of elastic ones, then their rates.
    ///
    /// Motors of rigid joints are no states. The order is that of `sinew-linear`; the lesson writes (q, q̇, θ, θ̇).
    pub fn state_len(&self) -> usize {
        self.model.nq + self.model.nv + 2 * self.motors()
    }

    /// Length of a displacement of the state: [`ElasticJoints::state_len`] but for floating bases, whose seven numbers of
    /// position have six directions.
    pub fn displacement_len(&self) -> usize {
        2 * (self.model.nv + self.motors())
    }

    fn motors(&self) -> usize {
        self.elastic.iter().filter(|&&elastic| elastic).count()
    }

    /// The rate of the state under motor torques.
    ///
    /// ```text
    /// ẋ = f(x, τ_m),   x = (q, θ, q̇, θ̇)
    /// ```
    ///
    /// `x`: [`ElasticJoints::state_len`] numbers. `tau_m`: nv, those of all joints. Returns as many as `x`; for a
    /// floating base the rates of place and quaternion.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// One joint: x = (q, θ, q̇, θ̇), and at rest in the origin the motor alone is pushed:
    /// ```
    /// use sinew_flex_joint::ElasticJoints;
    /// use sinew_model::{Robot, samples};
    /// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    /// robot.joints[0].stiffness = Some(150.0);
    /// robot.joints[0].rotor_inertia = 0.05;
    /// let rate = ElasticJoints::new(&robot)?.state_rate(&[0.0; 4], &[1.0]);
    /// assert_eq!(rate.as_slice(), [0.0, 0.0, 0.0, 1.0 / 0.05]);
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    pub fn state_rate(&self, x: &[f64], tau_m: &[f64]) -> DVector<f64> {
        let mut rate = DVector::zeros(self.state_len());
        self.state_rate_into(&mut Workspace::new(self), x, tau_m, rate.as_mut_slice());
        rate
    }

    /// [`ElasticJoints::state_rate`] without allocation.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn state_rate_into(&self, ws: &mut Workspace, x: &[f64], tau_m: &[f64], rate: &mut [f64]) {
        let mut motor = core::mem::take(&mut ws.scratch.motor);
        let mut qdd = core::mem::take(&mut ws.scratch.qdd);
        let [theta, thetad, thetadd] = &mut motor;
        let (q, qd) = self.unpack(x, theta, thetad);
        self.forward_dynamics_into(ws, q, qd, theta, thetad, tau_m, &mut qdd, thetadd);
        self.pack(q, qd, thetad, &qdd, thetadd, rate);
        (ws.scratch.motor, ws.scratch.qdd) = (motor, qdd);
    }

    /// [`ElasticJoints::state_rate_into`] for any kind of number.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn state_rate_with<S: Scalar>(&self, ws: &mut Scratch<S>, x: &[S], tau_m: &[S], rate: &mut [S]) {
        let mut motor = core::mem::take(&mut ws.motor);
        let mut qdd = core::mem::take(&mut ws.qdd);
        let [theta, thetad, thetadd] = &mut motor;
        let (q, qd) = self.unpack(x, theta, thetad);
        self.forward_dynamics_with(ws, q, qd, theta, thetad, tau_m, &mut qdd, thetadd);
        self.pack(q, qd, thetad, &qdd, thetadd, rate);
        (ws.motor, ws.qdd) = (motor, qdd);
    }

    /// The linear model about a state.
    ///
    /// ```text
    /// δẋ = A δx + B δτ_m,   A = ∂f/∂x,   B = ∂f/∂τ_m
    /// ```
    ///
    /// `x`: as [`ElasticJoints::state_rate`] takes it. Returns A, square by [`ElasticJoints::displacement_len`], and B,
    /// with nv columns, by analytic derivatives. δx of a floating base is [turn; shift] in its own axes, and its rate
    /// δv − v × δ.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn linearize(&self, x: &[f64], tau_m: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = self.displacement_len();
        let (mut A, mut B) = (DMatrix::zeros(n, n), DMatrix::zeros(n, self.model.nv));
        self.linearize_into(&mut Workspace::new(self), x, tau_m, A.as_mut_slice(), B.as_mut_slice());
        (A, B)
    }

    /// [`ElasticJoints::linearize`] without allocation, into A and B by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn linearize_into(&self, ws: &mut Workspace, x: &[f64], tau_m: &[f64], A: &mut [f64], B: &mut [f64]) {
        let (nv, n) = (self.model.nv, self.displacement_len());
        assert_eq!((A.len(), B.len()), (n * n, n * nv), "A, B");
        let (half, mut blocks) = (n / 2, core::mem::take(&mut ws.scratch.blocks));
        let mut motor = core::mem::take(&mut ws.scratch.motor);
        let [theta, thetad, _] = &mut motor;
        let (q, qd) = self.unpack(x, theta, thetad);
        let [by_q, by_qd, by_theta, by_thetad, by_tau] = &mut blocks;
        self.forward_dynamics_derivatives_into(
            ws, q, qd, theta, thetad, tau_m, by_q, by_qd, by_theta, by_thetad, by_tau,
        );
        let accelerations = |into: &mut [f64], from: &[f64]| {
            into[half..half + nv].copy_from_slice(&from[..nv]);
            let motors = (0..nv).filter(|&dof| self.elastic[dof]).map(|dof| from[nv + dof]);
            into[half + nv..].iter_mut().zip(motors).for_each(|(into, from)| *into = from);
        };
        A.fill(0.0);
        B.fill(0.0);
        let motors = || (0..nv).filter(|&dof| self.elastic[dof]);
        for (column, dof) in (0..nv).chain(motors()).enumerate() {
            let (by, by_rate) = if column < nv { (&*by_q, &*by_qd) } else { (&*by_theta, &*by_thetad) };
            let own = 2 * nv * dof..2 * nv * (dof + 1);
            accelerations(&mut A[n * column..][..n], &by[own.clone()]);
            let rates = &mut A[n * (half + column)..][..n];
            accelerations(rates, &by_rate[own]);
            rates[column] = 1.0;
        }
        for dof in 0..nv {
            accelerations(&mut B[n * dof..][..n], &by_tau[2 * nv * dof..][..2 * nv]);
        }
        self.carry_bases(qd, n, A);
        (ws.scratch.blocks, ws.scratch.motor) = (blocks, motor);
    }

    /// ∂ḋ/∂d = −v × of a displacement d in the axes of a body that moves with v.
    fn carry_bases(&self, qd: &[f64], n: usize, A: &mut [f64]) {
        for joint in self.model.joints.iter().filter(|joint| joint.kind == JointKind::Floating) {
            let first = joint.first_dof;
            let v = joint.kind;
            let moved = |k: usize, x: f64| v.motion(k, x);
            let velocity = (0..6).fold(Motion::ZERO, |sum, k| sum + moved(k, qd[first + k]));
            for k in 0..6 {
                let rate = velocity.cross_motion(moved(k, 1.0)).to_array();
                for (row, rate) in rate.into_iter().enumerate() {
                    A[n * (first + k) + first + row] = -rate;
                }
            }
        }
    }

    /// q and q̇ of a state; θ and θ̇ of all degrees of freedom, zero in rigid joints.
    #[inline(always)]
    fn unpack<'x, S: Scalar>(&self, x: &'x [S], theta: &mut [S], thetad: &mut [S]) -> (&'x [S], &'x [S]) {
        assert_eq!(x.len(), self.state_len(), "x");
        let (nq, nv, motors) = (self.model.nq, self.model.nv, self.motors());
        let (q, rest) = x.split_at(nq);
        let (motor, rest) = rest.split_at(motors);
        let (qd, rate) = rest.split_at(nv);
        let elastic = (0..nv).filter(|&dof| self.elastic[dof]);
        for (dof, (motor, rate)) in elastic.zip(motor.iter().zip(rate)) {
            (theta[dof], thetad[dof]) = (*motor, *rate);
        }
        (q, qd)
    }

    /// The rate of a state.
    #[inline(always)]
    fn pack<S: Scalar>(&self, q: &[S], qd: &[S], thetad: &[S], qdd: &[S], thetadd: &[S], rate: &mut [S]) {
        assert_eq!(rate.len(), self.state_len(), "rate");
        let (nq, nv, motors) = (self.model.nq, self.model.nv, self.motors());
        let (links, rest) = rate.split_at_mut(nq);
        let (motor, rest) = rest.split_at_mut(motors);
        let (acceleration, rest) = rest.split_at_mut(nv);
        position_rate_with(&self.model, q, qd, links);
        acceleration.copy_from_slice(qdd);
        let elastic = (0..nv).filter(|&dof| self.elastic[dof]);
        for (dof, (motor, rest)) in elastic.zip(motor.iter_mut().zip(rest)) {
            (*motor, *rest) = (thetad[dof], thetadd[dof]);
        }
    }
}
