//! The lesson's lines on robots of several joints, by the whole plant: §1, §2.1's last sentence, §3 and Problem 5.
#![allow(non_snake_case)]

use sinew_effect::Derivative;
use sinew_effects::CATALOGUE;
use sinew_linear::modes;
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{Coupling, EffectSpec, Place, Robot, Vector3};
use sinew_plant::{Dynamics, Plant, Rates, State};
use sinew_rigid::inverse_dynamics;
use sinew_simulate::{Options, Start, Torques, simulate};

const JOINTS: usize = 3;
const ROTOR: [f64; JOINTS] = [0.08, 0.05, 0.02];
// N·m·s/rad: friction of the links, of the motors.
const B_L: [f64; JOINTS] = [0.3, 0.2, 0.1];
const B_M: [f64; JOINTS] = [0.5, 0.4, 0.15];
// The first spring is one joint's own, the other two are coupled, by rows.
const K: [[f64; JOINTS]; JOINTS] = [[900.0, 0.0, 0.0], [0.0, 700.0, 120.0], [0.0, 120.0, 400.0]];
const D: [[f64; JOINTS]; JOINTS] = [[2.0, 0.0, 0.0], [0.0, 1.5, 0.4], [0.0, 0.4, 0.8]];
/// Rounding of terms of the size K δ q̇.
const ALGEBRA: f64 = 1e-8;

// Three rods with springs and rotors; dampers and friction as many times their size as `losses`.
fn arm(losses: f64) -> Robot {
    let mut robot = Robot::rigid(planar_arm(JOINTS, 1.2, 0.4));
    for (joint, rotor) in robot.joints.iter_mut().zip(ROTOR) {
        joint.rotor_inertia = rotor;
    }
    (robot.joints[0].stiffness, robot.joints[0].damping) = (Some(K[0][0]), losses * D[0][0]);
    let block = |m: &[[f64; JOINTS]; JOINTS], by: f64| {
        vec![m[1][1], m[1][2], m[2][1], m[2][2]].into_iter().map(|x| by * x).collect()
    };
    robot.couplings.push(Coupling {
        dofs: vec![1, 2],
        stiffness: block(&K, 1.0),
        damping: block(&D, losses),
    });
    for (kind, viscous) in [("link_viscous_friction", B_L), ("viscous_friction", B_M)] {
        for (k, viscous) in viscous.iter().enumerate().filter(|_| losses > 0.0) {
            let effect = EffectSpec::new(kind, Place::Joint(format!("joint_{}", k + 1)));
            robot.effects.push(effect.with("viscous", losses * viscous));
        }
    }
    robot
}

fn plant(robot: &Robot) -> Plant {
    Plant::new(robot, &CATALOGUE).unwrap()
}

fn states(plant: &Plant) -> Vec<State<f64>> {
    let mut random = Random::new(15);
    let state = |random: &mut Random| {
        let mut x = State::zero(plant);
        for values in [&mut x.q, &mut x.qd, &mut x.theta, &mut x.thetad] {
            *values = random.vector(JOINTS);
        }
        x
    };
    (0..20).map(|_| state(&mut random)).collect()
}

fn times(m: &[[f64; JOINTS]; JOINTS], x: &[f64]) -> Vec<f64> {
    m.iter().map(|row| row.iter().zip(x).map(|(m, x)| m * x).sum()).collect()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

// K (θ − q) + D (θ̇ − q̇)
fn tau_j(x: &State<f64>, losses: f64) -> Vec<f64> {
    let (spring, damper) = (times(&K, &minus(&x.theta, &x.q)), times(&D, &minus(&x.thetad, &x.qd)));
    spring.iter().zip(&damper).map(|(k, d)| k + losses * d).collect()
}

#[test]
fn section_1_the_slopes_of_the_spring_energy_are_the_elastic_torques() {
    // U = ½ (θ − q)ᵀ K (θ − q):  −∂U/∂q = K (θ − q) on the links, −∂U/∂θ = −K (θ − q) on the motors
    let mut robot = arm(0.0);
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    let plant = plant(&robot);
    let p: Vec<Derivative> =
        plant.parameters().iter().map(|&p| Derivative { value: p, ..Default::default() }).collect();
    let mut dynamics = Dynamics::new(&plant, &p);
    for x in states(&plant) {
        let spring = times(&K, &minus(&x.theta, &x.q));
        let mut at = State::<Derivative>::zero(&plant);
        for k in 0..JOINTS {
            at.q[k] = Derivative::variable(x.q[k], k);
            at.theta[k] = Derivative::variable(x.theta[k], JOINTS + k);
        }
        let U = dynamics.energy(&at);
        assert!((U.value - 0.5 * dot(&minus(&x.theta, &x.q), &spring)).abs() < ALGEBRA);
        for k in 0..JOINTS {
            assert!((-U.derivative[k] - spring[k]).abs() < ALGEBRA);
            assert!((-U.derivative[JOINTS + k] + spring[k]).abs() < ALGEBRA);
        }
    }
}

#[test]
fn section_1_the_motors_encoders_do_not_see_where_the_links_are() {
    // At rest q misses θ by K⁻¹ g(q): a position error that motor-side sensors do not show.
    let robot = arm(1.0);
    let plant = plant(&robot);
    let (p, q) = (plant.parameters(), [0.3, -0.4, 0.2]);
    let start = Start::balanced(&plant, &p, &q).unwrap();
    let g = sinew_rigid::gravity(&robot.model, &q);
    let carried = times(&K, &minus(&start.theta, &start.q));
    assert!(minus(&carried, g.as_slice()).iter().all(|x| x.abs() < ALGEBRA));
    assert!((start.theta[0] - start.q[0]).abs() > 5e-3);
    // And it stays so: the motors stand still and nothing in their signals tells of it.
    let mut options = Options::new(&plant, 0.2, 1e-2);
    options.start = start.clone();
    let run = simulate(&plant, &p, &mut Torques::constant(g.as_slice()), &options).unwrap().run;
    let motor = run.signal(sinew_data::Quantity::MotorPosition, "joint_1").unwrap();
    assert!(motor.values.iter().all(|x| (x - start.theta[0]).abs() < 1e-7));
}

#[test]
fn section_2_1_each_elastic_joint_adds_a_flexible_mode() {
    let count = |elastic: usize| {
        let mut robot = Robot::rigid(planar_arm(JOINTS, 1.2, 0.4).with_gravity(Vector3::ZERO));
        for (k, joint) in robot.joints.iter_mut().enumerate() {
            (joint.rotor_inertia, joint.stiffness) = (ROTOR[k], (k < elastic).then_some(K[k][k]));
        }
        let plant = plant(&robot);
        let modes = modes(&plant, &plant.parameters(), &[0.3, 0.5, -0.4]).unwrap();
        let free = modes.iter().filter(|m| m.omega_squared == 0.0).count();
        (free, modes.len() - free)
    };
    for elastic in 0..=JOINTS {
        assert_eq!(count(elastic), (JOINTS, elastic));
    }
}

#[test]
fn section_3_links_and_motors_of_an_arm_obey_both_equations() {
    let (robot, tau_m) = (arm(1.0), [3.0, -2.0, 1.0]);
    let plant = plant(&robot);
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &plant.parameters()), Rates::new(&plant));
    for x in states(&plant) {
        dynamics.forward(&x, &tau_m, &mut rates);
        let tau = tau_j(&x, 1.0);
        let links = inverse_dynamics(&robot.model, &x.q, &x.qd, &rates.qdd);
        for k in 0..JOINTS {
            // M q̈ + C q̇ + g + B_ℓ q̇ = τ_j
            assert!((links[k] + B_L[k] * x.qd[k] - tau[k]).abs() < ALGEBRA);
            // J_m θ̈ + B_m θ̇ + τ_j = τ_m
            assert!((ROTOR[k] * rates.thetadd[k] + B_M[k] * x.thetad[k] + tau[k] - tau_m[k]).abs() < ALGEBRA);
        }
    }
}

#[test]
fn problem_5_the_energy_of_an_arm_falls_by_what_friction_and_dampers_take() {
    // Ḣ = −q̇ᵀ B_ℓ q̇ − θ̇ᵀ B_m θ̇ − (θ̇ − q̇)ᵀ D (θ̇ − q̇) ≤ 0 with τ_m = 0, and Ḣ = 0 without all three
    for losses in [0.0, 1.0] {
        let plant = plant(&arm(losses));
        let p = plant.parameters();
        let constants: Vec<Derivative> =
            p.iter().map(|&p| Derivative { value: p, ..Default::default() }).collect();
        let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
        for x in states(&plant) {
            dynamics.forward(&x, &[0.0; JOINTS], &mut rates);
            let mut along = State::<Derivative>::zero(&plant);
            for (to, from, rate) in [
                (&mut along.q, &x.q, &x.qd),
                (&mut along.qd, &x.qd, &rates.qdd),
                (&mut along.theta, &x.theta, &x.thetad),
                (&mut along.thetad, &x.thetad, &rates.thetadd),
            ] {
                for k in 0..JOINTS {
                    to[k].value = from[k];
                    to[k].derivative[0] = rate[k];
                }
            }
            let rate = Dynamics::new(&plant, &constants).energy(&along).derivative[0];
            let slip = minus(&x.thetad, &x.qd);
            let rubbed = |b: &[f64; JOINTS], v: &[f64]| (0..JOINTS).map(|k| b[k] * v[k] * v[k]).sum::<f64>();
            let lost =
                losses * (rubbed(&B_L, &x.qd) + rubbed(&B_M, &x.thetad) + dot(&slip, &times(&D, &slip)));
            assert!((rate + lost).abs() < ALGEBRA, "{rate} {lost}");
            assert!(losses == 0.0 || rate < 0.0);
        }
    }
}
