//! The audit of passivity along a run.

use crate::{ElasticJoints, Workspace};

/// One instant of a run: the state and the motor torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<'a> {
    /// q: nq, rad (m).
    pub q: &'a [f64],
    /// q̇: nv, rad/s (m/s).
    pub qd: &'a [f64],
    /// θ: nv, rad (m).
    pub theta: &'a [f64],
    /// θ̇: nv, rad/s (m/s).
    pub thetad: &'a [f64],
    /// τ_m: nv, N·m (N).
    pub tau_m: &'a [f64],
}

/// The books of energy along a run: what the motors put in, what the dampers took, what is stored.
///
/// ```text
/// ∫ τ_mᵀ θ̇ dt = H(t) − H(0) + ∫ (θ̇ − q̇)ᵀ D (θ̇ − q̇) dt ≥ H(t) − H(0)
/// ```
///
/// Energy and losses are those of the model; the motion may come from anywhere. A motion that is not the model's, or
/// that an integrator has spoiled, shows as a defect of the equation on the left; a motion that gives more than was put
/// in shows as a negative margin of the inequality on the right.
///
/// # Example
/// A spring that swings freely after a push is passive, and its books balance:
/// ```
/// use sinew_flex_joint::{ElasticJoints, PassivityAudit, Sample, Workspace};
/// use sinew_model::{Robot, samples};
/// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
/// robot.joints[0].stiffness = Some(150.0);
/// robot.joints[0].damping = 0.5;
/// robot.joints[0].rotor_inertia = 0.05;
/// let arm = ElasticJoints::new(&robot)?;
/// let (mut ws, h) = (Workspace::new(&arm), 1e-4);
/// let [mut q, mut qd, mut theta, mut thetad] = [[0.0]; 4];
/// let tau_m = [1.0];
/// let start = Sample { q: &q, qd: &qd, theta: &theta, thetad: &thetad, tau_m: &tau_m };
/// let mut audit = PassivityAudit::new(&arm, &start);
/// for _ in 0..2000 {
///     let before = (q, qd, theta, thetad);
///     let (qdd, thetadd) = arm.forward_dynamics(&q, &qd, &theta, &thetad, &tau_m);
///     // a step by the mean of the rates at both ends
///     let (qm, tm) = ([q[0] + h * qd[0]], [theta[0] + h * thetad[0]]);
///     let (vm, wm) = ([qd[0] + h * qdd[0]], [thetad[0] + h * thetadd[0]]);
///     let (qdd2, thetadd2) = arm.forward_dynamics(&qm, &vm, &tm, &wm, &tau_m);
///     (q[0], theta[0]) = (q[0] + h / 2.0 * (qd[0] + vm[0]), theta[0] + h / 2.0 * (thetad[0] + wm[0]));
///     (qd[0], thetad[0]) = (qd[0] + h / 2.0 * (qdd[0] + qdd2[0]), thetad[0] + h / 2.0 * (thetadd[0] + thetadd2[0]));
///     let from = Sample { q: &before.0, qd: &before.1, theta: &before.2, thetad: &before.3, tau_m: &tau_m };
///     let to = Sample { q: &q, qd: &qd, theta: &theta, thetad: &thetad, tau_m: &tau_m };
///     audit.advance(&arm, &mut ws, h, &from, &to);
/// }
/// assert!(audit.lost > 0.0 && audit.worst_margin >= 0.0);
/// assert!(audit.worst_defect < 1e-5 * audit.work);
/// # Ok::<(), sinew_flex_joint::FlexJointError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PassivityAudit {
    /// H at the start, J.
    pub start: f64,
    /// H now, J.
    pub energy: f64,
    /// ∫ τ_mᵀ θ̇ dt, J.
    pub work: f64,
    /// ∫ (θ̇ − q̇)ᵀ D (θ̇ − q̇) dt, J.
    pub lost: f64,
    /// The largest |work − lost − (H − H(0))| seen, J.
    pub worst_defect: f64,
    /// The smallest work − (H − H(0)) seen, J: not negative along a passive run.
    pub worst_margin: f64,
    accelerations: [Vec<f64>; 4],
}

impl PassivityAudit {
    /// The books at the start of a run.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn new(joints: &ElasticJoints, at: &Sample) -> Self {
        let energy = joints.energy(at.q, at.qd, at.theta, at.thetad);
        Self {
            start: energy,
            energy,
            work: 0.0,
            lost: 0.0,
            worst_defect: 0.0,
            worst_margin: 0.0,
            accelerations: core::array::from_fn(|_| vec![0.0; joints.model().nv]),
        }
    }

    /// One step of `dt` s from `from` to `to`, between which the torques are linear in time (equal for held ones).
    ///
    /// ```text
    /// ∫ τθ̇ dt = [τ θ] − Δτ/dt ∫ θ dt,   ∫ x dt = dt/2 (x₀ + x₁) + dt²/10 (ẋ₀ − ẋ₁) + dt³/120 (ẍ₀ + ẍ₁) + O(dt⁷)
    /// ∫ P dt = dt/2 (P₀ + P₁) + dt²/12 (Ṗ₀ − Ṗ₁) + O(dt⁵)   for the dampers
    /// ```
    ///
    /// Accelerations are the model's.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn advance(
        &mut self,
        joints: &ElasticJoints,
        ws: &mut Workspace,
        dt: f64,
        from: &Sample,
        to: &Sample,
    ) {
        let [qdd_0, thetadd_0, qdd_1, thetadd_1] = &mut self.accelerations;
        for (x, qdd, thetadd) in [(from, &mut *qdd_0, &mut *thetadd_0), (to, &mut *qdd_1, &mut *thetadd_1)] {
            joints.forward_dynamics_into(ws, x.q, x.qd, x.theta, x.thetad, x.tau_m, qdd, thetadd);
        }
        for dof in 0..joints.model.nv {
            let motor = |x: &Sample| match joints.elastic[dof] {
                true => (x.theta[dof], x.thetad[dof]),
                false => (x.q[joints.position[dof]], x.qd[dof]),
            };
            let ((x_0, v_0), (x_1, v_1)) = (motor(from), motor(to));
            let (tau_0, tau_1) = (from.tau_m[dof], to.tau_m[dof]);
            // θ against its start: the angle itself may be large
            let (bend, snap) = (v_0 - v_1, thetadd_0[dof] + thetadd_1[dof]);
            let area = dt / 2.0 * (x_1 - x_0) + dt * dt / 10.0 * bend + dt.powi(3) / 120.0 * snap;
            self.work += tau_1 * (x_1 - x_0) - (tau_1 - tau_0) / dt * area;
        }
        let lost = |x: &Sample| joints.power_lost(x.qd, x.thetad);
        let rate = |x: &Sample, qdd: &[f64], thetadd: &[f64]| joints.power_lost_rate(x, qdd, thetadd);
        self.lost += dt / 2.0 * (lost(from) + lost(to))
            + dt * dt / 12.0 * (rate(from, qdd_0, thetadd_0) - rate(to, qdd_1, thetadd_1));
        self.energy = joints.energy_with(&mut ws.scratch, to.q, to.qd, to.theta, to.thetad);
        let margin = self.work - (self.energy - self.start);
        self.worst_margin = self.worst_margin.min(margin);
        self.worst_defect = self.worst_defect.max((margin - self.lost).abs());
    }
}

impl ElasticJoints {
    /// d/dt (θ̇ − q̇)ᵀ D (θ̇ − q̇).
    fn power_lost_rate(&self, x: &Sample, qdd: &[f64], thetadd: &[f64]) -> f64 {
        let slip = |dof: usize| x.thetad[dof] - x.qd[dof];
        let rate = |dof: usize| thetadd[dof] - qdd[dof];
        self.springs.iter().map(|s| 2.0 * slip(s.row) * s.damping * rate(s.column)).sum()
    }
}
