//! Linear models along a motion, against differences of the equations of motion.

use sinew_linear::{Linearizer, Moment, Nonlinear, Options, linearize_along};
use sinew_model::{EffectSpec, Place, Robot, Vector3};
use sinew_plant::{Dynamics, Plant, Rates, State};

use crate::robots::{modes_of, planar_2r, plant};

// Friction that is smooth where it moves, a hardening spring, an uneven gear, a load-dependent friction.
fn busy() -> Robot {
    let mut robot = planar_2r();
    let at = |joint: &str| Place::Joint(joint.into());
    for (kind, joint, values) in [
        ("coulomb_friction", "shoulder", &[("coulomb", 1.5)][..]),
        ("viscous_friction", "elbow", &[("viscous", 0.3)]),
        ("quadratic_viscous_friction", "elbow", &[("quadratic", 0.2)]),
        ("stiffness_hardening", "shoulder", &[("cubic", 4e4)]),
        ("transmission_error", "elbow", &[("sine", 2e-3), ("cosine", 1e-3), ("per_turn", 2.0)]),
        ("load_dependent_friction", "elbow", &[("load_coefficient", 0.05)]),
        ("balancer_spring", "shoulder", &[("stiffness", 12.0)]),
    ] {
        let spec = values.iter().fold(EffectSpec::new(kind, at(joint)), |s, (key, v)| s.with(key, *v));
        robot.effects.push(spec);
    }
    robot
}

fn moment(plant: &Plant, k: usize) -> Moment {
    let mut x = State::zero(plant);
    let t = k as f64;
    x.q = vec![0.3 + 0.2 * t, -0.7 + 0.1 * t];
    x.theta = vec![0.33 + 0.2 * t, -0.72 + 0.1 * t];
    x.qd = vec![0.9 - 0.1 * t, -1.3];
    x.thetad = vec![0.95 - 0.1 * t, -1.25];
    Moment { x, tau_m: vec![12.0 - t, 3.0] }
}

// Rates of [q, θ; q̇, θ̇] as the simulator has them.
fn rate(plant: &Plant, rigid: &[usize], x: &[f64], tau: &[f64]) -> Vec<f64> {
    let p = plant.parameters();
    let (mut dynamics, mut rates) = (Dynamics::new(plant, &p), Rates::new(plant));
    let mut state = State::zero(plant);
    let motors: Vec<usize> = (0..2).filter(|i| !rigid.contains(i)).collect();
    let n = 2 + motors.len();
    state.q.copy_from_slice(&x[..2]);
    state.qd.copy_from_slice(&x[n..n + 2]);
    (state.theta, state.thetad) = (state.q.clone(), state.qd.clone());
    for (k, &dof) in motors.iter().enumerate() {
        (state.theta[dof], state.thetad[dof]) = (x[2 + k], x[n + 2 + k]);
    }
    dynamics.forward(&state, tau, &mut rates);
    let of = |motor: &[f64]| motors.iter().map(|&dof| motor[dof]).collect::<Vec<_>>();
    [state.qd.clone(), of(&state.thetad), rates.qdd.clone(), of(&rates.thetadd)].concat()
}

fn check(robot: &Robot, rigid: &[usize]) {
    let plant = plant(robot);
    let p = plant.parameters();
    let motors: Vec<usize> = (0..2).filter(|i| !rigid.contains(i)).collect();
    let mut linearizer = Linearizer::new(&plant, &p);
    for k in 0..4 {
        let mut moment = moment(&plant, k);
        for &dof in rigid {
            moment.x.theta[dof] = moment.x.q[dof];
            moment.x.thetad[dof] = moment.x.qd[dof];
        }
        let of = |motor: &[f64]| motors.iter().map(|&dof| motor[dof]).collect::<Vec<_>>();
        let x = &moment.x;
        let flat = [x.q.clone(), of(&x.theta), x.qd.clone(), of(&x.thetad)].concat();
        let n = flat.len();
        let model = linearizer.at(x, &moment.tau_m);
        let size = model.A.norm_max();
        for column in 0..n + 2 {
            let h = 1e-5;
            let moved = |sign: f64| {
                let (mut x, mut tau) = (flat.clone(), moment.tau_m.clone());
                match column {
                    c if c < n => x[c] += sign * h,
                    c => tau[c - n] += sign * h,
                }
                rate(&plant, rigid, &x, &tau)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            for row in 0..n {
                let difference = (plus[row] - minus[row]) / (2.0 * h);
                let exact = if column < n { model.A[(row, column)] } else { model.B[(row, column - n)] };
                assert!(
                    (exact - difference).abs() < 1e-7 * size,
                    "[{row}, {column}]: {exact} {difference} of {size}"
                );
            }
        }
    }
}

#[test]
fn models_in_motion_are_the_derivatives_of_the_equations() {
    check(&busy(), &[]);
}

#[test]
fn mixed_and_rigid_robots_have_them_too() {
    let mut robot = busy();
    robot.effects.retain(|e| e.kind != "transmission_error" && e.kind != "load_dependent_friction");
    robot.joints[1].stiffness = None;
    check(&robot, &[1]);
}

#[test]
fn a_load_dependent_friction_in_a_rigid_joint_goes_through_the_whole_dynamics() {
    let mut robot = busy();
    robot.effects.retain(|e| e.kind != "transmission_error");
    robot.joints[1].stiffness = None;
    check(&robot, &[1]);
}

#[test]
fn a_rotor_that_feels_its_link_goes_through_the_whole_dynamics() {
    let mut robot = busy();
    robot.joints[1].gear_ratio = Some(5.0);
    let place = Place::Joint("elbow".into());
    robot.effects.push(EffectSpec::new("rotor_link_coupling", place).with("scale", 1.0));
    check(&robot, &[]);
    robot.effects.retain(|e| e.kind != "transmission_error");
    robot.joints[1].stiffness = None;
    check(&robot, &[1]);
}

#[test]
fn friction_is_smooth_in_motion_and_described_at_a_reversal() {
    let mut robot = planar_2r();
    let place = Place::Joint("shoulder".into());
    robot.effects.push(EffectSpec::new("coulomb_friction", place).with("coulomb", 1.5));
    let plant = plant(&robot);
    let p = plant.parameters();
    let (moving, mut resting) = (moment(&plant, 0), moment(&plant, 0));
    for rates in [&mut resting.x.qd, &mut resting.x.thetad] {
        rates.fill(0.0);
    }
    let along = linearize_along(&plant, &p, &[moving, resting.clone()], &Options::default()).unwrap();
    assert!(along.described[0].is_empty());
    assert_eq!(along.described[1][0].effect, "coulomb_friction@shoulder");
    assert_eq!(along.states.len(), along.models[0].A.nrows());
    let refuse = Options { nonlinear: Nonlinear::Refuse(Default::default()) };
    let refused = linearize_along(&plant, &p, &[resting], &refuse).unwrap_err();
    assert!(refused.to_string().contains("coulomb_friction@shoulder"), "{refused}");
}

fn coupled() -> Robot {
    let mut robot = planar_2r();
    robot.joints[1].gear_ratio = Some(5.0);
    let place = Place::Joint("elbow".into());
    robot.effects.push(EffectSpec::new("rotor_link_coupling", place).with("scale", 1.0));
    robot
}

// A described friction acts through the same inertia as a viscous one.
#[test]
fn a_described_friction_moves_a_rotor_that_feels_its_link_as_a_viscous_one() {
    let a = |friction: Option<(&str, &str)>| {
        let mut robot = coupled();
        if let Some((kind, key)) = friction {
            robot.effects.push(EffectSpec::new(kind, Place::Joint("elbow".into())).with(key, 1.5));
        }
        let plant = plant(&robot);
        let mut resting = moment(&plant, 0);
        for rates in [&mut resting.x.qd, &mut resting.x.thetad] {
            rates.fill(0.0);
        }
        let along = linearize_along(&plant, &plant.parameters(), &[resting], &Options::default()).unwrap();
        along.models[0].A.clone()
    };
    let without = a(None);
    let described = a(Some(("coulomb_friction", "coulomb"))) - &without;
    let viscous = a(Some(("viscous_friction", "viscous"))) - &without;
    let largest = viscous.norm_max();
    let at = (0..viscous.nrows())
        .flat_map(|i| (0..viscous.ncols()).map(move |j| (i, j)))
        .find(|&at| viscous[at].abs() == largest)
        .unwrap();
    let share = described[at] / viscous[at];
    assert!(share > 0.0, "{share}");
    assert!((&described - faer::Scale(share) * &viscous).norm_max() < 1e-9 * described.norm_max());
}

// Without damping every pole is ±iω of a mode of M and K.
#[test]
fn modes_of_a_rotor_that_feels_its_link_are_those_of_its_poles() {
    let mut robot = coupled();
    for joint in &mut robot.joints {
        joint.damping = 0.0;
    }
    for mode in modes_of(&robot, &[0.3, -0.7]) {
        let pole = mode.poles.iter().map(|p| p.im.abs()).fold(0.0, f64::max);
        assert!((pole - mode.omega).abs() < 1e-6 * (1.0 + pole), "{pole} of {mode:?}");
    }
    // About upright axes nothing holds the arm: two of its four modes are free.
    robot.model.gravity = Vector3::ZERO;
    let free = modes_of(&robot, &[0.3, -0.7]);
    let stiffness: Vec<bool> = free.iter().map(|mode| mode.omega_squared == 0.0).collect();
    assert_eq!(stiffness, [true, true, false, false]);
}
