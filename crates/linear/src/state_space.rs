//! The linear model of a plant about a rest position.

use faer::Mat;
use sinew_plant::{Dynamics, Plant, State};

use crate::describing::{Described, Nonlinear, describe, refuse_beside_followers};
use crate::drives::connect;
use crate::linearizer::{Linearizer, Matrices, OUTPUTS};
use crate::{Equilibrium, LinearError};

/// A linear system with named states, inputs and outputs, in deviations from a rest position.
///
/// ```text
/// ẋ = A x + B u(t − T_u),   y = C x + D u,   each output read T_y late         of continuous time
/// x⁺ = A x + B u,           y = C x + D u                                       of discrete time
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// `q.J` of every joint, `theta.J` of the elastic ones, `v.LINK.K` of links that bend and have inertia; their rates
    /// `qd.J`, `thetad.J` and `vd.LINK.K`; then the effects'
    /// own states `z.EFFECT@PLACE.K` and the drives' `lag.J`.
    pub states: Vec<String>,
    /// `motor_torque.J`: the torque as it is commanded.
    pub inputs: Vec<String>,
    /// `motor_position.J`, `motor_velocity.J`, `joint_position.J`, `joint_velocity.J`, `joint_torque.J`, as their
    /// sensors show them.
    pub outputs: Vec<String>,
    /// ∂ẋ/∂x.
    pub A: Mat<f64>,
    /// ∂ẋ/∂u.
    pub B: Mat<f64>,
    /// ∂y/∂x.
    pub C: Mat<f64>,
    /// ∂y/∂u.
    pub D: Mat<f64>,
    /// Dead time of each input, s.
    pub input_delay: Vec<f64>,
    /// How late each output is read, s.
    pub output_delay: Vec<f64>,
    /// Time between samples, s; none for continuous time.
    pub sample_time: Option<f64>,
    /// Where it holds.
    pub at: Equilibrium,
    /// The effects that are not linear over the amplitude of interest, and what stands for them.
    pub described: Vec<Described>,
}

/// How a plant is taken for linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// What is done with effects that are not linear.
    pub nonlinear: Nonlinear,
}

/// The linear model of `plant` with parameters `p` about rest with links at `q`, by exact derivatives; effects that
/// are not linear over 0.01 rad at 10 Hz by their describing functions.
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
    linearize_with(plant, p, q, &Options::default())
}

/// [`linearize`] with another treatment of effects that are not linear.
///
/// # Errors
/// As [`linearize`], and if such an effect is to be refused.
///
/// # Panics
/// If `p` or `q` has the wrong length.
pub fn linearize_with(
    plant: &Plant,
    p: &[f64],
    q: &[f64],
    options: &Options,
) -> Result<StateSpace, LinearError> {
    let mechanical = Mechanical::new(plant, p, q, options)?;
    connect(plant, p, &mechanical)
}

/// The linear model of the mechanics alone, from acting torques to true motion, before it is handed out.
#[derive(Debug)]
pub(crate) struct Mechanical<'a> {
    pub linearizer: Linearizer<'a>,
    pub matrices: Matrices,
    /// The state, in which elastic joints count with what links that follow their load bend.
    pub x: State<f64>,
    /// The robot as it stands.
    pub stands: State<f64>,
    pub at: Equilibrium,
    pub described: Vec<Described>,
}

impl<'a> Mechanical<'a> {
    pub fn new(plant: &'a Plant, p: &[f64], q: &[f64], options: &Options) -> Result<Self, LinearError> {
        plant.check_driven()?;
        let at = Equilibrium::at(plant, p, q)?;
        let mut stands = State::zero(plant);
        stands.q.copy_from_slice(&at.q);
        stands.theta.copy_from_slice(&at.theta);
        let mut x = stands.clone();
        x.q = Dynamics::new(plant, p).position_standing_at(&at.q);
        let found = match options.nonlinear {
            Nonlinear::Slope => Vec::new(),
            Nonlinear::Describe(amplitude) | Nonlinear::Refuse(amplitude) => {
                describe(plant, p, &stands, amplitude)
            }
        };
        if let (Nonlinear::Refuse(amplitude), false) = (options.nonlinear, found.is_empty()) {
            return Err(LinearError::NotLinear {
                robot: plant.model().name.clone(),
                effects: found.into_iter().map(|(_, d)| d.effect).collect(),
                size: amplitude.size,
                frequency: amplitude.frequency,
            });
        }
        refuse_beside_followers(plant, &found)?;
        let (indices, described): (Vec<usize>, Vec<Described>) = found.into_iter().unzip();
        let gains = described.iter().flat_map(|d| d.gains.clone()).collect();
        let mut linearizer = Linearizer::with_gains(plant, p, &indices, gains);
        let matrices = linearizer.at(&x, &at.tau_m).clone();
        Ok(Self { linearizer, matrices, x, stands, at, described })
    }
}

/// The names of outputs, quantity by quantity.
pub(crate) fn output_names(plant: &Plant, driven: &[usize]) -> Vec<String> {
    let of_joints = |quantity: &&str| of_joints(quantity, plant, driven);
    OUTPUTS.iter().flat_map(of_joints).collect()
}

/// `quantity.J` of every driven joint.
pub(crate) fn of_joints(quantity: &str, plant: &Plant, driven: &[usize]) -> Vec<String> {
    driven.iter().map(|&dof| format!("{quantity}.{}", plant.model().dof_name(dof))).collect()
}
