//! A run of a plant, as its sensors would log it.

use sinew_data::{Quantity, Run};
use sinew_plant::Plant;

use crate::channels::Channel;
use crate::equations::Equations;
use crate::holds::Holds;
use crate::noise::{self, Noise};
use crate::solver::INSTANT;
use crate::{Drive, EnergyAudit, Measured, Method, SimulateError, Solver, Start, Tolerance, Work};

/// What to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Times of the samples, s; torques are held from each to the next.
    pub times: Vec<f64>,
    /// Where the robot starts, at rest.
    pub start: Start,
    /// The signals wanted, for every joint that has a motor and sensors: bending links show in none of them.
    pub quantities: Vec<Quantity>,
    /// Temperature of each degree of freedom at the samples, °C; none where it is nobody's concern. What is told is logged.
    pub temperature: Vec<Option<Vec<f64>>>,
    /// What the sensors add.
    pub noise: Noise,
    /// Seed of the noise.
    pub seed: u64,
    /// How to integrate.
    pub method: Method,
    /// How well.
    pub tolerance: Tolerance,
}

impl Options {
    /// `duration` s at one sample each `period`, starting at zero position, ideal sensors, all six signals.
    ///
    /// # Panics
    /// If `period` is not positive or longer than `duration`.
    pub fn new(plant: &Plant, duration: f64, period: f64) -> Self {
        assert!(period > 0.0 && period <= duration, "period: positive and not beyond the duration");
        let samples = (duration / period).round() as usize;
        Self {
            times: (0..=samples).map(|k| k as f64 * period).collect(),
            start: Start::at(&vec![0.0; plant.model().nv]),
            quantities: SIGNALS.to_vec(),
            temperature: vec![None; plant.model().nv],
            noise: Noise::default(),
            seed: 0,
            method: Method::Auto,
            tolerance: Tolerance::default(),
        }
    }

    /// The same at the times of a run, its joints as warm as its log says.
    pub fn along(mut self, run: &Run, plant: &Plant) -> Self {
        let model = plant.model();
        let told = |dof| run.signal(Quantity::Temperature, model.dof_name(dof)).map(|s| s.values.clone());
        self.times.clone_from(&run.time);
        self.temperature = (0..model.nv).map(told).collect();
        self
    }
}

/// What a simulation gives.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// The log.
    pub run: Run,
    /// The true energy at each sample, J.
    pub energy: Vec<f64>,
    /// Where it came from and went.
    pub audit: EnergyAudit,
    /// What it cost.
    pub work: Work,
}

/// The signals that a simulation can log.
pub const SIGNALS: [Quantity; 6] = [
    Quantity::MotorPosition,
    Quantity::MotorVelocity,
    Quantity::MotorTorque,
    Quantity::JointPosition,
    Quantity::JointVelocity,
    Quantity::JointTorque,
];

/// Simulates `plant` with parameters `p` under `drive`.
///
/// ```text
/// τ_m = gain · lag(delay(command + noise)),   ẋ = f(x, τ_m),   reading = gain · truth(t − delay) + offset + noise
/// ```
///
/// Torques switch at the samples; a delayed one switches late, exactly then. Before the first sample the first
/// command has acted for ever. A negative delay means that the log is late instead: the command acts at once.
///
/// # Errors
/// If the plant cannot be driven, an option cannot be, the solver gives up, or the motion runs away.
///
/// # Panics
/// If `p` or the start has the wrong length.
///
/// # Example
/// A link of 0.5 kg·m² without gravity under 1 N·m turns by ½ (τ/J) t² = 1 rad in a second:
/// ```
/// use sinew_data::Quantity;
/// use sinew_model::{Robot, Vector3, samples::hanging_link};
/// use sinew_plant::Plant;
/// use sinew_simulate::{Options, Torques, simulate};
/// let weightless = hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO);
/// let plant = Plant::new(&Robot::rigid(weightless), &sinew_effects::CATALOGUE).unwrap();
/// let options = Options::new(&plant, 1.0, 0.01);
/// let result = simulate(&plant, &[], &mut Torques::constant(&[1.0]), &options).unwrap();
/// let q = &result.run.signal(Quantity::JointPosition, "joint").unwrap().values;
/// assert!((q.last().unwrap() - 1.0).abs() < 1e-9);
/// ```
pub fn simulate(
    plant: &Plant,
    p: &[f64],
    drive: &mut dyn Drive,
    options: &Options,
) -> Result<Simulated, SimulateError> {
    plant.check_driven()?;
    check(options)?;
    let nv = plant.model().nv;
    assert_eq!((options.start.q.len(), options.start.theta.len()), (nv, nv), "start");
    assert_eq!(options.temperature.len(), nv, "temperature");
    let equations = Equations::new(plant, p, &options.start.q, &options.start.theta);
    let mut bench = Bench::new(equations, options);
    let mut measured = vec![0.0; plant.joints().len()];
    let mut command = vec![0.0; plant.joints().len()];
    for (k, &t) in options.times.iter().enumerate() {
        bench.warm(k);
        bench.read_encoders(k, &mut measured);
        drive.command(Measured { time: t, motor_position: &measured }, &mut command);
        bench.hold(k, t, &command);
        bench.record(t)?;
        if let Some(&next) = options.times.get(k + 1) {
            bench.advance(t, next)?;
        }
    }
    bench.finish()
}

/// A robot on its test bench, at one instant.
struct Bench<'a> {
    options: &'a Options,
    equations: Equations<'a>,
    solver: Solver,
    holds: Holds,
    encoders: Vec<noise::Channel>,
    drives: Vec<noise::Channel>,
    channels: Vec<Channel>,
    x: Vec<f64>,
    command: Vec<f64>,
    energy: Vec<f64>,
    supplied: Vec<f64>,
    work: Work,
}

// Positions and velocities beyond these are no robot's.
const FAR: f64 = 1e6;
const FAST: f64 = 1e5;

impl<'a> Bench<'a> {
    fn new(equations: Equations<'a>, options: &'a Options) -> Self {
        let plant = equations.dynamics.plant();
        let (model, joints) = (plant.model(), plant.joints());
        let noise_of = |quantity| {
            let of = |&dof: &usize| options.noise.channel(options.seed, quantity, model.dof_name(dof));
            joints.iter().map(of).collect()
        };
        let mut channels = Vec::new();
        for &dof in joints {
            for &quantity in &options.quantities {
                channels.push(Channel::new(&equations, quantity, dof, &options.noise, options.seed));
            }
        }
        let told = (0..model.nv).filter(|&dof| options.temperature[dof].is_some());
        channels.extend(
            told.map(|dof| {
                Channel::new(&equations, Quantity::Temperature, dof, &options.noise, options.seed)
            }),
        );
        Self {
            solver: Solver::new(options.method, options.tolerance),
            holds: Holds::new(equations.actuation.iter().map(|a| a.delay.max(0.0)).collect()),
            encoders: noise_of(Quantity::MotorPosition),
            drives: noise_of(Quantity::MotorTorque),
            channels,
            x: equations.start(),
            command: vec![0.0; model.nv],
            energy: Vec::new(),
            supplied: Vec::new(),
            work: Work::default(),
            equations,
            options,
        }
    }

    // Joints keep their temperature from one sample to the next.
    fn warm(&mut self, k: usize) {
        for (now, told) in self.equations.state.temperature.iter_mut().zip(&self.options.temperature) {
            *now = told.as_ref().map(|values| values[k]);
        }
    }

    fn read_encoders(&mut self, k: usize, measured: &mut [f64]) {
        self.equations.evaluate(&self.x);
        for (joint, &dof) in self.equations.dynamics.plant().joints().iter().enumerate() {
            measured[joint] = self.encoders[joint].read(self.equations.state.theta[dof], k);
        }
    }

    // The command as logged, and what a drive makes of it, with its noise, on its way to the motor.
    fn hold(&mut self, k: usize, t: f64, command: &[f64]) {
        let mut noisy = vec![0.0; self.command.len()];
        for (joint, &dof) in self.equations.dynamics.plant().joints().iter().enumerate() {
            self.command[dof] = command[joint];
            let given = command[joint] - self.equations.actuation[dof].excess(command[joint]);
            noisy[dof] = given + self.drives[joint].noise(k);
        }
        self.holds.give(t, &noisy);
        self.holds.act(t, &mut self.equations.command);
        if k == 0 {
            self.equations.settle_drives(&mut self.x);
        }
    }

    fn record(&mut self, t: f64) -> Result<(), SimulateError> {
        self.read_channels(t);
        let state = &self.equations.state;
        let limits = [
            ("position", &state.q, FAR),
            ("velocity", &state.qd, FAST),
            ("motor's velocity", &state.thetad, FAST),
        ];
        for (what, values, most) in limits {
            if let Some(dof) = values.iter().position(|x| x.is_nan() || x.abs() > most) {
                let joint = self.equations.dynamics.plant().model().dof_name(dof).to_owned();
                return Err(SimulateError::RunsAway { time: t, joint, what, got: values[dof] });
            }
        }
        self.energy.push(self.equations.dynamics.energy(state));
        self.supplied.push(self.equations.work(&self.x));
        Ok(())
    }

    fn read_channels(&mut self, t: f64) {
        self.equations.evaluate(&self.x);
        for channel in &mut self.channels {
            channel.read(t, &self.options.times, &self.equations, &self.command);
        }
    }

    // From one sample to the next, with a stop wherever a torque switches or a late sensor looks.
    fn advance(&mut self, from: f64, to: f64) -> Result<(), SimulateError> {
        let mut t = from;
        while t < to {
            let due = self.channels.iter().map(|c| c.due(&self.options.times));
            let stop = due.fold(self.holds.next_switch().min(to), f64::min);
            // What differs from the next sample by rounding belongs to it.
            let stop = if to - stop <= INSTANT { to } else { stop };
            self.work += self.solver.advance(&mut self.equations, t, &mut self.x, stop)?;
            t = stop;
            if t < to {
                self.holds.act(t, &mut self.equations.command);
                self.read_channels(t);
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Simulated, SimulateError> {
        let signals = self.channels.into_iter().map(Channel::into_signal).collect();
        let run = Run::new("simulated".to_owned(), self.options.times.clone(), signals)?;
        let audit = EnergyAudit::of(&self.energy, &self.supplied);
        Ok(Simulated { run, energy: self.energy, audit, work: self.work })
    }
}

fn check(options: &Options) -> Result<(), SimulateError> {
    let bad =
        |what: String, help: String| SimulateError::BadRequest { place: "simulation".into(), what, help };
    if options.times.len() < 2 || !options.times.windows(2).all(|t| t[1] > t[0]) {
        let what = format!("times must increase and be two at least (got {} times)", options.times.len());
        return Err(bad(what, "give the times of the samples in order".into()));
    }
    let samples = options.times.len();
    if let Some(told) = options.temperature.iter().flatten().find(|told| told.len() != samples) {
        let what = format!("temperatures must be as many as times (got {} for {samples})", told.len());
        return Err(bad(what, "give the temperature of the joint at every sample".into()));
    }
    if let Some(q) = options.quantities.iter().find(|q| !SIGNALS.contains(q)) {
        let names = SIGNALS.map(|q| q.name()).join(", ");
        return Err(bad(format!("{q} is not simulated"), format!("simulated are {names}")));
    }
    Ok(())
}
