//! What the springs and dampers of a coupling do under a known torque.

use nalgebra::DMatrix;
use sinew_model::{Mechanism, Scalar, Taylor};

use crate::rotors::Rotor;

/// Which deflection θ − q of springs with dampers is meant where the links' motion alone leaves it open.
///
/// ```text
/// K δ + D δ̇ = τ_j(t),   δ = θ − q
/// ```
///
/// Without a damper δ = K⁻¹ τ_j and there is no choice. With one, τ_j fixes the rate of δ, and δ itself is a state: it
/// forgets its start as e^{−t K/D}.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deflection<'a, S> {
    /// What is left when the start is forgotten, as far as the derivatives given determine it.
    ///
    /// ```text
    /// δ = K⁻¹ (τ_j − D K⁻¹ τ̇_j + D K⁻¹ D K⁻¹ τ̈_j)   to an error of order (D/K)³ of τ_j's third derivative
    /// ```
    Settled,
    /// This one, nv numbers, as a state that the caller integrates by the rate that comes back.
    At(&'a [S]),
}

/// Joints that share springs, by the modes of K and D together.
///
/// ```text
/// δ = Φ y,   Φᵀ K Φ = 1,   Φᵀ D Φ = λ,   y + λ ẏ = Φᵀ τ_j
/// ```
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    pub(crate) dofs: Vec<usize>,
    /// Φ by columns.
    shapes: Vec<f64>,
    /// Φ⁻¹ = Φᵀ K by columns.
    inverse: Vec<f64>,
    /// λ, s.
    lag: Vec<f64>,
    /// The first segment that one of its degrees of freedom moves: once it is reached from the tip, τ_j is known.
    pub(crate) first: usize,
    /// Derivatives of the links' motion that τ_j has lost to rotors further out: with settled springs, with given ones.
    pub(crate) lost: [usize; 2],
    /// False if τ_j depends on the group's own rotors.
    pub(crate) open: bool,
}

impl Group {
    pub(crate) fn new(dofs: &[usize], K: &DMatrix<f64>, D: &DMatrix<f64>, mechanism: &Mechanism) -> Self {
        // K = L Lᵀ,   L⁻¹ D L⁻ᵀ = V λ Vᵀ,   Φ = L⁻ᵀ V
        let L = K.clone().cholesky().expect("K is positive").l();
        let L_inverse = L.try_inverse().expect("K is positive");
        let scaled = &L_inverse * D * L_inverse.transpose();
        let modes = ((&scaled + scaled.transpose()) * 0.5).symmetric_eigen();
        let shapes = L_inverse.transpose() * modes.eigenvectors;
        let inverse = shapes.transpose() * K;
        let rounding = ROUNDING * modes.eigenvalues.amax();
        let lag = modes.eigenvalues.iter().map(|&lag| if lag <= rounding { 0.0 } else { lag }).collect();
        let moves = |segment: &&sinew_model::Segment| {
            dofs.iter().any(|dof| (segment.first_dof..segment.first_dof + segment.nv()).contains(dof))
        };
        let first = mechanism.segments().iter().position(|segment| moves(&segment)).unwrap_or(0);
        Self {
            dofs: dofs.to_vec(),
            shapes: shapes.as_slice().to_vec(),
            inverse: inverse.as_slice().to_vec(),
            lag,
            first,
            lost: [0; 2],
            open: true,
        }
    }

    /// Derivatives that the motors' accelerations take from τ_j: with settled springs, with given ones.
    pub(crate) fn taken(&self) -> [usize; 2] {
        [2, if self.lag.iter().all(|&lag| lag > 0.0) { 1 } else { 2 }]
    }

    /// The deflections, nv numbers of which the group writes its own, under the torques of its joints.
    pub(crate) fn deflect<S: Scalar, const M: usize>(
        &self,
        torque: &[Taylor<S, M>],
        given: Deflection<S>,
        deflection: &mut [Taylor<S, M>],
    ) {
        let n = self.dofs.len();
        let settled = given == Deflection::Settled;
        let known = M - self.lost[usize::from(!settled)].min(M);
        self.dofs.iter().for_each(|&dof| deflection[dof] = Taylor::ZERO);
        for mode in 0..n {
            let (shape, lag) = (&self.shapes[n * mode..][..n], self.lag[mode]);
            // σ = Φᵀ τ_j
            let terms = self.dofs.iter().zip(shape).map(|(&dof, &shape)| torque[dof] * shape);
            let force = terms.fold(Taylor::ZERO, |sum, x| sum + x);
            let mut y = force;
            match given {
                Deflection::At(deflection) if lag > 0.0 => {
                    let start = (0..n).map(|k| deflection[self.dofs[k]] * self.inverse[n * k + mode]);
                    y.coefficients[0] = start.fold(S::ZERO, |sum, x| sum + x);
                    // ẏ = (σ − y)/λ
                    for k in 1..M {
                        let slope = force.coefficients[k - 1] - y.coefficients[k - 1];
                        y.coefficients[k] = slope / (lag * k as f64);
                    }
                }
                // y = σ − λ ẏ, from the highest derivative that is known
                _ => {
                    for k in (1..known).rev() {
                        let next = y.coefficients[k] * (lag * k as f64);
                        y.coefficients[k - 1] -= next;
                    }
                }
            }
            for (&dof, &shape) in self.dofs.iter().zip(shape) {
                deflection[dof] += y * shape;
            }
        }
    }
}

/// Of time constants, relative to the largest of a group.
const ROUNDING: f64 = 1e-12;

/// Finds how many derivatives each group loses to the rotors of groups further out, and puts the outermost first.
pub(crate) fn order(groups: &mut [Group], rotors: &[Rotor], mechanism: &Mechanism) {
    groups.sort_by_key(|group| core::cmp::Reverse(group.first));
    // Of each segment's subtree: derivatives taken by the rotors in it.
    let segments = mechanism.segments();
    let mut taken = vec![[0; 2]; segments.len() + 1];
    for (k, segment) in segments.iter().enumerate().rev() {
        for group in groups.iter_mut() {
            let own = segment.first_dof..segment.first_dof + segment.nv();
            if group.dofs.iter().any(|dof| own.contains(dof)) {
                group.lost = largest(group.lost, taken[k + 1]);
            }
        }
        for group in groups.iter_mut().filter(|group| group.first == k) {
            let own = [0, 1].map(|kind| group.lost[kind] + group.taken()[kind]);
            for rotor in rotors.iter().filter(|rotor| group.dofs.contains(&rotor.dof)) {
                taken[rotor.row] = largest(taken[rotor.row], own);
                // its carrier must still be ahead on the way to the base
                group.open &= rotor.row <= k;
            }
        }
        taken[segment.parent] = largest(taken[segment.parent], taken[k + 1]);
    }
}

fn largest(a: [usize; 2], b: [usize; 2]) -> [usize; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}
