//! Joint stiffness from loads and the deflections that they made.

use core::cmp::Ordering;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use sinew_kinematics::{Axes, hessian, jacobian, link_pose};
use sinew_model::LinkId;
use sinew_plant::Plant;

use super::Wrench;
use super::displacement::displacement;
use super::statics::Statics;
use crate::LinearError;

/// One load and the deflection that was measured under it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadTest {
    /// Link-side positions without the load, of all degrees of freedom of the plant, rad (m).
    pub q: Vec<f64>,
    /// [moment; force] on the link, constant in the base's axes, N·m and N.
    pub load: Wrench,
    /// [rotation vector; translation] of the link from its place without the load, in the base's axes, rad and m.
    pub deflection: Vector6<f64>,
    /// Standard deviation of each component; infinite for one that was not measured.
    pub std: Vector6<f64>,
}

/// The joint stiffnesses that a set of load tests shows.
#[derive(Debug, Clone, PartialEq)]
pub struct StiffnessFit {
    /// One entry for each joint asked for.
    pub joints: Vec<FittedStiffness>,
    /// Largest over smallest singular value of the regressor with columns of length one; infinite where some joint is
    /// not excited.
    pub condition: f64,
    /// Root mean square of the residuals in standard deviations; near one if the model is right and the deviations are.
    pub residual: f64,
    /// Measured components less fitted parameters.
    pub freedom: usize,
}

/// What the tests show of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedStiffness {
    /// Its degree of freedom.
    pub dof: usize,
    /// Its name.
    pub joint: String,
    /// 1/K, rad/(N·m), the number that is fitted; none if the tests do not show it.
    pub compliance: Option<f64>,
    /// Standard deviation of 1/K, widened where the residuals are larger than stated.
    pub compliance_std: f64,
    /// K, N·m/rad; none unless the tests show a spring.
    pub stiffness: Option<f64>,
    /// Standard deviation of K.
    pub stiffness_std: f64,
    /// True if the loads twist this joint and the deflections tell its share from the others'.
    pub excited: bool,
    /// What the tests say of it.
    pub evidence: Evidence,
    /// K is above this, N·m/rad, where a rigid joint explains the tests as well: 1/(1/K + 2 σ), 1/K not below zero.
    pub at_least: Option<f64>,
}

/// What load tests say of a joint, σ being the standard deviation of 1/K.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Evidence {
    /// No test shows it.
    Hidden,
    /// 1/K is above σ.
    Spring,
    /// 1/K is not above σ, and the joint makes less than a tenth of the deflections.
    Rigid,
    /// 1/K is not above σ, and the joint may make more of the deflections than that.
    Undetermined,
    /// 1/K is below −5 σ: the link moves against its load, which no spring does.
    Impossible,
}

/// Gauss–Newton rounds; a few do.
const ROUNDS: usize = 30;
/// Steps below this share of the compliances are rounding.
const SETTLED: f64 = 1e-12;
/// Singular values of the scaled regressor below this share of the largest belong to what no test shows.
const HIDDEN: f64 = 1e-8;
/// A joint with more than this share of itself in what no test shows is not excited.
const SHARE: f64 = 1e-6;
/// A compliance below zero by more of its standard deviations than this is no scatter.
const AGAINST: f64 = 5.0;
/// A compliance may be larger than fitted by so many of its standard deviations.
const SURE: f64 = 2.0;
/// A joint that can make no more of the deflections than this is as good as rigid.
const UNSEEN: f64 = 0.1;

/// The stiffnesses of the joints `dofs` of a robot from load tests of `link`, by weighted least squares in the compliances.
///
/// ```text
/// q − q₀ = K⁻¹ (J(q)ᵀ w + g(q₀) − g(q)),   x = displacement of the link
/// ∂x/∂(1/K_i) = J (1 + K⁻¹ (∂g/∂q − K_G))⁻¹ e_i τ_i
/// ```
///
/// The equilibrium is the nonlinear one, so large deflections are no error; other joints stand still, whatever springs the
/// plant has. Compliances are fitted, not stiffnesses: the model is nearly linear in them and a rigid joint is zero.
/// `p`: parameters of the plant, whose weights and balancers count.
///
/// # Errors
/// If there are no measured components.
///
/// # Panics
/// If a length is wrong or there is no such link.
///
/// # Example
/// A rod of one metre, level and weightless, sinks by F l²/K: 10 N and 1 mm are 10 000 N·m/rad.
/// ```
/// use nalgebra::Vector6;
/// use sinew_linear::{LoadTest, Wrench, identify_stiffness};
/// use sinew_model::{Robot, Vector3, samples::planar_arm};
/// let robot = Robot::rigid(planar_arm(2, 1.0, 1.0).with_gravity(Vector3::ZERO));
/// let plant = sinew_plant::Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let mut std = Vector6::repeat(f64::INFINITY);
/// std[5] = 1e-5;
/// let test = LoadTest {
///     q: vec![0.0, 0.0],
///     load: Wrench::new(0.0, 0.0, 0.0, 0.0, 0.0, -10.0),
///     deflection: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -1e-3),
///     std,
/// };
/// let fit = identify_stiffness(&plant, &[], robot.tool, &[0], &[test]).unwrap();
/// assert!((fit.joints[0].stiffness.unwrap() - 1e4).abs() < 0.1);
/// assert!((fit.joints[0].stiffness_std - 1e2).abs() < 0.1); // 1 %, as the deflection
/// ```
/// Source: Dumas, Caro, Garnier, Furet, *Joint stiffness identification of six-revolute industrial serial robots*,
/// Robotics and Computer-Integrated Manufacturing 27(4), 2011.
pub fn identify_stiffness(
    plant: &Plant,
    p: &[f64],
    link: LinkId,
    dofs: &[usize],
    tests: &[LoadTest],
) -> Result<StiffnessFit, LinearError> {
    let measured = tests.iter().flat_map(|t| t.std.iter()).filter(|s| s.is_finite()).count();
    if measured == 0 {
        return Err(LinearError::NothingMeasured { tests: tests.len() });
    }
    let mut bench = Bench { plant, link, statics: Statics::over(plant, p, dofs.to_vec()) };
    let n = dofs.len();
    let mut C = DVector::zeros(n);
    let mut system = bench.system(&C, tests, measured);
    for _ in 0..ROUNDS {
        let step = system.step();
        C += &step;
        let before = system.missing.norm();
        system = bench.system(&C, tests, measured);
        let still = step.amax() <= SETTLED * C.amax();
        if still || (system.missing.norm() - before).abs() <= 1e-15 * before {
            break;
        }
    }
    let deflections = tests.iter().flat_map(|t| t.deflection.iter().zip(&t.std)).map(|(x, std)| x / std);
    let deflected = deflections.map(|x| x * x).sum::<f64>().sqrt();
    Ok(system.told(plant, dofs, &C, deflected))
}

struct Bench<'a> {
    plant: &'a Plant,
    link: LinkId,
    statics: Statics<'a>,
}

/// Regressor and residuals in standard deviations.
struct System {
    A: DMatrix<f64>,
    missing: DVector<f64>,
}

impl Bench<'_> {
    fn system(&mut self, C: &DVector<f64>, tests: &[LoadTest], measured: usize) -> System {
        let mut A = DMatrix::zeros(measured, C.len());
        let mut missing = DVector::zeros(measured);
        let mut row = 0;
        for test in tests {
            let (x, slope) = self.predicted(C, test);
            for k in (0..6).filter(|&k| test.std[k].is_finite()) {
                missing[row] = (test.deflection[k] - x[k]) / test.std[k];
                A.set_row(row, &(slope.row(k) / test.std[k]));
                row += 1;
            }
        }
        System { A, missing }
    }

    // The deflection of one test, and its slopes by the compliances, 6 × n.
    fn predicted(&mut self, C: &DVector<f64>, test: &LoadTest) -> (Vector6<f64>, DMatrix<f64>) {
        let (model, n) = (self.plant.model(), C.len());
        let resting = self.statics.torques(&test.q, &test.q).weight;
        let mut q = test.q.clone();
        let spring = DMatrix::from_diagonal(C);
        let mut last = f64::INFINITY;
        loop {
            let there = self.statics.torques(&q, &test.q);
            let J = jacobian(model, &q, self.link, Axes::WorldAligned).select_columns(&self.statics.elastic);
            let H = hessian(model, &q, self.link, Axes::WorldAligned);
            let dofs = &self.statics.elastic;
            let K_G = DMatrix::from_fn(n, n, |j, k| H[dofs[k]].column(dofs[j]).dot(&test.load));
            // F = q − q₀ − C τ,   ∂F/∂q = 1 + C (∂g/∂q − K_G)
            let torque = J.transpose() * test.load + &resting - &there.weight;
            let twist = DVector::from_iterator(n, dofs.iter().map(|&dof| q[dof] - test.q[dof]));
            let missing = C.component_mul(&torque) - twist;
            let slope = DMatrix::identity(n, n) + &spring * (there.weight_slope - K_G);
            let lu = slope.lu();
            let left = missing.amax();
            let solved = lu.solve(&missing);
            // No longer falling, or no number.
            let falls = left.partial_cmp(&(0.5 * last)) == Some(Ordering::Less) && left > 0.0;
            if !falls || solved.is_none() {
                let x = displacement(&link_pose(model, &test.q, self.link), &link_pose(model, &q, self.link));
                let by_twist = lu.solve(&DMatrix::from_diagonal(&torque)).unwrap_or(DMatrix::zeros(n, n));
                let mut by_compliance = DMatrix::zeros(6, n);
                by_compliance.copy_from(&(J * by_twist));
                let turns = rate_of_rotation_vector(&x.fixed_rows::<3>(0).into_owned())
                    * by_compliance.fixed_rows::<3>(0);
                by_compliance.fixed_rows_mut::<3>(0).copy_from(&turns);
                return (x, by_compliance);
            }
            last = left;
            if let Some(step) = solved {
                dofs.iter().zip(step.iter()).for_each(|(&dof, step)| q[dof] += step);
            }
        }
    }
}

// From an angular velocity to the rate of the rotation vector:
// 1 − ½ [φ]× + e [φ]×²,   e = (1 − (α/2) cot(α/2))/α²
fn rate_of_rotation_vector(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (cross, angle) = (phi.cross_matrix(), phi.norm());
    let e =
        if angle < 1e-4 { 1.0 / 12.0 } else { (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle) };
    Matrix3::identity() - cross * 0.5 + cross * cross * e
}

impl System {
    // Columns of length one, so that stiff and soft joints count alike; a column of zeros stays one.
    fn scaled(&self) -> (DMatrix<f64>, Vec<f64>) {
        let lengths: Vec<f64> = self.A.column_iter().map(|c| c.norm()).collect();
        let unit = |k: usize| if lengths[k] > 0.0 { lengths[k].recip() } else { 1.0 };
        (DMatrix::from_fn(self.A.nrows(), self.A.ncols(), |i, k| self.A[(i, k)] * unit(k)), lengths)
    }

    // The shortest step that lowers the residuals most.
    fn step(&self) -> DVector<f64> {
        let (scaled, lengths) = self.scaled();
        let svd = scaled.svd(true, true);
        let least = HIDDEN * svd.singular_values.max();
        let step =
            svd.solve(&self.missing, least.max(f64::MIN_POSITIVE)).unwrap_or(DVector::zeros(lengths.len()));
        let unscaled = step.iter().zip(&lengths).map(|(x, l)| if *l > 0.0 { x / l } else { 0.0 });
        DVector::from_iterator(lengths.len(), unscaled)
    }

    // `deflected`: the root of the sum of squares of all deflections, in standard deviations.
    fn told(&self, plant: &Plant, dofs: &[usize], C: &DVector<f64>, deflected: f64) -> StiffnessFit {
        let n = dofs.len();
        let (scaled, lengths) = self.scaled();
        // Rows of zeros, so that every direction of the parameters has a singular value.
        let rows = scaled.nrows().max(n);
        let svd = scaled.resize_vertically(rows, 0.0).svd(false, true);
        let directions = svd.v_t.expect("it was asked for");
        let values = svd.singular_values;
        let shown = |k: usize| values[k] > HIDDEN * values.max();
        let hidden_share =
            |i: usize| -> f64 { (0..n).filter(|&k| !shown(k)).map(|k| directions[(k, i)].powi(2)).sum() };
        let freedom = self.missing.len().saturating_sub(n);
        let residual = (self.missing.norm_squared() / self.missing.len() as f64).sqrt();
        let widened =
            if freedom > 0 { (self.missing.norm_squared() / freedom as f64).sqrt().max(1.0) } else { 1.0 };
        let joint = |i: usize| {
            let excited = lengths[i] > 0.0 && hidden_share(i) < SHARE;
            // diag (AᵀA)⁻¹
            let variance: f64 =
                (0..n).filter(|&k| shown(k)).map(|k| (directions[(k, i)] / values[k]).powi(2)).sum();
            let std = if excited { widened * variance.sqrt() / lengths[i] } else { f64::INFINITY };
            let most = C[i].max(0.0) + SURE * std;
            let evidence = match C[i] {
                _ if !excited => Evidence::Hidden,
                c if c > std => Evidence::Spring,
                c if c < -AGAINST * std => Evidence::Impossible,
                _ if most * lengths[i] < UNSEEN * deflected => Evidence::Rigid,
                _ => Evidence::Undetermined,
            };
            let stiffness = (evidence == Evidence::Spring).then(|| 1.0 / C[i]);
            let may_be_rigid = matches!(evidence, Evidence::Rigid | Evidence::Undetermined);
            FittedStiffness {
                dof: dofs[i],
                joint: plant.model().dof_name(dofs[i]).to_owned(),
                compliance: excited.then_some(C[i]),
                compliance_std: std,
                stiffness,
                stiffness_std: stiffness.map_or(f64::INFINITY, |K| std * K * K),
                excited,
                evidence,
                at_least: may_be_rigid.then(|| 1.0 / most),
            }
        };
        let joints: Vec<FittedStiffness> = (0..n).map(joint).collect();
        let all = joints.iter().all(|j| j.excited);
        let condition = if all { values.max() / values.min() } else { f64::INFINITY };
        StiffnessFit { joints, condition, residual, freedom }
    }
}
