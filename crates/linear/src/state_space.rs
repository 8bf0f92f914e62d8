//! The linear model of a plant about a rest position.

use faer::Mat;
use sinew_effect::Derivative;
use sinew_plant::{Dynamics, LinkState, Plant, Rates};

use crate::equilibrium::lift;
use crate::seeds::{chunks, constants};
use crate::{Equilibrium, LinearError};

/// A linear system with named states, inputs and outputs, in deviations from a rest position.
///
/// ```text
/// ẋ = A x + B u,   y = C x + D u
/// ```
#[derive(Debug, Clone)]
pub struct StateSpace {
    /// `q.J` of every joint, `theta.J` of the elastic ones, their rates `qd.J` and `thetad.J`, then the effects'
    /// own states `z.EFFECT@PLACE.K`.
    pub states: Vec<String>,
    /// `motor_torque.J`: the torque that acts; lag, delay and gain of the drives are not part of the model.
    pub inputs: Vec<String>,
    /// `motor_position.J`, `motor_velocity.J`, `joint_position.J`, `joint_velocity.J`, `joint_torque.J`: true
    /// values, without errors of sensors.
    pub outputs: Vec<String>,
    /// ∂ẋ/∂x.
    pub A: Mat<f64>,
    /// ∂ẋ/∂u.
    pub B: Mat<f64>,
    /// ∂y/∂x.
    pub C: Mat<f64>,
    /// ∂y/∂u.
    pub D: Mat<f64>,
    /// Where it holds.
    pub at: Equilibrium,
}

/// The linear model of `plant` with parameters `p` about rest with links at `q`, by exact derivatives.
///
/// Friction counts with its slope at rest: a smooth sign function holds a motor almost fast, as sticking friction
/// does.
///
/// # Errors
/// If the plant cannot be driven, or its springs cannot carry the links there.
///
/// # Panics
/// If `p` or `q` has the wrong length.
///
/// # Example
/// A hanging link of J = 0.5 kg·m², m g l = 2·9.81·0.4 N·m: q̈ = −(m g l/J) q + τ/J:
/// ```
/// use sinew_model::{Robot, samples::hanging_link};
/// use sinew_plant::Plant;
/// let robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4));
/// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let linear = sinew_linear::linearize(&plant, &[], &[0.0]).unwrap();
/// assert_eq!(linear.states, ["q.joint", "qd.joint"]);
/// assert!((linear.A[(1, 0)] + 2.0 * 9.81 * 0.4 / 0.5).abs() < 1e-12);
/// assert!((linear.B[(1, 0)] - 2.0).abs() < 1e-12);
/// ```
pub fn linearize(plant: &Plant, p: &[f64], q: &[f64]) -> Result<StateSpace, LinearError> {
    plant.check_driven()?;
    let at = Equilibrium::at(plant, p, q)?;
    let layout = Layout::new(plant);
    let (n, m) = (layout.len(), layout.nv);
    let mut x = LinkState::zero(plant);
    x.q.copy_from_slice(&at.q);
    x.theta.copy_from_slice(&at.theta);
    let mut dynamics = Dynamics::<Derivative>::new(plant, &constants(p));
    let mut rates = Rates::new(plant);
    let outputs = OUTPUTS.len() * m;
    let (mut A, mut B) = (Mat::zeros(n, n), Mat::zeros(n, m));
    let (mut C, mut D) = (Mat::zeros(outputs, n), Mat::zeros(outputs, m));
    for chunk in chunks(n + m) {
        let (mut state, mut tau) = (lift(&x), constants(&at.tau_m));
        for (direction, k) in chunk.clone().enumerate() {
            layout.seed(&mut state, &mut tau, k, direction);
        }
        dynamics.forward(&state, &tau, &mut rates);
        let (rate, output) = (layout.rates(&state, &rates), layout.outputs(&state, &rates));
        for (direction, k) in chunk.enumerate() {
            let (into_rate, into_output, column) =
                if k < n { (&mut A, &mut C, k) } else { (&mut B, &mut D, k - n) };
            for (row, value) in rate.iter().enumerate() {
                into_rate[(row, column)] = value.derivative[direction];
            }
            for (row, value) in output.iter().enumerate() {
                into_output[(row, column)] = value.derivative[direction];
            }
        }
    }
    let joint = |dof: usize| plant.model().dof_name(dof);
    let of_joints =
        |quantity: &&str| (0..m).map(|dof| format!("{quantity}.{}", joint(dof))).collect::<Vec<_>>();
    Ok(StateSpace {
        states: layout.names(plant),
        inputs: of_joints(&"motor_torque"),
        outputs: OUTPUTS.iter().flat_map(of_joints).collect(),
        A,
        B,
        C,
        D,
        at,
    })
}

const OUTPUTS: [&str; 5] =
    ["motor_position", "motor_velocity", "joint_position", "joint_velocity", "joint_torque"];

/// The order of the states: positions of joints and elastic motors, their rates, own states.
#[derive(Debug)]
pub(crate) struct Layout {
    pub nv: usize,
    pub elastic: Vec<usize>,
    nz: usize,
}

impl Layout {
    pub fn new(plant: &Plant) -> Self {
        let nv = plant.model().nv;
        let elastic = (0..nv).filter(|&i| plant.elastic()[i]).collect();
        Self { nv, elastic, nz: plant.state_len() }
    }

    /// Number of positions.
    pub fn positions(&self) -> usize {
        self.nv + self.elastic.len()
    }

    /// Names of the positions: `q.J`, `theta.J`.
    pub fn coordinates(&self, plant: &Plant) -> Vec<String> {
        let joint = |dof: usize| plant.model().dof_name(dof);
        let links = (0..self.nv).map(|dof| format!("q.{}", joint(dof)));
        links.chain(self.elastic.iter().map(|&dof| format!("theta.{}", joint(dof)))).collect()
    }

    fn len(&self) -> usize {
        2 * self.positions() + self.nz
    }

    fn names(&self, plant: &Plant) -> Vec<String> {
        let positions = self.coordinates(plant);
        let rates = positions.iter().map(|name| name.replacen('.', "d.", 1));
        let own = plant.effects().iter().flat_map(|active| {
            let label = active.label();
            (0..active.effect.states()).map(move |k| format!("z.{label}.{k}"))
        });
        positions.iter().cloned().chain(rates).chain(own).collect()
    }

    // Makes variable k (a state, or beyond them an input) the one of `direction`.
    fn seed(&self, x: &mut LinkState<Derivative>, tau: &mut [Derivative], k: usize, direction: usize) {
        let np = self.positions();
        let (q, theta, k) = match k {
            k if k < np => (&mut x.q, &mut x.theta, k),
            k if k < 2 * np => (&mut x.qd, &mut x.thetad, k - np),
            k if k < self.len() => return mark(&mut x.z[k - 2 * np], direction),
            k => return mark(&mut tau[k - self.len()], direction),
        };
        if k >= self.nv {
            return mark(&mut theta[self.elastic[k - self.nv]], direction);
        }
        mark(&mut q[k], direction);
        // A rigid joint's motor moves with it.
        if !self.elastic.contains(&k) {
            mark(&mut theta[k], direction);
        }
    }

    fn rates(&self, x: &LinkState<Derivative>, rates: &Rates<Derivative>) -> Vec<Derivative> {
        let motors = |of: &[Derivative]| self.elastic.iter().map(|&dof| of[dof]).collect::<Vec<_>>();
        [x.qd.clone(), motors(&x.thetad), rates.qdd.clone(), motors(&rates.thetadd), rates.zd.clone()]
            .concat()
    }

    fn outputs(&self, x: &LinkState<Derivative>, rates: &Rates<Derivative>) -> Vec<Derivative> {
        [&x.theta[..], &x.thetad, &x.q, &x.qd, &rates.tau_j].concat()
    }
}

fn mark(x: &mut Derivative, direction: usize) {
    *x = Derivative::variable(x.value, direction);
}
