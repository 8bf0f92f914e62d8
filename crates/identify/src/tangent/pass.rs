//! One pass of dual numbers: the equations linearised along up to eight directions, at an instant of the walk.

use sinew_effect::{Act, DIRECTIONS, Derivative, Reading, Relaxation, Sensor};
use sinew_plant::{Dynamics, ImposedAt, ImposedOut, LinkState, Moving, Plant};

use crate::walk::{Walk, lead};

/// Derivatives of one number along the directions of a pass.
pub(super) type Row = [f64; DIRECTIONS];

/// The instants at which the equations are linearised: both ends of a step and its middle.
pub(super) const HERE: usize = 0;
pub(super) const MIDDLE: usize = 1;
pub(super) const NEXT: usize = 2;

/// Linearised rows: q̈ (free), τ_m, τ_j, τ_l, targets and rates of the live states.
pub(super) struct Pass<'a> {
    pub dynamics: Dynamics<'a, Derivative>,
    pub x: LinkState<Derivative>,
    encoder: Vec<Reading<Derivative>>,
    pub moving: Moving,
    /// True if nothing on the link side has a derivative.
    pub quiet: bool,
    /// Effects whose own states may change.
    pub remembers: Vec<usize>,
    pub out: ImposedOut<Derivative>,
    relax: Vec<Relaxation<Derivative>>,
    pub rows: [Vec<Row>; 3],
}

impl<'a> Pass<'a> {
    /// A pass that has no direction yet.
    pub fn new(dynamics: Dynamics<'a, Derivative>, rows: usize) -> Self {
        let plant = dynamics.plant();
        Self {
            x: LinkState::zero(plant),
            encoder: dynamics.reading(Sensor::JointPosition),
            moving: Moving { state: false, inertial: Vec::new() },
            quiet: false,
            remembers: Vec::new(),
            out: ImposedOut::new(plant.model().nv),
            relax: vec![Relaxation::default(); plant.state_len()],
            rows: std::array::from_fn(|_| vec![[0.0; DIRECTIONS]; rows]),
            dynamics,
        }
    }

    /// A pass along the parameters at `positions`: their own effects, and all that are present where they change what
    /// others see.
    pub fn along(
        plant: &'a Plant,
        constants: &[Derivative],
        positions: &[usize],
        is_present: &[bool],
        rows: usize,
    ) -> Self {
        let mut p = constants.to_vec();
        let mut own = vec![false; is_present.len()];
        for (direction, &position) in positions.iter().enumerate() {
            p[position].derivative[direction] = 1.0;
            let effect = (0..own.len()).find(|&k| plant.range(k).contains(&position));
            own[effect.expect("every parameter belongs to an effect")] = true;
        }
        let acts = |k: usize, act| plant.effects()[k].effect.acts().contains(&act);
        let gears = (0..own.len()).any(|k| own[k] && acts(k, Act::Deflection));
        let constants_of = Dynamics::new(plant, &p);
        let c = constants_of.coefficients();
        let changes = |x: &Derivative| x.derivative.iter().any(|d| *d != 0.0);
        let seen = [&c.compliance, &c.damping, &c.coulomb, &c.smoothing_velocity];
        let seen = seen.iter().any(|list| list.iter().any(changes));
        let moving = Moving::of(c);
        let asked = |k: usize| own[k] || (is_present[k] && (gears || seen));
        let dynamics = Dynamics::of_some(
            plant,
            &p,
            |k| own[k] || is_present[k],
            |k| {
                // The load on a motor changes with everything but the motor's own forces.
                asked(k) || (is_present[k] && acts(k, Act::LoadedMotorForce))
            },
        );
        let motors_only = |k: usize| {
            let of_motors = [Act::MotorForce, Act::LoadedMotorForce, Act::Actuation];
            plant.effects()[k].effect.acts().iter().all(|act| of_motors.contains(act))
        };
        let quiet = moving.is_still() && !seen && (0..own.len()).all(|k| !own[k] || motors_only(k));
        let remembers = (0..own.len()).filter(|&k| is_present[k] && asked(k)).collect();
        Self { moving, quiet, remembers, ..Self::new(dynamics, rows) }
    }

    /// Fills the rows of one instant at the walk's state, a share of a step after grid step `k`.
    pub fn linearise(
        &mut self,
        walk: &Walk<f64>,
        at: &ImposedAt,
        live: &[usize],
        (k, share): (usize, f64),
        instant: usize,
    ) {
        self.x.set_values(&walk.x);
        let motor = walk.freedom.motion(&walk.acceleration, &walk.link_acceleration);
        if self.quiet {
            self.dynamics.steady_gears(at, &mut self.out);
        } else {
            self.dynamics.imposed_derivatives(&self.x, motor, at, &self.moving, &mut self.out);
        }
        if instant != MIDDLE {
            self.dynamics.motor_derivatives(&self.x, motor, at, &mut self.out);
        }
        if !self.quiet {
            lead(walk.record, walk.freedom, &self.encoder, &self.x, (k, share), &mut self.out.qdd);
        }
        let nv = walk.acceleration.len();
        let rows = &mut self.rows[instant];
        let (springs, torques) = rows.split_at_mut(walk.free.len());
        for (row, &i) in springs.iter_mut().zip(&walk.free) {
            *row = self.out.qdd[i].derivative;
        }
        for i in 0..nv {
            torques[i] = self.out.tau_m[i].derivative;
            torques[nv + i] = self.out.tau_j[i].derivative;
            torques[2 * nv + i] = self.out.tau_l[i].derivative;
        }
        if !self.remembers.is_empty() && instant != MIDDLE {
            self.dynamics.relaxations_of(&self.remembers, &self.x, &mut self.relax);
            for (s, &state) in live.iter().enumerate() {
                torques[3 * nv + s] = self.relax[state].target.derivative;
                torques[3 * nv + live.len() + s] = self.relax[state].rate.derivative;
            }
        }
    }
}
