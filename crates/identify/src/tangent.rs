//! Derivatives of the imposed prediction along a run: one linear system in the state, forced by every parameter.
//!
//! The run is walked once in plain numbers. At every grid step and halfway between two, the equations are linearised
//! about it, along the state by a pass or two of dual numbers and along the parameters by passes in which only the
//! effects concerned are evaluated. The derivatives of the state then follow by the same Runge–Kutta step:
//!
//! ```text
//! δq̈ = A δx + b_p,   x = (q, q̇, z)         δ(τ_m, τ_j) = C δx + d_p
//! ```

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

use sinew_effect::{Act, Actuation, DIRECTIONS, Derivative, Reading, Relaxation, Role, Sensor};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedAt, ImposedOut, LinkState, MotorMotion, Moving, Plant};

use crate::record::{Channel, Record};
use crate::series::Series;
use crate::walk::{Walk, lead, mean, relaxed};

type Row = [f64; DIRECTIONS];

/// Rows of every channel along each of `positions`, one after another.
pub(crate) fn tangent_rows(
    plant: &Plant,
    p: &[f64],
    record: &Record,
    channels: &[Channel],
    imposed: &[bool],
    positions: &[usize],
) -> Vec<Vec<f64>> {
    let mut tangent = Tangent::new(plant, p, record, channels, imposed, positions);
    tangent.run();
    tangent.rows(positions.len())
}

/// Positions in an order in which those that ask for the same work stand together: parameters of forces, of the
/// robot's constants, of its inertias.
pub(crate) fn by_work(plant: &Plant, positions: &[usize]) -> Vec<usize> {
    let work = |&k: &usize| {
        let id = plant.parameter_ids()[positions[k]];
        let effect = plant.effects()[id.effect].effect.as_ref();
        let (constants, gears) =
            (effect.acts().contains(&Act::Coefficients), effect.acts().contains(&Act::Deflection));
        (constants, gears)
    };
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by_key(work);
    order
}

// The instants at which the equations are linearised: both ends of a step and its middle.
const HERE: usize = 0;
const MIDDLE: usize = 1;
const NEXT: usize = 2;

struct Tangent<'a> {
    walk: Walk<'a, f64>,
    at: ImposedAt,
    // The state has no derivative along any of the parameters.
    still: bool,
    // Own states that some present effect feels.
    live: Vec<usize>,
    states: Vec<Pass<'a>>,
    parameters: Vec<Forced<'a>>,
}

// One pass of dual numbers: linearised rows q̈ (free), τ_m, τ_j, targets and rates of the live states.
struct Pass<'a> {
    dynamics: Dynamics<'a, Derivative>,
    x: LinkState<Derivative>,
    encoder: Vec<Reading<Derivative>>,
    moving: Moving,
    // Nothing on the link side has one.
    quiet: bool,
    // Effects whose own states may change.
    remembers: Vec<usize>,
    out: ImposedOut<Derivative>,
    relax: Vec<Relaxation<Derivative>>,
    rows: [Vec<Row>; 3],
}

// A pass along parameters, with the state's derivatives and the series they give.
struct Forced<'a> {
    pass: Pass<'a>,
    // δq, δq̇ (free), δz (live)
    y: Vec<Row>,
    actuation: Vec<Actuation<Derivative>>,
    series: Series<'a, Derivative>,
}

// An effect is present if some strength of it is not zero; an absent one hands nothing on.
fn present(plant: &Plant, p: &[f64], effect: usize) -> bool {
    let parameters = plant.effects()[effect].effect.card().parameters.iter();
    let strengths = parameters.zip(&p[plant.range(effect)]).filter(|(q, _)| q.role == Role::Strength);
    let values: Vec<f64> = strengths.map(|(_, &x)| x).collect();
    values.is_empty() || values.iter().any(|x| *x != 0.0)
}

impl<'a> Tangent<'a> {
    fn new(
        plant: &'a Plant,
        p: &[f64],
        record: &'a Record,
        channels: &'a [Channel],
        imposed: &'a [bool],
        positions: &[usize],
    ) -> Self {
        let nv = plant.model().nv;
        let is_present: Vec<bool> = (0..plant.effects().len()).map(|k| present(plant, p, k)).collect();
        let base = Dynamics::of_some(plant, p, |k| is_present[k], |k| is_present[k]);
        let walk = Walk::new(base, record, imposed);
        let mut live: Vec<usize> =
            (0..is_present.len()).filter(|&k| is_present[k]).flat_map(|k| plant.own_states(k)).collect();
        let constants: Vec<Derivative> = p.iter().map(|&x| Derivative::constant(x)).collect();
        let rows = walk.free.len() + 2 * nv + 2 * live.len();
        let mut along: Vec<usize> = (0..2 * walk.free.len() + live.len()).collect();
        let passes: Vec<Pass> = positions
            .chunks(DIRECTIONS)
            .map(|chunk| Pass::along(plant, &constants, chunk, &is_present, rows))
            .collect();
        let still = passes.iter().all(|pass| pass.quiet && pass.remembers.is_empty());
        if still {
            live.clear();
            along.clear();
        }
        let states = along
            .chunks(DIRECTIONS)
            .map(|directions| {
                let dynamics = Dynamics::of_some(plant, &constants, |k| is_present[k], |k| is_present[k]);
                let mut pass = Pass::new(dynamics, rows);
                pass.moving.state = true;
                pass.remembers = (0..is_present.len()).filter(|&k| is_present[k]).collect();
                for (direction, &state) in directions.iter().enumerate() {
                    let n = walk.free.len();
                    let slot = match state {
                        s if s < n => &mut pass.x.q[walk.free[s]],
                        s if s < 2 * n => &mut pass.x.qd[walk.free[s - n]],
                        s => &mut pass.x.z[live[s - 2 * n]],
                    };
                    slot.derivative[direction] = 1.0;
                }
                pass
            })
            .collect();
        let parameters = passes
            .into_iter()
            .map(|pass| Forced {
                pass,
                y: vec![[0.0; DIRECTIONS]; along.len()],
                actuation: vec![Actuation::default(); nv],
                series: Series::new(channels, nv, record.len()),
            })
            .collect();
        Self { walk, at: ImposedAt::new(plant), still, live, states, parameters }
    }

    fn run(&mut self) {
        let len = self.walk.record.len();
        let [mut here, mut next] = [self.walk.x.clone(), self.walk.x.clone()];
        self.linearise(0, 0.0, HERE);
        self.balance();
        self.store();
        for k in 0..len - 1 {
            copy(&self.walk.x, &mut here);
            copy_motion(&self.at.out, &mut self.walk.out);
            self.walk.step(k);
            if !self.still && !self.walk.free.is_empty() {
                copy(&self.walk.x, &mut next);
                self.go_halfway(k, &here, &next);
                self.linearise(k, 0.5, MIDDLE);
                copy(&next, &mut self.walk.x);
            }
            self.linearise(k + 1, 0.0, NEXT);
            if !self.still {
                self.step(&here.z);
            }
            for pass in self.states.iter_mut().chain(self.parameters.iter_mut().map(|f| &mut f.pass)) {
                pass.rows.swap(HERE, NEXT);
            }
            self.store();
        }
    }

    // The state halfway through a step: the cubic of springs, the exponential of own states.
    fn go_halfway(&mut self, k: usize, here: &LinkState<f64>, next: &LinkState<f64>) {
        let h = self.walk.record.scales.step();
        self.walk.motor_between(k, 0.5, h);
        for &i in &self.walk.free {
            let (q0, q1, v0, v1) = (here.q[i], next.q[i], here.qd[i], next.qd[i]);
            self.walk.x.q[i] = 0.5 * (q0 + q1) + 0.125 * h * (v0 - v1);
            self.walk.x.qd[i] = 1.5 * (q1 - q0) / h - 0.25 * (v0 + v1);
        }
        for (s, z) in self.walk.x.z.iter_mut().enumerate() {
            *z = relaxed(here.z[s], self.walk.relax[0][s], 0.5 * h);
        }
    }

    // Rows of every pass at the walk's state, a share of a step after grid step `k`.
    fn linearise(&mut self, k: usize, share: f64, instant: usize) {
        let Self { walk, at, still, live, states, parameters } = self;
        if share == 0.0 {
            walk.set_motor(k);
        }
        let motor = MotorMotion { acceleration: &walk.acceleration, imposed: walk.imposed };
        if *still {
            walk.dynamics.imposed_torque(&walk.x, motor, &mut at.out);
        } else {
            walk.dynamics.imposed_at(&walk.x, motor, at);
        }
        for pass in states.iter_mut().chain(parameters.iter_mut().map(|f| &mut f.pass)) {
            if share == 0.0 || !pass.quiet {
                pass.linearise(walk, at, live, (k, share), instant);
            }
        }
        if share == 0.0 {
            for forced in parameters {
                forced.pass.dynamics.actuation(&forced.pass.x, &mut forced.actuation);
            }
        }
    }

    // A δx + b of one row.
    fn total(states: &[Pass], forced: &Forced, y: &[Row], row: usize, instant: usize) -> Row {
        let mut sum = forced.pass.rows[instant][row];
        for (s, y) in y.iter().enumerate() {
            let slope = states[s / DIRECTIONS].rows[instant][row][s % DIRECTIONS];
            add(&mut sum, slope, y);
        }
        sum
    }

    // The springs start at rest: A_q δq + b = 0.
    fn balance(&mut self) {
        let n = self.walk.free.len();
        if n == 0 || self.still {
            return;
        }
        let states = &self.states;
        let slope = |i: usize, s: usize| states[s / DIRECTIONS].rows[HERE][i][s % DIRECTIONS];
        let lu = Mat::from_fn(n, n, slope).partial_piv_lu();
        for forced in &mut self.parameters {
            let b = Mat::from_fn(n, DIRECTIONS, |i, d| -forced.pass.rows[HERE][i][d]);
            let x = lu.solve(&b);
            for i in 0..n {
                for d in 0..DIRECTIONS {
                    forced.y[i][d] = x[(i, d)];
                }
            }
        }
    }

    // One Runge–Kutta step of δq, δq̇ and one exponential step of δz, from the rows of three instants.
    fn step(&mut self, z: &[f64]) {
        let Self { walk, live, states, parameters, .. } = self;
        let h = walk.record.scales.step();
        let (n, nv) = (walk.free.len(), walk.imposed.len());
        let target = n + 2 * nv;
        let rate = target + live.len();
        let implicit = implicit_step(states, n, h);
        let mut stage = vec![[0.0; DIRECTIONS]; 2 * n + live.len()];
        let mut slope = vec![[0.0; DIRECTIONS]; 2 * n];
        let mut sum = vec![[0.0; DIRECTIONS]; 2 * n];
        for forced in parameters.iter_mut().filter(|f| !f.pass.quiet || !f.pass.remembers.is_empty()) {
            let here: Vec<[Row; 2]> = (0..live.len())
                .map(|s| [target + s, rate + s].map(|row| Self::total(states, forced, &forced.y, row, HERE)))
                .collect();
            let parts = match implicit {
                Some(_) => [].as_slice(),
                None => &[(0.0, 1.0, HERE), (0.5, 2.0, MIDDLE), (0.5, 2.0, MIDDLE), (1.0, 1.0, NEXT)],
            };
            for (number, (share, weight, instant)) in parts.iter().copied().enumerate() {
                stage.copy_from_slice(&forced.y);
                if number > 0 {
                    for i in 0..2 * n {
                        add(&mut stage[i], share * h, &slope[i]);
                    }
                    for (s, &state) in live.iter().enumerate() {
                        let r = walk.relax[0][state];
                        stage[2 * n + s] =
                            relaxed_change(z[state], r, &forced.y[2 * n + s], &here[s], share * h);
                    }
                }
                for i in 0..n {
                    slope[i] = stage[n + i];
                    slope[n + i] = Self::total(states, forced, &stage, i, instant);
                }
                for i in 0..2 * n {
                    if number == 0 {
                        sum[i] = [0.0; DIRECTIONS];
                    }
                    add(&mut sum[i], weight, &slope[i]);
                }
            }
            if let Some(lu) = &implicit {
                // (1 − h A) y' = y + h b,  own states held
                stage.copy_from_slice(&forced.y);
                stage[..2 * n].fill([0.0; DIRECTIONS]);
                let right = Mat::from_fn(2 * n, DIRECTIONS, |i, d| {
                    let b = if i < n { 0.0 } else { Self::total(states, forced, &stage, i - n, NEXT)[d] };
                    forced.y[i][d] + h * b
                });
                let y = lu.solve(&right);
                for i in 0..2 * n {
                    forced.y[i] = std::array::from_fn(|d| y[(i, d)]);
                }
            } else {
                for i in 0..2 * n {
                    add(&mut forced.y[i], h / 6.0, &sum[i]);
                }
            }
            for (s, &state) in live.iter().enumerate() {
                let next =
                    [target + s, rate + s].map(|row| Self::total(states, forced, &forced.y, row, NEXT));
                let mut middle = [[0.0; DIRECTIONS]; 2];
                for (m, (a, b)) in middle.iter_mut().zip(here[s].iter().zip(&next)) {
                    add(m, 0.5, a);
                    add(m, 0.5, b);
                }
                let r = mean(walk.relax[0][state], walk.relax[1][state]);
                forced.y[2 * n + s] = relaxed_change(z[state], r, &forced.y[2 * n + s], &middle, h);
            }
        }
    }

    // The channels at the grid step reached, whose rows are now HERE.
    fn store(&mut self) {
        let Self { walk, states, parameters, .. } = self;
        let (n, nv) = (walk.free.len(), walk.imposed.len());
        for forced in parameters {
            for i in 0..nv {
                forced.pass.out.tau_m[i].derivative = Self::total(states, forced, &forced.y, n + i, HERE);
                forced.pass.out.tau_j[i].derivative =
                    Self::total(states, forced, &forced.y, n + nv + i, HERE);
            }
            for (&i, y) in walk.free.iter().zip(&forced.y) {
                forced.pass.x.q[i].derivative = *y;
            }
            let Forced { pass, series, actuation, .. } = forced;
            series.store(&pass.dynamics, &pass.x, walk.imposed, &pass.out, actuation);
            // The state of a pass along parameters is a constant again.
            for &i in &walk.free {
                forced.pass.x.q[i].derivative = [0.0; DIRECTIONS];
            }
        }
    }

    fn rows(self, count: usize) -> Vec<Vec<f64>> {
        let (record, step) = (self.walk.record, self.walk.record.scales.step());
        let mut rows = Vec::with_capacity(count);
        for forced in self.parameters {
            let logged = forced.series.logged(&forced.pass.dynamics, step);
            for direction in 0..DIRECTIONS.min(count - rows.len()) {
                let along = |series: &Vec<Derivative>| -> Vec<f64> {
                    record.rows(&series.iter().map(|x| x.derivative[direction]).collect::<Vec<_>>())
                };
                rows.push(logged.iter().flat_map(along).collect());
            }
        }
        rows
    }
}

impl<'a> Pass<'a> {
    fn new(dynamics: Dynamics<'a, Derivative>, rows: usize) -> Self {
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

    // Along the parameters at `positions`: their own effects, and all that are present where they change what others
    // see.
    fn along(
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

    fn linearise(
        &mut self,
        walk: &Walk<f64>,
        at: &ImposedAt,
        live: &[usize],
        (k, share): (usize, f64),
        instant: usize,
    ) {
        for (to, from) in [
            (&mut self.x.q, &walk.x.q),
            (&mut self.x.qd, &walk.x.qd),
            (&mut self.x.theta, &walk.x.theta),
            (&mut self.x.thetad, &walk.x.thetad),
            (&mut self.x.z, &walk.x.z),
        ] {
            to.iter_mut().zip(from).for_each(|(to, from)| to.value = *from);
        }
        let motor = MotorMotion { acceleration: &walk.acceleration, imposed: walk.imposed };
        if self.quiet {
            self.dynamics.steady_gears(at, &mut self.out);
        } else {
            self.dynamics.imposed_derivatives(&self.x, motor, at, &self.moving, &mut self.out);
            lead(walk.record, &walk.free, &self.encoder, &self.x, (k, share), &mut self.out.qdd);
        }
        if share == 0.0 {
            self.dynamics.motor_derivatives(&self.x, motor, at, &mut self.out);
        }
        let nv = walk.imposed.len();
        let rows = &mut self.rows[instant];
        let (springs, torques) = rows.split_at_mut(walk.free.len());
        for (row, &i) in springs.iter_mut().zip(&walk.free) {
            *row = self.out.qdd[i].derivative;
        }
        for i in 0..nv {
            torques[i] = self.out.tau_m[i].derivative;
            torques[nv + i] = self.out.tau_j[i].derivative;
        }
        if !self.remembers.is_empty() && share == 0.0 {
            self.dynamics.relaxations_of(&self.remembers, &self.x, &mut self.relax);
            for (s, &state) in live.iter().enumerate() {
                torques[2 * nv + s] = self.relax[state].target.derivative;
                torques[2 * nv + live.len() + s] = self.relax[state].rate.derivative;
            }
        }
    }
}

fn copy(from: &LinkState<f64>, to: &mut LinkState<f64>) {
    to.q.copy_from_slice(&from.q);
    to.qd.copy_from_slice(&from.qd);
    to.theta.copy_from_slice(&from.theta);
    to.thetad.copy_from_slice(&from.thetad);
    to.z.copy_from_slice(&from.z);
}

fn copy_motion(from: &ImposedOut<f64>, to: &mut ImposedOut<f64>) {
    to.qdd.copy_from_slice(&from.qdd);
    to.tau_j.copy_from_slice(&from.tau_j);
}

// a ← a + s b
#[inline(always)]
fn add(a: &mut Row, s: f64, b: &Row) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += s * b;
    }
}

// 1 − h A of a step in which friction near rest is stiffer than Runge–Kutta bears; none elsewhere.
fn implicit_step(states: &[Pass], n: usize, h: f64) -> Option<PartialPivLu<f64>> {
    let slope = |i: usize, s: usize, instant: usize| states[s / DIRECTIONS].rows[instant][i][s % DIRECTIONS];
    let stiff = |instant: usize| {
        (0..n).any(|i| (n..2 * n).map(|s| slope(i, s, instant).abs()).sum::<f64>() * h > STIFFEST)
    };
    if n == 0 || ![HERE, MIDDLE, NEXT].into_iter().any(stiff) {
        return None;
    }
    let one = |i: usize, j: usize| f64::from(u8::from(i == j));
    let entry = |i: usize, j: usize| {
        let a = if i < n { one(i + n, j) } else { slope(i - n, j, NEXT) };
        one(i, j) - h * a
    };
    Some(Mat::from_fn(2 * n, 2 * n, entry).partial_piv_lu())
}

// h · |∂q̈/∂q̇| that Runge–Kutta bears.
const STIFFEST: f64 = 2.0;

// The derivative of z(h) = target + (z − target) e^(−rate·h), all three of which change.
fn relaxed_change(z: f64, r: Relaxation<f64>, dz: &Row, change: &[Row; 2], h: f64) -> Row {
    let decay = (-r.rate * h).exp();
    let mut sum = [0.0; DIRECTIONS];
    add(&mut sum, decay, dz);
    add(&mut sum, 1.0 - decay, &change[0]);
    add(&mut sum, -h * decay * (z - r.target), &change[1]);
    sum
}

#[cfg(test)]
mod tests {
    use sinew_data::{Quantity, Run, Signal};
    use sinew_effects::CATALOGUE;
    use sinew_model::{EffectSpec, JointSettings, Place, Robot, samples};

    use super::*;
    use crate::Options;
    use crate::comparison::Prepared;
    use crate::imposed::{imposed_dofs, predict};

    fn arm() -> Robot {
        let model = samples::planar_arm(2, 4.0, 0.5);
        let spring = |k: f64, b: f64| JointSettings {
            stiffness: Some(k),
            damping: 0.002 * k,
            rotor_inertia: b,
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
        specs.push(EffectSpec::new("payload", Place::Robot).with("mass", 1.0 * strength));
        specs.push(
            EffectSpec::new("base_tilt", Place::Robot).with("about_x", 0.0).with("about_y", 0.02 * strength),
        );
        specs
    }

    // Difference of a column from the simulation with dual numbers, as a share of that column.
    fn differences(strength: f64) -> Vec<(String, f64)> {
        let robot = arm();
        let runs = [run(&robot)];
        let prepared = Prepared::new(&robot, &runs, &Options::default()).unwrap();
        let record = &prepared.records[0];
        let channels = &prepared.sensors.channels;
        let plant = Plant::with_effects(&robot, &effects(&robot, strength), &CATALOGUE).unwrap();
        let p = plant.parameters();
        let imposed = imposed_dofs(&plant, &p, record);
        assert_eq!(imposed, [false, false]);
        let fitted = |id: &sinew_plant::ParameterId| {
            plant.effects()[id.effect].effect.card().parameters[id.parameter].role != Role::Stated
        };
        let ids: Vec<_> = plant.parameter_ids().into_iter().filter(fitted).collect();
        let positions: Vec<usize> = ids.iter().map(|id| plant.position(*id)).collect();
        let rows = tangent_rows(&plant, &p, record, channels, &imposed, &positions);
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
            let series = predict(&plant, &dual, record, channels, &imposed);
            for (direction, id) in ids.iter().enumerate() {
                let along = |s: &Vec<Derivative>| {
                    record.rows(&s.iter().map(|x| x.derivative[direction]).collect::<Vec<_>>())
                };
                let want = settled(&series.iter().flat_map(along).collect::<Vec<_>>());
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

    // The two middle stages of a step share one linearisation: hysteresis, whose rate turns within a step, shows it.
    #[test]
    fn derivatives_are_those_of_the_simulation_in_dual_numbers() {
        for (label, difference) in differences(1.0) {
            assert!(difference < 2e-2, "{label}: {difference:.1e}");
        }
    }

    #[test]
    fn absent_effects_are_left_out_without_a_change() {
        for (label, difference) in differences(0.0) {
            assert!(difference < 5e-3, "{label}: {difference:.1e}");
        }
    }
}
