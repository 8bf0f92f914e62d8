//! The equations of one joint about its reference, and what they make of a sample period.
//!
//! The state of a joint is x̃ = (θ̃, θ̃̇, q̃, q̃̇) if it is elastic, (θ̃, θ̃̇, 0, 0) if it is rigid, (θ̃, θ̃̇, w, 0) if the torque behind
//! its rigid gear is read, which shows the torque noise w of the hold that begins.

/// A vector of the deviation's state.
pub(super) type State = [f64; 4];
/// A matrix on the deviation's state, by rows.
pub(super) type Square = [[f64; 4]; 4];

/// A joint's equations of motion about the reference, at one instant: ẋ̃ = A x̃ + b δτ + b_ℓ δτ_ℓ.
///
/// ```text
/// elastic:  θ̈̃ = rate x̃ + motor δτ,   q̈̃ = link (push x̃ + δτ_ℓ)
/// rigid:    θ̈̃ = rate x̃ + motor δτ + link δτ_ℓ
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Linear {
    /// True if the link has states of its own.
    pub is_elastic: bool,
    /// Acceleration of the motor.
    pub rate: State,
    /// The same by a motor torque.
    pub motor: f64,
    /// Acceleration of the link by a torque on it.
    pub link: f64,
    /// The force on the joint's own body.
    pub push: State,
    /// The torque behind the gear; that of a rigid joint, which torque passes at once, by the torque noise in the third place.
    pub gear: State,
}

/// The same over one sample period: the Padé approximation of second degree of the exponential over a part of it,
/// doubled until the period is full. Friction near rest takes a light motor to its velocity in a tenth of a sample.
///
/// N = 1 − hA/2 + h²A²/12,   Φ = N⁻¹ (1 + hA/2 + h²A²/12),   g = N⁻¹ h b
#[derive(Debug, Clone, Copy)]
pub(super) struct Discrete {
    pub phi: Square,
    pub motor: State,
    pub link: State,
}

/// Times that a part of the period is doubled.
pub(super) const DOUBLINGS: i32 = 2;

impl Linear {
    // The velocity among the states that a torque on the link changes.
    fn pushed(&self) -> usize {
        if self.is_elastic { 3 } else { 1 }
    }

    /// A
    pub fn matrix(&self) -> Square {
        let mut a = Square::default();
        (a[0][1], a[1]) = (1.0, self.rate);
        if self.is_elastic {
            (a[2][3], a[3]) = (1.0, self.push.map(|push| self.link * push));
        }
        a
    }

    /// b and b_ℓ
    pub fn torques(&self) -> [State; 2] {
        let mut torques = [State::default(); 2];
        torques[0][1] = self.motor;
        torques[1][self.pushed()] = self.link;
        torques
    }

    pub fn over(&self, period: f64) -> Discrete {
        let part = self.over_part(period * 0.5f64.powi(DOUBLINGS));
        (0..DOUBLINGS).fold(part, |part, _| part.twice())
    }

    fn over_part(&self, h: f64) -> Discrete {
        let (a, [motor, link]) = (self.matrix(), self.torques());
        let mut left = [[0.0; 4]; 4];
        // Right sides: the columns of 1 + hA/2 + h²A²/12, then h b and h b_ℓ.
        let mut right = [[0.0; 6]; 4];
        for i in 0..4 {
            for j in 0..4 {
                let square: f64 = (0..4).map(|m| a[i][m] * a[m][j]).sum();
                let even = f64::from(u8::from(i == j)) + h * h / 12.0 * square;
                left[i][j] = even - 0.5 * h * a[i][j];
                right[i][j] = even + 0.5 * h * a[i][j];
            }
            right[i][4] = h * motor[i];
            right[i][5] = h * link[i];
        }
        eliminate(&mut left, &mut right);
        Discrete {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| right[i][j])),
            motor: std::array::from_fn(|i| right[i][4]),
            link: std::array::from_fn(|i| right[i][5]),
        }
    }
}

impl Discrete {
    // Φ ← Φ Φ,   g ← Φ g + g
    fn twice(&self) -> Self {
        let phi = &self.phi;
        let times = |v: &State| -> State { std::array::from_fn(|i| (0..4).map(|m| phi[i][m] * v[m]).sum()) };
        let again = |g: &State| -> State { std::array::from_fn(|i| times(g)[i] + g[i]) };
        let square = |i: usize, j: usize| (0..4).map(|m| phi[i][m] * phi[m][j]).sum();
        Self {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| square(i, j))),
            motor: again(&self.motor),
            link: again(&self.link),
        }
    }
}

/// The same as it is kept along a run: what a sample period changes, in single precision, which is as if the equations of
/// motion were off by so little.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// Φ − 1
    pub change: [Single; 4],
    /// g of a motor torque.
    pub motor: Single,
    /// g of a torque on the link.
    pub link: Single,
}

/// A vector of the deviation's state in single precision.
pub(super) type Single = [f32; 4];

impl Kept {
    /// The same with the torque noise of the hold, which none foretells, in the third state.
    pub fn pushed_by_third(mut self) -> Self {
        (0..2).for_each(|i| self.change[i][2] = self.motor[i]);
        self.change[2][2] = -1.0;
        self
    }
}

fn single(x: &State) -> Single {
    x.map(|x| x as f32)
}

impl From<Discrete> for Kept {
    fn from(step: Discrete) -> Self {
        let mut change = step.phi;
        (0..4).for_each(|i| change[i][i] -= 1.0);
        Self { change: change.map(|row| single(&row)), motor: single(&step.motor), link: single(&step.link) }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_turns_an_oscillator_without_loss() {
        let linear = Linear { rate: [-400.0, 0.0, 0.0, 0.0], ..Linear::default() };
        let phi = linear.over(1e-3).phi;
        // det Φ = 1, trace Φ = 2 cos ωh to fourth order
        assert!((phi[0][0] * phi[1][1] - phi[0][1] * phi[1][0] - 1.0).abs() < 1e-14);
        assert!((phi[0][0] + phi[1][1] - 2.0 * (0.02f64).cos()).abs() < 1e-10);
    }
}
