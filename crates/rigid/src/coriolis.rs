//! The Coriolis matrix.

use nalgebra::DMatrix;
use sinew_model::{Force, Inertia, Matrix3, Model, Motion, Scalar, Vector3, wide_forms};

use crate::inverse_dynamics_derivatives::Axis;
use crate::{Bodies, Scratch, Workspace};

/// The Coriolis and centrifugal matrix that makes Ṁ − 2C skew; for trees of single-axis joints that of Christoffel.
///
/// ```text
/// C(q, q̇) q̇ = h(q, q̇) − g(q),   xᵀ (Ṁ − 2C) x = 0 for every x
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns nv × nv. Cost O(n · depth).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// One joint alone has none:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// assert_eq!(sinew_rigid::coriolis_matrix(&pendulum, &[0.3], &[2.0])[(0, 0)], 0.0);
/// ```
/// Source: Echeandia, Wensing, *Numerical methods to compute the Coriolis matrix and Christoffel symbols*, J. Comput.
/// Nonlinear Dyn. 16(9), 2021.
pub fn coriolis_matrix(model: &Model, q: &[f64], qd: &[f64]) -> DMatrix<f64> {
    let mut C = DMatrix::zeros(model.nv, model.nv);
    coriolis_matrix_into(model, &mut Workspace::new(model), q, qd, C.as_mut_slice());
    C
}

wide_forms! {
    avx2,
    /// [`coriolis_matrix`] without allocation, into the nv × nv numbers of `C` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn coriolis_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64], C: &mut [f64]) {
        let (_, scratch, _) = ws.open(model);
        coriolis(scratch, q, qd, C);
    }
}

/// [`coriolis_matrix_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
pub fn coriolis_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], qd: &[S], C: &mut [S]) {
    ws.take(b);
    coriolis(ws, q, qd, C);
}

/// The same once the inertias are taken.
#[inline(always)]
fn coriolis<S: Scalar>(ws: &mut Scratch<S>, q: &[S], qd: &[S], C: &mut [S]) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), C.len()), (nv, nv * nv), "qd, C");
    C.fill(S::ZERO);
    // All in the world's axes, where composites only add.
    ws.poses_about_roots(q);
    let Scratch { mechanism, inertia, world, body, composite, transport, axis, .. } = ws;
    let segments = mechanism.segments();
    for (k, (segment, inertia)) in segments.iter().zip(&*inertia).enumerate() {
        let own = &mut axis[segment.first_axis..][..segment.nv()];
        let mut v = body[segment.parent].velocity;
        for (l, axis) in own.iter_mut().enumerate() {
            // v = v_parent + Σ s q̇
            axis.s = segment.axis(l, &world[k + 1]);
            v += axis.s * qd[segment.first_dof + l];
        }
        for axis in own {
            // ṡ = v × s
            axis.s_rate = v.cross_motion(axis.s);
        }
        let I = world[k + 1].inertia_to_parent(inertia);
        body[k + 1].velocity = v;
        (composite[k + 1], transport[k + 1]) = (I, Transport::new(&I, v));
    }
    for (j, segment) in segments.iter().enumerate().rev() {
        let (I, B) = (composite[j + 1], transport[j + 1]);
        composite[segment.parent] += I;
        transport[segment.parent] = transport[segment.parent].plus(&B);
        for k in 0..segment.nv() {
            let column = segment.first_dof + k;
            let Axis { s, s_rate, .. } = axis[segment.first_axis + k];
            // F₁ = I ṡ + B s,   F₂ = I s,   F₃ = Bᵀ s
            let (F1, F2, F3) = (I.times(s_rate) + B.times(s), I.times(s), B.transpose_times(s));
            for l in 0..segment.nv() {
                // C_ij = s_i·F₁
                C[segment.first_dof + l + nv * column] += F1.dot(axis[segment.first_axis + l].s);
            }
            let mut ancestor = segment.parent;
            while ancestor > 0 {
                let carrier = &segments[ancestor - 1];
                for (l, r) in axis[carrier.first_axis..][..carrier.nv()].iter().enumerate() {
                    let row = carrier.first_dof + l;
                    // C_ij = s_i·F₁,   C_ji = ṡ_i·F₂ + s_i·F₃
                    C[row + nv * column] += F1.dot(r.s);
                    C[column + nv * row] += F2.dot(r.s_rate) + F3.dot(r.s.angular);
                }
                ancestor = carrier.parent;
            }
        }
    }
}

/// How a body carries its momentum along: the body's own share of the Coriolis matrix.
///
/// ```text
/// B = ½ ((v×*) I − I (v×) + (I v) ×̄*) = [A 0; −[f]× 0],   f = linear momentum
/// A = [ω]× (I_ω − ½ tr(I_ω) 1) − [h]× [v]×
/// ```
#[derive(Debug, Clone, Copy)]
pub(crate) struct Transport<S> {
    A: Matrix3<S>,
    f: Vector3<S>,
}

impl<S: Scalar> Transport<S> {
    pub(crate) const ZERO: Self = Self { A: Matrix3 { rows: [Vector3::ZERO; 3] }, f: Vector3::ZERO };

    #[inline(always)]
    pub(crate) fn new(I: &Inertia<S>, v: Motion<S>) -> Self {
        let mut moment = I.second_moment;
        let half_trace = (moment.xx + moment.yy + moment.zz) * 0.5;
        moment.xx -= half_trace;
        moment.yy -= half_trace;
        moment.zz -= half_trace;
        let turning = Matrix3::skew(v.angular) * moment.to_matrix();
        let A = turning - Matrix3::skew(I.first_moment) * Matrix3::skew(v.linear);
        Self { A, f: I.times(v).linear }
    }

    #[inline(always)]
    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self { A: self.A + o.A, f: self.f + o.f }
    }

    #[inline(always)]
    pub(crate) fn times(&self, s: Motion<S>) -> Force<S> {
        Force::new(self.A * s.angular, s.angular.cross(self.f))
    }

    /// Bᵀ s, which is a moment alone.
    #[inline(always)]
    pub(crate) fn transpose_times(&self, s: Motion<S>) -> Vector3<S> {
        self.A.transpose_mul(s.angular) + self.f.cross(s.linear)
    }
}
