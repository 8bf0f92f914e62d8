//! Small deviations of all joints from a reference motion: linear equations, their bodies coupled.
//!
//! The state of a joint is x̃ = (θ̃, θ̃̇, q̃, q̃̇) if it is elastic, (θ̃, θ̃̇, 0, 0) if it is rigid.

use std::ops::Range;

/// A vector of the deviation's state.
pub(super) type State = [f64; 4];
/// A matrix on the deviation's state, by rows.
pub(super) type Square = [[f64; 4]; 4];

/// A joint's equations of motion about the reference, at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Linear {
    /// ẋ̃ = A x̃ + b δτ + b_ℓ δτ_ℓ.
    pub a: Square,
    /// Effect of a motor torque.
    pub motor: State,
    /// Effect of a torque on the link.
    pub link: State,
    /// The force on the joint's own body.
    pub push: State,
}

/// The same over one sample period, by the Padé approximation of second degree of the exponential.
///
/// N = 1 − hA/2 + h²A²/12,   Φ = N⁻¹ (1 + hA/2 + h²A²/12),   g = N⁻¹ h b
#[derive(Debug, Clone, Copy)]
pub(super) struct Discrete {
    pub phi: Square,
    pub motor: State,
    pub link: State,
}

impl Linear {
    pub fn over(&self, h: f64) -> Discrete {
        let mut left = [[0.0; 4]; 4];
        // Right sides: the columns of 1 + hA/2 + h²A²/12, then h b and h b_ℓ.
        let mut right = [[0.0; 6]; 4];
        for i in 0..4 {
            for j in 0..4 {
                let square: f64 = (0..4).map(|m| self.a[i][m] * self.a[m][j]).sum();
                let even = f64::from(u8::from(i == j)) + h * h / 12.0 * square;
                left[i][j] = even - 0.5 * h * self.a[i][j];
                right[i][j] = even + 0.5 * h * self.a[i][j];
            }
            right[i][4] = h * self.motor[i];
            right[i][5] = h * self.link[i];
        }
        eliminate(&mut left, &mut right);
        Discrete {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| right[i][j])),
            motor: std::array::from_fn(|i| right[i][4]),
            link: std::array::from_fn(|i| right[i][5]),
        }
    }
}

// Gauss–Jordan with row exchange; the solution stands in `right`. A singular column is left as it is.
fn eliminate<const N: usize>(left: &mut Square, right: &mut [[f64; N]; 4]) {
    for c in 0..4 {
        let pivot = (c..4).max_by(|&a, &b| left[a][c].abs().total_cmp(&left[b][c].abs())).unwrap_or(c);
        left.swap(c, pivot);
        right.swap(c, pivot);
        let d = left[c][c];
        if d == 0.0 {
            continue;
        }
        left[c].iter_mut().for_each(|x| *x /= d);
        right[c].iter_mut().for_each(|x| *x /= d);
        for r in (0..4).filter(|&r| r != c) {
            let f = left[r][c];
            if f != 0.0 {
                for j in 0..4 {
                    left[r][j] -= f * left[c][j];
                }
                for j in 0..N {
                    right[r][j] -= f * right[c][j];
                }
            }
        }
    }
}

/// What the encoders of a joint can show.
#[derive(Debug, Clone, Copy)]
pub(super) struct Encoders {
    /// Variance of a reading of the motor's position.
    pub motor: f64,
    /// The same of the link's, where it has an encoder.
    pub link: Option<f64>,
    /// State that the link's encoder shows: 2, or 0 of a rigid joint.
    pub shown: usize,
}

/// The equations of a joint along a run.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub encoders: Encoders,
    /// By sample.
    pub steps: Vec<Discrete>,
    /// The force with which a deviation of the joint pushes its body, by sample.
    pub push: Vec<State>,
}

/// The equations of all joints, their bodies coupled.
///
/// The bodies' accelerations depend on each other's pushes by the inverse of the inertia. What a joint does to itself
/// is in its own Φ; the rest acts as a kick of half a step before and after it.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub joints: Vec<Joint>,
    /// Sample period, s.
    pub period: f64,
    /// Inverse inertia, by rows, once every so many samples.
    pub mobility: Vec<Vec<f64>>,
    pub mobility_every: usize,
}

/// Torques on the motor and on the link of a joint, W sets of them at once.
pub(super) type Torques<const W: usize> = [[f64; W]; 2];

/// Deviations of some joints, W of them at once.
pub(super) type Deviations<const W: usize> = [[[f64; W]; 4]];

/// Most joints of a robot whose deviations are coupled.
pub(super) const MOST_JOINTS: usize = 32;

impl System {
    /// Samples of the run.
    pub fn len(&self) -> usize {
        self.joints.iter().map(|j| j.steps.len()).min().unwrap_or(0)
    }

    /// x̃ ← Φ x̃ + g δτ + g_ℓ δτ_ℓ of some of the joints, coupled among themselves.
    #[inline(always)]
    pub fn advance<const W: usize>(
        &self,
        joints: Range<usize>,
        k: usize,
        torques: &[Torques<W>],
        x: &mut Deviations<W>,
    ) {
        self.kick(joints.clone(), k, torques, x);
        for ((joint, x), torques) in self.joints[joints.clone()].iter().zip(x.iter_mut()).zip(torques) {
            *x = joint.advanced(k, x, torques);
        }
        self.kick(joints, k, torques, x);
    }

    // q̇̃_i += h/2 Σ_{j≠i} (M⁻¹)_ij (push of j)
    #[inline(always)]
    fn kick<const W: usize>(
        &self,
        joints: Range<usize>,
        k: usize,
        torques: &[Torques<W>],
        x: &mut Deviations<W>,
    ) {
        if joints.len() < 2 {
            return;
        }
        let n = self.joints.len();
        let mobility = &self.mobility[k / self.mobility_every];
        let mut pushes = [[0.0; W]; MOST_JOINTS];
        for (i, joint) in self.joints[joints.clone()].iter().enumerate() {
            let of_motor = f64::from(u8::from(joint.is_rigid()));
            let [motor, link] = &torques[i];
            for w in 0..W {
                let own: f64 = (0..4).map(|s| joint.push[k][s] * x[i][s][w]).sum();
                pushes[i][w] = 0.5 * self.period * (own + link[w] + of_motor * motor[w]);
            }
        }
        let first = joints.start;
        for (i, joint) in self.joints[joints.clone()].iter().enumerate() {
            let velocity = &mut x[i][joint.encoders.shown + 1];
            for j in (0..joints.len()).filter(|&j| j != i) {
                let m = mobility[(first + i) * n + first + j];
                for w in 0..W {
                    velocity[w] += m * pushes[j][w];
                }
            }
        }
    }
}

impl Joint {
    /// Φ x̃ + g δτ + g_ℓ δτ_ℓ
    #[inline(always)]
    pub fn advanced<const W: usize>(
        &self,
        k: usize,
        x: &[[f64; W]; 4],
        [motor, link]: &Torques<W>,
    ) -> [[f64; W]; 4] {
        let step = &self.steps[k];
        let mut next = [[0.0; W]; 4];
        for (i, next) in next.iter_mut().enumerate() {
            let phi = &step.phi[i];
            for w in 0..W {
                next[w] = phi[0] * x[0][w]
                    + phi[1] * x[1][w]
                    + phi[2] * x[2][w]
                    + phi[3] * x[3][w]
                    + step.motor[i] * motor[w]
                    + step.link[i] * link[w];
            }
        }
        next
    }

    /// True if motor and link move as one.
    pub fn is_rigid(&self) -> bool {
        self.encoders.shown == 0
    }

    /// The states that its encoders show, with the variances of a reading.
    pub fn sensors(&self) -> impl Iterator<Item = (usize, f64)> {
        let link = self.encoders.link.map(|variance| (self.encoders.shown, variance));
        [(0, self.encoders.motor)].into_iter().chain(link)
    }
}
