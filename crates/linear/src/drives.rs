//! Drives and sensors about a linear model of the mechanics.

use faer::Mat;
use sinew_effect::{Actuation, Derivative, Sensor};
use sinew_plant::{Dynamics, Plant};

use crate::LinearError;
use crate::linearizer::{Matrices, OUTPUTS};
use crate::seeds::{chunks, constants, lift};
use crate::state_space::{Mechanical, StateSpace, of_joints, output_names};

/// The whole plant, from commanded torques to what sensors show.
///
/// ```text
/// τ = (1 + κ) g(θ) s,   T ṡ + s = u(t − T_u):   δτ = (1 + κ) (g δs + s₀ ∂g/∂θ δθ)
/// y = sensor gain · true value, T_y late
/// ```
///
/// # Errors
/// If a drive is at its limit there.
pub(crate) fn connect(plant: &Plant, p: &[f64], mechanical: &Mechanical) -> Result<StateSpace, LinearError> {
    let layout = &mechanical.linearizer.layout;
    let Matrices { A, C, .. } = &mechanical.matrices;
    let (n, m, outputs) = (layout.len(), layout.driven.len(), C.nrows());
    let drives = Drives::new(plant, p, mechanical)?;
    let (B, D) = (&(&mechanical.matrices.B * &drives.mixed), &(&mechanical.matrices.D * &drives.mixed));
    let lagged: Vec<usize> = (0..m).filter(|&j| drives.path[j].lag > 0.0).collect();
    let states = n + lagged.len();
    let gain = |j: usize| drives.path[j].gain;
    // The torque that acts as a function of the states.
    let by_state = |j: usize, k: usize| -> f64 {
        let lag = lagged.iter().position(|&l| l == j);
        match (k < n, lag) {
            (true, _) => drives.slope[(j, k)],
            (false, Some(place)) if n + place == k => gain(j),
            _ => 0.0,
        }
    };
    let direct = |j: usize| if lagged.contains(&j) { 0.0 } else { gain(j) };
    let within = |matrix: &Mat<f64>, i: usize, k: usize| if k < n { matrix[(i, k)] } else { 0.0 };
    let through = |matrix: &Mat<f64>, i: usize, k: usize| -> f64 {
        (0..m).map(|j| matrix[(i, j)] * by_state(j, k)).sum()
    };
    let full_A = Mat::from_fn(states, states, |i, k| match i {
        i if i < n => within(A, i, k) + through(B, i, k),
        i if i == k => -1.0 / drives.path[lagged[i - n]].lag,
        _ => 0.0,
    });
    let full_B = Mat::from_fn(states, m, |i, j| match i {
        i if i < n => B[(i, j)] * direct(j),
        i if lagged[i - n] == j => 1.0 / drives.path[j].lag,
        _ => 0.0,
    });
    let (scale, output_delay) = sensors(plant, p, &layout.driven);
    let full_C = Mat::from_fn(outputs, states, |i, k| scale[i] * (within(C, i, k) + through(D, i, k)));
    let full_D = Mat::from_fn(outputs, m, |i, j| scale[i] * D[(i, j)] * direct(j));
    let lags = lagged.iter().map(|&j| format!("lag.{}", plant.model().dof_name(layout.driven[j])));
    Ok(StateSpace {
        states: layout.names(plant).into_iter().chain(lags).collect(),
        inputs: of_joints("motor_torque", plant, &layout.driven),
        outputs: output_names(plant, &layout.driven),
        A: full_A,
        B: full_B,
        C: full_C,
        D: full_D,
        input_delay: drives.path.iter().map(|path| path.delay.max(0.0)).collect(),
        output_delay,
        sample_time: None,
        at: mechanical.at.clone(),
        described: mechanical.described.clone(),
    })
}

// The path from command to acting torque of each input, and how the acting torque changes with the state.
struct Drives {
    path: Vec<Actuation<f64>>,
    slope: Mat<f64>,
    /// 1 + κ: where the torque of each drive acts.
    mixed: Mat<f64>,
}

impl Drives {
    fn new(plant: &Plant, p: &[f64], mechanical: &Mechanical) -> Result<Self, LinearError> {
        let layout = &mechanical.linearizer.layout;
        let (nv, n, m) = (layout.nv, layout.len(), layout.driven.len());
        let mut dynamics = Dynamics::new(plant, &constants(p));
        let mut x = lift(&mechanical.x);
        let mut path = vec![Actuation::default(); nv];
        let mut slope = Mat::zeros(m, n);
        let plain = Dynamics::new(plant, p);
        let mut given = vec![0.0; nv];
        plain.of_drives(&mechanical.at.tau_m, &mut given);
        for chunk in chunks(n) {
            for (direction, k) in chunk.clone().enumerate() {
                layout.seed(&mut x, k, direction, 1.0);
            }
            dynamics.actuation(&x, &mut path);
            for (direction, k) in chunk.enumerate() {
                for (j, &dof) in layout.driven.iter().enumerate() {
                    // s₀ = (1 + κ)⁻¹ τ/g
                    let command = given[dof] / path[dof].gain.value;
                    slope[(j, k)] = command * path[dof].gain.derivative[direction];
                }
                layout.seed(&mut x, k, direction, 0.0);
            }
        }
        for &dof in &layout.driven {
            let (needed, limit) = (given[dof] / path[dof].gain.value, path[dof].limit.value);
            if (needed * limit).abs() > 1.0 {
                let joint = plant.model().dof_name(dof).to_owned();
                return Err(LinearError::AtLimit { joint, needed, limit: 1.0 / limit });
            }
        }
        let value = |a: &Actuation<Derivative>| Actuation {
            gain: a.gain.value,
            lag: a.lag.value,
            delay: a.delay.value,
            limit: a.limit.value,
        };
        let share = &plain.coefficients().crosstalk;
        let mixed =
            Mat::from_fn(m, m, |i, j| f64::from(i == j) + share[layout.driven[i] * nv + layout.driven[j]]);
        Ok(Self { path: layout.driven.iter().map(|&dof| value(&path[dof])).collect(), slope, mixed })
    }
}

// Gain and delay of each output.
fn sensors(plant: &Plant, p: &[f64], driven: &[usize]) -> (Vec<f64>, Vec<f64>) {
    let dynamics = Dynamics::new(plant, p);
    let (position, torque) = (dynamics.reading(Sensor::JointPosition), dynamics.reading(Sensor::JointTorque));
    let of = |quantity: &str, dof: usize| match quantity {
        // A rate has the gain and the delay of its encoder.
        "joint_position" | "joint_velocity" => (position[dof].gain, position[dof].delay),
        "joint_torque" => (torque[dof].gain, torque[dof].delay),
        _ => (1.0, 0.0),
    };
    let all = OUTPUTS.iter().flat_map(|quantity| driven.iter().map(move |&dof| of(quantity, dof)));
    all.unzip()
}
