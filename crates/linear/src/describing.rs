//! Effects that are not linear over the motion of interest: their describing functions.

use core::f64::consts::TAU;

use sinew_effect::{Act, Derivative, Kind, Relaxation, Site};
use sinew_model::{Following, VirtualJoint};
use sinew_plant::{Dynamics, ImposedOut, LinkState, MotorMotion, Plant, State};

use crate::LinearError;
use crate::layout::Layout;
use crate::seeds::{constants, lift};

/// The sinusoid over which an effect is taken for linear: x₀ + a sin ωt, of whichever coordinate the effect follows
/// (motor, link, or deflection of the gear).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplitude {
    /// a, rad (m).
    pub size: f64,
    /// ω/2π, Hz.
    pub frequency: f64,
}

impl Default for Amplitude {
    /// 0.01 rad (m) at 10 Hz.
    fn default() -> Self {
        Self { size: 0.01, frequency: 10.0 }
    }
}

/// What is done with an effect that is not linear over the amplitude of interest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nonlinear {
    /// Its describing function: the gains that carry the same first harmonic.
    Describe(Amplitude),
    /// The linear model is refused.
    Refuse(Amplitude),
    /// Its slope at the very point, however small the motion for which it holds. A smooth sign function then holds a
    /// motor almost fast, as sticking friction does.
    Slope,
}

impl Default for Nonlinear {
    fn default() -> Self {
        Self::Describe(Amplitude::default())
    }
}

/// Where a force of an effect acts, and what it follows, by degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Port {
    /// The motor.
    Motor(usize),
    /// The link.
    Link(usize),
    /// Between motor and link.
    Spring(usize),
}

/// A force that follows a motion: f = position · x + rate · ẋ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// The motion that it follows.
    pub input: Port,
    /// Where it acts.
    pub output: Port,
    /// N·m/rad; minus a stiffness.
    pub position: f64,
    /// N·m·s/rad; minus a damping.
    pub rate: f64,
}

/// An effect and the gains that stand for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Described {
    /// `effect@place`.
    pub effect: String,
    /// The gains of its first harmonic.
    pub gains: Vec<Gain>,
}

// An effect whose gains over the sinusoid differ by no more than this share from its slopes is linear.
const LINEAR: f64 = 0.05;
// Gains below this share of the force by the motion are rounding.
const NOTHING: f64 = 1e-9;
// Samples of a period, and periods until an own state repeats itself.
const SAMPLES: usize = 512;
const PERIODS: usize = 6;

impl Gain {
    /// Adds it to derivatives of forces, nv × states by columns.
    pub(crate) fn add(&self, layout: &Layout, on_link: &mut [f64], on_motor: &mut [f64], spring: &mut [f64]) {
        let (nv, np) = (layout.nv, layout.positions());
        for (place, sign) in self.columns(layout) {
            for (column, gain) in [(place, self.position), (np + place, self.rate)] {
                let at = |dof: usize| dof + nv * column;
                match self.output {
                    Port::Link(dof) => on_link[at(dof)] += sign * gain,
                    Port::Motor(dof) => {
                        on_motor[at(dof)] += sign * gain;
                        if !layout.is_elastic(dof) {
                            on_link[at(dof)] += sign * gain;
                        }
                    }
                    Port::Spring(dof) => {
                        spring[at(dof)] += sign * gain;
                        on_link[at(dof)] += sign * gain;
                        on_motor[at(dof)] -= sign * gain;
                    }
                }
            }
        }
    }

    // The positions of what it follows, with signs.
    fn columns(&self, layout: &Layout) -> Vec<(usize, f64)> {
        match self.input {
            Port::Motor(dof) => vec![(layout.motor[dof], 1.0)],
            Port::Link(dof) => vec![(layout.link[dof], 1.0)],
            Port::Spring(dof) => vec![(layout.motor[dof], 1.0), (layout.link[dof], -1.0)],
        }
    }
}

/// The effects of `plant` that are not linear over `amplitude` about `x`, by index, with the gains that stand for
/// them.
///
/// ```text
/// N_x = 2/(a T) ∫ f sin ωt dt,   N_ẋ = 2/(a ω T) ∫ f cos ωt dt      over one period, own states swung in
/// ```
///
/// Effects with own states always count as not linear: their slope at rest is that of a stuck bristle.
///
/// Source: Gelb, Vander Velde, *Multiple-Input Describing Functions and Nonlinear System Design*, McGraw-Hill 1968.
pub(crate) fn describe(
    plant: &Plant,
    p: &[f64],
    x: &State<f64>,
    amplitude: Amplitude,
) -> Vec<(usize, Described)> {
    let acts = |k: usize, act: Act| plant.effects()[k].effect.acts().contains(&act);
    let mut found = Vec::new();
    for (k, active) in plant.effects().iter().enumerate() {
        let dofs = match active.effect.site() {
            Site::Dof(dof) => dof..dof + 1,
            _ => 0..plant.model().nv,
        };
        let mut ports = Vec::new();
        for dof in dofs {
            if acts(k, Act::LinkForce) {
                ports.push(Port::Link(dof));
            }
            if acts(k, Act::MotorForce) || acts(k, Act::LoadedMotorForce) {
                ports.push(Port::Motor(dof));
            }
            if plant.elastic()[dof] && (acts(k, Act::Deflection) || acts(k, Act::SpringTorque)) {
                ports.push(Port::Spring(dof));
            }
        }
        let without = |j: usize| j != k;
        let mut plain = Pair {
            with: Dynamics::new(plant, p),
            without: Dynamics::of_some(plant, p, without, without),
            out: ImposedOut::new(plant.model().nv),
        };
        let seeds = constants(p);
        let mut seeded = Pair {
            with: Dynamics::new(plant, &seeds),
            without: Dynamics::of_some(plant, &seeds, without, without),
            out: ImposedOut::new(plant.model().nv),
        };
        let (mut gains, mut linear) = (Vec::new(), active.effect.states() == 0);
        for &port in &ports {
            let swung = plain.swing(k, x, port, amplitude);
            let slopes = seeded.slopes(x, port);
            for (swung, slope) in swung.iter().zip(&slopes) {
                linear &= alike(swung.position, slope.0, swung.peak / amplitude.size);
                let speed = amplitude.size * amplitude.frequency * TAU;
                linear &= alike(swung.rate, slope.1, swung.peak / speed);
                if swung.position != 0.0 || swung.rate != 0.0 {
                    let (position, rate) = (swung.position, swung.rate);
                    gains.push(Gain { input: port, output: swung.output, position, rate });
                }
            }
        }
        if !linear {
            found.push((k, Described { effect: active.label(), gains }));
        }
    }
    found
}

/// Refuses gains behind an elastic gear of a plant whose links follow their load at once: such a force would bend those
/// links too.
pub(crate) fn refuse_beside_followers(
    plant: &Plant,
    found: &[(usize, Described)],
) -> Result<(), LinearError> {
    let follows = |v: &&VirtualJoint| v.following == Following::QuasiStatic;
    let Some(follower) = plant.virtual_joints().iter().find(follows) else { return Ok(()) };
    let behind = |port: Port| match port {
        Port::Motor(_) => false,
        Port::Link(dof) | Port::Spring(dof) => plant.elastic()[dof],
    };
    let bends = |d: &&Described| d.gains.iter().any(|g| behind(g.input) || behind(g.output));
    match found.iter().map(|(_, d)| d).find(bends) {
        None => Ok(()),
        Some(described) => Err(LinearError::BesideFollower {
            effect: described.effect.clone(),
            link: plant.model().links[follower.link.0].name.clone(),
        }),
    }
}

fn alike(swung: f64, slope: f64, size: f64) -> bool {
    let larger = swung.abs().max(slope.abs());
    larger <= NOTHING * size || (swung - slope).abs() <= LINEAR * larger
}

// A plant with and without one effect: the difference is what the effect does.
struct Pair<'a, S> {
    with: Dynamics<'a, S>,
    without: Dynamics<'a, S>,
    out: ImposedOut<S>,
}

// The first harmonic of a force.
struct Harmonic {
    output: Port,
    position: f64,
    rate: f64,
    peak: f64,
}

impl<S: Kind> Pair<'_, S> {
    // Forces of the effect on motors, links and springs at `x`.
    fn forces(&mut self, x: &LinkState<S>, port: Port) -> [Vec<S>; 3] {
        let nv = x.q.len();
        let (still, imposed) = (vec![S::ZERO; nv], vec![true; nv]);
        let mut of = |dynamics: &mut Dynamics<S>| -> [Vec<S>; 3] {
            let out = &mut self.out;
            if let Port::Spring(_) = port {
                dynamics.gear_torque(x, &still, out);
                return [vec![S::ZERO; nv], vec![S::ZERO; nv], out.tau_j.clone()];
            }
            // The load of a joint is that of its links held here.
            let motion = MotorMotion { acceleration: &still, imposed: &imposed, links: None };
            dynamics.imposed_torque(x, motion, out);
            let reaction = |i: usize| out.tau_j[i] * (dynamics.gears()[i].slope + 1.0);
            let motor = (0..nv).map(|i| reaction(i) - out.tau_m[i]).collect();
            [motor, dynamics.link_force().to_vec(), vec![S::ZERO; nv]]
        };
        let (with, without) = (of(&mut self.with), of(&mut self.without));
        let less = |k: usize| with[k].iter().zip(&without[k]).map(|(a, b)| *a - *b).collect();
        [less(0), less(1), less(2)]
    }
}

fn output(place: usize, dof: usize) -> Port {
    [Port::Motor(dof), Port::Link(dof), Port::Spring(dof)][place]
}

// Moves `x` by δx, δẋ along a port.
fn shift<S: Kind>(x: &mut LinkState<S>, port: Port, by: S, rate: S) {
    let (motor, link, dof) = match port {
        // Motor and link move together, so that the spring keeps its torque.
        Port::Motor(dof) | Port::Link(dof) => (true, true, dof),
        Port::Spring(dof) => (true, false, dof),
    };
    if motor {
        x.theta[dof] += by;
        x.thetad[dof] += rate;
    }
    if link {
        x.q[dof] += by;
        x.qd[dof] += rate;
    }
}

impl Pair<'_, f64> {
    fn swing(&mut self, effect: usize, x: &State<f64>, port: Port, amplitude: Amplitude) -> Vec<Harmonic> {
        let (a, w) = (amplitude.size, TAU * amplitude.frequency);
        let own = self.with.plant().own_states(effect);
        let periods = if own.is_empty() { 1 } else { PERIODS };
        let (nv, step) = (x.q.len(), TAU / SAMPLES as f64);
        let mut relaxation = vec![Relaxation::default(); x.z.len()];
        let mut z = x.z.clone();
        let mut harmonics: Vec<Harmonic> = (0..3 * nv)
            .map(|k| Harmonic { output: output(k / nv, k % nv), position: 0.0, rate: 0.0, peak: 0.0 })
            .collect();
        for k in 0..periods * SAMPLES {
            let phase = (k as f64 + 0.5) * step;
            let mut state = x.clone();
            shift(&mut state, port, a * phase.sin(), a * w * phase.cos());
            state.z.clone_from(&z);
            let forces = self.forces(&state, port);
            // z ← target + (z − target) e^(−rate Δt)
            self.with.relaxations_of(&[effect], &state, &mut relaxation);
            for i in own.clone() {
                let Relaxation { target, rate } = relaxation[i];
                z[i] = target + (z[i] - target) * (-rate * step / w).exp();
            }
            if k < (periods - 1) * SAMPLES {
                continue;
            }
            for (harmonic, force) in harmonics.iter_mut().zip(forces.iter().flatten()) {
                harmonic.position += 2.0 / (a * SAMPLES as f64) * force * phase.sin();
                harmonic.rate += 2.0 / (a * w * SAMPLES as f64) * force * phase.cos();
                harmonic.peak = harmonic.peak.max(force.abs());
            }
        }
        for h in &mut harmonics {
            // What the quadrature rounds is no gain.
            h.position = if h.position.abs() * a <= NOTHING * h.peak { 0.0 } else { h.position };
            h.rate = if h.rate.abs() * a * w <= NOTHING * h.peak { 0.0 } else { h.rate };
        }
        harmonics
    }
}

impl Pair<'_, Derivative> {
    // ∂f/∂x and ∂f/∂ẋ, in the order of `swing`.
    fn slopes(&mut self, x: &State<f64>, port: Port) -> Vec<(f64, f64)> {
        let mut state = lift(x);
        shift(&mut state, port, Derivative::variable(0.0, 0), Derivative::variable(0.0, 1));
        let forces = self.forces(&state, port);
        forces.iter().flatten().map(|f| (f.derivative[0], f.derivative[1])).collect()
    }
}
