//! Equilibrium under a load of any size, and what the link gives way to there.

use core::cmp::Ordering;

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, SymmetricEigen, Vector6};
use sinew_kinematics::{Axes, compliance, hessian, jacobian, link_pose};
use sinew_model::LinkId;
use sinew_plant::Plant;

use super::displacement::displacement;
use super::statics::{Statics, Torques};
use super::{CartesianStiffness, Wrench, through};
use crate::LinearError;

/// A robot that a load has pushed to another place, motors holding.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// [moment; force] on the link at its origin, constant in the base's axes, N·m and N.
    pub load: Wrench,
    /// Link-side positions, rad (m).
    pub q: Vec<f64>,
    /// [rotation vector; translation] of the link from its place without load, in the base's axes, rad and m.
    pub deflection: Vector6<f64>,
    /// J over the elastic degrees of freedom there.
    pub jacobian: Matrix6xX<f64>,
    /// K_q of the springs there, N·m/rad.
    pub joint_stiffness: DMatrix<f64>,
    /// ∂g/∂q there, N·m/rad.
    pub gravity_stiffness: DMatrix<f64>,
    /// K_G = ∂(Jᵀ w)/∂q there, N·m/rad; not symmetric where there is a moment.
    pub geometric_stiffness: DMatrix<f64>,
    /// J (K_q + ∂g/∂q − K_G)⁻¹ Jᵀ: how the link answers to a little more load.
    pub compliance: Matrix6<f64>,
    /// J K_q⁻¹ Jᵀ at the same place: the map that forgets the geometric term and gravity.
    pub classical_compliance: Matrix6<f64>,
}

/// Where a growing load leads.
#[derive(Debug, Clone, PartialEq)]
pub enum UnderLoad {
    /// To an equilibrium that stays.
    Holds(Box<Loaded>),
    /// To a point where the robot gives way.
    GivesWay(Critical),
}

/// Where the robot gives way to a growing load.
#[derive(Debug, Clone, PartialEq)]
pub struct Critical {
    /// The share of the load that it still bears, 0 to 1.
    pub factor: f64,
    /// How it gives way.
    pub kind: LossOfStability,
    /// Link-side positions there.
    pub q: Vec<f64>,
    /// The joint that moves most where it gives way.
    pub joint: String,
}

/// How an equilibrium is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossOfStability {
    /// It stands upright on its springs already without load: K_q + ∂g/∂q is not positive definite.
    Unloaded,
    /// It goes on existing but falls over to the side, as a column does.
    Buckling,
    /// There is none for a larger load: it snaps through.
    LimitPoint,
}

/// Torque left over, relative to the largest of the torques that balance.
const BALANCED: f64 = 1e-13;
/// Newton steps of one equilibrium; near a critical point they only halve the error.
const ROUNDS: usize = 60;
/// The farthest that one step of the load moves a joint, rad (m): beyond, Newton's method may find another equilibrium.
const STRIDE: f64 = 0.05;
/// To this share the critical load is found.
const CRITICAL: f64 = 1e-6;
/// Shares of the load below this are as good as none.
const FAINTEST: f64 = 1e-9;
/// Rounding of a position, which its spring turns into torque.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Where a dead load takes `link` of a robot that is held as `unloaded` says, by Newton's method along the growing load.
///
/// ```text
/// τ_j(θ − q) + J(q)ᵀ w = g(q),   θ fixed
/// C = J (K_q + ∂g/∂q − K_G)⁻¹ Jᵀ,   K_G = ∂(Jᵀ w)/∂q
/// ```
///
/// The load grows from zero in steps that move no joint by more than 0.05 rad, so the answer is the equilibrium that the
/// robot would follow, not any equilibrium; where it stops being stable, or stops, the answer says at which share of the
/// load and how. The components of the load stay constant in the base's axes and its force acts at the moving
/// link's origin. A moment constant in space has no potential, so K_G is then not symmetric, and neither is C.
///
/// `load`: [moment; force], N·m and N. `unloaded`: of the same plant, parameters and link.
///
/// # Errors
/// If a spring has no stiffness somewhere on the way (a gear inside its gap).
///
/// # Panics
/// If `p` has the wrong length, or `unloaded` is of another plant.
///
/// # Example
/// A weightless rod of one metre on a spring of 100 N·m/rad, pushed down by F: 100 α = F cos α.
/// ```
/// use sinew_linear::{UnderLoad, Wrench, cartesian_stiffness, equilibrium_under_load};
/// use sinew_model::{Robot, Vector3, samples::planar_arm};
/// use sinew_plant::Plant;
/// let mut robot = Robot::rigid(planar_arm(2, 1.0, 1.0).with_gravity(Vector3::ZERO));
/// robot.joints[0].stiffness = Some(100.0);
/// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let (p, tool) = (plant.parameters(), robot.tool);
/// let unloaded = cartesian_stiffness(&plant, &p, &[0.0, 0.0], tool).unwrap();
/// let load = Wrench::new(0.0, 0.0, 0.0, 0.0, 0.0, -50.0);
/// let UnderLoad::Holds(told) = equilibrium_under_load(&plant, &p, &unloaded, tool, &load).unwrap() else { panic!() };
/// let angle = -told.q[0];
/// assert!((100.0 * angle - 50.0 * angle.cos()).abs() < 1e-11);
/// assert!((told.deflection[5] + angle.sin()).abs() < 1e-14);
/// ```
/// Source: Chen, Kao, *Conservative congruence transformation for joint and Cartesian stiffness matrices of robotic
/// hands and fingers*, International Journal of Robotics Research 19(9), 2000.
pub fn equilibrium_under_load(
    plant: &Plant,
    p: &[f64],
    unloaded: &CartesianStiffness,
    link: LinkId,
    load: &Wrench,
) -> Result<UnderLoad, LinearError> {
    let mut path = Path { plant, link, load, theta: &unloaded.theta, statics: Statics::new(plant, p) };
    let mut reached = path.start(&unloaded.q, 0.0);
    if !unloaded.stable {
        return Ok(UnderLoad::GivesWay(path.critical(&reached, LossOfStability::Unloaded)));
    }
    if path.statics.elastic.is_empty() {
        reached.factor = 1.0;
    }
    let mut step = 1.0;
    while reached.factor < 1.0 {
        let factor = (reached.factor + step).min(1.0);
        let next = path.towards(&reached, factor);
        match next.filter(|next| next.is_near(&reached) && next.least > 0.0) {
            Some(next) => {
                reached = next;
                step *= 2.0;
            }
            None => step = 0.5 * (factor - reached.factor),
        }
        if step < CRITICAL * reached.factor.max(FAINTEST) {
            let kind = path.way_of_giving(&reached);
            return Ok(UnderLoad::GivesWay(path.critical(&reached, kind)));
        }
    }
    path.told(reached, unloaded).map(|told| UnderLoad::Holds(Box::new(told)))
}

/// The equilibria of one robot under growing shares of one load.
struct Path<'a> {
    plant: &'a Plant,
    link: LinkId,
    load: &'a Wrench,
    theta: &'a [f64],
    statics: Statics<'a>,
}

/// A position on the way, in balance or nearly.
struct Place {
    factor: f64,
    q: Vec<f64>,
    torques: Torques,
    J: Matrix6xX<f64>,
    K_G: DMatrix<f64>,
    /// The smallest eigenvalue of K_q + ∂g/∂q − K_G in units of the springs.
    least: f64,
}

impl Place {
    fn slope(&self) -> DMatrix<f64> {
        &self.torques.spring_slope + &self.torques.weight_slope - &self.K_G
    }
    fn is_near(&self, other: &Place) -> bool {
        self.q.iter().zip(&other.q).all(|(a, b)| (a - b).abs() <= STRIDE)
    }
}

impl Path<'_> {
    // K_G of the whole load, by its elastic rows and columns: K_jk = Σ_i ∂J_ij/∂q_k w_i
    fn geometric(&self, q: &[f64]) -> DMatrix<f64> {
        let H = hessian(self.plant.model(), q, self.link, Axes::WorldAligned);
        let elastic = &self.statics.elastic;
        let n = elastic.len();
        DMatrix::from_fn(n, n, |j, k| H[elastic[k]].column(elastic[j]).dot(self.load))
    }

    fn start(&mut self, q: &[f64], factor: f64) -> Place {
        let torques = self.statics.torques(q, self.theta);
        let J = jacobian(self.plant.model(), q, self.link, Axes::WorldAligned);
        let J = J.select_columns(&self.statics.elastic);
        let mut place =
            Place { factor, q: q.to_vec(), K_G: self.geometric(q) * factor, torques, J, least: 0.0 };
        place.least = least_stiffness(&place.slope(), &place.torques.spring_slope);
        place
    }

    // The equilibrium under `factor` times the load, by Newton's method from another one; none if it does not come.
    fn towards(&mut self, from: &Place, factor: f64) -> Option<Place> {
        let mut place = self.start(&from.q, factor);
        let mut last = f64::INFINITY;
        for _ in 0..ROUNDS {
            // r = τ_j + Jᵀ w − g,   (K_q + ∂g/∂q − K_G) δq = r
            let push = place.J.transpose() * (self.load * factor);
            let missing = &place.torques.spring + &push - &place.torques.weight;
            let left = missing.amax();
            // At rounding, and no longer falling.
            if left <= self.rounding(&place, &push) && left >= 0.5 * last || left == 0.0 {
                return Some(place);
            }
            last = left;
            let step: DVector<f64> = place.slope().lu().solve(&missing)?;
            // Not a number either.
            if !matches!(step.amax().partial_cmp(&(4.0 * STRIDE)), Some(Ordering::Less)) {
                return None;
            }
            let mut q = place.q.clone();
            for (&dof, step) in self.statics.elastic.iter().zip(step.iter()) {
                q[dof] += step;
            }
            place = self.start(&q, factor);
        }
        None
    }

    // What is left of balanced torques by rounding.
    fn rounding(&self, place: &Place, push: &DVector<f64>) -> f64 {
        let torques = &place.torques;
        let largest = torques.spring.amax().max(push.amax()).max(torques.weight.amax());
        let of_position = |(k, &dof): (usize, &usize)| {
            torques.spring_slope[(k, k)] * place.q[dof].abs().max(self.theta[dof].abs())
        };
        let stretch = self.statics.elastic.iter().enumerate().map(of_position).fold(0.0, f64::max);
        BALANCED * largest + ROUNDING * stretch
    }

    // A column goes on standing, unstable, under a little more load; past a limit point there is nothing near.
    fn way_of_giving(&mut self, reached: &Place) -> LossOfStability {
        let beyond = self.towards(reached, reached.factor * (1.0 + 1e3 * CRITICAL));
        let goes_on = beyond.is_some_and(|next| next.is_near(reached) && next.least <= 0.0);
        if goes_on { LossOfStability::Buckling } else { LossOfStability::LimitPoint }
    }

    fn critical(&self, reached: &Place, kind: LossOfStability) -> Critical {
        let slope = reached.slope();
        let eigen = SymmetricEigen::new((&slope + slope.transpose()) * 0.5);
        let weakest = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let dof = self.statics.elastic[weakest.iamax()];
        let joint = self.plant.model().dof_name(dof).to_owned();
        Critical { factor: reached.factor, kind, q: reached.q.clone(), joint }
    }

    fn told(&self, place: Place, unloaded: &CartesianStiffness) -> Result<Loaded, LinearError> {
        let missing = || super::no_stiffness(self.plant, &self.statics.elastic, &place.torques.spring_slope);
        let C = through(&place.J, &place.slope()).ok_or_else(missing)?;
        let springs = place.torques.spring_slope.clone().cholesky().ok_or_else(missing)?.inverse();
        // A force alone has a potential, so only rounding is taken away.
        let symmetric = self.load.fixed_rows::<3>(0).amax() == 0.0;
        Ok(Loaded {
            load: *self.load,
            deflection: displacement(&unloaded.pose, &link_pose(self.plant.model(), &place.q, self.link)),
            compliance: if symmetric { (C + C.transpose()) * 0.5 } else { C },
            classical_compliance: compliance(&place.J, &springs),
            q: place.q,
            jacobian: place.J,
            joint_stiffness: place.torques.spring_slope,
            gravity_stiffness: place.torques.weight_slope,
            geometric_stiffness: place.K_G,
        })
    }
}

/// The smallest real part of the eigenvalues of a slope T in units of the springs K, so that rad and m do not mix: positive
/// where the robot stays.
///
/// ```text
/// D⁻¹ᐟ² T D⁻¹ᐟ²,   D = diag K
/// ```
pub(crate) fn least_stiffness(T: &DMatrix<f64>, K: &DMatrix<f64>) -> f64 {
    let n = T.nrows();
    if n == 0 {
        return f64::INFINITY;
    }
    let unit = |k: usize| K[(k, k)].abs().sqrt().recip();
    let scaled = DMatrix::from_fn(n, n, |i, j| T[(i, j)] * unit(i) * unit(j));
    if scaled.iter().any(|x| !x.is_finite()) {
        return f64::NEG_INFINITY;
    }
    let skew = (&scaled - scaled.transpose()).amax();
    if skew <= 1e-12 * scaled.amax() {
        return ((&scaled + scaled.transpose()) * 0.5).symmetric_eigenvalues().min();
    }
    scaled.complex_eigenvalues().iter().map(|l| l.re).fold(f64::INFINITY, f64::min)
}
