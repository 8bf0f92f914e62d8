//! Robots with bending links: they sag, swing, lose what their dampers take, and log their joints only.

use sinew_data::Quantity;
use sinew_effects::CATALOGUE;
use sinew_model::{BeamSection, Bending, EffectSpec, LinkId, Place, Robot, samples};
use sinew_plant::Plant;
use sinew_simulate::{Method, Options, Simulated, Start, Tolerance, Torques, simulate};

use crate::robots::plant;

const TIGHT: Tolerance = Tolerance { relative: 1e-11, absolute: 1e-12 };

const BEAM: BeamSection = BeamSection {
    length: 0.8,
    flexural_rigidity: 300.0,
    torsional_rigidity: None,
    mass_per_length: 2.1,
    polar_inertia_per_length: 0.0,
};

// Two rods of 0.8 m, of which the first bends in the plane of its joints.
fn arm(damping_ratio: f64) -> Robot {
    let mut robot = Robot::rigid(samples::planar_arm(2, 1.68, 0.8));
    for joint in &mut robot.joints {
        joint.rotor_inertia = 0.3;
    }
    let bending = Bending::beam(LinkId(1), &['y'], 2, &[BEAM]);
    robot.bending.push(Bending { damping_ratio, ..bending });
    robot
}

fn run(robot: &Robot, start: &Start, tau: &[f64], method: Method, seconds: f64) -> Simulated {
    let plant = plant(robot);
    let mut options = Options::new(&plant, seconds, 0.01);
    (options.start, options.tolerance, options.method) = (start.clone(), TIGHT, method);
    simulate(&plant, &plant.parameters(), &mut Torques::constant(tau), &options).unwrap()
}

// From rest with straight links: they fall into their springs.
fn straight(robot: &Robot, q: &[f64]) -> Start {
    Start::at(&plant(robot).straight(q))
}

#[test]
fn energy_stays_without_dampers() {
    for method in [Method::Explicit, Method::Stiff] {
        let robot = arm(0.0);
        let run = run(&robot, &straight(&robot, &[0.4, -0.3]), &[0.0, 0.0], method, 1.0);
        let drift = run.energy.iter().map(|h| (h - run.energy[0]).abs()).fold(0.0, f64::max);
        assert!(drift < 1e-6, "{method:?}: {drift:e} of {}", run.energy[0]);
        assert!(run.audit.worst_defect < 1e-6);
    }
}

#[test]
fn dampers_take_energy_and_give_none() {
    let robot = arm(0.05);
    let run = run(&robot, &straight(&robot, &[0.4, -0.3]), &[3.0, 1.0], Method::Auto, 1.0);
    assert!(run.audit.dissipated > 1e-3, "{:?}", run.audit);
    assert!(run.audit.worst_defect < 1e-8, "{:?}", run.audit);
}

#[test]
fn a_robot_in_balance_stays_while_its_motors_hold() {
    let robot = arm(0.01);
    let plant = plant(&robot);
    let p = plant.parameters();
    let start = Start::balanced(&plant, &p, &[0.2, -0.5]).unwrap();
    let bent = plant.virtual_joints().iter().map(|v| start.q[v.dof].abs()).fold(0.0, f64::max);
    assert!(bent > 0.01, "the link sags by {bent}");
    // torque that holds: gravity of the bent robot
    let g = sinew_rigid::gravity(plant.model(), &start.q);
    let hold: Vec<f64> = plant.joints().iter().map(|&dof| g[dof]).collect();
    let run = run(&robot, &start, &hold, Method::Auto, 0.5);
    for joint in ["joint_1", "joint_2"] {
        let q = &run.run.signal(Quantity::JointPosition, joint).unwrap().values;
        assert!(q.iter().all(|x| (x - q[0]).abs() < 1e-9), "{joint}");
    }
}

#[test]
fn the_log_has_the_joints_and_nothing_of_the_links() {
    let robot = arm(0.01);
    let run = run(&robot, &straight(&robot, &[0.0, 0.0]), &[0.0, 0.0], Method::Auto, 0.05);
    let mut joints: Vec<&str> = run.run.signals.iter().map(|s| s.place.as_str()).collect();
    joints.dedup();
    assert_eq!(joints, ["joint_1", "joint_2"]);
}

#[test]
fn stiff_links_give_back_the_rigid_robot() {
    let end = |robot: &Robot| {
        let start = straight(robot, &[0.4, -0.3]);
        let run = run(robot, &start, &[0.0, 0.0], Method::Auto, 0.3).run;
        run.signal(Quantity::JointPosition, "joint_2").unwrap().values[30]
    };
    let mut rigid = arm(0.1);
    rigid.bending.clear();
    let gap = |stiffer: f64| {
        let mut robot = arm(0.1);
        let sections = [BeamSection { flexural_rigidity: 300.0 * stiffer, ..BEAM }];
        robot.bending =
            vec![Bending { damping_ratio: 0.1, ..Bending::beam(LinkId(1), &['y'], 2, &sections) }];
        (end(&robot) - end(&rigid)).abs()
    };
    // first order in 1/EI
    let (soft, hard) = (gap(30.0), gap(300.0));
    assert!(hard < soft / 5.0 && soft < 0.01, "{soft:e} {hard:e}");
}

#[test]
fn a_payload_at_the_tip_bends_the_link_by_f_l_cubed_over_three_ei() {
    let sag = |mass: f64| {
        let mut robot = arm(0.0);
        let sections = [BeamSection { flexural_rigidity: 3e5, ..BEAM }];
        robot.bending = vec![Bending::beam(LinkId(1), &['y'], 4, &sections)];
        // the tool is the frame of the second link, at the tip of the first
        robot.effects.push(EffectSpec::new("payload", Place::Robot).with("mass", mass));
        let plant = plant(&robot);
        let rest = plant.rest_position(&plant.parameters(), &[0.0, 0.0]).unwrap();
        plant.virtual_joints().iter().map(|v| rest[v.dof] * (0.8 - v.station)).sum::<f64>()
    };
    let want = 5.0 * 9.81 * 0.8f64.powi(3) / (3.0 * 3e5);
    // small angles
    assert!(((sag(5.0) - sag(0.0)) / want - 1.0).abs() < 1e-6, "{} against {want}", sag(5.0) - sag(0.0));
}

#[test]
fn effects_that_would_act_on_a_virtual_joint_or_hide_where_a_mass_is_are_refused() {
    let refusal = |spec: EffectSpec| {
        let mut robot = arm(0.0);
        robot.effects.push(spec);
        Plant::new(&robot, &CATALOGUE).unwrap_err().to_string()
    };
    let friction =
        EffectSpec::new("viscous_friction", Place::Joint("v.link_1.1".into())).with("viscous", 1.0);
    let text = refusal(friction);
    assert!(text.contains("stands for the bending of a link") && text.contains("help:"), "{text}");
    let mass = EffectSpec::new("link_mass", Place::Link("link_1".into())).with("mass", 0.1);
    let text = refusal(mass);
    assert!(text.contains("\"link_1\" bends") && text.contains("help:"), "{text}");
}

// Quasi-static links.

// The same arm with elastic joints, the first link without mass of its own along it.
fn quasi_static() -> Robot {
    let mut robot = arm(0.0);
    for joint in &mut robot.joints {
        joint.stiffness = Some(2000.0);
    }
    robot.bending[0].quasi_static = true;
    robot
}

#[test]
fn a_quasi_static_link_keeps_the_energy() {
    let drift = |stiffer: f64| {
        let mut robot = quasi_static();
        let sections = [BeamSection { flexural_rigidity: 300.0 * stiffer, ..BEAM }];
        robot.bending =
            vec![Bending { quasi_static: true, ..Bending::beam(LinkId(1), &['y'], 2, &sections) }];
        let start = straight(&robot, &[0.4, -0.3]);
        let run = run(&robot, &start, &[0.0, 0.0], Method::Explicit, 0.5);
        let lowest = run.energy.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = run.energy.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        highest - lowest
    };
    let (soft, hard) = (drift(10.0), drift(100.0));
    println!("energy moves by {soft:e} J, ten times as stiff {hard:e} J");
    // what is left is the integrator's
    assert!(hard < 1e-8 && soft < 1e-8, "{soft:e} {hard:e}");
}

#[test]
fn a_quasi_static_robot_in_balance_stays_where_it_is() {
    let robot = quasi_static();
    let plant = plant(&robot);
    let p = plant.parameters();
    let start = Start::balanced(&plant, &p, &[0.2, -0.5]).unwrap();
    let rest = plant.rest_position(&p, &[0.2, -0.5]).unwrap();
    let g = sinew_rigid::gravity(plant.model(), &rest);
    let hold: Vec<f64> = plant.joints().iter().map(|&dof| g[dof]).collect();
    let run = run(&robot, &start, &hold, Method::Auto, 0.5);
    for (joint, at) in [("joint_1", 0.2), ("joint_2", -0.5)] {
        let q = &run.run.signal(Quantity::JointPosition, joint).unwrap().values;
        assert!(q.iter().all(|x| (x - at).abs() < 1e-8), "{joint}: {} … {}", q[0], q[q.len() - 1]);
    }
}
