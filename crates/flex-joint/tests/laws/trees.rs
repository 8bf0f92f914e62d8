//! Random trees with springs, dampers, coupled joints and rotors on links anywhere, in random motion.

use sinew_flex_joint::{ElasticJoints, SpinInertia};
use sinew_model::samples::{Random, random_tree};
use sinew_model::{Coupling, LinkId, Robot};

/// A robot in a state.
pub struct Case {
    pub robot: Robot,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub theta: Vec<f64>,
    pub thetad: Vec<f64>,
    pub tau_m: Vec<f64>,
}

/// Where rotors are mounted.
#[derive(Clone, Copy, PartialEq)]
pub enum Mounting {
    /// On the link before the joint, along its axis.
    Usual,
    /// On any link, in any direction.
    Anywhere,
}

/// Trees of 1 to 15 bodies, floating bases and mimic joints among them; two of three joints elastic.
pub fn cases(mounting: Mounting) -> impl Iterator<Item = Case> {
    (0..30).map(move |seed| case(1 + seed as usize % 15, seed, mounting))
}

fn case(bodies: usize, seed: u64, mounting: Mounting) -> Case {
    let mut robot = Robot::rigid(random_tree(bodies, seed + 500));
    let random = &mut Random::new(seed);
    let model = robot.model.clone();
    let single: Vec<usize> =
        (0..model.nv).filter(|&dof| model.joints[model.joint_of_dof(dof).0].kind.nv() == 1).collect();
    for &dof in &single {
        let joint = &mut robot.joints[dof];
        joint.rotor_inertia = random.uniform(0.02, 0.3);
        if random.uniform(0.0, 3.0) < 1.0 {
            continue;
        }
        joint.stiffness = Some(random.uniform(50.0, 500.0));
        joint.damping = random.uniform(0.1, 2.0);
        joint.gear_ratio = Some(random.uniform(2.0, 20.0));
        if mounting == Mounting::Anywhere {
            joint.carried_by = Some(LinkId(random.uniform(0.0, model.links.len() as f64) as usize));
            joint.rotor_axis = Some((random.direction() * 2.0).to_array());
        }
    }
    let elastic: Vec<usize> =
        single.iter().copied().filter(|&d| robot.joints[d].stiffness.is_some()).collect();
    if mounting == Mounting::Anywhere && elastic.len() > 3 {
        let dofs = vec![elastic[0], elastic[2]];
        let (stiffness, damping) = (vec![300.0, 60.0, 60.0, 200.0], vec![0.5, 0.1, 0.1, 0.3]);
        robot.couplings.push(Coupling { dofs, stiffness, damping });
    }
    let nv = model.nv;
    let q = random.position(&model);
    Case {
        q,
        qd: random.vector(nv),
        theta: random.vector(nv),
        thetad: random.vector(nv),
        tau_m: random.vector(nv),
        robot,
    }
}

impl Case {
    /// The complete model with the rotors' spin beside the links.
    pub fn complete(&self) -> ElasticJoints {
        ElasticJoints::complete(&self.robot, SpinInertia::BesideLinks).expect("rotors with gears")
    }
}

/// Equal within `tolerance` of the largest number wanted, or of one.
pub fn assert_close(what: &str, got: &[f64], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len(), "{what}");
    let scale = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() <= tolerance * scale, "{what}: got {got}, want {want} of {scale}");
    }
}
