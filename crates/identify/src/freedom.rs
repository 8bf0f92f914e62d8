//! What the links do along a record: move with their motors, move as a reference says, or swing on their springs.

use faer::{Mat, Side};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, GivenLinks, MotorMotion, Plant};
use sinew_rigid::{Workspace, mass_matrix_into};

use crate::least_squares::Normal;
use crate::record::{Record, Reduction};

/// What the link of each degree of freedom does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Freedom {
    /// It is told how to move: with its motor, or as given.
    pub imposed: Vec<bool>,
    /// It moves as the record says.
    pub given: Vec<bool>,
    /// The robot's own degree of freedom that it is; none of a virtual joint, which swings freely and in no record.
    pub joints: Vec<Option<usize>>,
    /// Steps in which springs swing from one grid step to the next.
    pub parts: usize,
}

/// Where the links of a reference are.
#[derive(Debug, Clone)]
pub(crate) struct Links {
    /// q, q̇, q̈ at each grid step, by degree of freedom; none of joints that move with their motor.
    pub motion: Vec<Option<Vec<[f64; 3]>>>,
}

/// Whether links on springs follow a reference, where a record has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Springs {
    /// They move as the reference says; what is missing there is a torque on the link.
    Given,
    /// They are simulated.
    Simulated,
}

// A spring is simulated while its mode turns by less than this in the shortest step; a stiffer one follows its load.
const FASTEST_TURN: f64 = 0.7;

// The same about a reference that the model has smoothed: it has no noise that a coarse step would let through.
const FASTEST_TURN_ABOUT_MODEL: f64 = 1.5;

// A step of Runge–Kutta takes x⁶/144 of a mode that turns by x: 8 % of 1.5, 0.4 % of 0.9. So much the fastest mode may turn in
// a step of this many seconds or less, which only modes above 150 Hz exceed; in longer ones it turns by less.
const SHORT_STEP: f64 = 0.001;
const TURN_OF_LONG_STEP: f64 = 0.9;

// Turn or decay of a mode in a step at which the steps of a Runge–Kutta method of order four still die out, where
// only derivatives or smoothed motions are asked for: 2.8, less a tenth for poses between those that are looked at.
const STABLE: f64 = 2.5;

impl Freedom {
    /// Of a plant along a record. Rigid joints, and springs too stiff for the grid, move with their motor.
    pub fn of(plant: &Plant, p: &[f64], record: &Record, springs: Springs) -> Self {
        // Of each spring by itself, of all together.
        let [alone, together] = match record.reduction {
            Reduction::Kernel | Reduction::Thinned(_) => [FASTEST_TURN, STABLE],
            Reduction::Mean | Reduction::Innovations(_) => [FASTEST_TURN_ABOUT_MODEL; 2],
        };
        let links = record.links.as_ref().filter(|_| springs == Springs::Given);
        let mut joints = vec![None; plant.model().nv];
        plant.joints().iter().enumerate().for_each(|(joint, &dof)| joints[dof] = Some(joint));
        let moves = |joint: usize| links.is_some_and(|l| l.motion[joint].is_some());
        let is_given = |i: usize| plant.elastic()[i] && joints[i].is_some_and(moves);
        let given: Vec<bool> = (0..plant.model().nv).map(is_given).collect();
        let own: Vec<bool> = joints.iter().map(Option::is_some).collect();
        if plant.elastic().iter().zip(&given).all(|(elastic, given)| elastic == given) {
            return Self { imposed: own, given, joints, parts: 1 };
        }
        let is_free = |turn: Option<f64>| turn.is_some_and(|turn| turn < alone);
        let along = SpringsAlong::of(plant, p, record);
        let told = |(turn, given): (Option<f64>, &bool)| *given || !is_free(turn);
        let turns = along.turns(plant).into_iter().zip(&given);
        let mut imposed: Vec<bool> = turns.map(told).zip(&own).map(|(told, own)| told && *own).collect();
        along.impose_unstable(&mut imposed, &own, together);
        let parts = along.parts(&imposed, record.most_parts);
        Self { imposed, given, joints, parts }
    }

    /// The motion that motors and links are told.
    pub fn motion<'a, S: Scalar>(&'a self, motor: &'a [S], link: &'a [S]) -> MotorMotion<'a, S> {
        let given = self.given.contains(&true);
        let links = given.then_some(GivenLinks { given: &self.given, acceleration: link });
        MotorMotion { acceleration: motor, imposed: &self.imposed, links }
    }

    /// True if no link is told how to move.
    pub fn is_free(&self) -> bool {
        self.imposed.iter().all(|imposed| !imposed)
    }
}

// The springs of a plant and the masses that they carry along a record.
struct SpringsAlong {
    // K and D of each degree of freedom; K of a rigid joint is infinite.
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    // M in some poses, the middle one first.
    masses: Vec<Mat<f64>>,
    // The shortest step in which they may swing.
    step: f64,
}

// Poses along a record in which masses are looked at, besides the one in its middle.
const POSES: usize = 32;

impl SpringsAlong {
    fn of(plant: &Plant, p: &[f64], record: &Record) -> Self {
        let (model, nv) = (plant.model(), plant.model().nv);
        let dynamics = Dynamics::new(plant, p);
        let mut workspace = Workspace::new(model);
        let mass_at = |sample: usize| {
            let q: Vec<f64> = record.theta.iter().map(|t| t[sample]).collect();
            let mut mass = vec![0.0; nv * nv];
            mass_matrix_into(model, &mut workspace, &plant.straight(&q), &mut mass);
            Mat::from_fn(nv, nv, |i, j| mass[i * nv + j])
        };
        let middle = record.len() / 2;
        let poses = [middle].into_iter().chain((0..POSES).map(|k| k * record.len() / POSES));
        let masses = poses.map(mass_at).collect();
        let coefficients = dynamics.coefficients();
        let inverse = |&c: &f64| if c > 0.0 { 1.0 / c } else { f64::INFINITY };
        let mut stiffness: Vec<f64> = coefficients.compliance.iter().map(inverse).collect();
        let damping = coefficients.damping.clone();
        for coupling in plant.couplings() {
            let n = coupling.dofs.len();
            for (k, &dof) in coupling.dofs.iter().enumerate() {
                stiffness[dof] = coupling.stiffness[k * n + k];
            }
        }
        Self { stiffness, damping, masses, step: record.scales.step() / record.most_parts as f64 }
    }

    // By how much the mode of each spring against its own link turns in the shortest step, ω h; none of rigid joints.
    fn turns(&self, plant: &Plant) -> Vec<Option<f64>> {
        let of = |(i, k): (usize, &f64)| {
            let omega = (k / self.masses[0][(i, i)].max(1e-12)).sqrt();
            plant.elastic()[i].then_some(omega * self.step)
        };
        self.stiffness.iter().enumerate().map(of).collect()
    }

    // Links that carry each other swing faster together than each by itself: while some mode is too fast for the steps, the
    // link that swings most in it follows its load. `fastest`: most that a mode may turn in the shortest step.
    fn impose_unstable(&self, imposed: &mut [bool], own: &[bool], fastest: f64) {
        for mass in &self.masses {
            while let Some(dof) = self.unstable(mass, imposed, own, fastest) {
                imposed[dof] = true;
            }
        }
    }

    // Of the fastest mode that is too fast, the link of a joint that swings most.
    fn unstable(&self, mass: &Mat<f64>, imposed: &[bool], own: &[bool], fastest: f64) -> Option<usize> {
        let free = self.free(imposed);
        let inverse = inverse_of(mass, &free)?;
        let worst = |strength: &[f64], limit: f64| {
            let (value, mode) = fastest_mode(&inverse, &free, strength, limit)?;
            let joints = (0..free.len()).filter(|&a| own[free[a]]);
            let size = |a: &usize| mode[*a].abs();
            if value > limit {
                joints.max_by(|a, b| size(a).total_cmp(&size(b))).map(|a| free[a])
            } else {
                None
            }
        };
        worst(&self.stiffness, (fastest / self.step).powi(2))
            .or_else(|| worst(&self.damping, STABLE / self.step))
    }

    fn free(&self, imposed: &[bool]) -> Vec<usize> {
        (0..imposed.len()).filter(|&i| !imposed[i] && self.stiffness[i].is_finite()).collect()
    }

    // Steps in which the springs that are simulated swing from one grid step to the next.
    fn parts(&self, imposed: &[bool], most: usize) -> usize {
        let free = self.free(imposed);
        let fewest = |mass: &Mat<f64>| {
            let inverse = inverse_of(mass, &free);
            let mode = |strength: &[f64]| fastest_mode(inverse.as_ref()?, &free, strength, 0.0);
            let of = |strength: &[f64]| mode(strength).map_or(0.0, |(value, _)| value);
            let (turn, decay) = (of(&self.stiffness).max(0.0).sqrt(), of(&self.damping));
            let step = most as f64 * self.step;
            let short = (step / SHORT_STEP).ceil().min((turn * step / TURN_OF_LONG_STEP).ceil());
            let stable = (turn * step / FASTEST_TURN_ABOUT_MODEL).max(decay * step / STABLE);
            short.max(stable.ceil()) as usize
        };
        // Holds of the torque meet halfway: so do parts.
        let even = |parts: usize| if parts == 1 { 1 } else { parts.next_multiple_of(2) };
        if most == 1 { 1 } else { even(self.masses.iter().map(fewest).max().unwrap_or(1).clamp(1, most)) }
    }
}

fn inverse_of(mass: &Mat<f64>, free: &[usize]) -> Option<Mat<f64>> {
    let n = free.len();
    let of_free = Mat::from_fn(n, n, |a, b| mass[(free[a], free[b])]);
    Some(Normal::new(&of_free)?.solve_many(&Mat::identity(n, n)))
}

// The largest eigenvalue of S^½ M⁻¹ S^½, which is the square of a turn or a decay, with its vector; none if it cannot be above
// a limit.
fn fastest_mode(inverse: &Mat<f64>, free: &[usize], strength: &[f64], limit: f64) -> Option<(f64, Vec<f64>)> {
    let n = free.len();
    let root = |a: usize| strength[free[a]].max(0.0).sqrt();
    let scaled = Mat::from_fn(n, n, |a, b| root(a) * inverse[(a, b)] * root(b));
    let trace: f64 = (0..n).map(|a| scaled[(a, a)]).sum();
    if trace <= limit {
        return None;
    }
    let eigen = scaled.self_adjoint_eigen(Side::Lower).ok()?;
    Some((eigen.S()[n - 1], (0..n).map(|a| eigen.U()[(a, n - 1)]).collect()))
}

#[cfg(test)]
mod tests {
    use sinew_effects::CATALOGUE;
    use sinew_model::{JointSettings, Robot, samples};
    use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant};
    use sinew_rigid::mass_matrix;

    use super::*;

    // Two links that are nearly one about the same axis: M⁻¹ has 1/(1 − 0.99²) = 50 times what each has by itself.
    #[test]
    fn of_links_that_swing_too_fast_together_one_follows_its_load() {
        let springs = |stiffness: f64, damping: f64| SpringsAlong {
            stiffness: vec![stiffness, 0.8 * stiffness, f64::INFINITY],
            damping: vec![damping, damping, 0.0],
            masses: vec![
                Mat::identity(3, 3),
                Mat::from_fn(3, 3, |i, j| [[1.0, 0.99, 0.0], [0.99, 1.0, 0.0], [0.0, 0.0, 1.0]][i][j]),
            ],
            step: 1e-3,
        };
        let imposed = |stiffness: f64, damping: f64| {
            let mut imposed = [false, false, true];
            springs(stiffness, damping).impose_unstable(&mut imposed, &[true; 3], 1.5);
            imposed
        };
        // ω h = 0.1 each, about 0.95 together
        assert_eq!(imposed(1e4, 1.0), [false, false, true]);
        // 0.3 each, 2.8 together
        assert_eq!(imposed(9e4, 1.0), [true, false, true]);
        // D h / M = 0.03 each, 3 together
        assert_eq!(imposed(1e4, 30.0).iter().filter(|told| **told).count(), 2);
    }

    // M q̈ + C q̇ + g = τ_j + f_link + τ_l: no τ_l along the motion that the springs give, M e_j beyond it.
    #[test]
    fn a_given_link_asks_for_what_its_spring_does_not_give() {
        let spring = |k: f64| JointSettings {
            stiffness: Some(k),
            damping: 4.0,
            rotor_inertia: 0.5,
            ..JointSettings::default()
        };
        let model = samples::planar_arm(2, 4.0, 0.5);
        let robot = Robot { joints: vec![spring(8000.0), spring(2000.0)], ..Robot::rigid(model) };
        let plant = Plant::with_effects(&robot, &robot.all_effects(), &CATALOGUE).unwrap();
        let p = plant.parameters();
        let mut dynamics = Dynamics::new(&plant, &p);
        let mut x = LinkState::zero(&plant);
        (x.theta, x.thetad) = (vec![0.3, -0.8], vec![1.1, 0.4]);
        (x.q, x.qd) = (vec![0.302, -0.799], vec![1.0, 0.5]);
        let acceleration = [0.7, -0.2];
        let (none, all) = ([false; 2], [true; 2]);
        let mut free = ImposedOut::new(2);
        let motor = MotorMotion { acceleration: &acceleration, imposed: &none, links: None };
        dynamics.imposed_torque(&x, motor, &mut free);
        let mass = mass_matrix(plant.model(), &x.q);
        for j in 0..2 {
            let mut qdd = free.qdd.clone();
            let mut out = ImposedOut::new(2);
            for push in [0.0, 1.0] {
                qdd[j] += push;
                let links = GivenLinks { given: &all, acceleration: &qdd };
                let motor = MotorMotion { acceleration: &acceleration, imposed: &all, links: Some(links) };
                dynamics.imposed_torque(&x, motor, &mut out);
                for i in 0..2 {
                    assert!((out.tau_l[i] - push * mass[(i, j)]).abs() < 1e-10);
                    assert!((out.tau_j[i] - free.tau_j[i]).abs() < 1e-12);
                    assert!((out.tau_m[i] - free.tau_m[i]).abs() < 1e-12);
                }
            }
        }
    }
}
