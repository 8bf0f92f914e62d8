//! Sampled models against simulations.

use sinew_linear::{discretize, linearize};
use sinew_model::{EffectSpec, Place, Robot, Vector3, samples};
use sinew_simulate::{Options, Start, Tolerance, Torques, simulate};

use crate::robots::{planar_2r, plant};

// A weightless elastic joint is linear in the large; drive and sensors are all that a linear one can be.
fn linear_in_the_large() -> Robot {
    let model = samples::hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO);
    let mut robot = Robot::rigid(model);
    let joint = &mut robot.joints[0];
    (joint.stiffness, joint.rotor_inertia, joint.damping) = (Some(150.0), 0.05, 0.5);
    let at = || Place::Joint("joint".into());
    robot.effects.push(EffectSpec::new("viscous_friction", at()).with("viscous", 0.3));
    robot.effects.push(EffectSpec::new("actuator_lag", at()).with("time", 6e-3));
    // Not whole samples of 4 ms.
    robot.effects.push(EffectSpec::new("actuator_delay", at()).with("time", 9e-3));
    robot.effects.push(EffectSpec::new("torque_constant_error", at()).with("scale_error", 0.05));
    robot.effects.push(EffectSpec::new("position_sensor_scale", at()).with("scale_error", -0.02));
    let skew = EffectSpec::new("time_skew", at()).with("time", 5e-3);
    robot.effects.push(skew.said("signal", "joint_position"));
    robot
}

fn torque(k: usize) -> f64 {
    let t = k as f64 * 4e-3;
    (5.0 * t).sin() + 0.5 * (61.0 * t).cos()
}

#[test]
fn a_sampled_model_says_what_a_simulation_says() {
    let plant = plant(&linear_in_the_large());
    let p = plant.parameters();
    let (h, steps) = (4e-3, 400);
    let linear = linearize(&plant, &p, &[0.0]).unwrap();
    let sampled = discretize(&linear, h).unwrap();
    assert_eq!(sampled.sample_time, Some(h));
    let mut options = Options::new(&plant, steps as f64 * h, h);
    options.start = Start::at(&[0.0]);
    options.tolerance = Tolerance { relative: 1e-11, absolute: 1e-13 };
    let time: Vec<f64> = (0..=steps).map(|k| k as f64 * h).collect();
    // Before the first sample the first command has acted for ever, so it must be zero.
    let tau: Vec<f64> = (0..=steps).map(|k| if k == 0 { 0.0 } else { torque(k) }).collect();
    let mut drive = Torques { time, tau: vec![tau.clone()] };
    let run = simulate(&plant, &p, &mut drive, &options).unwrap().run;
    let n = sampled.A.nrows();
    let mut x = vec![0.0; n];
    for (k, u) in tau.iter().enumerate() {
        for (row, name) in sampled.outputs.iter().enumerate() {
            let y: f64 = (0..n).map(|i| sampled.C[(row, i)] * x[i]).sum::<f64>() + sampled.D[(row, 0)] * u;
            let (quantity, joint) = name.split_once('.').unwrap();
            let signal = run.signal(quantity.parse().unwrap(), joint).unwrap();
            let error = (y - signal.values[k]).abs();
            let size = signal.values.iter().fold(0.0, |s: f64, v| s.max(v.abs()));
            assert!(error < 1e-7 * size, "{name} at sample {k}: {y} {}", signal.values[k]);
        }
        x = (0..n)
            .map(|i| (0..n).map(|j| sampled.A[(i, j)] * x[j]).sum::<f64>() + sampled.B[(i, 0)] * u)
            .collect();
    }
}

#[test]
fn two_half_steps_are_one_step() {
    let plant = plant(&planar_2r());
    let linear = linearize(&plant, &plant.parameters(), &[-1.2, 0.4]).unwrap();
    let (half, whole) = (discretize(&linear, 0.5e-3).unwrap(), discretize(&linear, 1e-3).unwrap());
    let twice = &half.A * &half.A;
    assert!((&twice - &whole.A).norm_max() < 1e-11 * whole.A.norm_max());
    // Γ(2h) = Φ(h) Γ(h) + Γ(h)
    let driven = &half.A * &half.B + &half.B;
    assert!((&driven - &whole.B).norm_max() < 1e-12 * whole.B.norm_max());
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let plant = plant(&planar_2r());
    let linear = linearize(&plant, &plant.parameters(), &[0.0, 0.0]).unwrap();
    for h in [0.0, -1e-3, f64::NAN] {
        assert!(discretize(&linear, h).unwrap_err().to_string().contains("sample time"));
    }
    let sampled = discretize(&linear, 1e-3).unwrap();
    assert!(discretize(&sampled, 1e-3).unwrap_err().to_string().contains("already"));
}

#[test]
fn a_drive_that_acts_at_another_joint_does_so_in_the_linear_model() {
    let mut robot = planar_2r();
    let spec = EffectSpec::new("joint_cross_coupling", Place::Joint("elbow".into()))
        .with("coupling", 0.1)
        .said("from", "shoulder");
    let plain = plant(&robot);
    let own = linearize(&plain, &plain.parameters(), &[-1.2, 0.4]).unwrap();
    robot.effects.push(spec);
    let mixed = plant(&robot);
    let mixed = linearize(&mixed, &mixed.parameters(), &[-1.2, 0.4]).unwrap();
    for i in 0..own.A.nrows() {
        // τ_elbow = u_elbow + 0.1 u_shoulder
        let both = own.B[(i, 0)] + 0.1 * own.B[(i, 1)];
        assert!((mixed.B[(i, 0)] - both).abs() < 1e-12 * own.B.norm_max());
        assert_eq!(mixed.B[(i, 1)], own.B[(i, 1)]);
    }
}

#[test]
fn a_drive_at_its_limit_is_no_linear_system() {
    let mut robot = planar_2r();
    let at = Place::Joint("shoulder".into());
    robot.effects.push(EffectSpec::new("torque_saturation", at).with("limit", 5.0));
    let plant = plant(&robot);
    let hanging = [-core::f64::consts::FRAC_PI_2, 0.0];
    assert!(linearize(&plant, &plant.parameters(), &hanging).is_ok());
    let refused = linearize(&plant, &plant.parameters(), &[0.0, 0.0]).unwrap_err().to_string();
    assert!(refused.contains("joint \"shoulder\"") && refused.contains("allowed 5 N·m"), "{refused}");
}
