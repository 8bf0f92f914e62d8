//! One case: a truth that differs from the model, its measured runs, and the verdict.

use sinew_data::{Quantity, Run};
use sinew_effects::CATALOGUE;
use sinew_identify::{CandidateReport, Diagnosis, Options, Verdict, diagnose, fit};
use sinew_model::{EffectSpec, Robot};
use sinew_plant::Plant;
use sinew_simulate::{
    Controller, Excitation, Limits, Motion, Noise, Options as Simulation, SensorNoise, Start, Stream,
    Tolerance, Trajectory, simulate,
};

use crate::foreign::{Edit, Way, foreign_catalogue};
use crate::hidden::How;
use crate::robots::GEAR_RATIO;
use crate::{Arm, Foreign, Hidden};

/// How well a case is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// What is logged.
    pub sensors: Sensors,
    /// Step of the motors' encoders on the link side, rad.
    pub motor_step: f64,
    /// Torque noise, in units of the arm's own.
    pub torque_noise: f64,
    /// Whether it moves the arm.
    pub torque_noise_is: TorqueNoise,
    /// Period of the controller, which holds its torques, s.
    pub period: f64,
    /// Periods of the controller to a row of the log.
    pub every: usize,
    /// What the arm was made to do.
    pub data: Data,
}

/// What becomes of torque noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorqueNoise {
    /// The drive adds it; the log has the command.
    Acting,
    /// The arm moves without it; the log has the torque with it.
    Read,
}

/// What is logged of every joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensors {
    /// Motor torque, motor and link position.
    Full,
    /// Motor torque and position.
    Motor,
    /// Motor current and position; the torque constant is stated.
    Current,
    /// Torque and position behind the gear.
    Link,
    /// Torque and position before and behind the gear.
    All,
}

impl Sensors {
    /// Sensors by name.
    pub fn named(name: &str) -> Option<Self> {
        let all = [
            ("full", Self::Full),
            ("motor", Self::Motor),
            ("current", Self::Current),
            ("link", Self::Link),
            ("all", Self::All),
        ];
        all.into_iter().find(|(n, _)| *n == name).map(|(_, sensors)| sensors)
    }

    fn quantities(self) -> Vec<Quantity> {
        match self {
            Self::Full => vec![Quantity::MotorPosition, Quantity::MotorTorque, Quantity::JointPosition],
            Self::Motor | Self::Current => vec![Quantity::MotorPosition, Quantity::MotorTorque],
            Self::Link => vec![Quantity::JointPosition, Quantity::JointTorque],
            Self::All => vec![
                Quantity::MotorPosition,
                Quantity::MotorTorque,
                Quantity::JointPosition,
                Quantity::JointTorque,
            ],
        }
    }
}

/// What an arm was made to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Data {
    /// Fourier motion in one run; strokes, reversals, chirp and steps in another.
    Rich,
    /// Fourier motion alone.
    Excitation,
    /// Moves between poses, and stays there, in two runs.
    PickAndPlace,
    /// Slow strokes, and slow moves between poses.
    Slow,
}

/// Encoder step, rad: 17 bit a joint turn.
pub(crate) const STEP_17_BIT: f64 = std::f64::consts::TAU / 131_072.0;

impl Conditions {
    /// Motor encoders of 17 bit a motor turn, link encoders.
    pub const FULL: Self = Self {
        sensors: Sensors::Full,
        motor_step: STEP_17_BIT / GEAR_RATIO,
        torque_noise: 1.0,
        torque_noise_is: TorqueNoise::Acting,
        period: 1e-3,
        every: 1,
        data: Data::Rich,
    };

    /// Conditions by name: the sensors `full`, `motor`, `current`, `link` or `all`, then `fine` (17 bit a motor turn) or
    /// `coarse` (17 bit a joint turn). `fine+read` logs torques with a noise that does not act; `fine+fourier`, `fine+places` and
    /// `fine+slow` are of other motions. `fine/10` is a log of every tenth row, `fine@4` one of a drive that holds its torques for
    /// 4 ms.
    pub fn named(sensors: &str, encoder: &str) -> Option<Self> {
        let sensors = Sensors::named(sensors)?;
        let (encoder, every) = encoder.split_once('/').unwrap_or((encoder, "1"));
        let every = every.parse().ok().filter(|every| *every > 0)?;
        let (encoder, held) = encoder.split_once('@').unwrap_or((encoder, "1"));
        let period = 1e-3 * held.parse::<f64>().ok().filter(|held| *held > 0.0)?;
        let mut named = Self { sensors, period, every, ..Self::FULL };
        for word in encoder.split('+') {
            match word {
                "fine" => named.motor_step = STEP_17_BIT / GEAR_RATIO,
                "coarse" => named.motor_step = STEP_17_BIT,
                "read" => named.torque_noise_is = TorqueNoise::Read,
                "fourier" => named.data = Data::Excitation,
                "places" => named.data = Data::PickAndPlace,
                "slow" => named.data = Data::Slow,
                _ => return None,
            }
        }
        Some(named)
    }
}

/// A case of the suite: a pure function of its seed.
pub struct Case {
    /// The model under test.
    pub model: Robot,
    /// What really moves.
    pub truth: Robot,
    /// What the model lacks: effect and place of each; none if nothing.
    pub hidden: Vec<(String, String)>,
    /// A change of what was logged at a joint, if that is what is hidden.
    pub logged: Option<(Edit, String)>,
    /// How well it is measured.
    pub conditions: Conditions,
    /// Seed of deviations, motion and noise.
    pub seed: u64,
}

/// What came of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Effect and place of each that is hidden.
    pub hidden: Vec<(String, String)>,
    /// The verdict.
    pub verdict: Verdict,
    /// First effect and place named, with its probability.
    pub first: Option<(String, String, f64)>,
    /// Contribution ρ of what is hidden, in units of filtered noise; near zero for a value that only its tolerance speaks
    /// against.
    pub contribution: f64,
    /// All accepted, `effect@place`.
    pub accepted: Vec<String>,
    /// Rivals of the first.
    pub rivals: Vec<String>,
}

/// Outside the suite's control: why a case has no outcome.
pub type Outside = Box<dyn std::error::Error + Send + Sync>;

// Sign width of the truth's friction; the model starts from twice that.
const TRUE_SMOOTHING: f64 = 1e-3;
// Step of the links' encoders, rad.
const LINK_STEP: f64 = STEP_17_BIT / 8.0;
// True parameters are off their stated values by this share of the stated tolerance.
const DEVIATION: f64 = 0.5;

impl Case {
    /// The case that hides `hidden` in `arm`: nothing, one effect or several.
    pub fn new(arm: &Arm, hidden: &[&Hidden], conditions: Conditions, seed: u64) -> Self {
        let mut model = arm.robot.clone();
        if conditions.sensors == Sensors::Current {
            model.joints.iter_mut().for_each(|j| j.torque_constant = Some(TORQUE_CONSTANT));
        }
        let mut truth = deviated(&arm.robot, seed);
        for hidden in hidden {
            match &hidden.how {
                How::Added(spec) => truth.effects.push(spec.clone()),
                How::Changed(change) => change(&mut truth, hidden.dof),
                How::Forgotten(forget) => forget(&mut model, hidden.dof),
            }
        }
        let hidden = hidden.iter().map(|h| (h.effect.to_owned(), h.place.clone())).collect();
        Self { model, truth, hidden, logged: None, conditions, seed }
    }

    /// The case in which a cause from outside the catalogue acts at degree of freedom `dof`.
    pub fn foreign(arm: &Arm, cause: &Foreign, dof: usize, conditions: Conditions, seed: u64) -> Self {
        let joint = arm.robot.model.dof_name(dof).to_owned();
        let mut case = Self::new(arm, &[], conditions, seed);
        match &cause.how {
            Way::Law(spec) => case.truth.effects.push(spec.clone()),
            Way::Changed(change) => change(&mut case.truth, dof),
            Way::Logged(change) => case.logged = Some((*change, joint.clone())),
        }
        case.hidden = vec![(cause.name.to_owned(), joint)];
        case
    }

    /// Whether the diagnosis named the right effect at the right place first; of several, one of them.
    pub fn is_right(&self, outcome: &Outcome) -> bool {
        match &outcome.first {
            _ if self.hidden.is_empty() => outcome.verdict == Verdict::Adequate,
            Some((effect, place, _)) => self.hidden.iter().any(|(e, p)| e == effect && p == place),
            None => false,
        }
    }

    /// Whether all that is hidden was accepted.
    pub fn is_complete(&self, outcome: &Outcome) -> bool {
        self.hidden.iter().all(|(effect, place)| outcome.accepted.contains(&format!("{effect}@{place}")))
    }
}

/// A case in which nothing is hidden.
pub fn null_case(arm: &Arm, conditions: Conditions, seed: u64) -> Case {
    Case::new(arm, &[], conditions, seed)
}

/// The runs of a case, in closed loop.
///
/// # Errors
/// If the truth is no plant or cannot be simulated.
pub fn measure(arm: &Arm, case: &Case) -> Result<Vec<Run>, Outside> {
    let seed = case.seed;
    let motions = match case.conditions.data {
        Data::Rich => vec![fourier(arm, seed, 9.0), strokes(arm, seed)],
        Data::Excitation => vec![fourier(arm, seed, 17.0)],
        Data::PickAndPlace => vec![places(arm, seed, 1.0), places(arm, seed + 1, 1.0)],
        Data::Slow => vec![slow_strokes(arm), places(arm, seed, 0.2)],
    };
    recorded(arm, case, motions)
}

/// One run of a case of this length, s: Fourier motion in closed loop.
///
/// # Errors
/// If the truth is no plant or cannot be simulated.
pub fn measure_for(arm: &Arm, case: &Case, seconds: f64) -> Result<Vec<Run>, Outside> {
    recorded(arm, case, [fourier(arm, case.seed, seconds)])
}

fn recorded(
    arm: &Arm,
    case: &Case,
    motions: impl IntoIterator<Item = Trajectory>,
) -> Result<Vec<Run>, Outside> {
    let truth = Plant::new(&case.truth, foreign_catalogue())?;
    let parameters = truth.parameters();
    let mut feed_forward = case.model.clone();
    feed_forward.joints.iter_mut().for_each(|j| j.stiffness = None);
    feed_forward.effects.clear();
    let feed_forward = Plant::new(&feed_forward, &CATALOGUE)?;
    let mut noise = Noise::default()
        .with(Quantity::MotorPosition, 0.3 * case.conditions.motor_step, case.conditions.motor_step)
        .with(Quantity::JointPosition, 0.3 * LINK_STEP, LINK_STEP);
    let of_torque = |quantity| {
        let of_joint = move |(dof, &std): (usize, &f64)| SensorNoise {
            quantity,
            joint: Some(case.model.model.dof_name(dof).to_owned()),
            std: std * case.conditions.torque_noise,
            resolution: 0.0,
        };
        arm.torque_noise.iter().enumerate().map(of_joint)
    };
    noise.sensors.extend(of_torque(Quantity::JointTorque));
    let mut read = Vec::new();
    match case.conditions.torque_noise_is {
        TorqueNoise::Acting => noise.sensors.extend(of_torque(Quantity::MotorTorque)),
        TorqueNoise::Read => read.extend(of_torque(Quantity::MotorTorque)),
    }
    motions
        .into_iter()
        .enumerate()
        .map(|(k, reference)| {
            let duration = reference.joints.iter().map(Motion::duration).fold(0.0, f64::max);
            let start: Vec<f64> = (0..case.model.model.nv).map(|d| reference.at(d, 0.0).position).collect();
            let mut options = Simulation::new(&truth, duration, case.conditions.period);
            options.start = Start::balanced(&truth, &parameters, &start)?;
            options.quantities = case.conditions.sensors.quantities();
            let temperature: Vec<f64> = options.times.iter().map(|t| temperature(k, t / duration)).collect();
            for &dof in truth.joints() {
                options.temperature[dof] = Some(temperature.clone());
            }
            options.noise = noise.clone();
            options.seed = case.seed * 2 + k as u64;
            options.tolerance = Tolerance { relative: 1e-8, absolute: 1e-10 };
            let mut controller = Controller::new(&feed_forward, &feed_forward.parameters(), reference, 20.0);
            let mut run = simulate(&truth, &parameters, &mut controller, &options)?.run;
            run.name = format!("run_{k}");
            if case.conditions.torque_noise_is == TorqueNoise::Read {
                read_with_noise(&mut run, &read, options.seed);
            }
            thin(&mut run, case.conditions.every);
            if case.conditions.sensors == Sensors::Current {
                told_by_current(&mut run);
            }
            if let Some((change, joint)) = &case.logged {
                change(&mut run, joint);
            }
            Ok(run)
        })
        .collect()
}

// Torques that acted as they are, read with noise.
fn read_with_noise(run: &mut Run, read: &[SensorNoise], seed: u64) {
    for signal in run.signals.iter_mut().filter(|s| s.quantity == Quantity::MotorTorque) {
        let is_its = |noise: &&SensorNoise| noise.joint.as_ref() == Some(&signal.place);
        let Some(noise) = read.iter().find(is_its) else { continue };
        let random = Stream::new(seed, &format!("read.{}", signal.place));
        let readings = signal.values.iter_mut().zip(0..);
        readings.for_each(|(x, k)| *x += noise.std * random.normal(k));
        signal.std = Some(noise.std);
    }
}

// Torque constant of every joint, seen behind its gear, N·m/A.
const TORQUE_CONSTANT: f64 = 4.0;

// Torques as the currents that make them.
fn told_by_current(run: &mut Run) {
    for signal in run.signals.iter_mut().filter(|s| s.quantity == Quantity::MotorTorque) {
        signal.quantity = Quantity::MotorCurrent;
        signal.values.iter_mut().for_each(|x| *x /= TORQUE_CONSTANT);
        signal.std = signal.std.map(|s| s / TORQUE_CONSTANT);
    }
}

// Keeps every so manyth row.
fn thin(run: &mut Run, every: usize) {
    let kept = |x: &mut Vec<f64>| *x = x.iter().step_by(every).copied().collect();
    kept(&mut run.time);
    run.signals.iter_mut().for_each(|signal| kept(&mut signal.values));
}

/// About the mean temperature of the two runs of a case, °C.
pub(crate) const MEAN_TEMPERATURE: f64 = 34.0;

// A cold run and one after an hour of work, a share of their time after the start.
fn temperature(run: usize, share: f64) -> f64 {
    MEAN_TEMPERATURE + if run == 0 { -10.0 + 4.0 * share } else { 9.0 + share }
}

fn fourier(arm: &Arm, seed: u64, seconds: f64) -> Trajectory {
    let limits = Limits { amplitude: arm.amplitude, speed: arm.speed };
    let motion = |dof: u64| {
        let excitation = Excitation::fourier(seed * 10 + dof, 5, 8.0, limits);
        Motion::one(0.1, seconds, excitation)
    };
    Trajectory { joints: (0..arm.robot.model.nv as u64).map(motion).collect() }
}

// Moves between six poses at a share of the arm's speed.
fn places(arm: &Arm, seed: u64, share: f64) -> Trajectory {
    let limits = Limits { amplitude: arm.amplitude, speed: share * arm.speed };
    let motion = |dof: u64| Motion::one(-0.1, 9.0, Excitation::steps(seed * 10 + dof, 6, 0.3, limits));
    Trajectory { joints: (0..arm.robot.model.nv as u64).map(motion).collect() }
}

fn slow_strokes(arm: &Arm) -> Trajectory {
    let motion = |dof: usize| {
        let limits = Limits { amplitude: 0.3 * arm.amplitude, speed: 0.15 + 0.05 * dof as f64 };
        Motion::one(0.1, 9.0, Excitation::strokes(limits))
    };
    Trajectory { joints: (0..arm.robot.model.nv).map(motion).collect() }
}

fn strokes(arm: &Arm, seed: u64) -> Trajectory {
    let motion = |dof: u64| {
        let slow = Limits { amplitude: 0.3 * arm.amplitude, speed: 0.15 + 0.05 * dof as f64 };
        let small = Limits { amplitude: 0.02, speed: 0.2 };
        let fast = Limits { amplitude: 0.03, speed: 0.8 };
        let wide = Limits { amplitude: arm.amplitude, speed: 0.6 * arm.speed };
        Motion {
            centre: -0.2,
            parts: vec![
                (3.5, Excitation::strokes(slow)),
                (1.5, Excitation::reversals(1.5 + 0.4 * dof as f64, small)),
                (2.5, Excitation::chirp(2.0, 14.0, fast)),
                (3.0, Excitation::steps(seed * 10 + dof, 4, 0.3, wide)),
            ],
        }
    };
    Trajectory { joints: (0..arm.robot.model.nv as u64).map(motion).collect() }
}

/// Diagnoses a case.
///
/// # Errors
/// If the truth cannot be simulated or the diagnosis is refused.
pub fn judge(arm: &Arm, case: &Case, options: &Options) -> Result<(Outcome, Diagnosis), Outside> {
    let runs = measure(arm, case)?;
    let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, options)?;
    let named = diagnosis.accepted.len();
    let first = diagnosis.candidates.first().filter(|_| named > 0);
    let outcome = Outcome {
        hidden: case.hidden.clone(),
        verdict: diagnosis.verdict,
        first: first.map(|c| (c.effect.clone(), c.place.clone(), c.probability)),
        contribution: contribution(case, &runs, &diagnosis, options),
        accepted: diagnosis.accepted.iter().map(|a| format!("{}@{}", a.effect, a.place)).collect(),
        rivals: first.map(|c| c.rivals.iter().map(|r| r.effect.clone()).collect()).unwrap_or_default(),
    };
    Ok((outcome, diagnosis))
}

// ρ of what is hidden: its share after everything else has adapted, in units of noise.
fn contribution(case: &Case, runs: &[Run], diagnosis: &Diagnosis, options: &Options) -> f64 {
    let [(effect, place)] = &case.hidden[..] else { return 0.0 };
    let hidden = |c: &&CandidateReport| c.effect == *effect && c.place == *place;
    if let Some(named) = diagnosis.candidates.iter().find(hidden) {
        return named.contribution;
    }
    // Not named: asked for.
    let is_hidden = |e: &&EffectSpec| e.kind == *effect && e.place.to_string() == *place;
    let known = CATALOGUE.find(effect).is_some();
    let Some(spec) = case.truth.effects.iter().find(is_hidden).filter(|_| known) else { return 0.0 };
    let fitted = fit(&case.model, &CATALOGUE, runs, &[], std::slice::from_ref(spec), options);
    let found = fitted.as_ref().ok().and_then(|f| f.diagnosis.candidates.iter().find(hidden));
    found.map_or(0.0, |c| c.contribution)
}

// Every stated value moved by half of its tolerance, up or down by chance.
fn deviated(robot: &Robot, seed: u64) -> Robot {
    let mut truth = robot.clone();
    let random = Stream::new(seed, "deviation");
    let mut drawn = 0;
    let mut factor = |tolerance: f64| {
        drawn += 1;
        1.0 + if random.uniform(drawn) < 0.5 { -1.0 } else { 1.0 } * DEVIATION * tolerance
    };
    for joint in &mut truth.joints {
        joint.stiffness = joint.stiffness.map(|k| k * factor(0.08));
        joint.damping *= factor(0.3);
        joint.rotor_inertia *= factor(0.03);
    }
    for joint in &mut truth.model.joints {
        joint.inertia.first_moment.x *= factor(0.03);
        joint.inertia.second_moment.yy *= factor(0.05);
    }
    for effect in &mut truth.effects {
        let key = if effect.kind == "viscous_friction" { "viscous" } else { "coulomb" };
        if let Some(value) = effect.number(key) {
            *effect = std::mem::replace(effect, EffectSpec::new("", effect.place.clone()))
                .with(key, value * factor(0.2));
        }
        if effect.kind == "coulomb_friction" {
            let spec = std::mem::replace(effect, EffectSpec::new("", effect.place.clone()));
            *effect = spec.with("smoothing_velocity", TRUE_SMOOTHING);
        }
    }
    truth
}

/// Counts of first names by what is hidden, most frequent first.
pub fn confusion(outcomes: &[Outcome]) -> Vec<(String, Vec<(String, usize)>)> {
    let mut rows: Vec<(String, Vec<(String, usize)>)> = Vec::new();
    for outcome in outcomes {
        let names: Vec<&str> = outcome.hidden.iter().map(|(effect, _)| effect.as_str()).collect();
        let hidden = if names.is_empty() { "nothing".to_owned() } else { names.join(" + ") };
        let named = outcome.first.as_ref().map_or(outcome.verdict.to_string(), |(effect, ..)| effect.clone());
        let row = match rows.iter_mut().position(|(h, _)| *h == hidden) {
            Some(k) => &mut rows[k].1,
            None => {
                rows.push((hidden, Vec::new()));
                &mut rows.last_mut().expect("a row was just added").1
            }
        };
        match row.iter_mut().find(|(n, _)| *n == named) {
            Some((_, count)) => *count += 1,
            None => row.push((named, 1)),
        }
    }
    rows.iter_mut().for_each(|(_, row)| row.sort_by_key(|(_, count)| std::cmp::Reverse(*count)));
    rows
}
