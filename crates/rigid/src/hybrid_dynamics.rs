//! Forward and hybrid dynamics: the articulated-body algorithm.

use sinew_model::{ArticulatedInertia, Force, Motion, Scalar, Segment, SegmentKind, wide_forms};

use crate::mass_matrix::{along, composite_bodies};
use crate::rnea::{inverse_dynamics, velocity};
use crate::scratch::{Body, Conditions, Pivot};
use crate::{Bodies, BodyAccelerations, MovingBodies, Scratch};

wide_forms! {
    avx2,
    /// Accelerations that the torques `tau` produce, for any kind of number (articulated bodies).
    ///
    /// ```text
    /// q̈ = M(q)⁻¹ (τ − C(q, q̇) q̇ − g(q))
    /// ```
    ///
    /// `q`: nq, rad (m). `qd`, `tau`: nv. `qdd`: nv, overwritten. Cost O(n); with mimic joints M is factored instead.
    /// A degree of freedom that moves no inertia gives numbers that are not finite.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, table 7.1.
    pub fn forward_dynamics_with<S: Scalar>(
        b: &Bodies<S>,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        tau: &[S],
        qdd: &mut [S],
    ) {
        forward_dynamics_under_with(b, ws, q, qd, tau, |_| {}, qdd);
    }
}

/// [`forward_dynamics_with`] under forces on the bodies that may depend on how they move, in the same sweeps.
///
/// ```text
/// M(q) q̈ + C(q, q̇) q̇ + g(q) = τ + Σ Jᵀ f(v)
/// ```
///
/// `push` is called when the velocities of all bodies are known, and pushes them; where joints mimic others, twice, with the
/// same velocities. Returns the accelerations of the bodies.
///
/// # Panics
/// If a slice has the wrong length.
///
/// # Example
/// A level pendulum of 2 kg and 0.5 m is held by the moment of its weight, which is told in the frame of its segment:
/// ```
/// # use sinew_model::{Force, JointId, JointKind, Mechanism, Vector3, samples};
/// # use sinew_rigid::{Bodies, Scratch, forward_dynamics_under_with, inertias};
/// let pendulum = samples::pendulum(2.0, 0.5);
/// let JointKind::Revolute { axis } = pendulum.joints[0].kind else { panic!("it turns") };
/// let moment = Mechanism::new(&pendulum).segments()[0].vector_from_link(axis * (2.0 * 9.81 * 0.5));
/// let inertia = inertias(&pendulum);
/// let bodies = Bodies::new(&pendulum, &inertia);
/// let (mut ws, mut qdd) = (Scratch::new(&pendulum), [1.0]);
/// let hold = |moving: &mut sinew_rigid::MovingBodies<f64>| {
///     moving.push(JointId(0), Force::new(moment, Vector3::ZERO));
/// };
/// forward_dynamics_under_with(&bodies, &mut ws, &[0.0], &[0.0], &[0.0], hold, &mut qdd);
/// assert!(qdd[0].abs() < 1e-12);
/// ```
#[inline(always)]
pub fn forward_dynamics_under_with<'w, S: Scalar>(
    b: &Bodies<S>,
    ws: &'w mut Scratch<S>,
    q: &[S],
    qd: &[S],
    tau: &[S],
    push: impl Fn(&mut MovingBodies<S>),
    qdd: &mut [S],
) -> BodyAccelerations<'w, S> {
    let conditions = ws.take(b);
    forward_dynamics(ws, &conditions, q, qd, tau, push, qdd)
}

/// The same once the inertias are taken.
#[inline(always)]
pub(crate) fn forward_dynamics<'w, S: Scalar>(
    ws: &'w mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    tau: &[S],
    push: impl Fn(&mut MovingBodies<S>),
    qdd: &mut [S],
) -> BodyAccelerations<'w, S> {
    assert_eq!(tau.len(), ws.mechanism.nv(), "tau");
    let mut torque = core::mem::take(&mut ws.torque);
    torque.copy_from_slice(tau);
    hybrid(ws, c, q, qd, |_| false, push, qdd, &mut torque);
    ws.torque = torque;
    BodyAccelerations(&ws.body)
}

wide_forms! {
    avx2,
    /// Hybrid dynamics, for any kind of number: where `imposed`, q̈ is given and τ computed; elsewhere τ is given and q̈
    /// computed, in one sweep.
    ///
    /// ```text
    /// M(q) q̈ + C(q, q̇) q̇ + g(q) = τ
    /// ```
    ///
    /// `q`: nq, rad (m). `qd`, `imposed`, `qdd`, `tau`: nv. Entries of `qdd` where not imposed and of `tau` where
    /// imposed are overwritten. All imposed: inverse dynamics; none: forward dynamics. Cost O(n); with mimic joints M
    /// is factored instead.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 9.1.
    pub fn hybrid_dynamics_with<S: Scalar>(
        b: &Bodies<S>,
        ws: &mut Scratch<S>,
        q: &[S],
        qd: &[S],
        imposed: &[bool],
        qdd: &mut [S],
        tau: &mut [S],
    ) {
        assert_eq!(imposed.len(), b.model.nv, "imposed");
        let conditions = ws.take(b);
        hybrid(ws, &conditions, q, qd, |dof| imposed[dof], |_| {}, qdd, tau);
    }
}

wide_forms! {
    avx2,
    /// How a hybrid motion answers to the torques of its free joints, for any kind of number.
    ///
    /// ```text
    /// R_ij = ∂q̈_i/∂τ_j = (M_ff⁻¹)_ij          i free, j free
    /// R_ij = ∂τ_i/∂τ_j = (M_if M_ff⁻¹)_ij     i imposed, j free
    /// R_ij = 0                                j imposed
    /// ```
    ///
    /// `q`: nq, rad (m). `imposed`: nv. `response`: nv × nv by columns, overwritten. Cost O(n³) in the free degrees of
    /// freedom. None imposed: the inverse of the mass matrix.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 9.1.
    pub fn hybrid_response_with<S: Scalar>(
        b: &Bodies<S>,
        ws: &mut Scratch<S>,
        q: &[S],
        imposed: &[bool],
        response: &mut [S],
    ) {
        let nv = b.model.nv;
        assert_eq!((imposed.len(), response.len()), (nv, nv * nv), "imposed, response");
        let conditions = ws.take_composites(b);
        let mut M = core::mem::take(&mut ws.matrix);
        composite_bodies(ws, &conditions, q, &mut M);
        response.copy_from_slice(&M);
        identity_where(|dof| imposed[dof], response, nv);
        let Scratch { support, grouped, column, .. } = &mut *ws;
        grouped.load(support, response);
        grouped.factor(support, column);
        grouped.invert(support, column);
        grouped.store(response);
        for j in 0..nv {
            if imposed[j] {
                response[nv * j..nv * (j + 1)].fill(S::ZERO);
                continue;
            }
            for i in (0..nv).filter(|&i| imposed[i]) {
                let free = (0..nv).filter(|&k| !imposed[k]);
                response[i + nv * j] = free.fold(S::ZERO, |sum, k| sum + M[i + nv * k] * response[k + nv * j]);
            }
        }
        ws.matrix = M;
    }
}

// Rows and columns of imposed degrees of freedom become those of the identity.
#[inline(always)]
fn identity_where<S: Scalar>(imposed: impl Fn(usize) -> bool, M: &mut [S], nv: usize) {
    for (i, j) in (0..nv).flat_map(|j| (0..nv).map(move |i| (i, j))) {
        if imposed(i) || imposed(j) {
            M[i + nv * j] = if i == j { S::ONE } else { S::ZERO };
        }
    }
}

#[inline(always)]
fn hybrid<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    imposed: impl Fn(usize) -> bool + Copy,
    push: impl Fn(&mut MovingBodies<S>),
    qdd: &mut [S],
    tau: &mut [S],
) {
    let nv = ws.mechanism.nv();
    assert_eq!((qd.len(), qdd.len(), tau.len()), (nv, nv, nv), "qd, qdd, tau");
    if ws.mechanism.has_mimic() {
        by_mass_matrix(ws, c, q, qd, imposed, push, qdd, tau);
    } else {
        outward(ws, q, qd);
        push(&mut MovingBodies(&mut ws.body));
        inward(ws, c, imposed, qdd, tau);
        accelerate(ws, c, imposed, qdd, tau);
    }
}

/// Velocities, and what each body alone is and feels.
#[inline(always)]
fn outward<S: Scalar>(ws: &mut Scratch<S>, q: &[S], qd: &[S]) {
    let Scratch { mechanism, at, inertia, body, articulated, .. } = ws;
    mechanism.read(q, at);
    let mut last = Motion::ZERO;
    for (k, (segment, inertia)) in mechanism.segments().iter().zip(&*inertia).enumerate() {
        let pose = mechanism.pose(k, q, at);
        // along a chain the parent is the body before, and stays in registers
        let near = S::FITS_REGISTERS && segment.parent == k;
        let v_parent = if near { last } else { body[segment.parent].velocity };
        let (v, c) = velocity(segment, &pose, v_parent, qd);
        // I_A = I,   p_A = v ×* I v
        articulated[k + 1] = ArticulatedInertia::rigid(inertia);
        let own = &mut body[k + 1];
        (own.pose, own.velocity, own.acceleration) = (pose, v, c);
        own.force = v.cross_force(inertia.times(v));
        last = v;
    }
}

/// Articulated inertias. A free joint is six axes one after another in one frame, so that one treatment serves every
/// kind of joint.
#[inline(always)]
fn inward<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    imposed: impl Fn(usize) -> bool,
    qdd: &[S],
    tau: &[S],
) {
    let Scratch { mechanism, body, articulated, pivot, .. } = ws;
    let (mut carried_inertia, mut carried_force) = (ArticulatedInertia::default(), Force::ZERO);
    for (row, segment) in mechanism.segments().iter().enumerate().rev().map(|(k, s)| (k + 1, s)) {
        let (mut I, mut p) = (articulated[row], body[row].force);
        if S::FITS_REGISTERS {
            (I, p) = (I.plus(&carried_inertia), p + carried_force);
            (carried_inertia, carried_force) = (ArticulatedInertia::default(), Force::ZERO);
        }
        for k in (0..segment.nv()).rev() {
            let (dof, axis) = (segment.first_dof + k, segment.first_axis + k);
            // U = I_A s
            let U = column(&I, segment, k);
            let bias = along(segment, k, p);
            if imposed(dof) {
                // p_A = p_A + U q̈
                pivot[axis] = Pivot { U, d_inverse: S::ZERO, u: bias };
                p += U * qdd[dof];
            } else {
                // d = s·U,   u = τ − s·p_A,   I_A = I_A − U Uᵀ/d,   p_A = p_A + U u/d
                let d_inverse = (along(segment, k, U) + c.armature(dof)).recip();
                let u = tau[dof] - bias;
                pivot[axis] = Pivot { U, d_inverse, u };
                I = I.without(U, d_inverse);
                p += U * (u * d_inverse);
            }
        }
        if segment.parent > 0 {
            // I_parent = I_parent + Xᵀ I_A X,   p_parent = p_parent + Xᵀ (p_A + I_A c)
            let Body { pose, acceleration, .. } = &body[row];
            p += I.times(*acceleration);
            let (I, p) = (I.to_parent(pose), pose.force_to_parent(p));
            if S::FITS_REGISTERS && segment.parent + 1 == row {
                (carried_inertia, carried_force) = (I, p);
            } else {
                articulated[segment.parent] = articulated[segment.parent].plus(&I);
                body[segment.parent].force += p;
            }
        }
    }
}

/// Accelerations; those of the bodies are the velocity products c before.
#[inline(always)]
fn accelerate<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    imposed: impl Fn(usize) -> bool,
    qdd: &mut [S],
    tau: &mut [S],
) {
    let Scratch { mechanism, body, pivot, .. } = ws;
    let ground = c.ground();
    body[0].acceleration = ground;
    let mut last = ground;
    for (row, segment) in mechanism.segments().iter().enumerate().map(|(k, s)| (k + 1, s)) {
        // a = X a_parent + c
        let near = S::FITS_REGISTERS && segment.parent + 1 == row;
        let a_parent = if near { last } else { body[segment.parent].acceleration };
        let mut a = body[row].pose.motion_to_child(a_parent) + body[row].acceleration;
        for k in 0..segment.nv() {
            let dof = segment.first_dof + k;
            let Pivot { U, d_inverse, u } = pivot[segment.first_axis + k];
            if imposed(dof) {
                // a = a + s q̈,   τ = U·a + s·p_A
                add_along(segment, k, qdd[dof], &mut a);
                tau[dof] = U.dot(a) + u + c.armature(dof) * qdd[dof];
            } else {
                // q̈ = (u − U·a)/d,   a = a + s q̈
                qdd[dof] = (u - U.dot(a)) * d_inverse;
                add_along(segment, k, qdd[dof], &mut a);
            }
        }
        body[row].acceleration = a;
        last = a;
    }
}

/// The same through M and h, for trees in which several joints share a degree of freedom.
#[inline(always)]
fn by_mass_matrix<S: Scalar>(
    ws: &mut Scratch<S>,
    c: &Conditions<S>,
    q: &[S],
    qd: &[S],
    imposed: impl Fn(usize) -> bool,
    push: impl Fn(&mut MovingBodies<S>),
    qdd: &mut [S],
    tau: &mut [S],
) {
    let nv = ws.mechanism.nv();
    let (mut M, mut x) = (core::mem::take(&mut ws.matrix), core::mem::take(&mut ws.solution));
    // x = τ_f − (M q̈ + h)_f with q̈_f = 0
    for dof in (0..nv).filter(|&dof| !imposed(dof)) {
        qdd[dof] = S::ZERO;
    }
    inverse_dynamics(ws, c, q, qd, qdd, &push, &mut x);
    for dof in 0..nv {
        x[dof] = if imposed(dof) { S::ZERO } else { tau[dof] - x[dof] };
    }
    // M_ff q̈_f = x; imposed rows and columns become those of the identity
    ws.places.load(&ws.inertia);
    composite_bodies(ws, c, q, &mut M);
    identity_where(&imposed, &mut M, nv);
    ws.grouped.load(&ws.support, &M);
    ws.grouped.factor(&ws.support, &mut ws.column);
    ws.grouped.solve(&ws.support, &mut x);
    for dof in (0..nv).filter(|&dof| !imposed(dof)) {
        qdd[dof] = x[dof];
    }
    // τ_i = (M q̈ + h)_i
    inverse_dynamics(ws, c, q, qd, qdd, &push, &mut x);
    for dof in (0..nv).filter(|&dof| imposed(dof)) {
        tau[dof] = x[dof];
    }
    (ws.matrix, ws.solution) = (M, x);
}

/// I_A S_k. No joint here mimics another: the ratio is that of an axis that points backwards or forwards.
#[inline(always)]
fn column<S: Scalar>(I: &ArticulatedInertia<S>, segment: &Segment, k: usize) -> Force<S> {
    let ArticulatedInertia { angular: A, mixed: H, linear: L } = I;
    let ratio = S::constant(segment.ratio);
    match segment.kind {
        SegmentKind::Turning => Force::new([A.xz, A.yz, A.zz].into(), H.rows[2]) * ratio,
        SegmentKind::Sliding => {
            let [a, b, c] = H.rows;
            Force::new([a.z, b.z, c.z].into(), [L.xz, L.yz, L.zz].into()) * ratio
        }
        SegmentKind::Free => {
            let mut a = Motion::ZERO;
            add_along(segment, k, S::ONE, &mut a);
            I.times(a)
        }
    }
}

/// a = a + S_k x.
#[inline(always)]
fn add_along<S: Scalar>(segment: &Segment, k: usize, x: S, a: &mut Motion<S>) {
    match (segment.kind, k) {
        (SegmentKind::Turning, _) => a.angular.z += x * segment.ratio,
        (SegmentKind::Sliding, _) => a.linear.z += x * segment.ratio,
        (SegmentKind::Free, 0) => a.angular.x += x,
        (SegmentKind::Free, 1) => a.angular.y += x,
        (SegmentKind::Free, 2) => a.angular.z += x,
        (SegmentKind::Free, 3) => a.linear.x += x,
        (SegmentKind::Free, 4) => a.linear.y += x,
        (SegmentKind::Free, _) => a.linear.z += x,
    }
}
