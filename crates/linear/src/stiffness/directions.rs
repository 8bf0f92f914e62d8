//! What a 6 × 6 compliance says: rank, principal axes, and the wrenches that nothing gives way to.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

/// A compliance taken apart, rotation and translation kept apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    /// Independent ways in which the link gives way, 0 to 6.
    pub rank: usize,
    /// Largest over smallest singular value among those that count, translations in units of `length`.
    pub condition: f64,
    /// The length that makes turns and shifts comparable, m: the mean shift by forces over the mean turn by moments,
    /// as a square root.
    pub length: f64,
    /// Turn by moment, rad/(N·m), the softest axis first.
    pub rotation: [PrincipalAxis; 3],
    /// Shift by force, m/N, the softest axis first.
    pub translation: [PrincipalAxis; 3],
    /// Wrenches [moment; force] to which the link does not give way at all: 6 − rank of them, each of length one
    /// with moments in units of force times `length`.
    pub stiff: Vec<Vector6<f64>>,
}

/// A direction and how far the link gives way along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalAxis {
    /// Unit vector in the base's axes, its largest component positive.
    pub direction: Vector3<f64>,
    /// Compliance along it: rad/(N·m) or m/N.
    pub compliance: f64,
}

/// Singular values below this share of the largest are zero: a Jacobian whose own singular values differ by 1e5 counts as
/// singular, and K_x of a robot nearer to that would have lost its digits.
pub const RANK: f64 = 1e-10;

/// Takes a compliance apart.
///
/// Rank is found with translations in units of a length that the compliance itself gives, so it does not depend on the
/// units of the caller. Principal axes are those of the 3 × 3 blocks: what a pure moment turns and what a pure force
/// shifts; never a mixture of rad and m. Of a compliance that is not symmetric (a moment constant in space is no
/// gradient) the axes are those of the symmetric part.
///
/// # Example
/// A sliding joint of 500 N/m along z gives way to a force along z and to nothing else:
/// ```
/// use nalgebra::Matrix6;
/// let mut C = Matrix6::zeros();
/// C[(5, 5)] = 1.0 / 500.0;
/// let told = sinew_linear::directions(&C);
/// assert_eq!((told.rank, told.stiff.len()), (1, 5));
/// assert_eq!(told.translation[0].compliance, 1.0 / 500.0);
/// assert_eq!(told.translation[0].direction.z, 1.0);
/// ```
/// Source: Ciblak, Lipkin, *Centers of stiffness, compliance and elasticity in the modelling of robotic systems*,
/// ASME Design Technical Conferences, 1994, for why the two blocks have axes of their own.
pub fn directions(C: &Matrix6<f64>) -> Directions {
    let (turn, shift) = (C.fixed_view::<3, 3>(0, 0), C.fixed_view::<3, 3>(3, 3));
    let length = characteristic_length(C);
    let scaled = in_units_of(C, length);
    let svd = scaled.svd(false, true);
    let right = svd.v_t.expect("it was asked for");
    let largest = svd.singular_values.max();
    let counts = |k: usize| svd.singular_values[k] > RANK * largest;
    let smallest = (0..6).filter(|&k| counts(k)).map(|k| svd.singular_values[k]).fold(largest, f64::min);
    // Null vectors of the scaled problem are wrenches [moment; force · length].
    let stiff = (0..6).filter(|&k| !counts(k)).map(|k| wrench(right.row(k).transpose(), length));
    Directions {
        rank: (0..6).filter(|&k| counts(k)).count(),
        condition: if largest > 0.0 { largest / smallest } else { 1.0 },
        length,
        rotation: principal(turn.into_owned()),
        translation: principal(shift.into_owned()),
        stiff: stiff.collect(),
    }
}

/// The stiffness K_x = C⁻¹ where the link gives way in all six directions; otherwise none.
///
/// Nothing is regularised: a robot with fewer than six springs, or in a singular position, has a compliance but no
/// stiffness.
///
/// # Example
/// ```
/// use nalgebra::Matrix6;
/// assert_eq!(sinew_linear::stiffness_of(&(Matrix6::identity() * 0.5)), Some(Matrix6::identity() * 2.0));
/// let mut C = Matrix6::identity();
/// C[(2, 2)] = 0.0;
/// assert_eq!(sinew_linear::stiffness_of(&C), None);
/// ```
pub fn stiffness_of(C: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    if directions(C).rank < 6 {
        return None;
    }
    // Inverted in units in which turns and shifts are of one size.
    let length = characteristic_length(C);
    let inverse = in_units_of(C, length).try_inverse()?;
    let K = Matrix6::from_fn(|i, j| inverse[(i, j)] * unit(i, length) * unit(j, length));
    let symmetric = *C == C.transpose();
    Some(if symmetric { (K + K.transpose()) * 0.5 } else { K })
}

// 1/length for shifts.
fn unit(row: usize, length: f64) -> f64 {
    if row < 3 { 1.0 } else { length.recip() }
}

fn in_units_of(C: &Matrix6<f64>, length: f64) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| C[(i, j)] * unit(i, length) * unit(j, length))
}

fn characteristic_length(C: &Matrix6<f64>) -> f64 {
    let trace = |first: usize| (first..first + 3).map(|k| C[(k, k)].abs()).sum::<f64>();
    let ratio = (trace(3) / trace(0)).sqrt();
    if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
}

fn wrench(v: Vector6<f64>, length: f64) -> Vector6<f64> {
    // Powers are kept: w · x is the same in both units.
    let w = Vector6::from_fn(|k, _| v[k] * unit(k, length));
    let size = Vector6::from_fn(|k, _| if k < 3 { w[k] / length } else { w[k] }).norm();
    let peak = w.iter().fold(0.0, |s: f64, x| if x.abs() > s.abs() { *x } else { s });
    w * (peak.signum() / size)
}

fn principal(block: Matrix3<f64>) -> [PrincipalAxis; 3] {
    let eigen = SymmetricEigen::new((block + block.transpose()) * 0.5);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order.map(|k| {
        let v: Vector3<f64> = eigen.eigenvectors.column(k).into_owned();
        let peak = v.iter().fold(0.0, |s: f64, x| if x.abs() > s.abs() + 1e-9 { *x } else { s });
        PrincipalAxis { direction: v * peak.signum(), compliance: eigen.eigenvalues[k] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Matrix6<f64> {
        let A = Matrix6::from_fn(|i, j| ((i * 7 + j * 3) as f64).sin() + if i == j { 2.0 } else { 0.0 });
        A * A.transpose()
    }

    #[test]
    fn rank_does_not_depend_on_the_unit_of_length() {
        let mut C = sample();
        // The third kind of shift is the sum of two others.
        let mut T = Matrix6::identity();
        (T[(5, 5)], T[(5, 3)], T[(5, 4)]) = (0.0, 1.0, -0.5);
        C = T * C * T.transpose();
        for unit in [1e-6, 1.0, 1e6] {
            let D = Matrix6::from_fn(|i, j| {
                C[(i, j)] * if i < 3 { 1.0 } else { unit } * if j < 3 { 1.0 } else { unit }
            });
            let told = directions(&D);
            assert_eq!(told.rank, 5);
            // The stiff wrench does nothing.
            let x = D * told.stiff[0];
            let scale = (D.abs() * told.stiff[0].abs()).amax();
            assert!(x.amax() < 1e-12 * scale, "{unit}: {x}");
            assert!(stiffness_of(&D).is_none());
        }
    }

    #[test]
    fn stiffness_undoes_compliance_in_any_unit() {
        for unit in [1e-6_f64, 1.0, 1e6] {
            let C = Matrix6::from_fn(|i, j| {
                let size = |k| if k < 3 { 1.0 } else { unit };
                sample()[(i, j)] * size(i) * size(j)
            });
            let K = stiffness_of(&C).unwrap();
            let one = in_units_of(&(C * K), 1.0);
            let error = Matrix6::from_fn(|i, j| {
                let size = |k| if k < 3 { 1.0 } else { unit };
                (one[(i, j)] - f64::from(i == j)) * size(j) / size(i)
            });
            assert!(error.amax() < 1e-11, "{error}");
        }
    }

    #[test]
    fn nothing_elastic_gives_way_nowhere() {
        let told = directions(&Matrix6::zeros());
        assert_eq!((told.rank, told.stiff.len(), told.condition), (0, 6, 1.0));
    }
}
