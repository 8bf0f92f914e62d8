//! The inertia of a rigid body: ten numbers.

use core::ops::{Add, AddAssign};

use crate::{Force, Matrix3, Motion, Scalar, Symmetric3, Vector3};

/// Mass, first moment and second moment of a rigid body about a frame's origin, in its axes.
///
/// ```text
/// m,   h = m c,   I = I_c + m (cᵀc 1 − c cᵀ)
/// ```
///
/// The ten numbers enter the equations of motion linearly: they are the parameters of identification.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inertia<S> {
    /// m, kg.
    pub mass: S,
    /// m c, kg·m.
    pub first_moment: Vector3<S>,
    /// I about the frame's origin, kg·m².
    pub second_moment: Symmetric3<S>,
}

impl<S: Scalar> Inertia<S> {
    /// The same inertia in a richer kind of number.
    #[inline(always)]
    pub fn constant(i: &Inertia<f64>) -> Self {
        Self {
            mass: S::constant(i.mass),
            first_moment: Vector3::constant(i.first_moment),
            second_moment: Symmetric3::constant(&i.second_moment),
        }
    }
    /// A point of mass `mass` at `position`.
    pub fn point(mass: S, position: Vector3<S>) -> Self {
        Self { mass, ..Self::default() }.shifted(position)
    }
    /// The momentum I v.
    ///
    /// ```text
    /// [I ω + h × v; m v − h × ω]
    /// ```
    #[inline(always)]
    pub fn times(&self, v: Motion<S>) -> Force<S> {
        Force::new(
            self.second_moment * v.angular + self.first_moment.cross(v.linear),
            v.linear * self.mass - self.first_moment.cross(v.angular),
        )
    }
    /// The same body in axes turned by `r`.
    #[inline(always)]
    pub fn rotated(&self, r: &Matrix3<S>) -> Self {
        Self {
            mass: self.mass,
            first_moment: *r * self.first_moment,
            second_moment: self.second_moment.rotated(r),
        }
    }
    /// The same body about an origin from which the present one stands at `p`.
    ///
    /// ```text
    /// h' = h + m p,   I' = I + 2(p·h) 1 − p hᵀ − h pᵀ + m (pᵀp 1 − p pᵀ)
    /// ```
    #[inline(always)]
    pub fn shifted(&self, p: Vector3<S>) -> Self {
        let half = (p * self.mass) * S::constant(0.5);
        Self {
            mass: self.mass,
            first_moment: self.first_moment + p * self.mass,
            second_moment: self.second_moment + Symmetric3::shift(p, self.first_moment + half),
        }
    }
}

impl<S: Scalar> Inertia<S> {
    /// The same shape with `k` times the mass.
    #[inline(always)]
    pub fn scaled(&self, k: S) -> Self {
        Self {
            mass: self.mass * k,
            first_moment: self.first_moment * k,
            second_moment: self.second_moment.scaled(k),
        }
    }
}

impl Inertia<f64> {
    /// A body of mass m with centre of mass c and second moment `[xx, yy, zz, xy, xz, yz]` about it.
    pub fn at_centre_of_mass(mass: f64, c: Vector3<f64>, [xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Self {
        let about_centre = Symmetric3 { xx, yy, zz, xy, xz, yz };
        Self { mass, first_moment: Vector3::ZERO, second_moment: about_centre }.shifted(c)
    }
    /// c = h/m, m; the origin where the body has no mass.
    pub fn centre_of_mass(&self) -> Vector3<f64> {
        if self.mass == 0.0 { Vector3::ZERO } else { self.first_moment * (1.0 / self.mass) }
    }
    /// The second moment about the centre of mass.
    pub fn second_moment_about_centre(&self) -> Symmetric3<f64> {
        let c = self.centre_of_mass();
        self.second_moment + Symmetric3::shift(c, c * (-0.5 * self.mass))
    }
    /// The second moments of the mass itself, of which every body's are positive definite.
    ///
    /// ```text
    /// P = ∫ [x; 1] [x; 1]ᵀ dm = [½ tr(I) 1 − I, h; hᵀ, m]
    /// ```
    ///
    /// Rows of a symmetric 4 × 4 matrix, kg·m², kg·m, kg; affine in the ten parameters.
    ///
    /// Source: Wensing, Kim, Slotine, *Linear matrix inequalities for physically consistent inertial parameter
    /// identification*, IEEE Robotics and Automation Letters 3(1), 2018.
    pub fn pseudo_inertia(&self) -> [[f64; 4]; 4] {
        let (h, s) = (self.first_moment, &self.second_moment);
        let half = 0.5 * (s.xx + s.yy + s.zz);
        [
            [half - s.xx, -s.xy, -s.xz, h.x],
            [-s.xy, half - s.yy, -s.yz, h.y],
            [-s.xz, -s.yz, half - s.zz, h.z],
            [h.x, h.y, h.z, self.mass],
        ]
    }
    /// True if some body of finite density has this inertia: the pseudo-inertia is positive definite.
    ///
    /// # Example
    /// The moments of a body fulfil the triangle inequality:
    /// ```
    /// use sinew_model::{Inertia, Vector3};
    /// let body = |xx| Inertia::at_centre_of_mass(1.0, Vector3::ZERO, [xx, 0.2, 0.2, 0.0, 0.0, 0.0]);
    /// assert!(body(0.3).is_physical() && !body(0.5).is_physical());
    /// ```
    pub fn is_physical(&self) -> bool {
        let mut P = self.pseudo_inertia();
        // every pivot of P = L D Lᵀ is positive
        for k in 0..4 {
            let pivot = P[k][k];
            if pivot.is_nan() || pivot <= 0.0 {
                return false;
            }
            for i in k + 1..4 {
                let factor = P[i][k] / pivot;
                for j in k + 1..4 {
                    P[i][j] -= factor * P[k][j];
                }
            }
        }
        true
    }
}

impl<S: Scalar> Add for Inertia<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            mass: self.mass + o.mass,
            first_moment: self.first_moment + o.first_moment,
            second_moment: self.second_moment + o.second_moment,
        }
    }
}
impl<S: Scalar> AddAssign for Inertia<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_mass_has_the_moment_of_its_distance() {
        let i = Inertia::point(2.0, Vector3::new(0.5, 0.0, 0.0));
        assert_eq!(i.second_moment.zz, 2.0 * 0.25);
        assert_eq!(i.second_moment.xx, 0.0);
        assert_eq!(i.first_moment.x, 1.0);
    }

    #[test]
    fn four_points_are_physical_wherever_the_origin_is_and_two_are_flat() {
        let mut random = crate::samples::Random::new(3);
        for _ in 0..50 {
            let body = random.inertia();
            assert!(body.is_physical());
            assert!(random.pose().inertia_to_parent(&body).is_physical());
            let thin = Inertia::point(1.0, random.direction()) + Inertia::point(2.0, random.direction());
            // a plane of zero thickness: no pivot is left but rounding
            let lighter = Inertia { mass: thin.mass * (1.0 - 1e-9), ..thin };
            assert!(!lighter.is_physical());
        }
    }

    #[test]
    fn shifting_to_the_centre_of_mass_and_back_changes_nothing() {
        let about = [0.3, 0.2, 0.4, 0.01, 0.02, -0.03];
        let i = Inertia::at_centre_of_mass(2.0, [0.1, 0.2, -0.3].into(), about);
        let c = i.second_moment_about_centre();
        for (got, want) in [c.xx, c.yy, c.zz, c.xy, c.xz, c.yz].into_iter().zip(about) {
            assert!((got - want).abs() < 1e-15);
        }
    }
}
