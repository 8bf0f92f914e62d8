//! A controller that follows positions given at samples.

use sinew_data::{Quantity, Run};
use sinew_model::Robot;
use sinew_plant::Plant;
use sinew_rigid::{gravity, inverse_dynamics, mass_matrix};
use sinew_simulate::{Drive, Measured, Start};

use crate::error::CliError;

/// Follows the joint positions of a run, with the rigid robot, its rotors and the deflection of its springs as
/// feed-forward.
///
/// ```text
/// τ_J = ID(r, ṙ, r̈),   τ = τ_J + B r̈ + M_ii ω² (r + τ_J/K − θ) + 1.4 M_ii ω (ṙ − Δθ/Δt)
/// ```
#[derive(Debug)]
pub(crate) struct Tracking<'a> {
    robot: &'a Robot,
    time: Vec<f64>,
    /// For each degree of freedom its reference; joints that the run does not name stay where they start.
    reference: Vec<Vec<f64>>,
    inertia: Vec<f64>,
    omega: f64,
    last: Option<(f64, Vec<f64>)>,
}

/// The robot held with its links at `q` by its motors, its springs carrying gravity; coupled springs start without deflection.
///
/// ```text
/// θ = q + g(q)/K
/// ```
///
/// # Errors
/// If a link cannot carry its load.
pub(crate) fn held_at(robot: &Robot, plant: &Plant, q: &[f64]) -> Result<Start, CliError> {
    // where a joint's state counts with what the link behind it bends, all springs are solved together
    if plant.moving().len() < plant.model().nv {
        return Ok(Start::balanced(plant, &plant.parameters(), q)?);
    }
    let mut start = Start::sagging(plant, &plant.parameters(), q)?;
    let g = gravity(plant.model(), &start.q);
    for (joint, &dof) in robot.joints.iter().zip(plant.joints()) {
        start.theta[dof] += joint.stiffness.map_or(0.0, |K| g[dof] / K);
    }
    Ok(start)
}

impl<'a> Tracking<'a> {
    /// A controller of bandwidth `omega`, rad/s, for a robot that starts at `start`.
    pub fn new(robot: &'a Robot, run: &Run, start: &[f64], omega: f64) -> Self {
        let model = &robot.model;
        let of = |dof: usize| match run.signal(Quantity::JointPosition, model.dof_name(dof)) {
            Some(signal) => signal.values.clone(),
            None => vec![start[dof]; run.time.len()],
        };
        let mass = mass_matrix(model, start);
        Self {
            robot,
            time: run.time.clone(),
            reference: (0..model.nv).map(of).collect(),
            inertia: (0..model.nv).map(|k| mass[(k, k)] + robot.joints[k].rotor_inertia).collect(),
            omega,
            last: None,
        }
    }

    // r, ṙ and r̈ at sample k: by the parabola through it and its neighbours.
    fn point(&self, dof: usize, k: usize) -> (f64, f64, f64) {
        let (r, t, n) = (&self.reference[dof], &self.time, self.time.len());
        if n < 3 {
            return (r[k], 0.0, 0.0);
        }
        let m = k.clamp(1, n - 2);
        let (before, after) = (t[m] - t[m - 1], t[m + 1] - t[m]);
        let (left, right) = ((r[m] - r[m - 1]) / before, (r[m + 1] - r[m]) / after);
        let acceleration = 2.0 * (right - left) / (before + after);
        let velocity = (left * after + right * before) / (before + after);
        (r[k], velocity + acceleration * (t[k] - t[m]), acceleration)
    }
}

impl Drive for Tracking<'_> {
    fn command(&mut self, measured: Measured, tau: &mut [f64]) {
        let k = self.time.partition_point(|t| *t <= measured.time).saturating_sub(1);
        let points: Vec<_> = (0..tau.len()).map(|dof| self.point(dof, k)).collect();
        let of = |pick: fn(&(f64, f64, f64)) -> f64| points.iter().map(pick).collect::<Vec<f64>>();
        let (r, rd, rdd) = (of(|p| p.0), of(|p| p.1), of(|p| p.2));
        let model_torque = inverse_dynamics(&self.robot.model, &r, &rd, &rdd);
        for dof in 0..tau.len() {
            let theta = measured.motor_position[dof];
            let rate = match &self.last {
                Some((time, last)) => (theta - last[dof]) / (measured.time - time),
                None => rd[dof],
            };
            let (M, w, joint) = (self.inertia[dof], self.omega, &self.robot.joints[dof]);
            let tau_j = model_torque[dof];
            let target = r[dof] + joint.stiffness.map_or(0.0, |K| tau_j / K);
            tau[dof] = tau_j + joint.rotor_inertia * rdd[dof];
            tau[dof] += M * w * w * (target - theta) + 1.4 * M * w * (rd[dof] - rate);
        }
        self.last = Some((measured.time, measured.motor_position.to_vec()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_data::Signal;
    use sinew_model::samples;

    #[test]
    fn a_parabola_is_differentiated_exactly_on_uneven_stamps() {
        let robot = Robot::rigid(samples::pendulum(1.0, 0.5));
        let time = vec![0.0, 0.1, 0.25, 0.3];
        let values = time.iter().map(|t| 1.0 + 2.0 * t + 3.0 * t * t).collect();
        let signal = Signal::new(Quantity::JointPosition, "pivot", values);
        let run = Run::new("r".into(), time.clone(), vec![signal]).unwrap();
        let tracking = Tracking::new(&robot, &run, &[0.0], 20.0);
        for (k, t) in time.iter().enumerate() {
            let (_, velocity, acceleration) = tracking.point(0, k);
            approx::assert_relative_eq!(velocity, 2.0 + 6.0 * t, epsilon = 1e-12);
            approx::assert_relative_eq!(acceleration, 6.0, epsilon = 1e-11);
        }
    }
}
