//! Scratch space of the algorithms.

use sinew_model::{Joint, Model, Motion, Pose, Scalar, Vector3};

/// One workspace for all algorithms of the crate over numbers of one kind; nothing is allocated after `new`.
///
/// Holds no result from one call to the next: any workspace of the same model will do.
#[derive(Debug, Clone)]
pub struct Scratch<S> {
    pub(crate) world_from_body: Vec<Pose<S>>,
    pub(crate) velocity: Vec<Motion<S>>,
    pub(crate) acceleration: Vec<Motion<S>>,
}

/// The workspace of the plain forms.
pub type Workspace = Scratch<f64>;

impl<S: Scalar> Scratch<S> {
    /// Room for robots of this model.
    pub fn new(model: &Model) -> Self {
        let n = model.joints.len();
        Self {
            world_from_body: vec![Pose::identity(); n],
            velocity: vec![Motion::ZERO; n],
            acceleration: vec![Motion::ZERO; n],
        }
    }

    /// Poses and spatial velocities of all bodies about the world's origin.
    #[inline(always)]
    pub(crate) fn velocities(&mut self, model: &Model, q: &[S], qd: &[S]) {
        assert_eq!(qd.len(), model.nv, "qd");
        crate::body_poses_with(model, q, &mut self.world_from_body);
        for (i, joint) in model.joints.iter().enumerate() {
            let v_parent = joint.parent.map_or(Motion::ZERO, |p| self.velocity[p.0]);
            // v = v_parent + S q̇
            self.velocity[i] = v_parent + in_world(joint, &self.world_from_body[i], qd);
        }
    }

    /// The same with spatial accelerations.
    #[inline(always)]
    pub(crate) fn accelerations(&mut self, model: &Model, q: &[S], qd: &[S], qdd: &[S]) {
        assert_eq!(qdd.len(), model.nv, "qdd");
        self.velocities(model, q, qd);
        for (i, joint) in model.joints.iter().enumerate() {
            let pose = &self.world_from_body[i];
            let a_parent = joint.parent.map_or(Motion::ZERO, |p| self.acceleration[p.0]);
            // a = a_parent + S q̈ + v × S q̇
            let c = self.velocity[i].cross_motion(in_world(joint, pose, qd));
            self.acceleration[i] = a_parent + in_world(joint, pose, qdd) + c;
        }
    }
}

/// S x of one joint about the world's origin; `x` is a rate of the whole robot.
#[inline(always)]
fn in_world<S: Scalar>(joint: &Joint, world_from_body: &Pose<S>, x: &[S]) -> Motion<S> {
    let mut sum = Motion::new(Vector3::ZERO, Vector3::ZERO);
    for k in 0..joint.kind.nv() {
        sum += joint.kind.motion(k, x[joint.first_dof + k] * joint.multiplier());
    }
    world_from_body.motion_to_parent(sum)
}
