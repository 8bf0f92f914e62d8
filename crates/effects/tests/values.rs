//! Laws at points where their value is known by hand.

use sinew_effect::{Act, Actuation, At, Call, Coefficients, Deflection, Effect, Reading, Relaxation, Sensor};
use sinew_effects::*;
use sinew_model::{JointId, Model, Pose, samples};

/// Rounding of a few operations.
const ALGEBRA: f64 = 1e-12;

/// The state of one joint.
#[derive(Clone, Copy, Default)]
struct Joint {
    q: f64,
    qd: f64,
    theta: f64,
    thetad: f64,
    deflection: f64,
    rate: f64,
    tau_j: f64,
    z: f64,
}

fn arm() -> Model {
    samples::planar_arm(1, 1.5, 0.4)
}

fn constants() -> Coefficients<f64> {
    let mut c = Coefficients::of(&arm());
    c.coulomb[0] = 2.0;
    c
}

impl Joint {
    fn asks<T>(&self, ask: impl FnOnce(&At<f64>) -> T) -> T {
        let (c, one) = (constants(), core::slice::from_ref::<f64>);
        ask(&At {
            q: one(&self.q),
            qd: one(&self.qd),
            theta: one(&self.theta),
            thetad: one(&self.thetad),
            thetad_sweep: &[0.0],
            qd_sweep: &[0.0],
            temperature: &[Some(35.0)],
            deflection: one(&self.deflection),
            deflection_rate: one(&self.rate),
            tau_j: one(&self.tau_j),
            z: one(&self.z),
            coefficients: &c,
        })
    }
    /// The torque the effect adds, on whichever side it acts.
    fn torque(&self, effect: &dyn Effect, p: &[f64]) -> f64 {
        let mut tau = [0.0];
        self.asks(|at| match effect.acts() {
            acts if acts.contains(&Act::LinkForce) => effect.call_f64(p, Call::LinkForce(at, &mut tau)),
            acts if acts.contains(&Act::SpringTorque) => effect.call_f64(p, Call::SpringTorque(at, &mut tau)),
            _ => effect.call_f64(p, Call::MotorForce(at, &mut tau)),
        });
        tau[0]
    }
    fn relaxation(&self, effect: &dyn Effect, p: &[f64]) -> Relaxation<f64> {
        let mut z = [Relaxation::default()];
        self.asks(|at| effect.call_f64(p, Call::Relaxation(at, &mut z)));
        z[0]
    }
    fn actuation(&self, effect: &dyn Effect, p: &[f64]) -> Actuation<f64> {
        let mut a = [Actuation::default()];
        self.asks(|at| effect.call_f64(p, Call::Actuation(at, &mut a)));
        a[0]
    }
}

fn reading(effect: &dyn Effect, p: &[f64], sensor: Sensor) -> Reading<f64> {
    let mut r = [Reading::default()];
    effect.call_f64(p, Call::Reading(sensor, &mut r));
    r[0]
}

fn changed(effect: &dyn Effect, p: &[f64]) -> Coefficients<f64> {
    let mut c = constants();
    effect.call_f64(p, Call::Coefficients(&mut c));
    c
}

fn assert_close(got: f64, want: f64) {
    assert!((got - want).abs() <= ALGEBRA * (1.0 + want.abs()), "got {got}, want {want}");
}

#[test]
fn friction_opposes_the_motion() {
    let ahead = Joint { qd: 0.5, thetad: 0.5, tau_j: -10.0, ..Joint::default() };
    let back = Joint { qd: -0.5, thetad: -0.5, ..ahead };
    let cases: [(&dyn Effect, &[f64], f64); 6] = [
        (&ViscousFriction { dof: 0 }, &[4.0], 2.0),
        (&CoulombFriction { dof: 0 }, &[3.0, 2e-3], 3.0),
        (&QuadraticViscousFriction { dof: 0 }, &[4.0], 1.0),
        (&LoadDependentFriction { dof: 0 }, &[0.05, 1.0], 0.5),
        (&LinkViscousFriction { dof: 0 }, &[4.0], 2.0),
        (&LinkCoulombFriction { dof: 0 }, &[3.0, 2e-3], 3.0),
    ];
    for (effect, p, drag) in cases {
        assert_close(ahead.torque(effect, p), -drag);
        assert_close(back.torque(effect, p), drag);
    }
}

#[test]
fn friction_follows_the_temperature_from_where_it_is_stated() {
    let x = Joint { thetad: 0.5, ..Joint::default() };
    // 35 °C are 15 K more than stated: 15 (0.02 · 0.5 + 0.1)
    assert_close(x.torque(&TemperatureDependentFriction { dof: 0 }, &[0.02, 0.1, 20.0]), -1.65);
}

#[test]
fn stribeck_friction_has_fallen_by_e_at_its_velocity() {
    let x = Joint { thetad: 0.04, ..Joint::default() };
    assert_close(x.torque(&StribeckFriction { dof: 0 }, &[2.0, 0.04]), -2.0 / core::f64::consts::E);
}

#[test]
fn asymmetric_friction_pulls_to_one_side() {
    for thetad in [0.5, -0.5] {
        let x = Joint { thetad, ..Joint::default() };
        assert_close(x.torque(&AsymmetricFriction { dof: 0 }, &[4.0, 1.0]), -3.0);
    }
}

#[test]
fn load_dependent_friction_takes_the_stated_exponent() {
    let x = Joint { thetad: 1.0, tau_j: 16.0, ..Joint::default() };
    assert_close(x.torque(&LoadDependentFriction { dof: 0 }, &[0.1, 0.5]), -0.4);
}

#[test]
fn bristles_start_as_a_spring_and_end_as_coulomb_friction() {
    let (effect, p) = (PreslidingFriction { dof: 0 }, [1.0 / 5000.0, 0.0]);
    let x = Joint { thetad: 0.1, ..Joint::default() };
    // dz/dθ = ż/θ̇ = σ₀ at z = 0; the jump of F_c = 2 is taken back
    let r = x.relaxation(&effect, &p);
    assert_close(r.rate * r.target / x.thetad, 5000.0);
    assert_close(x.torque(&effect, &p), 2.0);
    let sliding = Joint { z: r.target, ..x };
    assert_close(sliding.torque(&effect, &p), 0.0);
    // Without compliance there is nothing but the parent.
    assert_close(x.torque(&effect, &[0.0, 0.0]), 0.0);
    assert_eq!(x.relaxation(&effect, &[0.0, 0.0]).rate, 0.0);
}

#[test]
fn hysteresis_starts_as_a_spring_and_saturates() {
    let (effect, p) = (TransmissionHysteresis { dof: 0 }, [3.0, 1e-3]);
    let x = Joint { rate: -0.2, z: -1.0, ..Joint::default() };
    let r = x.relaxation(&effect, &p);
    // dz/dδ = 1/δ_y at z = 0
    assert_close(r.rate * r.target / x.rate, 1e3);
    assert_close(r.target, -1.0);
    assert_close(x.torque(&effect, &p), -3.0);
}

#[test]
fn springs_pull_back() {
    let x = Joint { q: 0.5, deflection: 0.1, ..Joint::default() };
    assert_close(x.torque(&StiffnessHardening { dof: 0 }, &[2000.0]), 2.0);
    assert_close(x.torque(&BalancerSpring { dof: 0 }, &[20.0, -3.0]), -7.0);
    assert_close(x.torque(&Contact { dof: 0, side: Side::Above }, &[100.0, 0.2]), -30.0);
    assert_close(x.torque(&Contact { dof: 0, side: Side::Above }, &[100.0, 0.7]), 0.0);
    assert_close(x.torque(&Contact { dof: 0, side: Side::Below }, &[100.0, 0.7]), 20.0);
    assert_close(x.torque(&Contact { dof: 0, side: Side::Below }, &[100.0, 0.2]), 0.0);
}

#[test]
fn harmonics_repeat_n_times_a_turn() {
    let x = Joint { theta: core::f64::consts::FRAC_PI_2 / 3.0, ..Joint::default() };
    let p = [0.2, 0.7, 3.0];
    // sin nθ = 1, cos nθ = 0
    assert_close(x.torque(&CoggingTorque { dof: 0 }, &p), -0.2);
    assert_close(x.actuation(&TorqueRipple { dof: 0 }, &p).gain, 1.2);
    let mut gear = [Deflection::default()];
    x.asks(|at| TransmissionError { dof: 0 }.call_f64(&p, Call::Deflection(at, &mut gear)));
    assert_close(gear[0].shift, 0.2);
    x.asks(|at| Backlash { dof: 0 }.call_f64(&[1e-3], Call::Deflection(at, &mut gear)));
    assert_close(gear[0].half_gap, 1e-3);
}

#[test]
fn drives_pull_more_later_and_slower() {
    let x = Joint::default();
    assert_close(x.actuation(&TorqueConstantError { dof: 0 }, &[0.15]).gain, 1.15);
    assert_close(x.actuation(&ActuatorLag { dof: 0 }, &[2e-3]).lag, 2e-3);
    assert_close(x.actuation(&ActuatorDelay { dof: 0 }, &[-1e-3]).delay, -1e-3);
}

#[test]
fn readings_are_wrong_in_their_own_sensor_only() {
    let sensors = [Sensor::MotorTorque, Sensor::JointPosition, Sensor::JointTorque];
    let position = Sensor::JointPosition;
    let ideal = Reading::default();
    let cases: [(&dyn Effect, Sensor, Reading<f64>); 5] = [
        (
            &TorqueSensorOffset { dof: 0, sensor: Sensor::MotorTorque },
            Sensor::MotorTorque,
            Reading { offset: 0.1, ..ideal },
        ),
        (&PositionSensorOffset { dof: 0 }, position, Reading { offset: 0.1, ..ideal }),
        (&PositionSensorScale { dof: 0 }, position, Reading { gain: 1.1, ..ideal }),
        (&TorqueSensorScale { dof: 0 }, Sensor::JointTorque, Reading { gain: 1.1, ..ideal }),
        (&TimeSkew { dof: 0, sensor: position }, position, Reading { delay: 0.1, ..ideal }),
    ];
    for (effect, own, wrong) in cases {
        for sensor in sensors {
            assert_eq!(reading(effect, &[0.1], sensor), if sensor == own { wrong } else { ideal });
        }
    }
}

#[test]
fn a_payload_at_the_tip_has_the_moment_of_its_distance() {
    let body_from_tool = Pose::from_xyz_rpy([0.4, 0.0, 0.0], [0.0; 3]);
    let mut p = [0.0; 10];
    p[0] = 2.0;
    let body = changed(&Payload { body: JointId(0), body_from_tool }, &p).inertia[0];
    let before = arm().joints[0].inertia;
    assert_close(body.mass - before.mass, 2.0);
    assert_close(body.first_moment.x - before.first_moment.x, 2.0 * 0.4);
    assert_close(body.second_moment.yy - before.second_moment.yy, 2.0 * 0.16);
}

#[test]
fn a_link_takes_its_errors_in_its_own_frame() {
    // The link frame is turned by a quarter about z: its x is the body's y.
    let body_from_link = Pose::from_xyz_rpy([0.0; 3], [0.0, 0.0, core::f64::consts::FRAC_PI_2]);
    let (body, before) = (JointId(0), arm().joints[0].inertia);
    let moment = changed(&LinkFirstMoment { body, body_from_link }, &[0.3, 0.0, 0.0]).inertia[0].first_moment;
    assert_close(moment.y - before.first_moment.y, 0.3);
    let second = changed(&LinkInertia { body, body_from_link }, &[0.1, 0.0, 0.0, 0.0, 0.0, 0.0]).inertia[0];
    assert_close(second.second_moment.yy - before.second_moment.yy, 0.1);
    let mass = changed(&LinkMass { body, body_from_link }, &[-0.2]).inertia[0].mass;
    assert_close(mass - before.mass, -0.2);
}

#[test]
fn a_base_that_leans_forward_feels_gravity_along_its_x() {
    // Turned about y, the base's x dips: gravity has a share g sin φ along it.
    let g = changed(&BaseTilt, &[0.0, 0.1]).gravity;
    assert_close(g.x, 9.81 * 0.1_f64.sin());
    assert_close(g.z, -9.81 * 0.1_f64.cos());
    // Turned about x, the base's y rises.
    assert_close(changed(&BaseTilt, &[0.1, 0.0]).gravity.y, -9.81 * 0.1_f64.sin());
}

#[test]
fn rotors_and_coulomb_friction_are_known_to_the_other_laws() {
    assert_close(changed(&RotorInertia { dof: 0 }, &[0.4]).rotor[0], 0.4);
    let c = changed(&CoulombFriction { dof: 0 }, &[1.5, 0.01]);
    assert_eq!((c.coulomb[0], c.smoothing_velocity[0]), (3.5, 0.01));
}
