//! The transmissions of a robot whose joints are rigid or elastic, in any mixture.

use nalgebra::DMatrix;
use sinew_model::{Coupling, Mechanism, Model, Robot};

use crate::deflection::{Group, order};
use crate::rotors::{Rotor, mount};
use crate::spin::carriers;
use crate::{FlexJointError, SpinInertia};

/// A robot with elastic joints.
///
/// In the reduced model a rotor turns about its own axis only, as if its link stood still:
///
/// ```text
/// M(q) q̈ + C(q, q̇) q̇ + g(q) = τ_j,   B θ̈ + τ_j = τ_m,   τ_j = K (θ − q) + D (θ̇ − q̇)      elastic joints
/// (M(q) + B) q̈ + C(q, q̇) q̇ + g(q) = τ_m                                                     rigid joints
/// ```
///
/// In the complete model it turns with the link that carries it too, which couples the accelerations of both:
///
/// ```text
/// Mc(q) q̈ + S(q) θ̈ + c(q, q̇, θ̇) + g(q) = τ_j,   Sᵀ(q) q̈ + B θ̈ + s(q, q̇) + τ_j = τ_m
/// ```
///
/// with S as told at [`ElasticJoints::rotor_coupling`]. Rotors of rigid joints count on M's diagonal only.
///
/// Vectors are by degree of freedom, positions q as the model has them; θ is the motor's position reflected to the
/// link side. In rigid joints θ = q and the entries of `theta` and `thetad` are not looked at.
///
/// # Example
/// Against the spring of 150 N·m/rad, a level arm of 2 kg at 0.4 m sags by m g ℓ/K:
/// ```
/// use sinew_flex_joint::ElasticJoints;
/// use sinew_model::{Robot, samples};
/// let mut robot = Robot::rigid(samples::hanging_link(0.5, 2.0, 0.4));
/// robot.joints[0].stiffness = Some(150.0);
/// robot.joints[0].rotor_inertia = 0.05;
/// let arm = ElasticJoints::new(&robot)?;
/// let level = core::f64::consts::FRAC_PI_2;
/// let (theta, tau_m) = arm.equilibrium(&[level]);
/// approx::assert_relative_eq!(tau_m[0], 2.0 * 9.81 * 0.4, max_relative = 1e-12);
/// approx::assert_relative_eq!(theta[0] - level, 2.0 * 9.81 * 0.4 / 150.0, max_relative = 1e-12);
/// # Ok::<(), sinew_flex_joint::FlexJointError>(())
/// ```
/// Sources: Spong, *ASME J. Dynamic Systems, Measurement, and Control* 109(4), 1987; De Luca, Tomei, *Elastic joints*,
/// in: Canudas de Wit et al. (eds.), *Theory of Robot Control*, Springer 1996; De Luca, Book, *Robots with flexible
/// elements*, Springer Handbook of Robotics, 2nd ed., 2016.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticJoints {
    pub(crate) model: Model,
    // The same with bodies that lack the spin inertia of the rotors they carry.
    pub(crate) links: Model,
    pub(crate) mechanism: Mechanism,
    pub(crate) rotor_inertia: Vec<f64>,
    pub(crate) elastic: Vec<bool>,
    // Where the position of a degree of freedom stands in q; of no meaning for those of a floating base.
    pub(crate) position: Vec<usize>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) groups: Vec<Group>,
    // Of the complete model: the rotors on moving segments, those segments and all that carry them.
    pub(crate) rotors: Vec<Rotor>,
    pub(crate) carriers: Vec<usize>,
    // True if a rigid joint has a rotor.
    pub(crate) armature: bool,
}

/// One entry of K, of D and of K⁻¹; all others are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spring {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) compliance: f64,
}

impl ElasticJoints {
    /// The reduced model of a robot: its springs, dampers and rotors. A coupling's matrices stand instead of its joints'
    /// own numbers.
    ///
    /// # Errors
    /// If an elastic joint has no rotor inertia, a K or D is not symmetric and positive, or a link bends. Effects of
    /// [`Robot::effects`] are no part of this model.
    pub fn new(robot: &Robot) -> Result<Self, FlexJointError> {
        Self::build(robot, None)
    }

    /// The complete model of a robot: [`ElasticJoints::new`] with rotors that turn with the links that carry them.
    ///
    /// Gear ratio, axis and carrying link are those of [`Robot::joints`]: `rotor_axis` in the frame of `carried_by`,
    /// by default the joint's own axis and the link before it. The sign of the axis is the sign of the gear. `spin` says
    /// what the inertias of the links already hold of the rotors. A rotor that the base carries is not coupled.
    ///
    /// # Errors
    /// As [`ElasticJoints::new`]; if a rotor on a moving link has no gear ratio or no known axis; or if a link is lighter
    /// than the rotors said to be in it.
    pub fn complete(robot: &Robot, spin: SpinInertia) -> Result<Self, FlexJointError> {
        Self::build(robot, Some(spin))
    }

    fn build(robot: &Robot, spin: Option<SpinInertia>) -> Result<Self, FlexJointError> {
        if let Some(bending) = robot.bending.first() {
            let link = robot.model.links[bending.link.0].name.clone();
            return Err(FlexJointError::Bends { link });
        }
        let (model, mechanism) = (robot.model.clone(), Mechanism::new(&robot.model));
        let mut elastic = vec![false; model.nv];
        let (mut springs, mut groups) = (Vec::new(), Vec::new());
        let mut take = |coupling: &Coupling| -> Result<(), FlexJointError> {
            let (K, D) = checked(&model, coupling)?;
            springs.extend(entries(coupling, &K, &D));
            groups.push(Group::new(&coupling.dofs, &K, &D, &mechanism));
            Ok(())
        };
        for coupling in &robot.couplings {
            take(coupling)?;
            coupling.dofs.iter().for_each(|&dof| elastic[dof] = true);
        }
        for (dof, joint) in robot.joints.iter().enumerate() {
            let Some(stiffness) = joint.stiffness.filter(|_| !elastic[dof]) else { continue };
            take(&Coupling { dofs: vec![dof], stiffness: vec![stiffness], damping: vec![joint.damping] })?;
            elastic[dof] = true;
        }
        let rotor_inertia: Vec<f64> = robot.joints.iter().map(|joint| joint.rotor_inertia).collect();
        for dof in (0..model.nv).filter(|&dof| elastic[dof]) {
            let positive = rotor_inertia[dof] > 0.0 && rotor_inertia[dof].is_finite();
            if !positive {
                let joint = model.dof_name(dof).to_owned();
                return Err(FlexJointError::NoRotor { joint, got: rotor_inertia[dof] });
            }
        }
        let (rotors, links) = match spin {
            Some(spin) => mount(robot, &elastic, &mechanism, spin)?,
            None => (Vec::new(), model.clone()),
        };
        order(&mut groups, &rotors, &mechanism);
        let position = (0..model.nv).map(|dof| model.joints[model.joint_of_dof(dof).0].first_q).collect();
        let armature = (0..model.nv).any(|dof| !elastic[dof] && rotor_inertia[dof] != 0.0);
        let carriers = carriers(mechanism.segments(), &rotors);
        Ok(Self {
            model,
            links,
            mechanism,
            rotor_inertia,
            elastic,
            position,
            springs,
            groups,
            rotors,
            carriers,
            armature,
        })
    }

    /// The mechanism.
    pub fn model(&self) -> &Model {
        &self.model
    }
    /// For each degree of freedom, whether its joint is elastic.
    pub fn elastic(&self) -> &[bool] {
        &self.elastic
    }
    /// B of each degree of freedom, kg·m².
    pub fn rotor_inertia(&self) -> &[f64] {
        &self.rotor_inertia
    }
    /// K, nv × nv, N·m/rad; rows and columns of rigid joints are zero.
    pub fn stiffness(&self) -> DMatrix<f64> {
        self.matrix(|s| s.stiffness)
    }
    /// D, nv × nv, N·m·s/rad; rows and columns of rigid joints are zero.
    pub fn damping(&self) -> DMatrix<f64> {
        self.matrix(|s| s.damping)
    }

    fn matrix(&self, of: impl Fn(&Spring) -> f64) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.model.nv, self.model.nv);
        for spring in &self.springs {
            matrix[(spring.row, spring.column)] = of(spring);
        }
        matrix
    }
}

/// K and D of one coupling, symmetric and positive.
fn checked(model: &Model, coupling: &Coupling) -> Result<(DMatrix<f64>, DMatrix<f64>), FlexJointError> {
    let n = coupling.dofs.len();
    let joints = || coupling.dofs.iter().map(|&dof| model.dof_name(dof).to_owned()).collect();
    let matrix = |what, numbers: &[f64]| match numbers.len() == n * n {
        true => Ok(DMatrix::from_row_slice(n, n, numbers)),
        false => Err(FlexJointError::Size { joints: joints(), what, got: numbers.len(), allowed: n * n }),
    };
    let (K, D) = (matrix("stiffness", &coupling.stiffness)?, matrix("damping", &coupling.damping)?);
    let refuse = |what, got: &DMatrix<f64>| {
        let got = format!("{:?}", got.transpose().as_slice());
        Err(FlexJointError::NotPositive { joints: joints(), what, got })
    };
    let sound = |M: &DMatrix<f64>| M.iter().all(|x| x.is_finite()) && *M == M.transpose();
    if !sound(&K) || K.clone().cholesky().is_none() {
        return refuse("stiffness", &K);
    }
    // Rounding of eigenvalues that are zero.
    let smallest = -1e-12 * D.amax();
    if !sound(&D) || D.clone().symmetric_eigenvalues().iter().any(|&d| d < smallest) {
        return refuse("damping", &D);
    }
    Ok((K, D))
}

/// The entries of one coupling.
fn entries(coupling: &Coupling, K: &DMatrix<f64>, D: &DMatrix<f64>) -> Vec<Spring> {
    let n = coupling.dofs.len();
    let C = K.clone().cholesky().expect("K is positive").inverse();
    let entry = |(r, c)| Spring {
        row: coupling.dofs[r],
        column: coupling.dofs[c],
        stiffness: K[(r, c)],
        damping: D[(r, c)],
        compliance: C[(r, c)],
    };
    (0..n).flat_map(|r| (0..n).map(move |c| (r, c))).map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::{Bending, LinkId, samples};

    fn arm() -> Robot {
        let mut robot = Robot::rigid(samples::planar_arm(2, 1.5, 0.4));
        robot.joints.iter_mut().for_each(|joint| joint.rotor_inertia = 0.05);
        robot
    }

    fn coupled(stiffness: [f64; 4], damping: [f64; 4]) -> Robot {
        let mut robot = arm();
        let (stiffness, damping) = (stiffness.to_vec(), damping.to_vec());
        robot.couplings.push(Coupling { dofs: vec![0, 1], stiffness, damping });
        robot
    }

    #[test]
    fn a_coupling_stands_instead_of_its_joints_own_springs() {
        let mut robot = coupled([900.0, 120.0, 120.0, 700.0], [0.0; 4]);
        robot.joints[0].stiffness = Some(5.0);
        let joints = ElasticJoints::new(&robot).unwrap();
        assert_eq!(joints.stiffness().as_slice(), [900.0, 120.0, 120.0, 700.0]);
    }

    #[test]
    fn an_elastic_joint_without_a_rotor_is_refused_by_name() {
        let mut robot = arm();
        robot.joints[1].stiffness = Some(100.0);
        robot.joints[1].rotor_inertia = 0.0;
        let error = ElasticJoints::new(&robot).unwrap_err().to_string();
        assert!(error.starts_with("joint \"joint_2\": an elastic joint needs a rotor inertia"), "{error}");
    }

    #[test]
    fn a_link_that_bends_is_refused_by_name_and_not_taken_for_rigid() {
        let mut robot = arm();
        robot.bending.push(Bending::base_spring(LinkId(1), &['y'], 4e3));
        for model in [ElasticJoints::new(&robot), ElasticJoints::complete(&robot, SpinInertia::BesideLinks)] {
            let error = model.unwrap_err().to_string();
            assert!(error.starts_with("link \"link_1\": it bends") && error.contains("help:"), "{error}");
        }
    }

    #[test]
    fn springs_that_push_and_dampers_that_drive_are_refused() {
        for (stiffness, damping) in [
            ([900.0, 120.0, 121.0, 700.0], [0.0; 4]),
            ([100.0, 120.0, 120.0, 100.0], [0.0; 4]),
            ([900.0, 120.0, 120.0, 700.0], [1.0, 2.0, 2.0, 1.0]),
            ([f64::NAN, 0.0, 0.0, 700.0], [0.0; 4]),
        ] {
            let error = ElasticJoints::new(&coupled(stiffness, damping)).unwrap_err();
            assert!(matches!(error, FlexJointError::NotPositive { .. }), "{error}");
        }
    }
}
