//! The rest position of an elastic robot under gravity.

use faer::Mat;
use faer::linalg::solvers::Solve;
use sinew_effect::Derivative;
use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant, Rates, State};

use crate::LinearError;
use crate::seeds::{chunks, constants, lift};

/// A robot at rest, motors holding it.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Link-side positions by degree of freedom of the plant's model, rad (m); links that bend sag.
    pub q: Vec<f64>,
    /// Motor-side positions; equal to `q` in rigid joints.
    pub theta: Vec<f64>,
    /// Motor torques that hold it, N·m (N).
    pub tau_m: Vec<f64>,
}

// Torque left over, relative to the largest torque.
const BALANCED: f64 = 1e-13;
// Roundings of θ and q that a spring's torque may show.
const ROUNDINGS: f64 = 4.0;
const ROUNDS: usize = 100;

impl Equilibrium {
    /// The rest position with the robot's own joints at `q`: springs of links and joints carry gravity, motors hold the
    /// springs.
    ///
    /// ```text
    /// τ_j(θ − q) = g(q) − f_link,   τ_m = τ_j − f_motor
    /// ```
    ///
    /// # Errors
    /// If the springs cannot carry the links.
    ///
    /// # Panics
    /// If `p` has the wrong length, or `q` has not one number for each of the robot's own joints.
    pub fn at(plant: &Plant, p: &[f64], q: &[f64]) -> Result<Self, LinearError> {
        let nv = plant.model().nv;
        let q = plant.rest_position(p, q)?;
        let mut x = State::zero(plant);
        x.q.copy_from_slice(&q);
        x.theta.copy_from_slice(&q);
        let motion = MotorMotion { acceleration: &vec![0.0; nv], imposed: &vec![true; nv], links: None };
        let mut out = ImposedOut::new(nv);
        let mut dynamics = Dynamics::new(plant, p);
        dynamics.imposed_torque(&x, motion, &mut out);
        let needed = out.tau_j.clone();
        x.q = dynamics.position_standing_at(&q);
        solve_springs(plant, p, &mut x, &needed)?;
        // The motors' own forces where they now stand.
        let (mut rates, hold) = (Rates::new(plant), out.tau_m.clone());
        dynamics.forward(&x, &hold, &mut rates);
        for dof in (0..nv).filter(|&i| plant.elastic()[i]) {
            // τ_m = τ + (what is missing to B θ̈ = 0)
            out.tau_m[dof] -= dynamics.coefficients().rotor[dof] * rates.thetadd[dof];
        }
        Ok(Self { q, theta: x.theta, tau_m: out.tau_m })
    }
}

// Newton's method with the exact slope ∂τ_j/∂θ.
fn solve_springs(
    plant: &Plant,
    p: &[f64],
    x: &mut LinkState<f64>,
    needed: &[f64],
) -> Result<(), LinearError> {
    let elastic: Vec<usize> = (0..plant.model().nv).filter(|&i| plant.elastic()[i]).collect();
    let n = elastic.len();
    let mut dynamics = Dynamics::<Derivative>::new(plant, &constants(p));
    let mut rates = Rates::new(plant);
    let torque = constants(&vec![0.0; plant.model().nv]);
    let scale = needed.iter().fold(1.0, |s: f64, t| s.max(t.abs()));
    let mut worst = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (mut slope, mut missing) = (Mat::zeros(n, n), Mat::zeros(n, 1));
        for chunk in chunks(n.max(1)) {
            let mut seeded = lift(x);
            for (direction, k) in chunk.clone().enumerate().filter(|&(_, k)| k < n) {
                seeded.theta[elastic[k]] = Derivative::variable(x.theta[elastic[k]], direction);
            }
            dynamics.forward(&seeded, &torque, &mut rates);
            for (row, &dof) in elastic.iter().enumerate() {
                missing[(row, 0)] = needed[dof] - rates.tau_j[dof].value;
                for (direction, k) in chunk.clone().enumerate().filter(|&(_, k)| k < n) {
                    slope[(row, k)] = rates.tau_j[dof].derivative[direction];
                }
            }
        }
        worst = (0..n).map(|k| missing[(k, 0)].abs()).fold(0.0, f64::max);
        // A stiff spring turns the last digit of θ into torque.
        let last_digit = |k: usize| (slope[(k, k)] * x.theta[elastic[k]]).abs() * f64::EPSILON;
        let rounding = ROUNDINGS * (0..n).map(last_digit).fold(0.0, f64::max);
        if worst <= BALANCED * scale + rounding {
            return Ok(());
        }
        for (k, &dof) in elastic.iter().enumerate() {
            // In a gap the spring has no slope: go by the stiffness beyond it.
            if slope[(k, k)] == 0.0 {
                slope[(k, k)] = dynamics.coefficients().compliance[dof].value.recip();
            }
        }
        let step = slope.partial_piv_lu().solve(&missing);
        for (k, &dof) in elastic.iter().enumerate() {
            x.theta[dof] += step[(k, 0)];
        }
    }
    Err(LinearError::NoEquilibrium { robot: plant.model().name.clone(), missing: worst })
}
