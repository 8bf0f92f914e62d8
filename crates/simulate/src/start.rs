//! Where a robot starts.

use sinew_plant::{Dynamics, ImposedOut, MotorMotion, Plant, Rates, State};

use crate::SimulateError;

/// A robot at rest, by degree of freedom of the plant's model, as a state has it: see [`Dynamics::forward`] where links
/// follow their load at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Link-side positions, and those of virtual joints.
    pub q: Vec<f64>,
    /// Motor-side positions; those of rigid joints are not looked at.
    pub theta: Vec<f64>,
}

// Torque left over, relative to the torques in play.
const BALANCED: f64 = 1e-12;
const SWEEPS: usize = 200;
// Step of the difference quotient of a spring, rad: far below any gap, far above rounding.
const NUDGE: f64 = 1e-7;

impl Start {
    /// Springs without deflection: θ = q.
    pub fn at(q: &[f64]) -> Self {
        Self { q: q.to_vec(), theta: q.to_vec() }
    }

    /// Springs of joints without deflection, θ = q, and links that sag under gravity: `q` for each joint, in the order
    /// of [`Plant::joints`].
    ///
    /// # Errors
    /// If a link cannot carry its load.
    ///
    /// # Panics
    /// If `p` or `q` has the wrong length.
    pub fn sagging(plant: &Plant, p: &[f64], q: &[f64]) -> Result<Self, SimulateError> {
        Ok(Self::at(&plant.rest_position(p, q)?))
    }

    /// Springs of joints and links that carry gravity with the joints at `q`, so that nothing moves while the motors
    /// hold; one number for each joint, in the order of [`Plant::joints`].
    ///
    /// ```text
    /// τ_j(θ − q) = g(q) − f_link(q, 0)
    /// ```
    ///
    /// # Errors
    /// If no motor position does it.
    ///
    /// # Panics
    /// If `p` or `q` has the wrong length.
    pub fn balanced(plant: &Plant, p: &[f64], q: &[f64]) -> Result<Self, SimulateError> {
        let nv = plant.model().nv;
        let q = plant.rest_position(p, q)?;
        let mut dynamics = Dynamics::new(plant, p);
        let mut x = State::zero(plant);
        x.q.copy_from_slice(&q);
        x.theta.copy_from_slice(&q);
        let motion = MotorMotion { acceleration: &vec![0.0; nv], imposed: &vec![true; nv], links: None };
        let mut out = ImposedOut::new(nv);
        dynamics.imposed_motion(&x, motion, &mut out);
        let needed = out.tau_j;
        let scale = needed.iter().fold(1.0, |s: f64, t| s.max(t.abs()));
        let q = dynamics.position_standing_at(&q);
        x.q.copy_from_slice(&q);
        let (no_torque, mut rates) = (vec![0.0; nv], Rates::new(plant));
        let elastic: Vec<usize> = (0..nv).filter(|&i| plant.elastic()[i]).collect();
        // Joint after joint, over and over: a stiffness matrix is definite, so this converges also where springs
        // are coupled.
        for _ in 0..SWEEPS {
            let mut worst = 0.0f64;
            for &dof in &elastic {
                let mut torque = |x: &State<f64>| {
                    dynamics.forward(x, &no_torque, &mut rates);
                    rates.tau_j[dof]
                };
                let missing = needed[dof] - torque(&x);
                worst = worst.max(missing.abs());
                let here = x.theta[dof];
                x.theta[dof] += NUDGE * missing.signum();
                let slope = (needed[dof] - missing - torque(&x)).abs() / NUDGE;
                let compliance = dynamics.coefficients().compliance[dof];
                // θ ← θ + (τ needed − τ_j)/K; in a gap, where K vanishes, by the stiffness beyond it.
                let step = if slope > 0.0 { missing / slope } else { missing * compliance };
                x.theta[dof] = here + step;
            }
            if worst <= BALANCED * scale {
                return Ok(Self { q, theta: x.theta });
            }
        }
        Err(SimulateError::BadRequest {
            place: format!("robot \"{}\"", plant.model().name),
            what: "the springs cannot carry gravity in this position".to_owned(),
            help: "start with springs at rest, or look at stiffness and gap of its joints".to_owned(),
        })
    }
}
