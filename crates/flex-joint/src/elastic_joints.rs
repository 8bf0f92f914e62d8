//! The transmissions of a robot whose joints are rigid or elastic, in any mixture.

use nalgebra::DMatrix;
use sinew_model::{Coupling, Model, Robot};

use crate::FlexJointError;

/// A robot with elastic joints: the reduced model, in which a rotor turns about its own axis only.
///
/// ```text
/// M(q) q̈ + C(q, q̇) q̇ + g(q) = τ_j,   B θ̈ + τ_j = τ_m,   τ_j = K (θ − q) + D (θ̇ − q̇)      elastic joints
/// (M(q) + B) q̈ + C(q, q̇) q̇ + g(q) = τ_m                                                     rigid joints
/// ```
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
/// Source: Spong, *ASME J. Dynamic Systems, Measurement, and Control* 109(4), 1987.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticJoints {
    pub(crate) model: Model,
    pub(crate) rotor: Vec<f64>,
    pub(crate) elastic: Vec<bool>,
    // Where the position of a degree of freedom stands in q; of no meaning for those of a floating base.
    pub(crate) position: Vec<usize>,
    pub(crate) springs: Vec<Spring>,
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
    /// The springs, dampers and rotors of a robot; a coupling's matrices stand instead of its joints' own numbers.
    ///
    /// # Errors
    /// If an elastic joint has no rotor inertia, or a K or D is not symmetric and positive.
    pub fn new(robot: &Robot) -> Result<Self, FlexJointError> {
        let model = robot.model.clone();
        let mut elastic = vec![false; model.nv];
        let mut springs = Vec::new();
        for coupling in &robot.couplings {
            springs.extend(entries(&model, coupling)?);
            coupling.dofs.iter().for_each(|&dof| elastic[dof] = true);
        }
        for (dof, joint) in robot.joints.iter().enumerate().filter(|&(dof, _)| !elastic[dof]) {
            let Some(stiffness) = joint.stiffness else { continue };
            let own = Coupling { dofs: vec![dof], stiffness: vec![stiffness], damping: vec![joint.damping] };
            springs.extend(entries(&model, &own)?);
        }
        springs.iter().for_each(|s| elastic[s.row] = true);
        let rotor: Vec<f64> = robot.joints.iter().map(|joint| joint.rotor_inertia).collect();
        for dof in (0..model.nv).filter(|&dof| elastic[dof]) {
            let positive = rotor[dof] > 0.0 && rotor[dof].is_finite();
            if !positive {
                let joint = model.dof_name(dof).to_owned();
                return Err(FlexJointError::NoRotor { joint, got: rotor[dof] });
            }
        }
        let position = (0..model.nv).map(|dof| model.joints[model.joint_of_dof(dof).0].first_q).collect();
        Ok(Self { model, rotor, elastic, position, springs })
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
        &self.rotor
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

/// The entries of one coupling, checked.
fn entries(model: &Model, coupling: &Coupling) -> Result<Vec<Spring>, FlexJointError> {
    let n = coupling.dofs.len();
    let joints = || coupling.dofs.iter().map(|&dof| model.dof_name(dof).to_owned()).collect();
    let matrix = |what, numbers: &[f64]| match numbers.len() == n * n {
        true => Ok(DMatrix::from_row_slice(n, n, numbers)),
        false => Err(FlexJointError::Size { joints: joints(), what, got: numbers.len(), allowed: n * n }),
    };
    let (K, D) = (matrix("stiffness", &coupling.stiffness)?, matrix("damping", &coupling.damping)?);
    let refuse = |what, got: &DMatrix<f64>| {
        let got = format!("{:?}", got.transpose().as_slice());
        FlexJointError::NotPositive { joints: joints(), what, got }
    };
    let sound = |M: &DMatrix<f64>| M.iter().all(|x| x.is_finite()) && *M == M.transpose();
    let C =
        sound(&K).then(|| K.clone().cholesky()).flatten().ok_or_else(|| refuse("stiffness", &K))?.inverse();
    // Rounding of eigenvalues that are zero.
    let smallest = -1e-12 * D.amax();
    if !sound(&D) || D.clone().symmetric_eigenvalues().iter().any(|&d| d < smallest) {
        return Err(refuse("damping", &D));
    }
    let entry = |(r, c)| Spring {
        row: coupling.dofs[r],
        column: coupling.dofs[c],
        stiffness: K[(r, c)],
        damping: D[(r, c)],
        compliance: C[(r, c)],
    };
    Ok((0..n).flat_map(|r| (0..n).map(move |c| (r, c))).map(entry).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples;

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
