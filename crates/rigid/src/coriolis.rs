//! The Coriolis matrix.

use nalgebra::DMatrix;
use sinew_kinematics::body_poses_with;
use sinew_model::{Force, Inertia, JointKind, Matrix3, Model, Motion, Scalar, Vector3};

use crate::rnea::{rate, scaled};
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

/// [`coriolis_matrix`] without allocation, into the nv × nv numbers of `C` by columns.
///
/// # Panics
/// If a slice has the wrong length.
pub fn coriolis_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64], C: &mut [f64]) {
    let (bodies, scratch, _) = ws.split(model);
    coriolis_matrix_with(&bodies, scratch, q, qd, C);
}

/// [`coriolis_matrix_into`] for any kind of number.
///
/// # Panics
/// If a slice has the wrong length.
#[inline(always)]
pub fn coriolis_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], qd: &[S], C: &mut [S]) {
    b.check();
    let nv = b.model.nv;
    assert_eq!((qd.len(), C.len()), (nv, nv * nv), "qd, C");
    C.fill(S::ZERO);
    // All in the world, where composites only add.
    body_poses_with(b.model, q, &mut ws.pose);
    for (i, joint) in b.model.joints.iter().enumerate() {
        let v_parent = joint.parent.map_or(Motion::ZERO, |p| ws.velocity[p.0]);
        let v = v_parent + ws.pose[i].motion_to_parent(rate(joint, qd));
        let I = ws.pose[i].inertia_to_parent(&b.inertia[i]);
        (ws.velocity[i], ws.composite[i], ws.transport[i]) = (v, I, Transport::new(&I, v));
    }
    for (j, joint) in b.model.joints.iter().enumerate().rev() {
        let (I, B) = (ws.composite[j], ws.transport[j]);
        if let Some(p) = joint.parent {
            ws.composite[p.0] += I;
            ws.transport[p.0] = ws.transport[p.0].plus(&B);
        }
        for k in 0..joint.kind.nv() {
            let column = joint.first_dof + k;
            let (s, s_rate) = axis(ws, joint.kind, j, k, scaled(joint, S::ONE));
            // F₁ = I ṡ + B s,   F₂ = I s,   F₃ = Bᵀ s
            let (F1, F2, F3) = (I.times(s_rate) + B.times(s), I.times(s), B.transpose_times(s));
            let mut body = Some(j);
            while let Some(i) = body {
                let ancestor = &b.model.joints[i];
                let own = i == j;
                for l in 0..ancestor.kind.nv() {
                    let row = ancestor.first_dof + l;
                    let (r, r_rate) = axis(ws, ancestor.kind, i, l, scaled(ancestor, S::ONE));
                    // C_ij = s_i·F₁,   C_ji = ṡ_i·F₂ + s_i·F₃
                    C[row + nv * column] += F1.dot(r);
                    if !own {
                        C[column + nv * row] += F2.dot(r_rate) + F3.dot(r);
                    }
                }
                body = ancestor.parent.map(|p| p.0);
            }
        }
    }
}

/// One axis about the world's origin and its rate, times `scale`.
///
/// ```text
/// s = X S_k,   ṡ = v × s
/// ```
#[inline(always)]
fn axis<S: Scalar>(
    ws: &Scratch<S>,
    kind: JointKind,
    body: usize,
    k: usize,
    scale: S,
) -> (Motion<S>, Motion<S>) {
    let s = ws.pose[body].motion_to_parent(kind.motion(k, scale));
    (s, ws.velocity[body].cross_motion(s))
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

    #[inline(always)]
    pub(crate) fn transpose_times(&self, s: Motion<S>) -> Force<S> {
        Force::new(self.A.transpose_mul(s.angular) + self.f.cross(s.linear), Vector3::ZERO)
    }
}
