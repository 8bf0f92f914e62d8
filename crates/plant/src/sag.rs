//! How far links bend under gravity while the joints hold still.

use nalgebra::{DMatrix, DVector};
use sinew_effect::{DIRECTIONS, Derivative};
use sinew_model::Scalar;

use crate::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant, PlantError};

// Torque left over, relative to the largest torque of the springs.
const BALANCED: f64 = 1e-12;
// Steps of Newton's method, which needs three or four.
const ROUNDS: usize = 50;

impl Plant {
    /// The position at rest with the robot's own joints at `q`: the springs of bending links carry gravity and what
    /// else acts on links at rest. Without bending links `q` itself.
    ///
    /// ```text
    /// K_v q_v + g_v(q, q_v) − f_v = 0      Newton's method, with the exact derivative
    /// ```
    ///
    /// `q`: one number for each of [`Plant::joints`]. Returns nv of [`Plant::model`].
    ///
    /// # Errors
    /// If the links cannot carry their load.
    ///
    /// # Panics
    /// If `p` or `q` has the wrong length.
    pub fn rest_position(&self, p: &[f64], q: &[f64]) -> Result<Vec<f64>, PlantError> {
        let mut rest = self.straight(q);
        let n = self.virtual_joints.len();
        if n == 0 {
            return Ok(rest);
        }
        let constants =
            |x: &[f64]| -> Vec<Derivative> { x.iter().map(|&x| Derivative::constant(x)).collect() };
        let mut dynamics = Dynamics::<Derivative>::new(self, &constants(p));
        let (still, all) = (constants(&vec![0.0; self.model.nv]), vec![true; self.model.nv]);
        let motion = MotorMotion { acceleration: &still, imposed: &all, links: None };
        let mut out = ImposedOut::new(self.model.nv);
        let mut x = LinkState::<Derivative>::zero(self);
        for _ in 0..ROUNDS {
            let (mut missing, mut slope) = (DVector::zeros(n), DMatrix::zeros(n, n));
            for first in (0..n).step_by(DIRECTIONS) {
                let some = first..n.min(first + DIRECTIONS);
                x.q = constants(&rest);
                for (direction, k) in some.clone().enumerate() {
                    let dof = self.virtual_joints[k].dof;
                    x.q[dof] = Derivative::variable(rest[dof], direction);
                }
                x.theta.clone_from(&x.q);
                dynamics.imposed_motion(&x, motion, &mut out);
                for (row, v) in self.virtual_joints.iter().enumerate() {
                    // what besides the springs would have to hold the joint
                    missing[row] = -out.tau_j[v.dof].value;
                    some.clone().enumerate().for_each(|(direction, k)| {
                        slope[(row, k)] = out.tau_j[v.dof].derivative[direction];
                    });
                }
            }
            let carried = |v: &crate::VirtualJoint| dynamics.link_force()[v.dof].value.abs();
            let scale = self.virtual_joints.iter().map(carried).fold(0.0, f64::max);
            let Some(step) = slope.lu().solve(&missing).filter(|s| s.iter().all(|x| x.is_finite())) else {
                break;
            };
            self.virtual_joints.iter().zip(step.iter()).for_each(|(v, step)| rest[v.dof] += step);
            if missing.amax() <= BALANCED * scale || missing.amax() == 0.0 {
                return Ok(rest);
            }
        }
        Err(PlantError::Unsupported {
            robot: self.model.name.clone(),
            what: "its links cannot carry their load in this position".to_owned(),
            help: "look at stiffness and length in [links.….bending]".to_owned(),
        })
    }
}
