//! Analytic derivatives of forward dynamics.

use nalgebra::DMatrix;
use sinew_model::{Matrix3, Scalar, Vector3, wide_forms};
use sinew_rigid::{
    forward_dynamics_derivatives_into, forward_dynamics_derivatives_with, inverse_dynamics_with,
};

use crate::elastic_joints::Spring;
use crate::spin::{Turn, axis, turning_axes};
use crate::{ElasticJoints, Scratch, Workspace};

/// How the accelerations of links and motors change with state and motor torques; each matrix 2 nv × nv, rows: q̈,
/// then θ̈, column: what changes.
#[derive(Debug, Clone, PartialEq)]
pub struct ForwardDynamicsDerivatives {
    /// ∂(q̈, θ̈)/∂q, along the displacements of [`integrate`](sinew_kinematics::integrate).
    pub by_position: DMatrix<f64>,
    /// ∂(q̈, θ̈)/∂q̇.
    pub by_velocity: DMatrix<f64>,
    /// ∂(q̈, θ̈)/∂θ; columns of rigid joints are zero.
    pub by_motor_position: DMatrix<f64>,
    /// ∂(q̈, θ̈)/∂θ̇; columns of rigid joints are zero.
    pub by_motor_velocity: DMatrix<f64>,
    /// ∂(q̈, θ̈)/∂τ_m.
    pub by_motor_torque: DMatrix<f64>,
}

impl ElasticJoints {
    /// Derivatives of [`ElasticJoints::forward_dynamics`] by all that it takes.
    ///
    /// ```text
    /// δq̈ = M⁻¹ (δτ_j − ∂τ/∂q δq − ∂τ/∂q̇ δq̇),   δθ̈ = B⁻¹ (δτ_m − δτ_j),   δτ_j = K (δθ − δq) + D (δθ̇ − δq̇)
    /// ```
    ///
    /// in the reduced model, and with what rotors add to it in the complete one. `q`: nq, rad (m). `qd`, `theta`,
    /// `thetad`, `tau_m`: nv. In rigid joints θ̈ is q̈, and so are its derivatives. Cost O(n² · depth).
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// The spring of 150 N·m/rad between a link of 0.5 kg·m² and a rotor of 0.05 kg·m²:
    /// ```
    /// # use sinew_flex_joint::ElasticJoints;
    /// # use sinew_model::{Robot, samples};
    /// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    /// robot.joints[0].stiffness = Some(150.0);
    /// robot.joints[0].rotor_inertia = 0.05;
    /// let arm = ElasticJoints::new(&robot)?;
    /// let d = arm.forward_dynamics_derivatives(&[0.0], &[0.0], &[0.0], &[0.0], &[0.0]);
    /// approx::assert_relative_eq!(d.by_position[(0, 0)], -(150.0 + 2.0 * 9.81 * 0.4) / 0.5, max_relative = 1e-12);
    /// approx::assert_relative_eq!(d.by_motor_position[(1, 0)], -150.0 / 0.05, max_relative = 1e-12);
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    pub fn forward_dynamics_derivatives(
        &self,
        q: &[f64],
        qd: &[f64],
        theta: &[f64],
        thetad: &[f64],
        tau_m: &[f64],
    ) -> ForwardDynamicsDerivatives {
        let nv = self.model.nv;
        let [mut by_q, mut by_qd, mut by_theta, mut by_thetad, mut by_tau] =
            core::array::from_fn(|_| DMatrix::zeros(2 * nv, nv));
        self.forward_dynamics_derivatives_into(
            &mut Workspace::new(self),
            q,
            qd,
            theta,
            thetad,
            tau_m,
            by_q.as_mut_slice(),
            by_qd.as_mut_slice(),
            by_theta.as_mut_slice(),
            by_thetad.as_mut_slice(),
            by_tau.as_mut_slice(),
        );
        ForwardDynamicsDerivatives {
            by_position: by_q,
            by_velocity: by_qd,
            by_motor_position: by_theta,
            by_motor_velocity: by_thetad,
            by_motor_torque: by_tau,
        }
    }

    /// [`ElasticJoints::forward_dynamics_derivatives`] without allocation, into five times 2 nv × nv numbers by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn forward_dynamics_derivatives_into(
        &self,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        theta: &[f64],
        thetad: &[f64],
        tau_m: &[f64],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
        by_motor_position: &mut [f64],
        by_motor_velocity: &mut [f64],
        by_motor_torque: &mut [f64],
    ) {
        let x = [q, qd, theta, thetad, tau_m];
        let by = [by_position, by_velocity, by_motor_position, by_motor_velocity, by_motor_torque];
        differentiate(self, ws, x, by);
    }

    /// [`ElasticJoints::forward_dynamics_derivatives_into`] for any kind of number.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn forward_dynamics_derivatives_with<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
        tau_m: &[S],
        by_position: &mut [S],
        by_velocity: &mut [S],
        by_motor_position: &mut [S],
        by_motor_velocity: &mut [S],
        by_motor_torque: &mut [S],
    ) {
        self.push_links(ws, q, qd, theta, thetad, tau_m);
        let [by_q, by_qd, by_tau, ..] = &mut ws.matrices;
        let bodies = Scratch::bodies(self, &ws.inertia, &ws.armature);
        forward_dynamics_derivatives_with(&bodies, &mut ws.rigid, q, qd, &ws.tau, by_q, by_qd, by_tau);
        let by = [by_position, by_velocity, by_motor_position, by_motor_velocity, by_motor_torque];
        self.assemble(ws, q, qd, by);
    }

    /// The whole from the derivatives of the links alone, which stand in the first three matrices.
    #[inline(always)]
    fn assemble<S: Scalar>(&self, ws: &mut Scratch<S>, q: &[S], qd: &[S], by: [&mut [S]; 5]) {
        let nv = self.model.nv;
        for (by, name) in
            by.iter().zip(["position", "velocity", "motor_position", "motor_velocity", "motor_torque"])
        {
            assert_eq!(by.len(), 2 * nv * nv, "by_{name}");
        }
        if self.has_moving_rotors() {
            self.link_acceleration(ws, q, qd);
            self.rotor_slopes(ws);
        }
        let [by_q, by_qd, inverse, response, by_thetad, by_tau, ..] = &ws.matrices;
        let response = if self.has_moving_rotors() { response } else { inverse };
        let [into_q, into_qd, into_theta, into_thetad, into_tau] = by;
        into_theta.fill(S::ZERO);
        for dof in 0..nv {
            let pushed = if self.elastic[dof] { by_tau } else { inverse };
            for (from, into) in [
                (by_q, &mut *into_q),
                (by_qd, &mut *into_qd),
                (by_thetad, &mut *into_thetad),
                (pushed, &mut *into_tau),
            ] {
                let (links, motors) = into[2 * nv * dof..2 * nv * (dof + 1)].split_at_mut(nv);
                links.copy_from_slice(&from[nv * dof..nv * (dof + 1)]);
                motors.fill(S::ZERO);
            }
            if self.elastic[dof] {
                into_tau[2 * nv * dof + nv + dof] = S::constant(1.0 / self.rotor_inertia[dof]);
            }
        }
        self.pull(response, into_theta, into_q, |s| s.stiffness);
        self.pull(response, into_thetad, into_qd, |s| s.damping);
        for into in [&mut *into_q, &mut *into_qd, into_theta, into_thetad, into_tau] {
            self.follow(ws, into);
        }
        self.swing_motors(ws, into_q, into_qd);
    }

    /// Adds what the springs or dampers do where a motor moves, and takes it off where its link does.
    ///
    /// ```text
    /// δτ_j = K (δθ − δq) + D (δθ̇ − δq̇),   δq̈ = R δτ_j,   δθ̈ = −B⁻¹ δτ_j
    /// ```
    #[inline(always)]
    fn pull<S: Scalar>(
        &self,
        response: &[S],
        by_motor: &mut [S],
        by_link: &mut [S],
        slope: impl Fn(&Spring) -> f64,
    ) {
        let nv = self.model.nv;
        for s in &self.springs {
            let (own, start) = (&response[nv * s.row..][..nv], 2 * nv * s.column);
            let (motor, link) = (&mut by_motor[start..][..2 * nv], &mut by_link[start..][..2 * nv]);
            for ((motor, link), response) in motor.iter_mut().zip(link.iter_mut()).zip(own) {
                let pull = *response * slope(s);
                *motor += pull;
                *link -= pull;
            }
            let alone = S::constant(slope(s) / self.rotor_inertia[s.row]);
            motor[nv + s.row] -= alone;
            link[nv + s.row] += alone;
        }
    }

    /// Rows of motors that follow the links: rigid joints, and the turn of a rotor with its link.
    #[inline(always)]
    fn follow<S: Scalar>(&self, ws: &Scratch<S>, into: &mut [S]) {
        let nv = self.model.nv;
        if self.is_all_elastic() && !self.has_moving_rotors() {
            return;
        }
        let turned = &ws.matrices[9];
        for column in into.chunks_exact_mut((2 * nv).max(1)) {
            let (links, motors) = column.split_at_mut(nv);
            for dof in (0..nv).filter(|&dof| !self.elastic[dof]) {
                motors[dof] = links[dof];
            }
            if !self.has_moving_rotors() {
                continue;
            }
            // δθ̈ = δθ̈ − B⁻¹ Sᵀ δq̈
            for (turned, qdd) in turned.chunks_exact(nv).zip(&*links) {
                motors.iter_mut().zip(turned).for_each(|(motor, turned)| *motor -= *turned * *qdd);
            }
        }
    }

    fn is_all_elastic(&self) -> bool {
        self.elastic.iter().all(|&elastic| elastic)
    }

    /// q̈ of the torques that move the links, and the angular accelerations that follow from it.
    #[inline(always)]
    fn link_acceleration<S: Scalar>(&self, ws: &mut Scratch<S>, q: &[S], qd: &[S]) {
        let nv = self.model.nv;
        let bodies = Scratch::bodies(self, &ws.inertia, &ws.armature);
        inverse_dynamics_with(&bodies, &mut ws.rigid, q, qd, &ws.zeros, &mut ws.bias);
        // q̈ = M⁻¹ (τ − h)
        let qdd = &mut ws.qdd;
        qdd.fill(S::ZERO);
        for (column, (tau, h)) in ws.matrices[2].chunks_exact(nv.max(1)).zip(ws.tau.iter().zip(&ws.bias)) {
            let rest = *tau - *h;
            qdd.iter_mut().zip(column).for_each(|(qdd, inverse)| *qdd += *inverse * rest);
        }
        self.accelerate(&mut ws.turn, qdd);
    }

    /// What the rotors change of q̈'s derivatives; their coupling by the motors' inertias.
    #[inline(always)]
    fn rotor_slopes<S: Scalar>(&self, ws: &mut Scratch<S>) {
        let nv = self.model.nv;
        let Scratch { turn, spin, axis, matrices, .. } = ws;
        let [by_q, by_qd, inverse, response, by_thetad, by_tau, coupling, slope_q, slope_qd, turned] =
            matrices;
        for matrix in
            [&mut *by_thetad, &mut *by_tau, &mut *coupling, &mut *slope_q, &mut *slope_qd, &mut *turned]
        {
            matrix.fill(S::ZERO);
        }
        response.copy_from_slice(inverse);
        turn.iter_mut().for_each(|turn| turn.slope = Matrix3 { rows: [Vector3::ZERO; 3] });
        for (rotor, spin) in self.rotors.iter().zip(&*spin) {
            // ∂n/∂ω = B/N² (ω × u) uᵀ − h [u]×
            let (s, u) = (spin.swing * S::constant(rotor.spin), spin.axis);
            let rows = [u * s.x, u * s.y, u * s.z];
            let gyroscopic = Matrix3::skew(u * spin.momentum);
            turn[rotor.row].slope = turn[rotor.row].slope + Matrix3 { rows } - gyroscopic;
            // S/B, and ∂τ/∂θ̇ = B/N z·(ω × u)
            let own = nv * rotor.dof;
            self.each_axis_below(turn, rotor.row, |dof, z| {
                let own_turn = z.dot(u) * rotor.ratio;
                coupling[own + dof] += own_turn;
                turned[rotor.dof + nv * dof] += own_turn;
                by_thetad[own + dof] += z.dot(spin.swing) * rotor.coupling;
            });
        }
        self.moment_slopes(turn, axis, slope_q, slope_qd);
        // ∂q̈ = −M⁻¹ ∂τ
        minus_product(nv, inverse, slope_q, by_q);
        minus_product(nv, inverse, slope_qd, by_qd);
        let swing = &mut *slope_q;
        swing.copy_from_slice(by_thetad);
        by_thetad.fill(S::ZERO);
        minus_product(nv, inverse, swing, by_thetad);
        // ∂q̈/∂τ_m = −M⁻¹ S B⁻¹,   ∂q̈/∂τ_j = M⁻¹ (1 + S B⁻¹)
        minus_product(nv, inverse, coupling, by_tau);
        response.iter_mut().zip(&*by_tau).for_each(|(response, by_tau)| *response -= *by_tau);
    }

    /// ∂τ/∂q and ∂τ/∂q̇ of the moments that the rotors take; those of segments become those of subtrees.
    #[inline(always)]
    fn moment_slopes<S: Scalar>(
        &self,
        turn: &mut [Turn<S>],
        axes: &mut [[Vector3<S>; 2]],
        by_q: &mut [S],
        by_qd: &mut [S],
    ) {
        let (segments, nv) = (self.mechanism.segments(), self.model.nv);
        for &k in &self.carriers {
            let (segment, v_parent) = (&segments[k], turn[segments[k].parent].velocity);
            for l in 0..turning_axes(segment) {
                // z, ψ̇ = ω_parent × z
                let z = axis(segment, l, &turn[k + 1].rotation);
                axes[segment.first_axis + l] = [z, v_parent.cross(z)];
            }
        }
        for &j in self.carriers.iter().rev() {
            let (segment, n, Y) = (&segments[j], turn[j + 1].moment, turn[j + 1].slope);
            turn[segment.parent].slope = turn[segment.parent].slope + Y;
            for k in 0..turning_axes(segment) {
                let column = segment.first_dof + k;
                let [z, psi] = axes[segment.first_axis + k];
                let (by_psi, by_z, back) = (Y * psi, Y * z, Y.transpose_mul(z));
                for l in 0..turning_axes(segment) {
                    let (row, r) = (segment.first_dof + l, axes[segment.first_axis + l][0]);
                    by_q[row + nv * column] += r.dot(by_psi);
                    by_qd[row + nv * column] += r.dot(by_z);
                }
                // an ancestor's axis stays where it is when this joint turns the moment of its subtree
                let by_psi = by_psi + z.cross(n);
                let mut ancestor = segment.parent;
                while ancestor > 0 {
                    let carrier = &segments[ancestor - 1];
                    for l in 0..turning_axes(carrier) {
                        let (row, [r, r_psi]) = (carrier.first_dof + l, axes[carrier.first_axis + l]);
                        by_q[row + nv * column] += r.dot(by_psi);
                        by_qd[row + nv * column] += r.dot(by_z);
                        by_q[column + nv * row] += back.dot(r_psi);
                        by_qd[column + nv * row] += back.dot(r);
                    }
                    ancestor = carrier.parent;
                }
            }
        }
    }

    /// What of a motor's acceleration changes with the motion of its carrier at given accelerations of the joints.
    ///
    /// ```text
    /// ∂(u·α)/∂q_j = u·ψ̈_j + (ω × u)·ψ̇_j,   ∂(u·α)/∂q̇_j = u·(ψ̇_j + ż_j) + (ω × u)·z_j
    /// ψ̇ = ω_parent × z,   ψ̈ = α_parent × z + ω_parent × ψ̇,   ż = ω × z
    /// ```
    #[inline(always)]
    fn swing_motors<S: Scalar>(&self, ws: &Scratch<S>, into_q: &mut [S], into_qd: &mut [S]) {
        let (segments, nv) = (self.mechanism.segments(), self.model.nv);
        for (rotor, spin) in self.rotors.iter().zip(&ws.spin) {
            let (u, swing, row) = (spin.axis, spin.swing, nv + rotor.dof);
            let mut at = rotor.row;
            while at > 0 {
                let segment = &segments[at - 1];
                let (own, parent) = (&ws.turn[at], &ws.turn[segment.parent]);
                for l in 0..turning_axes(segment) {
                    let column = segment.first_dof + l;
                    let [z, psi] = ws.axis[segment.first_axis + l];
                    let psi_rate = parent.acceleration.cross(z) + parent.velocity.cross(psi);
                    let by_q = u.dot(psi_rate) + swing.dot(psi);
                    let by_qd = u.dot(psi + own.velocity.cross(z)) + swing.dot(z);
                    into_q[row + 2 * nv * column] -= by_q * rotor.ratio;
                    into_qd[row + 2 * nv * column] -= by_qd * rotor.ratio;
                }
                at = segment.parent;
            }
        }
    }
}

/// C = C − A B for n × n matrices by columns; zeros of B cost nothing.
#[inline(always)]
fn minus_product<S: Scalar>(n: usize, A: &[S], B: &[S], C: &mut [S]) {
    let columns = C.chunks_exact_mut(n.max(1)).zip(B.chunks_exact(n.max(1)));
    for (into, b) in columns {
        for (a, b) in A.chunks_exact(n.max(1)).zip(b).filter(|(_, b)| **b != S::ZERO) {
            into.iter_mut().zip(a).for_each(|(into, a)| *into -= *a * *b);
        }
    }
}

wide_forms! {
    avx2,
    fn differentiate(joints: &ElasticJoints, ws: &mut Workspace, x: [&[f64]; 5], by: [&mut [f64]; 5]) {
        let [q, qd, theta, thetad, tau_m] = x;
        let Workspace { links, scratch } = ws;
        joints.push_links(scratch, q, qd, theta, thetad, tau_m);
        let [by_q, by_qd, by_tau, ..] = &mut scratch.matrices;
        if joints.armature {
            let bodies = Scratch::bodies(joints, &scratch.inertia, &scratch.armature);
            let rigid = &mut scratch.rigid;
            forward_dynamics_derivatives_with(&bodies, rigid, q, qd, &scratch.tau, by_q, by_qd, by_tau);
        } else {
            let tau = &scratch.tau;
            forward_dynamics_derivatives_into(&joints.links, links, q, qd, tau, by_q, by_qd, by_tau);
        }
        joints.assemble(scratch, q, qd, by);
    }
}
