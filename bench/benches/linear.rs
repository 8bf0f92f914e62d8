//! Linear models of a seven-joint elastic arm beside its forward dynamics and central differences:
//! `cargo bench -p sinew-bench --bench linear`.

use divan::{Bencher, black_box};
use sinew_effects::CATALOGUE;
use sinew_linear::Linearizer;
use sinew_model::samples::{Random, planar_arm};
use sinew_model::{EffectSpec, Inertia, JointShape, JointSpec, ModelBuilder, Place, Robot};
use sinew_plant::{Dynamics, Plant, Rates, State};

/// Seven elastic joints with viscous friction: planar rods, and rods whose axes point everywhere.
const ROBOTS: [&str; 2] = ["planar", "spatial"];

fn main() {
    divan::main();
}

fn plant(name: &str) -> Plant {
    let model = if name == ROBOTS[0] {
        planar_arm(7, 2.0, 0.3)
    } else {
        let (mut builder, mut random) = (ModelBuilder::new("arm"), Random::new(1));
        builder.link("link_0", Inertia::default());
        for k in 1..=7 {
            let (parent, child) = (format!("link_{}", k - 1), format!("link_{k}"));
            builder.link(&child, random.inertia());
            let mut axis = [0.0; 3];
            axis[k % 3] = 1.0;
            let joint = JointSpec::new(&format!("joint_{k}"), JointShape::Revolute, &parent, &child);
            builder.joint(joint.about(axis).at(random.pose()));
        }
        builder.build().expect("a chain is a tree")
    };
    let mut robot = Robot::rigid(model);
    for dof in 0..7 {
        let joint = &mut robot.joints[dof];
        (joint.stiffness, joint.damping, joint.rotor_inertia) = (Some(8000.0), 5.0, 0.4);
        let place = Place::Joint(robot.model.dof_name(dof).to_owned());
        robot.effects.push(EffectSpec::new("viscous_friction", place).with("viscous", 2.0));
    }
    Plant::new(&robot, &CATALOGUE).expect("a plant")
}

fn state(plant: &Plant) -> (State<f64>, Vec<f64>) {
    let mut random = Random::new(2);
    let mut x = State::zero(plant);
    (x.q, x.qd) = (random.vector(7), random.vector(7));
    (x.theta, x.thetad) = (x.q.clone(), x.qd.clone());
    (x, random.vector(7))
}

#[divan::bench(args = ROBOTS)]
fn elastic_forward_dynamics(bencher: Bencher, name: &str) {
    let plant = plant(name);
    let ((x, tau), p) = (state(&plant), plant.parameters());
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    bencher.bench_local(|| dynamics.forward(black_box(&x), black_box(&tau), black_box(&mut rates)));
}

#[divan::bench(args = ROBOTS)]
fn linearisation(bencher: Bencher, name: &str) {
    let plant = plant(name);
    let ((x, tau), p) = (state(&plant), plant.parameters());
    let mut linearizer = Linearizer::new(&plant, &p);
    bencher.bench_local(|| linearizer.at(black_box(&x), black_box(&tau)).A[(27, 13)]);
}

/// A and B by central differences: twice as many evaluations as states and torques.
#[divan::bench(args = ROBOTS)]
fn central_differences(bencher: Bencher, name: &str) {
    let plant = plant(name);
    let ((x, tau), p) = (state(&plant), plant.parameters());
    let (mut dynamics, mut rates) = (Dynamics::new(&plant, &p), Rates::new(&plant));
    let mut jacobian = vec![0.0; 14 * 35];
    bencher.bench_local(|| {
        let (mut x, mut tau, h) = (black_box(x.clone()), black_box(tau.clone()), 1e-6);
        for k in 0..35 {
            for sign in [1.0, -1.0] {
                let slot = |x: &mut State<f64>, tau: &mut Vec<f64>, by: f64| match k / 7 {
                    0 => x.q[k % 7] += by,
                    1 => x.theta[k % 7] += by,
                    2 => x.qd[k % 7] += by,
                    3 => x.thetad[k % 7] += by,
                    _ => tau[k % 7] += by,
                };
                slot(&mut x, &mut tau, sign * h);
                dynamics.forward(&x, &tau, &mut rates);
                slot(&mut x, &mut tau, -sign * h);
                for i in 0..7 {
                    jacobian[14 * k + i] += sign * rates.qdd[i] / (2.0 * h);
                    jacobian[14 * k + 7 + i] += sign * rates.thetadd[i] / (2.0 * h);
                }
            }
        }
        black_box(jacobian[0])
    });
}
