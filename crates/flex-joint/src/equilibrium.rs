//! Where the motors must stand so that the links stay.

use nalgebra::DVector;
use sinew_model::Scalar;
use sinew_rigid::inverse_dynamics_with;

use crate::{ElasticJoints, Workspace};

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
        self.equilibrium_with(&mut Workspace::new(self), q, theta.as_mut_slice(), tau_m.as_mut_slice());
        (theta, tau_m)
    }

    /// [`ElasticJoints::equilibrium`] for any kind of number, into `theta` and `tau_m`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn equilibrium_with<S: Scalar>(
        &self,
        ws: &mut Workspace<S>,
        q: &[S],
        theta: &mut [S],
        tau_m: &mut [S],
    ) {
        assert_eq!((theta.len(), tau_m.len()), (self.model.nv, self.model.nv), "theta, tau_m");
        // τ_m = g(q)
        let bodies = Workspace::bodies(self, &ws.inertia, &ws.armature);
        inverse_dynamics_with(&bodies, &mut ws.scratch, q, &ws.zeros, &ws.zeros, tau_m);
        // θ = q + K⁻¹ g(q)
        theta.fill(S::ZERO);
        for joint in self.model.joints.iter().filter(|j| j.mimic.is_none() && j.kind.nv() == 1) {
            theta[joint.first_dof] = q[joint.first_q];
        }
        for s in &self.springs {
            theta[s.row] += tau_m[s.column] * s.compliance;
        }
    }
}
