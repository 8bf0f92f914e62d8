//! Rotors that feel how the links that carry them turn.

use core::ops::Mul;

use sinew_effect::{Coefficients, Kind};
use sinew_model::{JointKind, Matrix3, Model, Robot, RotorMount, Scalar, Vector3};

use crate::active::refused;
use crate::{Active, LinkState, Plant, PlantError};

/// A rotor that an effect couples with the link that carries it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mount {
    /// The degree of freedom it drives.
    dof: usize,
    /// The body that carries it.
    body: usize,
    /// Its axis in the frame of that body, a unit vector.
    axis: Vector3<f64>,
    /// 1/N.
    ratio: f64,
}

/// The rotors of the effects that couple one with its link, on the bodies of the plant's `model`.
///
/// # Errors
/// If a rotor rides on no moving link, the robot does not say how fast it turns or about which axis, or links bend.
pub(crate) fn mounts(robot: &Robot, model: &Model, effects: &[Active]) -> Result<Vec<Mount>, PlantError> {
    let carried = effects.iter().filter_map(|e| e.effect.carried_rotor().map(|dof| (dof, e)));
    carried.map(|(dof, active)| mount(robot, model, dof, active)).collect()
}

fn mount(robot: &Robot, model: &Model, dof: usize, active: &Active) -> Result<Mount, PlantError> {
    let own = robot.model.dof(model.dof_name(dof)).expect("a joint of the plant is one of the robot");
    let (place, ratio) = carried(robot, own).map_err(|reason| refused(&active.spec, reason))?;
    let joint = model.joint(&robot.model.joints[place.body.0].name);
    let body = joint.expect("hinges of effects leave the robot's joints").0;
    Ok(Mount { dof, body, axis: place.axis, ratio: 1.0 / ratio })
}

// Where the rotor of a robot's degree of freedom rides, and its gear ratio; the error is a sentence that says what is
// missing.
fn carried(robot: &Robot, dof: usize) -> Result<(RotorMount, f64), String> {
    if !robot.bending.is_empty() {
        return Err("is not known beside links that bend".to_owned());
    }
    let name = robot.model.dof_name(dof);
    let Some(ratio) = robot.joints[dof].gear_ratio else {
        return Err(format!("needs the speed of the rotor: `gear_ratio` in [joints.{name}]"));
    };
    match robot.rotor_mount(dof) {
        Ok(Some(place)) => Ok((place, ratio)),
        Ok(None) => Err("its rotor rides on no moving link".to_owned()),
        Err(unknown) => Err(format!("{}; state {}", unknown.reason, unknown.key)),
    }
}

impl Plant {
    /// True if a plant of `robot` can couple the rotor of a degree of freedom with the link that carries it: that link
    /// moves, no link bends, and gear ratio and axis are known.
    pub fn can_couple_rotor(robot: &Robot, dof: usize) -> bool {
        carried(robot, dof).is_ok()
    }
}

/// How the coupled rotors move with their links.
///
/// ```text
/// T = ½ B θ̇² + κ B θ̇ u·ω,   κ = s/N
/// ```
///
/// with u the axis of the rotor and ω the angular velocity of the link that carries it.
#[derive(Debug)]
pub(crate) struct Rotors<'a, S> {
    model: &'a Model,
    mounts: &'a [Mount],
    // κB
    coupling: Vec<S>,
    turns: Vec<Turn<S>>,
}

// How a body turns, in its own frame.
#[derive(Debug, Clone, Copy)]
struct Turn<S> {
    // parent_from_body
    rotation: Matrix3<S>,
    velocity: Vector3<S>,
    acceleration: Vector3<S>,
    // What it must be given.
    moment: Vector3<S>,
}

impl<'a, S: Kind> Rotors<'a, S> {
    /// None where no rotor is coupled.
    pub(crate) fn new(model: &'a Model, mounts: &'a [Mount], c: &Coefficients<S>) -> Option<Self> {
        let coupling: Vec<S> =
            mounts.iter().map(|m| c.rotor_link[m.dof] * c.rotor[m.dof] * m.ratio).collect();
        let zero = Vector3::ZERO;
        let still = Turn { rotation: Matrix3::identity(), velocity: zero, acceleration: zero, moment: zero };
        let coupled = coupling.iter().any(|coupling| *coupling != S::ZERO);
        coupled.then(|| Self { model, mounts, coupling, turns: vec![still; model.joints.len()] })
    }

    /// Takes the positions and velocities of the links.
    ///
    /// ```text
    /// ω = Rᵀ ω_parent + a q̇
    /// ```
    pub(crate) fn turn(&mut self, q: &[S], qd: &[S]) {
        for (k, joint) in self.model.joints.iter().enumerate() {
            let rotation = joint.pose(q).rotation;
            let carried = joint.parent.map(|p| rotation.transpose_mul(self.turns[p.0].velocity));
            let own = own_turn(joint.kind, qd[joint.first_dof] * joint.multiplier());
            let turn = &mut self.turns[k];
            (turn.rotation, turn.velocity) = (rotation, carried.map_or(own, |carried| carried + own));
        }
    }

    /// Takes the accelerations of the links, whose velocities it has.
    ///
    /// ```text
    /// ω̇ = Rᵀ ω̇_parent + ω × a q̇ + a q̈
    /// ```
    pub(crate) fn accelerate(&mut self, qd: &[S], qdd: &[S]) {
        for (k, joint) in self.model.joints.iter().enumerate() {
            let Turn { rotation, velocity, .. } = self.turns[k];
            let carried = joint.parent.map(|p| rotation.transpose_mul(self.turns[p.0].acceleration));
            let rate = |x: &[S]| own_turn(joint.kind, x[joint.first_dof] * joint.multiplier());
            let own = velocity.cross(rate(qd)) + rate(qdd);
            self.turns[k].acceleration = carried.map_or(own, |carried| carried + own);
        }
    }

    /// Takes from the forces on the links what turns the rotors about and speeds them up.
    ///
    /// ```text
    /// τ ← τ − J_ωᵀ κB (θ̈ u + θ̇ ω × u)
    /// ```
    pub(crate) fn load_links<A: Copy>(&mut self, thetad: &[S], thetadd: &[A], tau: &mut [S])
    where
        S: Mul<A, Output = S>,
    {
        self.turns.iter_mut().for_each(|turn| turn.moment = Vector3::ZERO);
        for (mount, &coupling) in self.mounts.iter().zip(&self.coupling) {
            let turn = &mut self.turns[mount.body];
            let swing = turn.velocity.cross(Vector3::constant(mount.axis));
            turn.moment += Vector3::on_axis(mount.axis, coupling * thetadd[mount.dof]);
            turn.moment += swing * (coupling * thetad[mount.dof]);
        }
        for (k, joint) in self.model.joints.iter().enumerate().rev() {
            let Turn { rotation, moment, .. } = self.turns[k];
            if let JointKind::Revolute { axis } = joint.kind {
                tau[joint.first_dof] -= moment.along(axis) * joint.multiplier();
            }
            if let Some(parent) = joint.parent {
                let parent = &mut self.turns[parent.0];
                parent.moment += rotation * moment;
            }
        }
    }

    /// Takes from the forces on the motors what the links' turning asks of them, reflected.
    ///
    /// ```text
    /// f ← f − κB u·ω̇
    /// ```
    pub(crate) fn load_motors(&self, force: &mut [S]) {
        for (mount, &coupling) in self.mounts.iter().zip(&self.coupling) {
            force[mount.dof] -= self.turns[mount.body].acceleration.along(mount.axis) * coupling;
        }
    }

    /// ∂²T/∂θ̇∂q̇ with links at `q`, nv × nv by columns.
    ///
    /// ```text
    /// S = κB uᵀ J_ω
    /// ```
    pub(crate) fn coupling(&mut self, q: &[S]) -> Vec<S> {
        let nv = self.model.nv;
        let mut out = vec![S::ZERO; nv * nv];
        for j in 0..nv {
            let mut qd = vec![S::ZERO; nv];
            qd[j] = S::ONE;
            self.turn(q, &qd);
            for (mount, &coupling) in self.mounts.iter().zip(&self.coupling) {
                out[mount.dof + nv * j] = self.turns[mount.body].velocity.along(mount.axis) * coupling;
            }
        }
        out
    }

    /// Σ κB θ̇ u·ω, J.
    pub(crate) fn energy(&mut self, x: &LinkState<S>) -> S {
        self.turn(&x.q, &x.qd);
        let of = |(mount, &coupling): (&Mount, &S)| {
            self.turns[mount.body].velocity.along(mount.axis) * x.thetad[mount.dof] * coupling
        };
        self.mounts.iter().zip(&self.coupling).map(of).fold(S::ZERO, |sum, e| sum + e)
    }
}

// a q̇ of a joint that turns
fn own_turn<S: Scalar>(kind: JointKind, rate: S) -> Vector3<S> {
    kind.motion(0, rate).angular
}
