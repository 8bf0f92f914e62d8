//! How the levers of quasi-static joints change along a motion, as a force.

use sinew_effect::Kind;
use sinew_rigid::coriolis_matrix_with;

use crate::Dynamics;
use crate::condensed::Condensation;

impl<S: Kind> Dynamics<'_, S> {
    /// The force on the coordinates z = q + A q_s that comes from the change of A, of whichever torque w accelerates the
    /// elastic joints; none at rest. Needs the torques of springs, links and weight where the robot stands.
    ///
    /// ```text
    /// f_k = −wᵀ (∂A/∂z_k) q_s,   w = τ_j − g_e + f_e,   A = M_ee⁻¹ M_es
    ///     = −bᵀ (∂M/∂z_k) y,     b = M_ee⁻¹ w,   y = [−A q_s; q_s]
    ///     = −(C(z, y)ᵀ b + C(z, b)ᵀ y)_k         with Christoffel's C
    /// ```
    pub(crate) fn change_of_levers(&mut self, c: &mut Condensation<S>) {
        let plant = self.plant;
        let nv = plant.model.nv;
        c.change.fill(S::ZERO);
        if c.elastic.is_empty() {
            return;
        }
        let (mut b, mut y) = (core::mem::take(&mut c.pushed), core::mem::take(&mut c.bend_of_all));
        b.fill(S::ZERO);
        y.fill(S::ZERO);
        for s in 0..c.deflections().len() {
            y[c.dof(plant, s)] = c.deflections()[s];
        }
        for (e, &joint) in c.elastic.iter().enumerate() {
            for s in 0..c.deflections().len() {
                y[joint] -= c.lever(e, s) * c.deflections()[s];
            }
            // b = M_ee⁻¹ w
            for &other in &c.elastic {
                let net = self.tau_j[other] - c.weight(other) + self.link_force[other];
                b[joint] += c.response[joint + nv * other] * net;
            }
        }
        self.armature.fill(S::ZERO);
        let bodies = Self::bodies(plant, &self.coefficients, &self.armature);
        for (along, with) in [(&y, &b), (&b, &y)] {
            coriolis_matrix_with(&bodies, &mut self.scratch, &c.straight.q, along, &mut c.coriolis);
            for (change, column) in c.change.iter_mut().zip(c.coriolis.chunks_exact(nv)) {
                *change -= column.iter().zip(with).fold(S::ZERO, |sum, (entry, x)| sum + *entry * *x);
            }
        }
        (c.pushed, c.bend_of_all) = (b, y);
    }
}
