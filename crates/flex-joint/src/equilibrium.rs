//! Where motors and links rest under gravity.

use nalgebra::{DMatrix, DVector};
use sinew_model::Scalar;
use sinew_rigid::{
    gravity_into, inverse_dynamics_derivatives_into, inverse_dynamics_with, potential_energy_into,
};

use crate::{ElasticJoints, FlexJointError, Scratch};

/// Links at rest against their springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// q: nq, rad (m).
    pub q: DVector<f64>,
    /// τ_m that holds the motors there, and the torque of gravity in rigid joints: nv, N·m (N).
    pub tau_m: DVector<f64>,
    /// The largest torque left over in an elastic joint, N·m (N).
    pub residual: f64,
    /// Steps taken.
    pub steps: usize,
    /// The smallest eigenvalue of K + ∂g/∂q in the elastic joints, N·m/rad: the links stay if it is positive.
    pub smallest_stiffness: f64,
}

impl Rest {
    /// True if the links come back after a small push.
    pub fn is_stable(&self) -> bool {
        self.smallest_stiffness > 0.0
    }
}

/// Steps of the search for a rest position.
const MOST_STEPS: usize = 200;
/// Torque left, relative to the largest torque of gravity and springs.
const BALANCE: f64 = 1e-12;
/// Rounding of positions, rad (m) by their size.
const ROUNDING: f64 = 1e-15;

impl ElasticJoints {
    /// The motor positions and torques that hold the links still at `q` against gravity.
    ///
    /// ```text
    /// τ_m = g(q),   θ = q + K⁻¹ g(q) in elastic joints, θ = q in rigid ones
    /// ```
    ///
    /// `q`: nq, rad (m). Returns (θ, τ_m): nv each; θ is 0 for the degrees of freedom of a floating base.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn equilibrium(&self, q: &[f64]) -> (DVector<f64>, DVector<f64>) {
        let (mut theta, mut tau_m) = (DVector::zeros(self.model.nv), DVector::zeros(self.model.nv));
        self.equilibrium_with(&mut Scratch::new(self), q, theta.as_mut_slice(), tau_m.as_mut_slice());
        (theta, tau_m)
    }

    /// [`ElasticJoints::equilibrium`] for any kind of number, into `theta` and `tau_m`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn equilibrium_with<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        theta: &mut [S],
        tau_m: &mut [S],
    ) {
        assert_eq!((theta.len(), tau_m.len()), (self.model.nv, self.model.nv), "theta, tau_m");
        // τ_m = g(q)
        let bodies = Scratch::bodies(self, &ws.inertia, &ws.armature);
        inverse_dynamics_with(&bodies, &mut ws.rigid, q, &ws.zeros, &ws.zeros, tau_m);
        // θ = q + K⁻¹ g(q)
        theta.fill(S::ZERO);
        for joint in self.model.joints.iter().filter(|j| j.mimic.is_none() && j.kind.nv() == 1) {
            theta[joint.first_dof] = q[joint.first_q];
        }
        for s in &self.springs {
            theta[s.row] += tau_m[s.column] * s.compliance;
        }
    }

    /// Where the links rest while the motors are held at `theta`.
    ///
    /// ```text
    /// g(q) = K (θ − q) in elastic joints;   a minimum of U(q) + ½ (θ − q)ᵀ K (θ − q) near `start`
    /// ```
    ///
    /// `theta`: nv, rad (m). `start`: nq, where the search begins; rigid joints and floating bases stay there, held by
    /// whatever holds them. Newton's method with K + ∂g/∂q; where that is not positive definite it is made so, and
    /// steps are shortened until the energy falls, so that the search ends where the links would come to rest. A
    /// start that is itself a balance, even an unstable one, is returned; [`Rest::is_stable`] tells.
    ///
    /// # Errors
    /// If the torques are not balanced to 1e-12 of the largest, or to the rounding of positions, after 200 steps.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// # Example
    /// A level link of 2 kg at 0.4 m on 150 N·m/rad sags until the spring carries it:
    /// ```
    /// use sinew_flex_joint::ElasticJoints;
    /// use sinew_model::{Robot, samples};
    /// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
    /// robot.joints[0].stiffness = Some(150.0);
    /// robot.joints[0].rotor_inertia = 0.05;
    /// let arm = ElasticJoints::new(&robot)?;
    /// let rest = arm.rest_position(&[1.6], &[1.6])?;
    /// approx::assert_relative_eq!(150.0 * (1.6 - rest.q[0]), 2.0 * 9.81 * 0.4 * rest.q[0].sin(), max_relative = 1e-12);
    /// assert!(rest.is_stable());
    /// # Ok::<(), sinew_flex_joint::FlexJointError>(())
    /// ```
    pub fn rest_position(&self, theta: &[f64], start: &[f64]) -> Result<Rest, FlexJointError> {
        let (nq, nv) = (self.model.nq, self.model.nv);
        assert_eq!((theta.len(), start.len()), (nv, nq), "theta, start");
        let dofs: Vec<usize> = (0..nv).filter(|&dof| self.elastic[dof]).collect();
        let mut balance = Balance::new(self, theta, dofs);
        let mut q = start.to_vec();
        for steps in 0..=MOST_STEPS {
            balance.evaluate(&q);
            if balance.left() <= balance.allowed {
                return Ok(balance.rest(q, steps));
            }
            let step = balance.step();
            balance.shorten(&mut q, &step);
        }
        balance.evaluate(&q);
        let worst = balance.torque.iamax();
        Err(FlexJointError::NoEquilibrium {
            joint: self.model.dof_name(balance.dofs[worst]).to_owned(),
            residual: balance.left(),
            iterations: MOST_STEPS,
            allowed: balance.allowed,
        })
    }
}

/// Springs against gravity with the motors held.
struct Balance<'a> {
    joints: &'a ElasticJoints,
    ws: sinew_rigid::Workspace,
    theta: &'a [f64],
    dofs: Vec<usize>,
    K: DMatrix<f64>,
    /// g(q), nv.
    gravity: DVector<f64>,
    /// K (θ − q) − g(q) of the elastic joints.
    torque: DVector<f64>,
    /// K + ∂g/∂q of the elastic joints.
    slope: DMatrix<f64>,
    /// Torque that may be left.
    allowed: f64,
}

impl<'a> Balance<'a> {
    fn new(joints: &'a ElasticJoints, theta: &'a [f64], dofs: Vec<usize>) -> Self {
        let K = joints.stiffness();
        let (n, nv) = (dofs.len(), joints.model.nv);
        Self {
            ws: sinew_rigid::Workspace::new(&joints.links),
            K: DMatrix::from_fn(n, n, |i, j| K[(dofs[i], dofs[j])]),
            gravity: DVector::zeros(nv),
            torque: DVector::zeros(n),
            slope: DMatrix::zeros(n, n),
            allowed: 0.0,
            joints,
            theta,
            dofs,
        }
    }

    fn deflection(&self, q: &[f64]) -> DVector<f64> {
        let dofs = self.dofs.iter();
        DVector::from_iterator(
            self.dofs.len(),
            dofs.map(|&dof| self.theta[dof] - q[self.joints.position[dof]]),
        )
    }

    fn evaluate(&mut self, q: &[f64]) {
        let (model, nv) = (&self.joints.links, self.joints.model.nv);
        gravity_into(model, &mut self.ws, q, self.gravity.as_mut_slice());
        let still = vec![0.0; nv];
        let [mut by_q, mut by_qd, mut M] = core::array::from_fn(|_| DMatrix::zeros(nv, nv));
        let (a, b, c) = (by_q.as_mut_slice(), by_qd.as_mut_slice(), M.as_mut_slice());
        inverse_dynamics_derivatives_into(model, &mut self.ws, q, &still, &still, a, b, c);
        let (n, dofs) = (self.dofs.len(), &self.dofs);
        let pull = &self.K * self.deflection(q);
        let weight = DVector::from_fn(n, |i, _| self.gravity[dofs[i]]);
        let largest = if n == 0 { 0.0 } else { pull.amax().max(weight.amax()) };
        self.torque = pull - weight;
        let slope = DMatrix::from_fn(n, n, |i, j| by_q[(dofs[i], dofs[j])]);
        self.slope = &self.K + (&slope + slope.transpose()) * 0.5;
        let place = dofs.iter().fold(1.0_f64, |m, &dof| m.max(q[self.joints.position[dof]].abs()));
        let steepest = self.slope.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        self.allowed = BALANCE * largest + ROUNDING * place * steepest;
    }

    fn left(&self) -> f64 {
        if self.torque.is_empty() { 0.0 } else { self.torque.amax() }
    }

    fn energy(&mut self, q: &[f64]) -> f64 {
        let d = self.deflection(q);
        potential_energy_into(&self.joints.links, &mut self.ws, q) + 0.5 * d.dot(&(&self.K * &d))
    }

    /// The step to where the linear springs balance, with a slope that is made positive where it is not.
    fn step(&self) -> DVector<f64> {
        if let Some(factors) = self.slope.clone().cholesky() {
            return factors.solve(&self.torque);
        }
        let modes = self.slope.clone().symmetric_eigen();
        let softest = self.K.clone().symmetric_eigenvalues().min();
        let along = modes.eigenvectors.tr_mul(&self.torque);
        let step = along.zip_map(&modes.eigenvalues, |t, slope| t / slope.abs().max(0.1 * softest));
        modes.eigenvectors * step
    }

    /// Takes as much of the step as lets the energy fall, or the torque where rounding hides the energy.
    fn shorten(&mut self, q: &mut [f64], step: &DVector<f64>) {
        let (start, before, left) = (q.to_vec(), self.energy(q), self.left());
        let slope = step.dot(&self.torque);
        let mut share = 1.0;
        for _ in 0..60 {
            for (&dof, step) in self.dofs.iter().zip(step.iter()) {
                let at = self.joints.position[dof];
                q[at] = start[at] + share * step;
            }
            if self.energy(q) <= before - 1e-4 * share * slope {
                return;
            }
            self.evaluate(q);
            if self.left() <= 0.5 * left {
                return;
            }
            share *= 0.5;
        }
        q.copy_from_slice(&start);
    }

    fn rest(self, q: Vec<f64>, steps: usize) -> Rest {
        let smallest = self.slope.clone().symmetric_eigenvalues();
        Rest {
            residual: self.left(),
            q: DVector::from_vec(q),
            tau_m: self.gravity,
            steps,
            smallest_stiffness: if smallest.is_empty() { f64::INFINITY } else { smallest.min() },
        }
    }
}
