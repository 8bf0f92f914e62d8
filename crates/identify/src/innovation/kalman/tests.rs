//! Tests of the Kalman filter of a group of joints.

use super::super::step::Linear;
use super::super::system::Readings;
use super::*;

// Two bodies that push each other: the states of links that they do not have change nothing.
#[test]
fn rigid_joints_need_two_states() {
    let mobility = [0.8, -0.3, -0.3, 1.4];
    let linear = [0, 1].map(|joint| {
        let (push, mobility) = ([-30.0, -2.0, 0.0, 0.0], mobility[3 * joint]);
        let rate = push.map(|p| mobility * p);
        let linear = Linear { rate, motor: mobility, link: mobility, push, ..Linear::default() };
        [linear; 40]
    });
    let readings = Readings { motor: Some(1e-10), ..Readings::default() };
    let system = System::new(vec![readings; 2], &[&linear[0], &linear[1]], &[mobility.to_vec()], 40, 1e-3);
    let kalman = Kalman { system: &system, group: 0..2, noise: &[0.5, 0.2] };
    assert_eq!(kalman.states(), 2);
    let (two, four) = (kalman.gains_of::<4, 2>(), kalman.gains_of::<8, 4>());
    for ((white, own), (same, all)) in (0..40).flat_map(|k| two.of_sample(k).zip(four.of_sample(k))) {
        assert!((white / same - 1.0).abs() < 1e-9);
        let [own, all] = [own, all].map(|gains| gains.iter().map(|k| f64::from(*k)).collect::<Vec<f64>>());
        for (own, all) in own.iter().zip([&all[0..2], &all[4..6]].concat()) {
            assert!((own - all).abs() <= 1e-6 * all.abs(), "{own} {all}");
        }
        assert_eq!([&all[2..4], &all[6..8]].concat(), [0.0; 4]);
    }
}

// 0.5² = 0.4² + 0.3²
#[test]
fn friction_that_is_unsure_adds_to_the_noise() {
    let linear = Linear { motor: 0.5, ..Linear::default() };
    let readings = Readings { motor: Some(1e-10), ..Readings::default() };
    let mut system = System::new(vec![readings], &[&[linear; 40]], &[vec![0.5]], 40, 1e-3);
    let white = |system: &System, noise: f64| -> Vec<f64> {
        let gains = Kalman { system, group: 0..1, noise: &[noise] }.gains();
        (0..40).flat_map(|k| gains.of_sample(k).map(|(white, _)| white).collect::<Vec<f64>>()).collect()
    };
    let (all, sure) = (white(&system, 0.5), white(&system, 0.4));
    system.joints[0].unsure = vec![0.3; 40];
    assert_eq!(white(&system, 0.4), sure);
    system.unsure_friction = true;
    for (white, all) in white(&system, 0.4).into_iter().zip(all) {
        assert!((white / all - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_short_number_is_right_to_three_digits() {
    for x in [1.0, -0.777, 1.0 / 3.0, 2.0f64.powi(100), -1e-30, 0.0] {
        assert!((f64::from(Short::from(x)) - x).abs() <= x.abs() / 256.0, "{x}");
    }
    assert!(f64::from(Short::from(f64::NAN)).is_nan());
}

// Behind an encoder that tells nothing, what a motor slips adds up.
#[test]
fn slip_moves_the_motor() {
    let linear = Linear { motor: 1.0, ..Linear::default() };
    let readings = Readings { motor: Some(1e12), ..Readings::default() };
    let system = System::new(vec![readings], &[&[linear; 10]], &[vec![1.0]], 10, 1e-3);
    let kalman = Kalman { system: &system, group: 0..1, noise: &[1e-9] };
    let input = |_, _| Input { torque: 0.0, slip: 1e-6, read: [0.0; SENSORS] };
    for (k, smoothed) in kalman.smoothed(false, input, |_, _, _| {})[0].iter().enumerate() {
        assert!((smoothed.x[0] - 1e-6 * k as f64).abs() < 1e-12, "{k}: {:?}", smoothed.x);
        assert!(smoothed.x[1].abs() < 1e-12);
    }
}
