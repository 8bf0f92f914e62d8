//! Times the algorithms of elastic joints on the same mechanism, beside rigid forward dynamics.

use std::hint::black_box;

use sinew_flex_joint::{ElasticJoints, SpinInertia, Workspace};
use sinew_model::{Model, Robot};

use crate::suite::{STATES, States};
use crate::timer::time;

/// The robot with a spring, a damper and a geared rotor in every joint that turns; the others stay rigid.
fn sprung(model: &Model) -> Robot {
    let mut robot = Robot::rigid(model.clone());
    for joint in model.joints.iter().filter(|j| j.mimic.is_none() && j.kind.nv() == 1 && !j.kind.slides()) {
        let settings = &mut robot.joints[joint.first_dof];
        (settings.stiffness, settings.damping) = (Some(1e4), 10.0);
        (settings.rotor_inertia, settings.gear_ratio) = (0.5, Some(100.0));
    }
    robot
}

/// Times both models; `elastic_mixed` has every other joint rigid, with its rotor.
pub fn time_all(model: &Model, states: &States) {
    let robot = sprung(model);
    let mut mixed = robot.clone();
    mixed.joints.iter_mut().skip(1).step_by(2).for_each(|joint| joint.stiffness = None);
    let sound = "springs and gears of the suite are sound";
    let reduced = ElasticJoints::new(&robot).expect(sound);
    let complete = ElasticJoints::complete(&robot, SpinInertia::BesideLinks).expect(sound);
    let mixed = ElasticJoints::new(&mixed).expect(sound);
    for (name, joints) in [("elastic", &reduced), ("elastic_complete", &complete), ("elastic_mixed", &mixed)]
    {
        time_model(name, joints, states);
    }
    differences(&reduced, states);
}

fn time_model(name: &str, joints: &ElasticJoints, states: &States) {
    let (model, nv) = (joints.model(), joints.model().nv);
    let (mut ws, n) = (Workspace::new(joints), joints.displacement_len());
    let (mut rigid, mut tau) = (sinew_rigid::Workspace::new(model), vec![0.0; nv]);
    let (mut qdd, mut thetadd) = (vec![0.0; nv], vec![0.0; nv]);
    let [mut a, mut b, mut c, mut d, mut e] = [(); 5].map(|()| vec![0.0; 2 * nv * nv]);
    let (mut A, mut B) = (vec![0.0; n * n], vec![0.0; n * nv]);
    let q = |i: usize| &states.q[i * model.nq..][..model.nq];
    let (qd, x) = (|i: usize| &states.qd[i * nv..][..nv], |i: usize| &states.x[i * nv..][..nv]);
    let run = |algorithm: &str, f: &mut dyn FnMut(usize)| {
        time(&model.name, &format!("{name}_{algorithm}"), "sinew", STATES, 1, f);
    };
    run("beside_aba", &mut |i| {
        sinew_rigid::forward_dynamics_into(model, &mut rigid, q(i), qd(i), x(i), black_box(&mut tau));
    });
    run("aba", &mut |i| {
        let (qdd, thetadd) = (black_box(&mut qdd), black_box(&mut thetadd));
        joints.forward_dynamics_into(&mut ws, q(i), qd(i), x(i), qd(i), x(i), qdd, thetadd);
    });
    run("derivatives", &mut |i| {
        let (a, b, c) = (black_box(&mut a), black_box(&mut b), black_box(&mut c));
        let (d, e) = (black_box(&mut d), black_box(&mut e));
        joints.forward_dynamics_derivatives_into(&mut ws, q(i), qd(i), x(i), qd(i), x(i), a, b, c, d, e);
    });
    let state = vec![0.1; joints.state_len()];
    if model.nq == nv {
        run("linearize", &mut |i| {
            joints.linearize_into(&mut ws, &state, x(i), black_box(&mut A), black_box(&mut B));
        });
    }
}

/// The linear model by central differences of the state's rate.
fn differences(joints: &ElasticJoints, states: &States) {
    let (model, nv, n) = (joints.model(), joints.model().nv, joints.state_len());
    if model.nq != nv {
        return;
    }
    let (mut ws, mut x) = (Workspace::new(joints), vec![0.1; n]);
    let (mut up, mut down) = (vec![0.0; n], vec![0.0; n]);
    let (mut A, mut B, h) = (vec![0.0; n * n], vec![0.0; n * nv], 1e-6);
    let mut slope = |x: &mut [f64], tau_m: &mut [f64], k: usize| {
        let mut at = |by: f64, rate: &mut [f64]| {
            if k < n {
                x[k] += by
            } else {
                tau_m[k - n] += by
            }
            joints.state_rate_into(&mut ws, x, tau_m, rate);
            if k < n { x[k] -= by } else { tau_m[k - n] -= by }
        };
        at(h, &mut up);
        at(-h, &mut down);
        let into = if k < n { &mut A[n * k..][..n] } else { &mut B[n * (k - n)..][..n] };
        into.iter_mut().zip(up.iter().zip(&down)).for_each(|(into, (a, b))| *into = (a - b) / (2.0 * h));
        black_box(into);
    };
    let mut tau_m = vec![0.0; nv];
    time(&model.name, "elastic_differences", "sinew", STATES, 1, |i| {
        tau_m.copy_from_slice(&states.x[i * nv..][..nv]);
        (0..n + nv).for_each(|k| slope(&mut x, &mut tau_m, k));
    });
}
