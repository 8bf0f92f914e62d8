//! Laws of rotors that feel how the links that carry them turn.

use sinew_effect::{DIRECTIONS, Derivative};
use sinew_effects::CATALOGUE;
use sinew_flex_joint::{ElasticJoints, SpinInertia};
use sinew_model::samples::{Random, planar_arm, random_tree};
use sinew_model::{Bending, EffectSpec, LinkId, Place, Robot, Scalar};
use sinew_plant::{Dynamics, ImposedOut, MotorMotion, Plant, Rates, State};

use crate::robots::plant;

const TOLERANCE: f64 = 1e-9;

/// Trees without floating bases, every rotor on a moving link with a gear; `elastic`: every how many joints.
fn trees(elastic: usize) -> Vec<(Robot, Plant, State<f64>, Vec<f64>)> {
    (0..60).filter_map(|seed| tree(seed, elastic)).collect()
}

fn tree(seed: u64, elastic: usize) -> Option<(Robot, Plant, State<f64>, Vec<f64>)> {
    let model = random_tree(2 + seed as usize % 7, seed + 900);
    let mut robot = (model.nq == model.nv).then(|| Robot::rigid(model))?;
    let random = &mut Random::new(seed);
    for dof in 0..robot.model.nv {
        let joint = &mut robot.joints[dof];
        joint.rotor_inertia = random.uniform(0.02, 0.3);
        if dof % elastic == 0 {
            (joint.stiffness, joint.damping) = (Some(random.uniform(50.0, 500.0)), 0.3);
        }
        joint.gear_ratio = Some(random.uniform(15.0, 60.0));
        joint.carried_by = Some(LinkId(random.uniform(0.0, robot.model.links.len() as f64) as usize));
        joint.rotor_axis = Some((random.direction() * 2.0).to_array());
        if let Ok(Some(_)) = robot.rotor_mount(dof) {
            let place = Place::Joint(robot.model.dof_name(dof).to_owned());
            robot.effects.push(EffectSpec::new("rotor_link_coupling", place).with("scale", 1.0));
        }
    }
    // A link that is lighter than the rotors in it is none.
    ElasticJoints::complete(&robot, SpinInertia::InLinks).ok()?;
    let plant = (!robot.effects.is_empty()).then(|| plant(&robot))?;
    let nv = robot.model.nv;
    let mut x = State::zero(&plant);
    (x.q, x.qd) = (random.vector(nv), random.vector(nv));
    (x.theta, x.thetad) = (random.vector(nv), random.vector(nv));
    for dof in (0..nv).filter(|dof| dof % elastic != 0) {
        (x.theta[dof], x.thetad[dof]) = (x.q[dof], x.qd[dof]);
    }
    Some((robot, plant, x, random.vector(nv)))
}

fn forward(plant: &Plant, x: &State<f64>, tau_m: &[f64]) -> Rates<f64> {
    let mut rates = Rates::new(plant);
    Dynamics::new(plant, &plant.parameters()).forward(x, tau_m, &mut rates);
    rates
}

fn assert_close(got: &[f64], want: &[f64]) {
    let scale = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() <= TOLERANCE * scale, "got {got}, want {want} of {scale}");
    }
}

#[test]
fn elastic_joints_accelerate_as_in_the_complete_model() {
    let cases = trees(1);
    assert!(cases.len() > 20, "{}", cases.len());
    for (robot, plant, x, tau_m) in cases {
        let rates = forward(&plant, &x, &tau_m);
        let complete = ElasticJoints::complete(&robot, SpinInertia::InLinks).unwrap();
        let (qdd, thetadd) = complete.forward_dynamics(&x.q, &x.qd, &x.theta, &x.thetad, &tau_m);
        assert_close(&rates.qdd, qdd.as_slice());
        assert_close(&rates.thetadd, thetadd.as_slice());
    }
}

#[test]
fn the_torque_of_an_imposed_motion_is_the_one_that_drives_it() {
    for elastic in [1, 2, 100] {
        for (_, plant, x, tau_m) in trees(elastic) {
            let rates = forward(&plant, &x, &tau_m);
            let mut out = ImposedOut::new(plant.model().nv);
            let imposed: Vec<bool> = plant.elastic().iter().map(|elastic| !elastic).collect();
            let motor = MotorMotion { acceleration: &rates.thetadd, imposed: &imposed, links: None };
            Dynamics::new(&plant, &plant.parameters()).imposed_torque(&x, motor, &mut out);
            assert_close(&out.qdd, &rates.qdd);
            assert_close(&out.tau_m, &tau_m);
            assert_close(&out.tau_j, &rates.tau_j);
        }
    }
}

// dH/dt = τ_mᵀ θ̇ − damping
#[test]
fn the_spin_of_rotors_keeps_the_balance_of_energy() {
    for (robot, plant, x, tau_m) in trees(2) {
        let rates = forward(&plant, &x, &tau_m);
        let moves = |(&value, &rate): (&f64, &f64)| {
            let mut derivative = [0.0; DIRECTIONS];
            derivative[0] = rate;
            Derivative { value, derivative }
        };
        let along = |x: &[f64], rate: &[f64]| -> Vec<Derivative> { x.iter().zip(rate).map(moves).collect() };
        let p: Vec<Derivative> = plant.parameters().iter().map(|&p| Derivative::constant(p)).collect();
        let mut moving = State::zero(&plant);
        (moving.q, moving.qd) = (along(&x.q, &x.qd), along(&x.qd, &rates.qdd));
        (moving.theta, moving.thetad) = (along(&x.theta, &x.thetad), along(&x.thetad, &rates.thetadd));
        let rate = Dynamics::new(&plant, &p).energy(&moving).derivative[0];
        let given: f64 = tau_m.iter().zip(&x.thetad).map(|(tau, v)| tau * v).sum();
        let lost: f64 = (0..plant.model().nv)
            .filter(|&dof| plant.elastic()[dof])
            .map(|dof| robot.joints[dof].damping * (x.thetad[dof] - x.qd[dof]).powi(2))
            .sum();
        assert_close(&[rate], &[given - lost]);
    }
}

#[test]
fn a_rotor_that_is_not_told_is_refused() {
    let mut robot = Robot::rigid(planar_arm(2, 3.0, 0.4));
    let at = |joint: &str| {
        EffectSpec::new("rotor_link_coupling", Place::Joint(joint.to_owned())).with("scale", 1.0)
    };
    for joint in &mut robot.joints {
        joint.rotor_inertia = 0.1;
    }
    let refusal = |robot: &Robot| Plant::new(robot, &CATALOGUE).unwrap_err().to_string();
    robot.effects = vec![at("joint_2")];
    assert!(refusal(&robot).contains("`gear_ratio` in [joints.joint_2]"), "{}", refusal(&robot));
    for joint in &mut robot.joints {
        joint.gear_ratio = Some(50.0);
    }
    assert!(Plant::new(&robot, &CATALOGUE).is_ok());
    robot.effects = vec![at("joint_1")];
    assert!(refusal(&robot).contains("rides on no moving link"), "{}", refusal(&robot));
    robot.effects = vec![at("joint_2")];
    robot.bending.push(Bending::base_spring(LinkId(1), &['y'], 4e3));
    assert!(refusal(&robot).contains("links that bend"), "{}", refusal(&robot));
}
