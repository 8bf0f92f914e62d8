//! Arms and conditions by chance: what is measured on the suite's own arms should hold for any.

use core::f64::consts::TAU;

use sinew_model::{Inertia, JointSettings, JointShape, JointSpec, ModelBuilder, Pose, Robot, Vector3};
use sinew_simulate::Stream;

use crate::hidden::effects_by_chance;
use crate::robots::{friction, spring};
use crate::suite::STEP_17_BIT;
use crate::{Arm, Case, Conditions, Data, Sensors, TorqueNoise, hidden_effects, null_case};

// Draws of one stream, one after the other.
pub(crate) struct Draws {
    stream: Stream,
    drawn: u64,
}

impl Draws {
    pub fn new(seed: u64, name: &str) -> Self {
        Self { stream: Stream::new(seed, name), drawn: 0 }
    }

    pub fn uniform(&mut self, least: f64, most: f64) -> f64 {
        self.drawn += 1;
        least + (most - least) * self.stream.uniform(self.drawn)
    }

    // Evenly spread in the logarithm.
    pub fn log(&mut self, least: f64, most: f64) -> f64 {
        self.uniform(least.ln(), most.ln()).exp()
    }

    // One of a list; what stands in it twice is drawn twice as often.
    pub fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    // A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count - 1)
    }
}

// A joint with a spring, its friction and its torque noise.
pub(crate) struct Drive {
    pub settings: JointSettings,
    pub viscous: f64,
    pub coulomb: f64,
    pub torque_noise: f64,
}

impl Drive {
    // A drive for what it moves, kg·m², and holds, N·m; antiresonance between two frequencies, Hz.
    pub fn drawn(draws: &mut Draws, inertia: f64, [low, high]: [f64; 2], held: f64, speed: f64) -> Self {
        let stiffness = inertia * (TAU * draws.log(low, high)).powi(2);
        let rotor = inertia * draws.log(0.2, 1.6);
        let both = inertia * rotor / (inertia + rotor);
        let damping = 2.0 * draws.uniform(0.02, 0.08) * (stiffness * both).sqrt();
        let coulomb = draws.log(0.08, 0.3) * (4.0 * (inertia + rotor) + held);
        Self {
            settings: spring(stiffness, damping, rotor),
            viscous: draws.uniform(0.4, 1.2) * coulomb / speed,
            coulomb,
            torque_noise: coulomb * draws.log(0.03, 0.16),
        }
    }
}

const GRAVITY: f64 = 9.81;

impl Arm {
    /// An arm by chance: one to three joints about upright or level axes across the links, 0.2 to 34 kg a link,
    /// antiresonances of 6 to 18 Hz with rotors clamped, rotors of 0.2 to 1.6 of what they move.
    pub fn drawn(seed: u64) -> Self {
        let draws = &mut Draws::new(seed, "arm");
        let n = draws.one_of(&[1, 1, 1, 2, 2, 2, 3]);
        let size = draws.log(0.1, 3.0);
        let mut builder = ModelBuilder::new(["one_drawn", "two_drawn", "three_drawn"][n - 1]);
        builder.link("base", Inertia::default());
        // Mass, length and centre of every link.
        let links: Vec<[f64; 3]> = (0..n)
            .map(|j| {
                let mass = 8.0 * size * 0.6f64.powi(j as i32) * draws.log(0.7, 1.4);
                let length = draws.uniform(0.3, 0.7);
                [mass, length, length * draws.uniform(0.3, 0.6)]
            })
            .collect();
        for (j, [mass, length, centre]) in links.iter().enumerate() {
            let across = mass * length * length / 12.0;
            let about = [0.1 * across, across, across, 0.0, 0.0, 0.0];
            let centre = Vector3::new(*centre, 0.0, 0.0);
            builder.link(LINKS[j], Inertia::at_centre_of_mass(*mass, centre, about));
        }
        builder.link("tool", Inertia::default());
        for j in 0..n {
            let axis = if j == 0 {
                draws.one_of(&[[0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
            } else {
                draws.one_of(&[[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            };
            let (parent, x) = if j == 0 { ("base", 0.0) } else { (LINKS[j - 1], links[j - 1][1]) };
            let at = Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]);
            let joint = JointSpec::new(JOINTS[j], JointShape::Revolute, parent, LINKS[j]);
            builder.joint(joint.about(axis).at(at));
        }
        let flange = Pose::from_xyz_rpy([links[n - 1][1], 0.0, 0.0], [0.0; 3]);
        builder.joint(JointSpec::new("flange", JointShape::Fixed, LINKS[n - 1], "tool").at(flange));
        let model = builder.build().expect("a chain is a tree");
        let (mut joints, mut viscous, mut torque, mut torque_noise) = (vec![], vec![], vec![], vec![]);
        let speed = draws.uniform(1.2, 2.5);
        for j in 0..n {
            // The stretched arm beyond the joint.
            let (mut inertia, mut moment, mut from) = (0.0, 0.0, 0.0);
            for [mass, length, centre] in &links[j..] {
                inertia += mass * ((from + centre).powi(2) + length * length / 12.0);
                moment += mass * (from + centre);
                from += length;
            }
            let drive = Drive::drawn(draws, inertia, [6.0, 18.0], 0.7 * GRAVITY * moment, speed);
            joints.push(drive.settings);
            viscous.push(drive.viscous);
            torque_noise.push(drive.torque_noise);
            torque.push(drive.coulomb);
        }
        let robot = Robot { effects: friction(&model, &viscous, &torque), joints, ..Robot::rigid(model) };
        let amplitude = draws.uniform(0.6, 1.0);
        Self { robot, torque, torque_noise, payload: 0.25 * links[n - 1][0], amplitude, speed }
    }
}

const LINKS: [&str; 3] = ["link_1", "link_2", "link_3"];
const JOINTS: [&str; 3] = ["joint_1", "joint_2", "joint_3"];

impl Conditions {
    /// Conditions by chance: with or without link encoders; motor encoders of 17 bit a joint turn, or 12 or 17 bit a
    /// turn of a motor geared 30 to 160 times; a third, one or three times the torque noise; control at
    /// 250 Hz to 1 kHz, logged whole or thinned to that.
    pub fn drawn(seed: u64) -> Self {
        let draws = &mut Draws::new(seed, "conditions");
        let gear = draws.log(30.0, 160.0);
        let rates = [(1e-3, 1), (1e-3, 1), (1e-3, 1), (2e-3, 1), (4e-3, 1), (1e-3, 2), (1e-3, 4)];
        let (period, every) = draws.one_of(&rates);
        Self {
            period,
            every,
            sensors: draws.one_of(&[Sensors::Full, Sensors::Motor]),
            motor_step: draws.one_of(&[STEP_17_BIT, STEP_17_BIT / gear, 32.0 * STEP_17_BIT / gear]),
            torque_noise: draws.one_of(&[1.0 / 3.0, 1.0, 3.0]),
            data: draws.one_of(&[Data::Rich, Data::Rich, Data::Excitation, Data::PickAndPlace, Data::Slow]),
            ..Self::FULL
        }
    }

    /// The conditions in words, factor by factor.
    pub fn factors(&self) -> [String; 5] {
        let sensors = match self.sensors {
            Sensors::Full => "link encoders",
            Sensors::Motor => "motor side only",
            Sensors::Current => "currents",
            Sensors::Link => "behind the gear",
            Sensors::All => "before and behind the gear",
        };
        let bits = (TAU / self.motor_step).log2();
        let encoder = if bits < 17.5 { "coarse encoders" } else { "fine encoders" };
        [
            sensors.to_owned(),
            encoder.to_owned(),
            format!(
                "torque noise × {:.1}{}",
                self.torque_noise,
                if self.torque_noise_is == TorqueNoise::Read { ", read" } else { "" }
            ),
            format!(
                "{:.0} Hz{}",
                1.0 / (self.period * self.every as f64),
                if self.every > 1 { ", thinned" } else { "" }
            ),
            match self.data {
                Data::Rich => "rich motion",
                Data::Excitation => "one Fourier run",
                Data::PickAndPlace => "pick and place",
                Data::Slow => "slow motion",
            }
            .to_owned(),
        ]
    }
}

/// A case by chance, a pure function of its seed: arm, conditions, and an effect at one of the joints, the one asked for
/// if there is one; else every sixth seed hides nothing. Sensors may be given instead of drawn.
pub fn drawn_case(seed: u64, size: f64, only: Option<&str>, sensors: Option<Sensors>) -> (Arm, Case) {
    let (arm, drawn) = (Arm::drawn(seed), Conditions::drawn(seed));
    let conditions = Conditions { sensors: sensors.unwrap_or(drawn.sensors), ..drawn };
    let case = case_by_chance(&arm, conditions, seed, size, only);
    (arm, case)
}

// An effect at one of the joints, the one asked for if there is one; else every sixth seed hides nothing.
pub(crate) fn case_by_chance(
    arm: &Arm,
    conditions: Conditions,
    seed: u64,
    size: f64,
    only: Option<&str>,
) -> Case {
    let draws = &mut Draws::new(seed, "hidden");
    let dof = (draws.uniform(0.0, arm.robot.model.nv as f64) as usize).min(arm.robot.model.nv - 1);
    let all = if only.is_some() { hidden_effects } else { effects_by_chance };
    let mut hidden = all(arm, dof, size);
    hidden.retain(|h| h.is_seen_by(conditions.sensors) && h.is_possible_in(arm));
    hidden.retain(|h| only.is_none_or(|o| h.effect == o));
    let chosen = draws.uniform(0.0, hidden.len() as f64) as usize;
    match hidden.get(chosen) {
        Some(hidden) if only.is_some() || !seed.is_multiple_of(6) => {
            Case::new(arm, &[hidden], conditions, seed)
        }
        _ => null_case(arm, conditions, seed),
    }
}
