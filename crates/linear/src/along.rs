//! Linear models along a motion.

use sinew_plant::{Dynamics, Plant, Rates, State};

use crate::describing::{Described, Nonlinear, describe, refuse_beside_followers};
use crate::linearizer::{Linearizer, Matrices, OUTPUTS};
use crate::state_space::of_joints;
use crate::{LinearError, Options};

/// A moment of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Where the robot is and how fast, as [`Dynamics::forward`] takes it.
    pub x: State<f64>,
    /// The torques that act on its motors, N·m (N).
    pub tau_m: Vec<f64>,
}

/// Linear models about the moments of a motion, all with the same states, inputs and outputs.
///
/// ```text
/// δẋ = A(t) δx + B(t) δu,   δy = C(t) δx + D(t) δu      about x(t), u(t)
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    /// As of a [`StateSpace`](crate::StateSpace); drives and sensors are ideal.
    pub states: Vec<String>,
    /// The torques that act on the motors.
    pub inputs: Vec<String>,
    /// True motion and torque of the gears.
    pub outputs: Vec<String>,
    /// One model for each moment.
    pub models: Vec<Matrices>,
    /// For each moment the effects that are not linear over the amplitude of interest there.
    pub described: Vec<Vec<Described>>,
}

/// The linear models of `plant` with parameters `p` along a motion, by exact derivatives.
///
/// The robot need not rest: velocity, acceleration and its torques are part of each model. Friction is smooth where a
/// joint moves fast enough not to turn back within the amplitude of interest, and is described by its first harmonic
/// elsewhere.
///
/// # Errors
/// If the plant cannot be driven, or an effect that is not linear is to be refused.
///
/// # Panics
/// If `p` or a moment is of another plant.
pub fn linearize_along(
    plant: &Plant,
    p: &[f64],
    motion: &[Moment],
    options: &Options,
) -> Result<Along, LinearError> {
    plant.check_driven()?;
    let amplitude = match options.nonlinear {
        Nonlinear::Slope => None,
        Nonlinear::Describe(amplitude) | Nonlinear::Refuse(amplitude) => Some(amplitude),
    };
    let (mut plain, mut dynamics, mut rates) =
        (Linearizer::new(plant, p), Dynamics::new(plant, p), Rates::new(plant));
    // Effects with own states are replaced everywhere or nowhere, so that all models have the same states.
    let of_states = Linearizer::with_gains(plant, p, &with_states(plant, amplitude.is_some()), Vec::new());
    let layout = of_states.layout.clone();
    let (mut models, mut all) = (Vec::new(), Vec::new());
    for moment in motion {
        dynamics.forward(&moment.x, &moment.tau_m, &mut rates);
        let stands = dynamics.settled().unwrap_or(&moment.x);
        let found = amplitude.map_or_else(Vec::new, |a| describe(plant, p, stands, a));
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
        let model = if indices.is_empty() {
            plain.at(&moment.x, &moment.tau_m).clone()
        } else {
            let gains = described.iter().flat_map(|d| d.gains.clone()).collect();
            Linearizer::with_gains(plant, p, &indices, gains).at(&moment.x, &moment.tau_m).clone()
        };
        models.push(model);
        all.push(described);
    }
    let outputs = OUTPUTS.iter().flat_map(|quantity| of_joints(quantity, plant, &layout.driven));
    Ok(Along {
        states: layout.names(plant),
        inputs: of_joints("motor_torque", plant, &layout.driven),
        outputs: outputs.collect(),
        models,
        described: all,
    })
}

fn with_states(plant: &Plant, replaced: bool) -> Vec<usize> {
    (0..plant.effects().len()).filter(|&k| replaced && plant.effects()[k].effect.states() > 0).collect()
}
