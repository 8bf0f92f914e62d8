//! The static torques of a plant at a position, with their slopes.

use nalgebra::{DMatrix, DVector};
use sinew_effect::Derivative;
use sinew_plant::{Dynamics, GivenLinks, ImposedOut, LinkState, MotorMotion, Plant};

use crate::LinearError;
use crate::seeds::{chunks, constants};

/// A plant at rest with its motors held, evaluated at one position after another.
#[derive(Debug)]
pub(crate) struct Statics<'a> {
    dynamics: Dynamics<'a, Derivative>,
    x: LinkState<Derivative>,
    out: ImposedOut<Derivative>,
    /// The degrees of freedom that give way, springs of bending links included; all others stand still.
    pub elastic: Vec<usize>,
    // Places in `elastic` of what has no motor: bending links, bodies that effects put on springs.
    links: Vec<usize>,
}

// Torque left over, relative to the largest torque, and rounding of a position, which its spring turns into torque.
const BALANCED: f64 = 1e-13;
const ROUNDING: f64 = 4.0 * f64::EPSILON;
const ROUNDS: usize = 100;

/// What pulls at the elastic degrees of freedom, and how it changes with their positions.
#[derive(Debug, Clone)]
pub(crate) struct Torques {
    /// τ_j of the joints' springs, force of the links' own, N·m.
    pub spring: DVector<f64>,
    /// −∂τ_j/∂q: K, N·m/rad.
    pub spring_slope: DMatrix<f64>,
    /// g − f_link, what the springs must carry, N·m.
    pub weight: DVector<f64>,
    /// ∂(g − f_link)/∂q, N·m/rad.
    pub weight_slope: DMatrix<f64>,
}

impl<'a> Statics<'a> {
    pub fn new(plant: &'a Plant, p: &[f64]) -> Self {
        let gives_way = |&dof: &usize| plant.elastic()[dof] || !plant.driven()[dof];
        Self::over(plant, p, (0..plant.model().nv).filter(gives_way).collect())
    }

    /// The torques of other degrees of freedom than those with springs.
    pub fn over(plant: &'a Plant, p: &[f64], elastic: Vec<usize>) -> Self {
        let links = (0..elastic.len()).filter(|&row| !plant.driven()[elastic[row]]);
        Self {
            dynamics: Dynamics::new(plant, &constants(p)),
            x: LinkState::zero(plant),
            out: ImposedOut::new(plant.model().nv),
            links: links.collect(),
            elastic,
        }
    }

    /// The torques with links at `q` and motors at `theta`, nv numbers each.
    pub fn torques(&mut self, q: &[f64], theta: &[f64]) -> Torques {
        let (n, nv) = (self.elastic.len(), q.len());
        let mut torques = Torques {
            spring: DVector::zeros(n),
            spring_slope: DMatrix::zeros(n, n),
            weight: DVector::zeros(n),
            weight_slope: DMatrix::zeros(n, n),
        };
        let (still, all) = (constants(&vec![0.0; nv]), vec![true; nv]);
        let links = Some(GivenLinks { given: &all, acceleration: &still });
        let motion = MotorMotion { acceleration: &still, imposed: &all, links };
        self.x.theta = constants(theta);
        for chunk in chunks(n) {
            self.x.q = constants(q);
            for (direction, k) in chunk.clone().enumerate() {
                let dof = self.elastic[k];
                self.x.q[dof] = Derivative::variable(q[dof], direction);
            }
            self.dynamics.imposed_motion(&self.x, motion, &mut self.out);
            for (row, &dof) in self.elastic.iter().enumerate() {
                // g − f_link = τ_j + τ_l, where τ_l is what would still have to hold the link
                let (mut spring, mut weight) =
                    (self.out.tau_j[dof], self.out.tau_j[dof] + self.out.tau_l[dof]);
                // Without a motor the spring is the force on the link.
                if self.links.contains(&row) {
                    let force = self.dynamics.link_force()[dof];
                    (spring, weight) = (spring + force, weight + force);
                }
                (torques.spring[row], torques.weight[row]) = (spring.value, weight.value);
                for (direction, column) in chunk.clone().enumerate() {
                    torques.spring_slope[(row, column)] = -spring.derivative[direction];
                    torques.weight_slope[(row, column)] = weight.derivative[direction];
                }
            }
        }
        torques
    }

    /// Where the motors must stand so that the springs carry the links at `q`, by Newton's method.
    ///
    /// ```text
    /// τ_j(θ − q) = g(q) − f_link
    /// ```
    pub fn motors_that_hold(&mut self, q: &[f64]) -> Result<Vec<f64>, LinearError> {
        let mut theta = q.to_vec();
        if self.elastic.is_empty() {
            return Ok(theta);
        }
        let mut left = f64::INFINITY;
        for _ in 0..ROUNDS {
            let torques = self.torques(q, &theta);
            let mut missing = &torques.weight - &torques.spring;
            // No motor holds the spring of a link.
            self.links.iter().for_each(|&row| missing[row] = 0.0);
            left = missing.amax();
            let mut slope = torques.spring_slope;
            let stretch =
                |(k, &dof): (usize, &usize)| slope[(k, k)].abs() * theta[dof].abs().max(q[dof].abs());
            let rounding = ROUNDING * self.elastic.iter().enumerate().map(stretch).fold(0.0, f64::max);
            if left <= BALANCED * torques.weight.amax().max(torques.spring.amax()) + rounding {
                return Ok(theta);
            }
            for (k, &dof) in self.elastic.iter().enumerate() {
                // In a gap the spring has no slope: go by the stiffness beyond it.
                if slope[(k, k)] == 0.0 {
                    slope[(k, k)] = self.dynamics.coefficients().compliance[dof].value.recip();
                }
            }
            let Some(step) = slope.lu().solve(&missing) else { break };
            self.elastic.iter().zip(step.iter()).for_each(|(&dof, step)| theta[dof] += step);
        }
        let robot = self.dynamics.plant().model().name.clone();
        Err(LinearError::NoEquilibrium { robot, missing: left })
    }
}
