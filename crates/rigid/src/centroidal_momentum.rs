//! The momentum of a whole robot about its centre of mass.

use nalgebra::Matrix6xX;
use sinew_model::{Force, Inertia, Model, Motion, Scalar, Vector3, wide_forms};

use crate::rnea::body_force;
use crate::{Bodies, Scratch, Workspace};

/// The momentum of all moving bodies about their centre of mass, [angular; linear] in world axes.
///
/// ```text
/// h = Σ X I v = A(q) q̇,   linear part: total mass times the velocity of the centre of mass
/// ```
///
/// `q`: nq, rad (m). `qd`: nv. Returns kg·m²/s and kg·m/s. A robot without mass gives numbers that are not finite.
/// Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A point mass on a rod has linear momentum m l ω and none about itself:
/// ```
/// let pendulum = sinew_model::samples::pendulum(2.0, 0.5);
/// let h = sinew_rigid::centroidal_momentum(&pendulum, &[0.0], &[3.0]);
/// approx::assert_relative_eq!(h.linear.z, 2.0 * 0.5 * 3.0, max_relative = 1e-12);
/// approx::assert_abs_diff_eq!(h.angular.y, 0.0, epsilon = 1e-12);
/// ```
/// Source: Orin, Goswami, Lee, *Centroidal dynamics of a humanoid robot*, Autonomous Robots 35, 2013.
pub fn centroidal_momentum(model: &Model, q: &[f64], qd: &[f64]) -> Force<f64> {
    centroidal_momentum_into(model, &mut Workspace::new(model), q, qd)
}

wide_forms! {
    avx2,
    /// [`centroidal_momentum`] without allocation.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn centroidal_momentum_into(model: &Model, ws: &mut Workspace, q: &[f64], qd: &[f64]) -> Force<f64> {
        let (_, scratch, zeros) = ws.open(model);
        momentum_and_rate(scratch, q, qd, zeros).0
    }
}

/// The rate of [`centroidal_momentum`]: the wrench of gravity and of the surroundings about the centre of mass.
///
/// ```text
/// ḣ = A q̈ + Ȧ q̇
/// ```
///
/// `q`: nq, rad (m). `qd`, `qdd`: nv. Cost O(n).
///
/// # Panics
/// If a slice has the wrong length.
pub fn centroidal_momentum_rate(model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]) -> Force<f64> {
    centroidal_momentum_rate_into(model, &mut Workspace::new(model), q, qd, qdd)
}

wide_forms! {
    avx2,
    /// [`centroidal_momentum_rate`] without allocation.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn centroidal_momentum_rate_into(
        model: &Model,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
    ) -> Force<f64> {
        let (_, scratch, _) = ws.open(model);
        momentum_and_rate(scratch, q, qd, qdd).1
    }
}

/// The momentum about the centre of mass and its rate, for any kind of number and with the inertias given.
///
/// # Panics
/// If a slice has the wrong length.
pub fn centroidal_momentum_with<S: Scalar>(
    b: &Bodies<S>,
    ws: &mut Scratch<S>,
    q: &[S],
    qd: &[S],
    qdd: &[S],
) -> (Force<S>, Force<S>) {
    ws.take(b);
    momentum_and_rate(ws, q, qd, qdd)
}

/// The matrix A of [`centroidal_momentum`], 6 × nv.
///
/// ```text
/// h = A(q) q̇
/// ```
///
/// `q`: nq, rad (m). Cost O(n).
///
/// # Panics
/// If `q` has the wrong length.
pub fn centroidal_momentum_matrix(model: &Model, q: &[f64]) -> Matrix6xX<f64> {
    let mut A = Matrix6xX::zeros(model.nv);
    centroidal_momentum_matrix_into(model, &mut Workspace::new(model), q, A.as_mut_slice());
    A
}

wide_forms! {
    avx2,
    /// [`centroidal_momentum_matrix`] without allocation, into the 6 × nv numbers of `A` by columns.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn centroidal_momentum_matrix_into(model: &Model, ws: &mut Workspace, q: &[f64], A: &mut [f64]) {
        let (_, scratch, _) = ws.open(model);
        matrix(scratch, q, A);
    }
}

/// [`centroidal_momentum_matrix_into`] for any kind of number, with the inertias given.
///
/// # Panics
/// If a slice has the wrong length.
pub fn centroidal_momentum_matrix_with<S: Scalar>(b: &Bodies<S>, ws: &mut Scratch<S>, q: &[S], A: &mut [S]) {
    ws.take(b);
    matrix(ws, q, A);
}

#[inline(always)]
fn matrix<S: Scalar>(ws: &mut Scratch<S>, q: &[S], A: &mut [S]) {
    assert_eq!(A.len(), 6 * ws.mechanism.nv(), "A");
    let Scratch { mechanism, at, inertia, world, composite, .. } = ws;
    mechanism.world_poses(q, at, world);
    composite[0] = Inertia::default();
    for ((composite, pose), inertia) in composite[1..].iter_mut().zip(&world[1..]).zip(&*inertia) {
        *composite = pose.inertia_to_parent(inertia);
    }
    for (k, segment) in mechanism.segments().iter().enumerate().rev() {
        let I = composite[k + 1];
        composite[segment.parent] += I;
    }
    let centre = composite[0].first_moment * composite[0].mass.recip();
    A.fill(S::ZERO);
    for (k, segment) in mechanism.segments().iter().enumerate() {
        for l in 0..segment.nv() {
            // a column: the momentum I s of the subtree
            let column = about(centre, composite[k + 1].times(segment.axis(l, &world[k + 1])));
            let first = 6 * (segment.first_dof + l);
            for (entry, x) in A[first..first + 6].iter_mut().zip(column.to_array()) {
                *entry += x;
            }
        }
    }
}

#[inline(always)]
fn momentum_and_rate<S: Scalar>(ws: &mut Scratch<S>, q: &[S], qd: &[S], qdd: &[S]) -> (Force<S>, Force<S>) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), qdd.len()), (nv, nv), "qd, qdd");
    let Scratch { mechanism, at, inertia, world, body, .. } = ws;
    mechanism.world_poses(q, at, world);
    let (mut total, mut momentum, mut rate) = (Inertia::default(), Force::ZERO, Force::ZERO);
    body[0].acceleration = Motion::ZERO;
    for (k, (segment, inertia)) in mechanism.segments().iter().zip(&*inertia).enumerate() {
        let pose = &world[k + 1];
        let moved = pose.motion_to_parent(segment.rate(qd));
        let v = body[segment.parent].velocity + moved;
        let pushed = pose.motion_to_parent(segment.rate(qdd));
        let a = body[segment.parent].acceleration + pushed + v.cross_motion(moved);
        (body[k + 1].velocity, body[k + 1].acceleration) = (v, a);
        // h = Σ I v,   ḣ = Σ I a + v ×* I v about the world's origin
        let I = pose.inertia_to_parent(inertia);
        total += I;
        momentum += I.times(v);
        rate += body_force(&I, v, a);
    }
    let centre = total.first_moment * total.mass.recip();
    (about(centre, momentum), about(centre, rate))
}

/// A force or momentum about the world's origin, about a point.
#[inline(always)]
fn about<S: Scalar>(point: Vector3<S>, f: Force<S>) -> Force<S> {
    Force::new(f.angular - point.cross(f.linear), f.linear)
}
