//! Arms whose links a URDF describes, with drives and conditions by chance: what holds for the suite's own arms should hold
//! for the arms of others.

use std::path::Path;

use sinew_model::{Joint, Robot};
use sinew_rigid::{inverse_dynamics, mass_matrix};

use crate::drawn::{Draws, Drive, case_by_chance};
use crate::robots::friction;
use crate::suite::Outside;
use crate::{Arm, Case, Conditions, Sensors};

impl Arm {
    /// The arm in the URDF file `path` with drives by chance: all joints elastic or all rigid, antiresonances of 8 to 30 Hz,
    /// rotors of 0.2 to 1.6 and friction of 0.08 to 0.3 of what they move and hold. Joints that slide move as many metres as others do
    /// radians, but for fingers, which are held at zero.
    ///
    /// # Errors
    /// If the file is no URDF.
    pub fn described(path: &Path, seed: u64) -> Result<Self, Outside> {
        let described = sinew_urdf::read_urdf(path)?.model;
        let is_finger = |j: &&Joint| j.kind.slides() && j.mimic.is_none() && travel(j) < LEAST_TRAVEL;
        let fingers: Vec<usize> = described.joints.iter().filter(is_finger).map(|j| j.first_dof).collect();
        let mut model = described.held(&fingers);
        model.name = path.file_stem().map_or(model.name, |name| name.to_string_lossy().into_owned());
        let draws = &mut Draws::new(seed, "drives");
        let is_elastic = draws.one_of(&[true, false]);
        let (n, speed) = (model.nv, draws.uniform(1.0, 2.0));
        // The most that a joint moves and holds in poses by chance.
        let (mut moved, mut held) = (vec![0.0_f64; n], vec![0.0_f64; n]);
        for _ in 0..20 {
            let q: Vec<f64> = (0..n).map(|_| draws.uniform(-1.0, 1.0)).collect();
            let (mass, weight) =
                (mass_matrix(&model, &q), inverse_dynamics(&model, &q, &vec![0.0; n], &vec![0.0; n]));
            for j in 0..n {
                moved[j] = moved[j].max(mass[(j, j)]);
                held[j] = held[j].max(weight[j].abs());
            }
        }
        // The smallest drive of an arm is not as small as the hand that it turns.
        let least = 0.01 * moved.iter().copied().fold(0.0, f64::max);
        let (mut joints, mut viscous, mut torque, mut torque_noise) = (vec![], vec![], vec![], vec![]);
        for j in 0..n {
            let inertia = moved[j].max(least);
            let mut drive = Drive::drawn(draws, inertia, [8.0, 30.0], held[j], speed);
            if !is_elastic {
                (drive.settings.stiffness, drive.settings.damping) = (None, 0.0);
            }
            joints.push(drive.settings);
            viscous.push(drive.viscous);
            torque_noise.push(drive.torque_noise);
            torque.push(drive.coulomb);
        }
        let robot = Robot { effects: friction(&model, &viscous, &torque), joints, ..Robot::rigid(model) };
        let payload = 0.1 * robot.model.moving_mass();
        Ok(Self { robot, torque, torque_noise, payload, amplitude: draws.uniform(0.6, 1.0), speed })
    }

    /// True if no joint has a spring.
    pub fn is_rigid(&self) -> bool {
        self.robot.joints.iter().all(|joint| joint.stiffness.is_none())
    }
}

// Travel of a sliding joint below which it is a finger, m.
const LEAST_TRAVEL: f64 = 0.15;

fn travel(joint: &Joint) -> f64 {
    joint.limits.upper - joint.limits.lower
}

/// A case by chance of the arm in a URDF file, a pure function of the file and the seed: drives, conditions, and an effect at
/// one of the joints, the one asked for if there is one; else every sixth seed hides nothing. Rigid joints have no encoder
/// behind the gear.
///
/// # Errors
/// If the file is no URDF.
pub fn described_case(path: &Path, seed: u64, size: f64, only: Option<&str>) -> Result<(Arm, Case), Outside> {
    let arm = Arm::described(path, seed)?;
    let mut conditions = Conditions::drawn(seed);
    if arm.is_rigid() {
        conditions.sensors = Sensors::Motor;
    }
    let case = case_by_chance(&arm, conditions, seed, size, only);
    Ok((arm, case))
}
