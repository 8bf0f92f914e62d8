//! A joint controller as drives have it: position and rate feedback on the motor side, model as feed-forward.

use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant};

use crate::{Drive, Measured, Trajectory};

/// Follows a trajectory with the measured motor positions.
///
/// ```text
/// τ = k_p (r − θ) + k_d (ṙ − Δθ/Δt) + τ_model(r, ṙ, r̈)
/// ```
///
/// It sees only what encoders show: θ with noise and steps, its rate as the difference of two samples.
#[derive(Debug)]
pub struct Controller<'a> {
    /// What to follow.
    pub reference: Trajectory,
    /// k_p of each degree of freedom, N·m/rad.
    pub proportional: Vec<f64>,
    /// k_d of each degree of freedom, N·m·s/rad.
    pub derivative: Vec<f64>,
    model: Dynamics<'a, f64>,
    state: LinkState<f64>,
    acceleration: Vec<f64>,
    out: ImposedOut<f64>,
    imposed: Vec<bool>,
    last: Option<(f64, Vec<f64>)>,
}

impl<'a> Controller<'a> {
    /// A controller of this `bandwidth` in rad/s, well damped, for the inertia that `model` has at the start of
    /// the trajectory. `model` is also the feed-forward, its motors moving with its links: a robot without its
    /// springs and friction is a usual one. In an elastic joint keep the bandwidth below the antiresonance √(K/J).
    ///
    /// ```text
    /// k_p = M_ii ω²,   k_d = 2 ζ M_ii ω,   ζ = 0.7
    /// ```
    ///
    /// # Panics
    /// If `p` has not the length of the model's parameters, the trajectory not one motion for each degree of freedom, or
    /// the model's links bend: a controller knows nothing of bending.
    pub fn new(model: &'a Plant, p: &[f64], reference: Trajectory, bandwidth: f64) -> Self {
        const DAMPING: f64 = 0.7;
        let nv = model.model().nv;
        if let Some(v) = model.virtual_joints().first() {
            let link = &model.model().links[v.link.0].name;
            panic!(
                "model: without links that bend, but link \"{link}\" does; a feed-forward takes it for rigid"
            );
        }
        assert_eq!(reference.joints.len(), nv, "reference: one motion for each degree of freedom");
        let mut controller = Self {
            reference,
            proportional: vec![0.0; nv],
            derivative: vec![0.0; nv],
            model: Dynamics::new(model, p),
            state: LinkState::zero(model),
            acceleration: vec![0.0; nv],
            out: ImposedOut::new(nv),
            imposed: vec![true; nv],
            last: None,
        };
        for dof in 0..nv {
            controller.state.q[dof] = controller.reference.at(dof, 0.0).position;
        }
        for dof in 0..nv {
            // M_ii = τ_i(q̈ = e_i) − τ_i(q̈ = 0)
            let still = controller.torque()[dof];
            controller.acceleration[dof] = 1.0;
            let inertia = controller.torque()[dof] - still;
            controller.acceleration[dof] = 0.0;
            controller.proportional[dof] = inertia * bandwidth * bandwidth;
            controller.derivative[dof] = 2.0 * DAMPING * inertia * bandwidth;
        }
        controller
    }

    // The model's torque at the present state and acceleration.
    fn torque(&mut self) -> &[f64] {
        self.state.theta.copy_from_slice(&self.state.q);
        self.state.thetad.copy_from_slice(&self.state.qd);
        let motion = MotorMotion { acceleration: &self.acceleration, imposed: &self.imposed, links: None };
        self.model.imposed_torque(&self.state, motion, &mut self.out);
        &self.out.tau_m
    }
}

impl Drive for Controller<'_> {
    fn command(&mut self, measured: Measured, tau: &mut [f64]) {
        for dof in 0..tau.len() {
            let r = self.reference.at(dof, measured.time);
            (self.state.q[dof], self.state.qd[dof]) = (r.position, r.velocity);
            self.acceleration[dof] = r.acceleration;
        }
        tau.copy_from_slice(self.torque());
        for dof in 0..tau.len() {
            let theta = measured.motor_position[dof];
            let rate = match &self.last {
                Some((time, last)) => (theta - last[dof]) / (measured.time - time),
                None => self.state.qd[dof],
            };
            // τ = τ_model + k_p (r − θ) + k_d (ṙ − θ̇)
            tau[dof] += self.proportional[dof] * (self.state.q[dof] - theta)
                + self.derivative[dof] * (self.state.qd[dof] - rate);
        }
        self.last = Some((measured.time, measured.motor_position.to_vec()));
    }
}
