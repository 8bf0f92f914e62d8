//! Scratch space.

use sinew_model::{Coordinates, Inertia, Scalar, Vector3};
use sinew_rigid::{Bodies, inertias};

use crate::ElasticJoints;
use crate::spin::{Spin, Turn};

/// Scratch space of the forms ending in `_with`; nothing is allocated after `new`.
///
/// Belongs to the joints it was made of. Holds no result from one call to the next.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    pub(crate) rigid: sinew_rigid::Scratch<S>,
    pub(crate) inertia: Vec<Inertia<S>>,
    // B in rigid joints, zero in elastic ones.
    pub(crate) armature: Vec<S>,
    // Torques on the links, and those of the springs among them.
    pub(crate) tau: Vec<S>,
    pub(crate) tau_j: Vec<S>,
    pub(crate) qdd: Vec<S>,
    pub(crate) bias: Vec<S>,
    pub(crate) zeros: Vec<S>,
    pub(crate) at: Coordinates<S>,
    // Of the world and of each segment.
    pub(crate) turn: Vec<Turn<S>>,
    // Of each rotor on a moving segment.
    pub(crate) spin: Vec<Spin<S>>,
    // Of each axis of each segment: z and ω_parent × z.
    pub(crate) axis: Vec<[Vector3<S>; 2]>,
    // nv × nv numbers each.
    pub(crate) matrices: [Vec<S>; 10],
    // 2 nv × nv numbers each.
    pub(crate) blocks: [Vec<S>; 5],
    // nv numbers each: positions, rates, accelerations of the motors.
    pub(crate) motor: [Vec<S>; 3],
}

impl<S: Scalar> Scratch<S> {
    /// Room for these joints, with the inertias of their model.
    pub fn new(joints: &ElasticJoints) -> Self {
        let (nv, segments) = (joints.model.nv, joints.mechanism.segments().len());
        let zeros = || vec![S::ZERO; nv];
        let matrix = || vec![S::ZERO; nv * nv];
        let armature = |(&elastic, &B): (&bool, &f64)| if elastic { S::ZERO } else { S::constant(B) };
        Self {
            rigid: sinew_rigid::Scratch::new(&joints.links),
            inertia: inertias(&joints.links),
            armature: joints.elastic.iter().zip(&joints.rotor_inertia).map(armature).collect(),
            tau: zeros(),
            tau_j: zeros(),
            qdd: zeros(),
            bias: zeros(),
            zeros: zeros(),
            at: Coordinates::new(&joints.mechanism),
            turn: vec![Turn::still(); segments + 1],
            spin: vec![Spin::still(); joints.rotors.len()],
            axis: vec![[Vector3::ZERO; 2]; joints.mechanism.axes()],
            matrices: core::array::from_fn(|_| matrix()),
            blocks: core::array::from_fn(|_| vec![S::ZERO; 2 * nv * nv]),
            motor: core::array::from_fn(|_| zeros()),
        }
    }

    /// The links with the rotors of rigid joints, and the rest of what the rigid algorithms take.
    pub(crate) fn bodies<'a>(
        joints: &'a ElasticJoints,
        inertia: &'a [Inertia<S>],
        armature: &'a [S],
    ) -> Bodies<'a, S> {
        let gravity = Vector3::constant(joints.links.gravity);
        Bodies { model: &joints.links, inertia, gravity, armature }
    }
}

/// Scratch space of the forms ending in `_into`; nothing is allocated after `new`.
///
/// Belongs to the joints it was made of. Holds no result from one call to the next.
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(crate) links: sinew_rigid::Workspace,
    pub(crate) scratch: Scratch<f64>,
}

impl Workspace {
    /// Room for these joints.
    pub fn new(joints: &ElasticJoints) -> Self {
        Self { links: sinew_rigid::Workspace::new(&joints.links), scratch: Scratch::new(joints) }
    }
}
