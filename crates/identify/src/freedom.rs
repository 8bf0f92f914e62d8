//! What the links do along a record: move with their motors, move as a reference says, or swing on their springs.

use sinew_model::Scalar;
use sinew_plant::{Dynamics, GivenLinks, MotorMotion, Plant};
use sinew_rigid::{Bodies, Scratch, inertias, mass_matrix_with};

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

// A spring is simulated while its mode turns by less than this in a grid step; a stiffer one follows its load.
const FASTEST_TURN: f64 = 0.7;

// The same about a reference that the model has smoothed: it has no noise that a coarse step would let through.
const FASTEST_TURN_ABOUT_MODEL: f64 = 1.5;

impl Freedom {
    /// Of a plant along a record. Rigid joints, and springs too stiff for the grid, move with their motor.
    pub fn of(plant: &Plant, p: &[f64], record: &Record, springs: Springs) -> Self {
        let most = match record.reduction {
            Reduction::Kernel | Reduction::Thinned(_) => FASTEST_TURN,
            Reduction::Mean | Reduction::Innovations(_) => FASTEST_TURN_ABOUT_MODEL,
        };
        let links = record.links.as_ref().filter(|_| springs == Springs::Given);
        let mut joints = vec![None; plant.model().nv];
        plant.joints().iter().enumerate().for_each(|(joint, &dof)| joints[dof] = Some(joint));
        let moves = |joint: usize| links.is_some_and(|l| l.motion[joint].is_some());
        let is_given = |i: usize| plant.elastic()[i] && joints[i].is_some_and(moves);
        let given: Vec<bool> = (0..plant.model().nv).map(is_given).collect();
        let own: Vec<bool> = joints.iter().map(Option::is_some).collect();
        if plant.elastic().iter().zip(&given).all(|(elastic, given)| elastic == given) {
            return Self { imposed: own, given, joints };
        }
        let is_free = |turn: Option<f64>| turn.is_some_and(|turn| turn < most);
        let turns = turns(plant, p, record);
        let told = |(turn, given): (Option<f64>, &bool)| *given || !is_free(turn);
        let imposed =
            turns.into_iter().zip(&given).map(told).zip(own).map(|(told, own)| told && own).collect();
        Self { imposed, given, joints }
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

// By how much the mode of each spring against its own link turns in a grid step, ω h; none of rigid joints.
fn turns(plant: &Plant, p: &[f64], record: &Record) -> Vec<Option<f64>> {
    let nv = plant.model().nv;
    let dynamics = Dynamics::new(plant, p);
    let middle = record.len() / 2;
    let q: Vec<f64> = record.theta.iter().map(|t| t[middle]).collect();
    let q = plant.straight(&q);
    let bodies_inertia = inertias::<f64>(plant.model());
    let armature = vec![0.0; nv];
    let bodies = Bodies {
        model: plant.model(),
        inertia: &bodies_inertia,
        gravity: plant.model().gravity,
        armature: &armature,
    };
    let mut mass = vec![0.0; nv * nv];
    mass_matrix_with(&bodies, &mut Scratch::new(plant.model()), &q, &mut mass);
    let mut stiffness: Vec<f64> = dynamics
        .coefficients()
        .compliance
        .iter()
        .map(|&c| if c > 0.0 { 1.0 / c } else { f64::INFINITY })
        .collect();
    for coupling in plant.couplings() {
        let n = coupling.dofs.len();
        for (k, &dof) in coupling.dofs.iter().enumerate() {
            stiffness[dof] = coupling.stiffness[k * n + k];
        }
    }
    (0..nv)
        .map(|i| {
            let omega = (stiffness[i] / mass[i * nv + i].max(1e-12)).sqrt();
            plant.elastic()[i].then_some(omega * record.scales.step())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use sinew_effects::CATALOGUE;
    use sinew_model::{JointSettings, Robot, samples};
    use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant};
    use sinew_rigid::mass_matrix;

    use super::*;

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
