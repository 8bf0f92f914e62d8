//! A planar two-link arm with elastic joints against independent numbers.
//!
//! A, poles and frequencies of the arm at two positions, from Pinocchio 4.1.0 with dense solves (eigenvalues by
//! SciPy), 21 November 2026; its A was checked there by central differences to 2e-13.

use sinew_linear::{linearize, poles};

use crate::robots::{modes_of, planar_2r, plant};

struct Reference {
    q: [f64; 2],
    theta: [f64; 2],
    tau_m: [f64; 2],
    // Rows of A for the accelerations of the links.
    rows: [[f64; 8]; 2],
    // Real and imaginary part; of pairs the one above the real axis.
    poles: &'static [(f64, f64)],
    // Signed roots of ω².
    frequencies: [f64; 4],
}

const BENT: Reference = Reference {
    q: [-0.33443, 1.971801],
    theta: [-0.22806111709738797, 1.9691905391628346],
    tau_m: [15.955332435391805, -0.2610460837165373],
    rows: [
        [
            -220.49025168106868,
            42.83130381946181,
            216.49333429803383,
            -38.69542928099884,
            -0.7216444476601128,
            0.11608628784299652,
            0.7216444476601128,
            -0.11608628784299652,
        ],
        [
            95.82074668660047,
            -912.2773204229829,
            -58.043143921498256,
            947.8744735520088,
            0.19347714640499417,
            -2.8436234206560265,
            -0.19347714640499417,
            2.8436234206560265,
        ],
    ],
    poles: &[
        (-2.2544817911904214e-06, 2.6318340552600605),
        (5.599444591600936, 0.0),
        (-5.599619146160235, 0.0),
        (-5.356171470019126, 56.44372154380485),
        (-6.426372932377522, 65.07413949571914),
    ],
    frequencies: [-5.599530405627963, 2.6318340359575307, 56.697216203290665, 65.39078505879425],
};

const HANGING: Reference = Reference {
    q: [-core::f64::consts::FRAC_PI_2, 0.0],
    theta: [-core::f64::consts::FRAC_PI_2, 0.0],
    tau_m: [0.0, 0.0],
    rows: [
        [
            -426.1600000000002,
            786.2866666666672,
            400.0000000000002,
            -766.666666666667,
            -1.3333333333333341,
            2.300000000000001,
            1.3333333333333341,
            -2.300000000000001,
        ],
        [
            1188.4225000000006,
            -3234.861666666668,
            -1150.0000000000007,
            3141.6666666666674,
            3.8333333333333353,
            -9.425000000000002,
            -3.8333333333333353,
            9.425000000000002,
        ],
    ],
    poles: &[
        (-4.7516814105008284e-06, 3.9719209736273458),
        (-0.0005979026563016493, 7.078861220663347),
        (-5.188076091983589, 55.765881788314665),
        (-10.190487920345408, 81.77831602893957),
    ],
    frequencies: [3.971920911141073, 7.0788483836522245, 56.005504834293085, 82.4126942775983],
};

// Tolerances that the reference states, each of the largest entry.
const MATRIX: f64 = 1e-11;
const POLE: f64 = 1e-9;

#[test]
fn state_matrix_and_rest_position_agree() {
    for reference in [&BENT, &HANGING] {
        let plant = plant(&planar_2r());
        let linear = linearize(&plant, &plant.parameters(), &reference.q).unwrap();
        for k in 0..2 {
            assert!((linear.at.theta[k] - reference.theta[k]).abs() < 1e-12);
            assert!((linear.at.tau_m[k] - reference.tau_m[k]).abs() < 1e-11);
            for column in 0..8 {
                let (a, b) = (linear.A[(4 + k, column)], reference.rows[k][column]);
                assert!((a - b).abs() < MATRIX * 3200.0, "A[{k}, {column}]: {a} {b}");
            }
        }
        let found = poles(&linear.A).unwrap();
        for &(re, im) in reference.poles {
            let close = |p: &&faer::c64| (p.re - re).abs() < POLE * 82.0 && (p.im - im).abs() < POLE * 82.0;
            assert!(found.iter().any(|p| close(&p)), "{re} {im}: {found:?}");
        }
    }
}

#[test]
fn frequencies_agree_signed_where_the_arm_falls_over() {
    for reference in [&BENT, &HANGING] {
        let modes = modes_of(&planar_2r(), &reference.q);
        for (mode, frequency) in modes.iter().zip(reference.frequencies) {
            let squared = frequency * frequency.abs();
            assert!(
                (mode.omega_squared - squared).abs() < MATRIX * 6800.0,
                "{} {squared}",
                mode.omega_squared
            );
            assert_eq!(mode.stable, squared > 0.0);
            assert_eq!(mode.poles.len(), 2);
        }
    }
}

#[test]
fn an_arm_without_weight_turns_freely_in_both_joints() {
    let mut robot = planar_2r();
    robot.model = robot.model.with_gravity(sinew_model::Vector3::ZERO);
    let modes = modes_of(&robot, &[0.3, 0.9]);
    assert_eq!([modes[0].omega, modes[1].omega], [0.0, 0.0]);
    assert!(modes.iter().all(|m| m.stable) && modes[2].omega > 10.0);
}
