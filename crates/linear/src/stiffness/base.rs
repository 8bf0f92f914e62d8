//! A robot whose base gives way: the same robot on springs.

use nalgebra::Matrix6;
use sinew_model::{
    Coupling, Inertia, Joint, JointId, JointKind, JointSettings, Limits, Link, LinkId, Model, Pose, Robot,
    Vector3,
};

/// The joints under the base, from the ground up, with their place in [turn; shift].
const JOINTS: [(&str, usize); 6] =
    [("base.x", 3), ("base.y", 4), ("base.z", 5), ("base.rx", 0), ("base.ry", 1), ("base.rz", 2)];

/// The robot with its base on springs: every map of this crate then holds for joints and base together.
///
/// ```text
/// J = [J_base J_q],   K = diag(K_base, K_q),   C = J K⁻¹ Jᵀ = C_q + X C_base Xᵀ
/// ```
///
/// `stiffness`: from [turn; shift] of the base's frame to [moment; force], in the ground's axes, N·m/rad, N, N/m;
/// symmetric positive definite where it is finite. A direction whose diagonal entry is infinite stays rigid. The
/// base's own inertia now moves, and its weight rests on the springs. The new degrees of freedom come first, `base.x`,
/// `base.y`, `base.z`, `base.rx`, `base.ry`, `base.rz` without the rigid ones; positions get as many numbers in front,
/// zero where the base stands without the load. Links count from a new root, `ground`.
///
/// # Example
/// A rigid rod of one metre bolted to a floor of 200 N·m/rad about y:
/// ```
/// use nalgebra::{Matrix6, Vector6};
/// use sinew_linear::{cartesian_stiffness, on_springs};
/// use sinew_model::{Robot, samples::planar_arm};
/// let rigid = f64::INFINITY;
/// let floor = Matrix6::from_diagonal(&Vector6::new(rigid, 200.0, rigid, rigid, rigid, rigid));
/// let robot = on_springs(&Robot::rigid(planar_arm(2, 1.0, 1.0)), &floor);
/// let plant = sinew_plant::Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let told = cartesian_stiffness(&plant, &plant.parameters(), &[0.0; 3], robot.tool).unwrap();
/// assert_eq!(told.coordinates, ["q.base.ry"]);
/// assert!((told.compliance[(5, 5)] - 1.0 / 200.0).abs() < 1e-15);
/// ```
pub fn on_springs(robot: &Robot, stiffness: &Matrix6<f64>) -> Robot {
    let soft: Vec<(&str, usize)> =
        JOINTS.into_iter().filter(|&(_, k)| stiffness[(k, k)].is_finite()).collect();
    let n = soft.len();
    let mut moved = robot.clone();
    moved.model = on_joints(&robot.model, &soft);
    moved.joints.splice(0..0, vec![JointSettings::default(); n]);
    for carrier in moved.joints.iter_mut().filter_map(|j| j.carried_by.as_mut()) {
        carrier.0 += 1;
    }
    for dof in moved.couplings.iter_mut().flat_map(|c| c.dofs.iter_mut()) {
        *dof += n;
    }
    if n > 0 {
        let entry = |r: usize, c: usize| stiffness[(soft[r].1, soft[c].1)];
        let stiffness = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        moved.couplings.push(Coupling { dofs: (0..n).collect(), stiffness, damping: vec![0.0; n * n] });
    }
    moved.bending.iter_mut().for_each(|b| b.link.0 += 1);
    moved.tool = LinkId(robot.tool.0 + 1);
    moved
}

fn on_joints(model: &Model, soft: &[(&str, usize)]) -> Model {
    let n = soft.len();
    let carrier = n.checked_sub(1).map(JointId);
    let up = |id: Option<JointId>| id.map_or(carrier, |id| Some(JointId(id.0 + n)));
    let base = model.links.iter().filter(|l| l.body.is_none());
    let resting = base.fold(Inertia::default(), |mut sum, link| {
        sum += link.body_from_link.inertia_to_parent(&link.inertia);
        sum
    });
    let mut joints: Vec<Joint> =
        soft.iter().enumerate().map(|(k, &(name, direction))| spring(k, name, direction)).collect();
    if let Some(last) = joints.last_mut() {
        last.inertia = resting;
    }
    joints.extend(model.joints.iter().cloned().map(|mut joint| {
        joint.parent = up(joint.parent);
        if let Some(mimic) = &mut joint.mimic {
            mimic.leader.0 += n;
        }
        (joint.first_q, joint.first_dof) = (joint.first_q + n, joint.first_dof + n);
        joint
    }));
    let ground = Link {
        name: "ground".to_owned(),
        parent: None,
        body: None,
        body_from_link: Pose::identity(),
        inertia: Inertia::default(),
    };
    let links = model.links.iter().cloned().map(|mut link| {
        link.parent = Some(link.parent.map_or(LinkId(0), |parent| LinkId(parent.0 + 1)));
        link.body = up(link.body);
        link
    });
    Model {
        name: model.name.clone(),
        joints,
        links: core::iter::once(ground).chain(links).collect(),
        gravity: model.gravity,
        nq: model.nq + n,
        nv: model.nv + n,
    }
}

// The k-th joint from the ground, along or about an axis of the ground.
fn spring(k: usize, name: &str, direction: usize) -> Joint {
    let unit = |i: usize| f64::from(direction % 3 == i);
    let axis = Vector3::new(unit(0), unit(1), unit(2));
    Joint {
        name: name.to_owned(),
        kind: if direction < 3 { JointKind::Revolute { axis } } else { JointKind::Prismatic { axis } },
        parent: k.checked_sub(1).map(JointId),
        placement: Pose::identity(),
        inertia: Inertia::default(),
        limits: Limits::NONE,
        mimic: None,
        first_q: k,
        first_dof: k,
    }
}
