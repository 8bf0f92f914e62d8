//! The tangent against the simulation in dual numbers.

use sinew_data::{Quantity, Run, Signal};
use sinew_effects::CATALOGUE;
use sinew_model::{EffectSpec, JointSettings, Place, Robot, samples};

use sinew_effect::{DIRECTIONS, Derivative, Role};
use sinew_model::Scalar;
use sinew_plant::Plant;

use super::tangent_rows;
use crate::Options;
use crate::comparison::Prepared;
use crate::freedom::{Freedom, Springs};
use crate::imposed::predict;

fn arm() -> Robot {
    let model = samples::planar_arm(2, 4.0, 0.5);
    let spring = |k: f64, b: f64| JointSettings {
        stiffness: Some(k),
        damping: 0.002 * k,
        rotor_inertia: b,
        gear_ratio: Some(20.0),
        ..JointSettings::default()
    };
    Robot { joints: vec![spring(8000.0, 1.0), spring(2000.0, 0.3)], ..Robot::rigid(model) }
}

fn run(robot: &Robot) -> Run {
    let time: Vec<f64> = (0..2500).map(|k| 1e-3 * k as f64).collect();
    let mut signals = Vec::new();
    for dof in 0..2 {
        let name = robot.model.dof_name(dof).to_owned();
        let (a, w) = (0.5 - 0.1 * dof as f64, 3.0 + 2.0 * dof as f64);
        let theta: Vec<f64> = time.iter().map(|t| a * (w * t).sin() + 0.05 * (21.0 * t).cos()).collect();
        signals.push(Signal::new(Quantity::MotorPosition, &name, theta.clone()));
        signals.push(Signal::new(Quantity::JointPosition, &name, theta.clone()));
        signals.push(Signal::new(Quantity::MotorTorque, &name, theta));
    }
    Run::new("sines".to_owned(), time, signals).unwrap()
}

// Every effect with a value, at both joints; backlash, whose gap has corners, at none.
fn effects(robot: &Robot, strength: f64) -> Vec<EffectSpec> {
    let mut specs = robot.all_effects();
    for dof in 0..2 {
        let place = || Place::Joint(robot.model.dof_name(dof).to_owned());
        let mut add = |kind: &str, values: &[(&str, f64)]| {
            let spec = EffectSpec::new(kind, place());
            specs.push(values.iter().fold(spec, |s, (key, value)| s.with(key, *value)));
        };
        let s = strength;
        add("viscous_friction", &[("viscous", 3.0)]);
        add("coulomb_friction", &[("coulomb", 4.0), ("smoothing_velocity", 5e-2)]);
        add("stribeck_friction", &[("stribeck", 2.0 * s), ("stribeck_velocity", 0.3)]);
        add("load_dependent_friction", &[("load_coefficient", 0.1 * s)]);
        add("presliding_friction", &[("bristle_stiffness", 3000.0), ("micro_damping", 3.0)]);
        add("transmission_hysteresis", &[("stiffness", 8.0 * s), ("yield_deflection", 5e-4)]);
        add("stiffness_hardening", &[("cubic", 1e7 * s)]);
        add("transmission_error", &[("sine", 2e-4 * s), ("cosine", 1e-4 * s), ("per_turn", 9.0)]);
        add("link_viscous_friction", &[("viscous", 1.0 * s)]);
        add("link_coulomb_friction", &[("coulomb", 1.0 * s), ("smoothing_velocity", 5e-2)]);
        add("actuator_lag", &[("time", 2e-3 * s)]);
        add("torque_constant_error", &[("scale_error", 0.05 * s)]);
        add("position_sensor_offset", &[("offset", 1e-3 * s)]);
        add("time_skew", &[("time", 1e-3 * s)]);
    }
    let carried = Place::Joint(robot.model.dof_name(1).to_owned());
    specs.push(EffectSpec::new("rotor_link_coupling", carried).with("scale", 0.9 * strength));
    specs.push(EffectSpec::new("payload", Place::Robot).with("mass", 1.0 * strength));
    specs.push(
        EffectSpec::new("base_tilt", Place::Robot).with("about_x", 0.0).with("about_y", 0.02 * strength),
    );
    specs
}

// Difference of a column from the simulation with dual numbers, as a share of that column; springs swing in so many steps
// from one grid step to the next.
fn differences(strength: f64, parts: usize) -> Vec<(String, f64)> {
    let robot = arm();
    let runs = [run(&robot)];
    let prepared = Prepared::new(&robot, &runs, &Options::default()).unwrap();
    let record = &prepared.records[0];
    let channels = &prepared.sensors.channels;
    let plant = Plant::with_effects(&robot, &effects(&robot, strength), &CATALOGUE).unwrap();
    let p = plant.parameters();
    let freedom = Freedom { parts, ..Freedom::of(&plant, &p, record, Springs::Simulated) };
    assert!(freedom.is_free());
    let fitted = |id: &sinew_plant::ParameterId| {
        plant.effects()[id.effect].effect.card().parameters[id.parameter].role != Role::Stated
    };
    let ids: Vec<_> = plant.parameter_ids().into_iter().filter(fitted).collect();
    let positions: Vec<usize> = ids.iter().map(|id| plant.position(*id)).collect();
    let rows = tangent_rows(&plant, &p, record, channels, &freedom, &positions);
    let settled = |rows: &[f64]| -> Vec<f64> {
        let each = rows.len() / channels.len();
        let first = (0.8 / (record.scales.step() * record.scales.every as f64)) as usize;
        rows.chunks(each).flat_map(|c| c[first..].iter().copied()).collect()
    };
    let mut out = Vec::new();
    for (chunk, ids) in positions.chunks(DIRECTIONS).zip(ids.chunks(DIRECTIONS)) {
        let mut dual: Vec<Derivative> = p.iter().map(|&x| Derivative::constant(x)).collect();
        for (direction, &position) in chunk.iter().enumerate() {
            dual[position] = Derivative::variable(p[position], direction);
        }
        let series = predict(&plant, &dual, record, channels, &freedom);
        for (direction, id) in ids.iter().enumerate() {
            let along = |s: &Vec<Derivative>| {
                record.rows(&s.iter().map(|x| x.derivative[direction]).collect::<Vec<_>>())
            };
            let want = settled(&series.channels.iter().flat_map(along).collect::<Vec<_>>());
            let got = settled(&rows[out.len()]);
            let length = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
            let size = length(&mut want.iter().copied());
            let off = length(&mut want.iter().zip(&got).map(|(a, b)| a - b));
            let effect = &plant.effects()[id.effect];
            let key = effect.effect.card().parameters[id.parameter].key;
            out.push((format!("{} {key}", effect.label()), if size > 0.0 { off / size } else { off }));
        }
    }
    out
}

// The two middle stages of a step share one linearisation: hysteresis and friction, which turn within a step, show it.
#[test]
fn derivatives_are_those_of_the_simulation_in_dual_numbers() {
    for (label, difference) in [1, 2].into_iter().flat_map(|parts| differences(1.0, parts)) {
        assert!(difference < 3e-2, "{label}: {difference:.1e}");
    }
}

#[test]
fn absent_effects_are_left_out_without_a_change() {
    for (label, difference) in differences(0.0, 1) {
        assert!(difference < 5e-3, "{label}: {difference:.1e}");
    }
}

// Twice as many steps leave a sixteenth of the error of a method of order four.
#[test]
fn springs_that_swing_in_parts_of_a_step_are_those_of_smaller_steps() {
    let robot = arm();
    let prepared = Prepared::new(&robot, &[run(&robot)], &Options::default()).unwrap();
    let plant = Plant::with_effects(&robot, &robot.all_effects(), &CATALOGUE).unwrap();
    let p = plant.parameters();
    let predicted = |parts: usize| -> Vec<f64> {
        let record = &prepared.records[0];
        let freedom = Freedom { parts, ..Freedom::of(&plant, &p, record, Springs::Simulated) };
        predict(&plant, &p, record, &prepared.sensors.channels, &freedom).channels.concat()
    };
    let exact = predicted(16);
    let error = |parts: usize| -> f64 {
        predicted(parts).iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let gain = error(1) / error(2);
    assert!((12.0..20.0).contains(&gain), "{gain}");
}
