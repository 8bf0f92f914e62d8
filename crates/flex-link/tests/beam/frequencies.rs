//! Natural frequencies against Euler and Bernoulli's beam and the twisting rod.

use std::f64::consts::PI;
use std::path::Path;

use serde_json::Value;
use sinew_model::BeamSection;

use crate::robots::{BEAM, Body, Chain, Hinge, cantilever, chain};

// β L of a clamped beam without and with a tip mass of the beam's own, and of a clamped rod.
const FREE: [f64; 3] = [1.8751040687119611, 4.694091132974175, 7.854757438237613];
const LOADED: [f64; 3] = [1.2479174096064694, 4.03113943671496, 7.134132240939746];
const OWN_MASS: Body = Body { mass: 1.68, inertia: 0.0 };

fn bending(beta: f64) -> f64 {
    (beta / BEAM.length).powi(2) * (BEAM.flexural_rigidity / BEAM.mass_per_length).sqrt()
}

// The order of convergence from n to 2n springs.
fn order(error: impl Fn(usize) -> f64, n: usize) -> f64 {
    (error(n).abs() / error(2 * n).abs()).log2()
}

#[test]
fn bending_frequencies_converge_with_the_fourth_power() {
    for (beta, tip) in [(FREE, Body::default()), (LOADED, OWN_MASS)] {
        for mode in 0..3 {
            let error = |n| cantilever(n, &['y'], tip).frequencies()[mode] / bending(beta[mode]) - 1.0;
            for n in [8, 16] {
                let order = order(error, n);
                assert!((3.5..5.5).contains(&order), "mode {mode}, {n} springs: order {order}");
            }
            assert!(error(32).abs() < 2e-5, "mode {mode}: {:e}", error(32));
        }
    }
}

#[test]
fn both_planes_have_the_same_frequencies() {
    let pairs = cantilever(4, &['y', 'z'], OWN_MASS).frequencies();
    let plane = cantilever(4, &['y'], OWN_MASS).frequencies();
    for k in 0..4 {
        for got in &pairs[2 * k..2 * k + 2] {
            assert!((got / plane[k] - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn twisting_frequencies_converge_with_the_second_power() {
    for (disc, beta) in [(0.0, [0.5 * PI, 1.5 * PI]), (1.0, [0.8603335890193797, 3.4256184594817283])] {
        let tip = Body { mass: 0.0, inertia: disc * 0.004 * BEAM.length };
        for mode in 0..2 {
            let exact = beta[mode] / BEAM.length * (350.0f64 / 0.004).sqrt();
            let error = |n| cantilever(n, &['x'], tip).frequencies()[mode] / exact - 1.0;
            for n in [8, 16] {
                let order = order(error, n);
                assert!((1.7..2.5).contains(&order), "disc {disc}, mode {mode}, {n}: order {order}");
            }
            assert!(error(32).abs() < 5e-3, "disc {disc}, mode {mode}: {:e}", error(32));
        }
    }
}

// Everything below is read from the reference numbers.

fn reference() -> Option<Value> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/beam/beam.json");
    match std::fs::read_to_string(&file) {
        Ok(text) => Some(serde_json::from_str(&text).expect("beam.json")),
        Err(_) => {
            eprintln!("skipped: {} is not there", file.display());
            None
        }
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

// The first three frequencies that are not zero, and by how much each is off; tells the worst.
fn compare(chain: &Chain, case: &Value, rigid: usize, allowed: f64, name: &str) {
    let got = &chain.frequencies()[rigid..];
    for (k, want) in case["frequencies"]["values"].as_array().unwrap().iter().take(3).enumerate() {
        let error = got[k] / number(want) - 1.0;
        println!("{name}, mode {}: {error:+.1e}", k + 1);
        assert!(error.abs() < allowed, "{name}, mode {}: {} against {want} ({error:+.1e})", k + 1, got[k]);
    }
}

#[test]
fn masses_hubs_and_discs_have_the_exact_frequencies() {
    let Some(reference) = reference() else { return };
    let (m, L) = (BEAM.mass_per_length * BEAM.length, BEAM.length);
    let scale = m * L * L;
    for case in reference["clamped_with_tip_mass"].as_array().unwrap() {
        let tip = Body {
            mass: number(&case["tip_mass_ratio"]) * m,
            inertia: number(&case["tip_rotary_inertia_ratio"]) * scale,
        };
        compare(&cantilever(16, &['y'], tip), case, 0, 2e-4, "tip mass");
    }
    for case in reference["hub_free"].as_array().unwrap() {
        let hub = Body { mass: 0.0, inertia: number(&case["hub_inertia_ratio"]) * scale };
        let spring = number(&case["base_spring_ratio"]) * BEAM.flexural_rigidity / L;
        let hinge = Hinge::Sprung(0.0, spring);
        let chain = chain(&[(hinge, vec![BEAM])], hub, &[Body::default()], &['y'], 16);
        let rigid = usize::from(case["rigid_mode"].as_bool().unwrap());
        assert!(rigid == 0 || chain.frequencies()[0] < 1e-3);
        compare(&chain, case, rigid, 5e-4, "hub");
    }
    for case in reference["torsion"].as_array().unwrap() {
        let inertia = number(&case["tip_disc_ratio"]) * 0.004 * L;
        compare(&cantilever(32, &['x'], Body { mass: 0.0, inertia }), case, 0, 5e-3, "torsion");
    }
}

#[test]
fn two_bending_links_have_the_exact_frequencies_however_they_are_joined() {
    let Some(reference) = reference() else { return };
    let links: Vec<BeamSection> = reference["links"]
        .as_array()
        .unwrap()
        .iter()
        .map(|l| BeamSection {
            length: number(&l["length"]),
            flexural_rigidity: number(&l["E I"]),
            mass_per_length: number(&l["mass_per_length"]),
            torsional_rigidity: None,
            polar_inertia_per_length: 0.0,
        })
        .collect();
    for case in reference["two_links"].as_array().unwrap() {
        let angle = number(&case["angle"]);
        let base = match case["base"].as_object() {
            None => Hinge::Locked(0.0),
            Some(base) => Hinge::Sprung(0.0, number(&base["spring"])),
        };
        let hub = Body { mass: 0.0, inertia: case["base"].get("hub_inertia").map_or(0.0, number) };
        let second = match case["joint2"].as_object() {
            None => Hinge::Locked(angle),
            Some(joint) => Hinge::Sprung(angle, number(&joint["spring"])),
        };
        let body =
            |mass: &str, inertia: &str| Body { mass: number(&case[mass]), inertia: number(&case[inertia]) };
        let bodies = [body("joint2_mass", "joint2_inertia"), body("tip_mass", "tip_inertia")];
        let beams = [(base, vec![links[0]]), (second, vec![links[1]])];
        let chain = chain(&beams, hub, &bodies, &['y'], 12);
        let rigid = case["rigid_modes"].as_u64().unwrap() as usize;
        compare(&chain, case, rigid, 1e-4, case["name"].as_str().unwrap());
    }
}
