//! Energy of links, motors and springs, and what the dampers take.

use sinew_model::{Scalar, Vector3};
use sinew_rigid::{kinetic_energy_with, potential_energy_with};

use crate::{ElasticJoints, Scratch};

impl ElasticJoints {
    /// Total energy: of the moving links and rotors, in gravity and in the springs.
    ///
    /// ```text
    /// H = ½ q̇ᵀ Mc q̇ + q̇ᵀ S θ̇ + ½ θ̇ᵀ B θ̇ + U(q) + ½ (θ − q)ᵀ K (θ − q)
    /// dH/dt = τ_mᵀ θ̇ − (θ̇ − q̇)ᵀ D (θ̇ − q̇)
    /// ```
    ///
    /// In the reduced model Mc is M and S is zero.
    ///
    /// `q`: nq, rad (m). `qd`, `theta`, `thetad`: nv. Returns J, gravity's share 0 at the world's origin.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn energy(&self, q: &[f64], qd: &[f64], theta: &[f64], thetad: &[f64]) -> f64 {
        self.energy_with(&mut Scratch::new(self), q, qd, theta, thetad)
    }

    /// [`ElasticJoints::energy`] for any kind of number.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    #[inline(always)]
    pub fn energy_with<S: Scalar>(
        &self,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        theta: &[S],
        thetad: &[S],
    ) -> S {
        let nv = self.model.nv;
        assert_eq!((theta.len(), thetad.len()), (nv, nv), "theta, thetad");
        let bodies = Scratch::bodies(self, &ws.inertia, &ws.armature);
        // ½ q̇ᵀ M q̇, the rotors of rigid joints in it, and U(q)
        let mut sum = kinetic_energy_with(&bodies, &mut ws.rigid, q, qd)
            + potential_energy_with(&bodies, &mut ws.rigid, q);
        if self.has_moving_rotors() {
            self.turn(ws, q, qd);
        }
        // ½ B (θ̇ + u·ω/N)²
        ws.tau.copy_from_slice(thetad);
        for rotor in &self.rotors {
            let turn = &ws.turn[rotor.row];
            let u = turn.rotation * Vector3::constant(rotor.axis);
            ws.tau[rotor.dof] += u.dot(turn.velocity) * rotor.ratio;
        }
        for dof in (0..nv).filter(|&dof| self.elastic[dof]) {
            sum += ws.tau[dof] * ws.tau[dof] * (0.5 * self.rotor_inertia[dof]);
        }
        // ½ δᵀ K δ
        let deflection = |dof: usize| theta[dof] - q[self.position[dof]];
        for s in &self.springs {
            sum += deflection(s.row) * deflection(s.column) * (0.5 * s.stiffness);
        }
        sum
    }

    /// Power that the dampers turn into heat.
    ///
    /// ```text
    /// P = (θ̇ − q̇)ᵀ D (θ̇ − q̇) ≥ 0
    /// ```
    ///
    /// `qd`, `thetad`: nv. Returns W.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn power_lost(&self, qd: &[f64], thetad: &[f64]) -> f64 {
        assert_eq!((qd.len(), thetad.len()), (self.model.nv, self.model.nv), "qd, thetad");
        let rate = |dof: usize| thetad[dof] - qd[dof];
        self.springs.iter().map(|s| rate(s.row) * s.damping * rate(s.column)).sum()
    }

    /// Power that the motors put in.
    ///
    /// ```text
    /// P = τ_mᵀ θ̇, with θ̇ = q̇ in rigid joints;   dH/dt = P − power lost
    /// ```
    ///
    /// `qd`, `thetad`, `tau_m`: nv. Returns W. That this and what the dampers take are all that changes the energy makes
    /// the robot passive from τ_m to θ̇.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn power_in(&self, qd: &[f64], thetad: &[f64], tau_m: &[f64]) -> f64 {
        let nv = self.model.nv;
        assert_eq!((qd.len(), thetad.len(), tau_m.len()), (nv, nv, nv), "qd, thetad, tau_m");
        (0..nv).map(|dof| tau_m[dof] * if self.elastic[dof] { thetad[dof] } else { qd[dof] }).sum()
    }
}
