//! The motor torques that make the links follow a motion.

use sinew_kinematics::position_rate_with;
use sinew_model::{Scalar, Taylor, Vector3};
use sinew_rigid::inverse_dynamics_with;

use crate::spin::{Turn, along_axes};
use crate::{Deflection, ElasticJoints, FlexJointError, Scratch};

/// What the motors do while the links follow a motion; nv numbers each.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorMotion<S> {
    /// θ, rad (m); q in rigid joints, 0 for a floating base.
    pub theta: Vec<S>,
    /// θ̇, rad/s (m/s).
    pub thetad: Vec<S>,
    /// θ̈, rad/s² (m/s²).
    pub thetadd: Vec<S>,
    /// τ_j, N·m (N): what moves the links; in rigid joints τ_m.
    pub tau_j: Vec<S>,
    /// τ_m, N·m (N); for a floating base the force that would have to push it.
    pub tau_m: Vec<S>,
    /// dδ/dt of the deflection δ = θ − q, rad/s (m/s): the rate of [`Deflection::At`]; zero in rigid joints.
    pub deflection_rate: Vec<S>,
}

impl<S: Scalar> MotorMotion<S> {
    /// Room for the motors of these joints.
    pub fn new(joints: &ElasticJoints) -> Self {
        let zeros = || vec![S::ZERO; joints.model.nv];
        Self {
            theta: zeros(),
            thetad: zeros(),
            thetadd: zeros(),
            tau_j: zeros(),
            tau_m: zeros(),
            deflection_rate: zeros(),
        }
    }
}

/// Scratch space of inverse dynamics over series of `M` terms; nothing is allocated after `new`.
#[derive(Debug, Clone)]
pub struct InverseScratch<S, const M: usize> {
    scratch: Scratch<Taylor<S, M>>,
    q: Vec<Taylor<S, M>>,
    rate: Vec<Taylor<S, M>>,
    qd: Vec<Taylor<S, M>>,
    deflection: Vec<Taylor<S, M>>,
}

impl<S: Scalar, const M: usize> InverseScratch<S, M> {
    /// Room for these joints.
    pub fn new(joints: &ElasticJoints) -> Self {
        let (nq, nv) = (joints.model.nq, joints.model.nv);
        Self {
            scratch: Scratch::new(joints),
            q: vec![Taylor::ZERO; nq],
            rate: vec![Taylor::ZERO; nq],
            qd: vec![Taylor::ZERO; nv],
            deflection: vec![Taylor::ZERO; nv],
        }
    }
}

impl ElasticJoints {
    /// The motor motion and torques with which the links follow q(t), of which the first four derivatives are known.
    ///
    /// ```text
    /// τ_j = M q̈ + C q̇ + g,   θ = q + K⁻¹ τ_j,   τ_m = τ_j + B θ̈ = τ_j + B (q̈ + K⁻¹ τ̈_j)      springs without dampers
    /// ```
    ///
    /// `motion`: q (nq) and q̇, q̈, q⃛, q⃜ (nv). τ̈_j holds the fourth derivative: the links can follow no motion that is
    /// less smooth. With dampers the deflection is a state of its own, chosen by `deflection`. Where K → ∞ this is rigid
    /// inverse dynamics with B on M's diagonal, which is how rigid joints are treated. Each derivative of the torque is
    /// exact, by Taylor numbers through recursive Newton–Euler; cost O(n).
    ///
    /// # Errors
    /// In the complete model, if a rotor rides on a moving link: four derivatives are then too few, and
    /// [`ElasticJoints::inverse_dynamics_with`] takes more.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// A link of 0.5 kg·m² without weight that swings as sin t, behind 150 N·m/rad and a rotor of 0.05 kg·m²: at
    /// t = π/2, where q̈ = −1, τ_j = −0.5 and τ̈_j = 0.5:
    /// ```
    /// use sinew_flex_joint::{Deflection, ElasticJoints};
    /// use sinew_model::{Robot, samples};
    /// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4).with_gravity([0.0; 3].into()));
    /// robot.joints[0].stiffness = Some(150.0);
    /// robot.joints[0].rotor_inertia = 0.05;
    /// let arm = ElasticJoints::new(&robot)?;
    /// let motion: [&[f64]; 5] = [&[1.0], &[0.0], &[-1.0], &[0.0], &[1.0]];
    /// let motor = arm.inverse_dynamics(motion, Deflection::Settled)?;
    /// approx::assert_relative_eq!(motor.theta[0], 1.0 - 0.5 / 150.0, max_relative = 1e-12);
    /// approx::assert_relative_eq!(motor.tau_m[0], -0.5 + 0.05 * (-1.0 + 0.5 / 150.0), max_relative = 1e-12);
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    /// Sources: De Luca, Book, *Robots with flexible elements*, Springer Handbook of Robotics, 2nd ed., 2016, section
    /// 11.1.3; Buondonno, De Luca, *A recursive Newton–Euler algorithm for robots with elastic joints*, IROS 2015.
    pub fn inverse_dynamics(
        &self,
        motion: [&[f64]; 5],
        deflection: Deflection<f64>,
    ) -> Result<MotorMotion<f64>, FlexJointError> {
        let mut out = MotorMotion::new(self);
        self.inverse_dynamics_with(&mut InverseScratch::<f64, 3>::new(self), &motion, deflection, &mut out)?;
        Ok(out)
    }

    /// [`ElasticJoints::inverse_dynamics`] for any kind of number, of either model, without allocation.
    ///
    /// `motion`: q and its first M + 1 derivatives, M > 2; those beyond [`ElasticJoints::derivatives_needed`] have no
    /// influence. In the complete model each rotor on a moving link makes the torque of
    /// the joints before it depend on two more derivatives, up to order 2 (n + 1) for an arm of n joints. Motors are
    /// solved from the tip to the base:
    ///
    /// ```text
    /// τ_j = (M q̈ + C q̇ + g)_k + Σ z_k·[B_i/N_i (ẇ_i/N_i + θ̈_i) u_i + h_i ω × u_i],   τ_m = τ_j + B (θ̈ + ẇ/N),   w = u·ω
    /// ```
    ///
    /// # Errors
    /// If `motion` has too few derivatives, or if no number of them would do.
    ///
    /// # Panics
    /// If `motion` has not M + 2 parts, or a slice has the wrong length.
    ///
    /// Source: De Luca, Lucibello, *A general algorithm for dynamic feedback linearization of robots with elastic joints*,
    /// IEEE International Conference on Robotics and Automation, 1998.
    pub fn inverse_dynamics_with<S: Scalar, const M: usize>(
        &self,
        ws: &mut InverseScratch<S, M>,
        motion: &[&[S]],
        deflection: Deflection<S>,
        out: &mut MotorMotion<S>,
    ) -> Result<(), FlexJointError> {
        const { assert!(M > 2, "accelerations of the motors are third terms") };
        let needed = self.derivatives_needed(deflection)?;
        if M + 1 < needed {
            return Err(FlexJointError::TooFewDerivatives { got: M + 1, needed });
        }
        self.read_motion(ws, motion);
        let InverseScratch { scratch, q, qd, deflection: bent, .. } = ws;
        // τ = M q̈ + C q̇ + g of the links without the spin of their rotors
        let qdd = core::mem::take(&mut scratch.qdd);
        let bodies = Scratch::bodies(self, &scratch.inertia, &scratch.armature);
        inverse_dynamics_with(&bodies, &mut scratch.rigid, q, qd, &qdd, &mut scratch.tau);
        scratch.qdd = qdd;
        if self.has_moving_rotors() {
            self.turn(scratch, q, qd);
        }
        scratch.turn.iter_mut().for_each(|turn| turn.moment = Vector3::ZERO);
        scratch.motor.iter_mut().for_each(|motor| motor.fill(Taylor::ZERO));
        let mut groups = self.groups.iter().peekable();
        for (k, segment) in self.mechanism.segments().iter().enumerate().rev() {
            let Scratch { turn, tau, motor, .. } = &mut *scratch;
            if self.has_moving_rotors() {
                // τ = τ + z·n
                along_axes(segment, &turn[k + 1], |dof, torque| tau[dof] += torque);
                let n = turn[k + 1].moment;
                turn[segment.parent].moment += n;
            }
            while let Some(group) = groups.next_if(|group| group.first == k) {
                group.deflect(tau, deflection, bent);
                for &dof in &group.dofs {
                    motor[0][dof] = q[self.position[dof]] + bent[dof];
                    motor[1][dof] = tau[dof] + self.turn_rotor(dof, motor[0][dof], turn);
                }
            }
        }
        self.write_motors(ws, out);
        Ok(())
    }

    /// The order of the highest derivative of the links' motion that the motor torques depend on.
    ///
    /// # Errors
    /// If some motor torque depends on all of them.
    pub fn derivatives_needed<S: Scalar>(&self, deflection: Deflection<S>) -> Result<usize, FlexJointError> {
        let kind = usize::from(deflection != Deflection::Settled);
        if let Some(group) = self.groups.iter().find(|group| !group.open) {
            let joint = self.model.dof_name(group.dofs[0]).to_owned();
            return Err(FlexJointError::RotorAhead { joint });
        }
        // q̈ for the torque, and what each motor takes of it
        let taken = self.groups.iter().map(|group| group.lost[kind] + group.taken()[kind]);
        Ok(2 + taken.max().unwrap_or(0))
    }

    /// The motion as series.
    fn read_motion<S: Scalar, const M: usize>(&self, ws: &mut InverseScratch<S, M>, motion: &[&[S]]) {
        let (nq, nv) = (self.model.nq, self.model.nv);
        assert_eq!(motion.len(), M + 2, "motion: q and its derivatives to order M + 1");
        assert!(motion.iter().enumerate().all(|(k, x)| x.len() == if k == 0 { nq } else { nv }), "motion");
        for dof in 0..nv {
            let series =
                |first: usize| Taylor::from_derivatives(core::array::from_fn(|k| motion[first + k][dof]));
            (ws.qd[dof], ws.scratch.qdd[dof]) = (series(1), series(2));
        }
        for (q, &start) in ws.q.iter_mut().zip(motion[0]) {
            *q = Taylor::ZERO;
            q.coefficients[0] = start;
        }
        // q_{k+1} = q̇_k/(k + 1), one more term of the positions at a time
        for k in 1..M {
            position_rate_with(&self.model, &ws.q, &ws.qd, &mut ws.rate);
            for (q, rate) in ws.q.iter_mut().zip(&ws.rate) {
                q.coefficients[k] = rate.coefficients[k - 1] / k as f64;
            }
        }
    }

    /// The torque that turns a rotor along θ; the moment that this takes from its carrier is added to it.
    fn turn_rotor<S: Scalar, const M: usize>(
        &self,
        dof: usize,
        theta: Taylor<S, M>,
        turn: &mut [Turn<Taylor<S, M>>],
    ) -> Taylor<S, M> {
        let rate = theta.rate();
        let mut torque = rate.rate() * self.rotor_inertia[dof];
        for rotor in self.rotors.iter().filter(|rotor| rotor.dof == dof) {
            let own = &turn[rotor.row];
            let u = own.rotation * Vector3::constant(rotor.axis);
            let w = u.dot(own.velocity);
            // n = ḣ u + ω × h u,   h = B/N (w/N + θ̇)
            let momentum = w * rotor.spin + rate * rotor.coupling;
            let moment = u * momentum.rate() + own.velocity.cross(u) * momentum;
            torque += w.rate() * rotor.coupling;
            turn[rotor.row].moment += moment;
        }
        torque
    }

    fn write_motors<S: Scalar, const M: usize>(&self, ws: &InverseScratch<S, M>, out: &mut MotorMotion<S>) {
        let nv = self.model.nv;
        let rooms = [&out.theta, &out.thetad, &out.thetadd, &out.tau_j, &out.tau_m, &out.deflection_rate];
        assert!(rooms.iter().all(|room| room.len() == nv), "out");
        let [theta, torque, _] = &ws.scratch.motor;
        for dof in 0..nv {
            out.tau_j[dof] = ws.scratch.tau[dof].coefficients[0];
            if self.elastic[dof] {
                out.theta[dof] = theta[dof].derivative(0);
                out.thetad[dof] = theta[dof].derivative(1);
                out.thetadd[dof] = theta[dof].derivative(2);
                out.tau_m[dof] = torque[dof].coefficients[0];
                out.deflection_rate[dof] = ws.deflection[dof].derivative(1);
            } else {
                let joint = &self.model.joints[self.model.joint_of_dof(dof).0];
                let alone = joint.kind.nv() == 1;
                out.theta[dof] = if alone { ws.q[joint.first_q].derivative(0) } else { S::ZERO };
                out.thetad[dof] = ws.qd[dof].derivative(0);
                out.thetadd[dof] = ws.scratch.qdd[dof].derivative(0);
                out.tau_m[dof] = out.tau_j[dof];
                out.deflection_rate[dof] = S::ZERO;
            }
        }
    }
}
