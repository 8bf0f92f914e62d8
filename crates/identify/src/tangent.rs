//! Derivatives of the imposed prediction along a run: one linear system in the state, forced by every parameter.
//!
//! The run is walked once in plain numbers. At every grid step and halfway between two, the equations are linearised
//! about it, along the state by a pass or two of dual numbers and along the parameters by passes in which only the
//! effects concerned are evaluated. The derivatives of the state then follow by the same Runge–Kutta step:
//!
//! ```text
//! δq̈ = A δx + b_p,   x = (q, q̇, z)         δ(τ_m, τ_j, τ_l) = C δx + d_p
//! ```

mod pass;

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

use sinew_effect::{Act, Actuation, DIRECTIONS, Derivative, Relaxation, Role};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedAt, ImposedOut, LinkState, Plant};

use crate::freedom::Freedom;
use crate::least_squares::add;
use crate::record::{Channel, Record};
use crate::series::Series;
use crate::walk::{Walk, mean, relaxed};
use pass::{HERE, MIDDLE, NEXT, Pass, Row};

/// Rows of every channel along each of `positions`, one after another.
pub(crate) fn tangent_rows(
    plant: &Plant,
    p: &[f64],
    record: &Record,
    channels: &[Channel],
    freedom: &Freedom,
    positions: &[usize],
) -> Vec<Vec<f64>> {
    let mut tangent = Tangent::new(plant, p, record, channels, freedom, positions);
    tangent.run();
    tangent.rows(positions.len())
}

/// An order of `positions` in which those that ask for the same work stand together: parameters of forces, of gears, of
/// the robot's constants.
pub(crate) fn by_work(plant: &Plant, positions: &[usize]) -> Vec<usize> {
    let ids = plant.parameter_ids();
    let work = |&k: &usize| {
        let acts = plant.effects()[ids[positions[k]].effect].effect.acts();
        (acts.contains(&Act::Coefficients), acts.contains(&Act::Deflection))
    };
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by_key(work);
    order
}

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
    let strengths = parameters
        .zip(&p[plant.range(effect)])
        .filter(|(q, _)| matches!(q.role, Role::Strength | Role::Optional));
    let values: Vec<f64> = strengths.map(|(_, &x)| x).collect();
    values.is_empty() || values.iter().any(|x| *x != 0.0)
}

impl<'a> Tangent<'a> {
    fn new(
        plant: &'a Plant,
        p: &[f64],
        record: &'a Record,
        channels: &'a [Channel],
        freedom: &'a Freedom,
        positions: &[usize],
    ) -> Self {
        let nv = plant.model().nv;
        let is_present: Vec<bool> = (0..plant.effects().len()).map(|k| present(plant, p, k)).collect();
        let base = Dynamics::of_some(plant, p, |k| is_present[k], |k| is_present[k]);
        let walk = Walk::new(base, record, freedom);
        let mut live: Vec<usize> =
            (0..is_present.len()).filter(|&k| is_present[k]).flat_map(|k| plant.own_states(k)).collect();
        let constants: Vec<Derivative> = p.iter().map(|&x| Derivative::constant(x)).collect();
        let rows = walk.free.len() + 3 * nv + 2 * live.len();
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
                series: Series::new(channels, nv, record),
            })
            .collect();
        Self { walk, at: ImposedAt::new(plant), still, live, states, parameters }
    }

    fn run(&mut self) {
        let len = self.walk.record.len();
        let [mut here, mut next] = [self.walk.x.clone(), self.walk.x.clone()];
        let parts = self.walk.freedom.parts;
        self.linearise(0, 0.0, HERE);
        self.balance();
        self.store();
        for k in 0..len - 1 {
            for part in 0..parts {
                copy(&self.walk.x, &mut here);
                copy_motion(&self.at.out, &mut self.walk.out);
                self.walk.part(k, part);
                let share = |of_part: f64| (part as f64 + of_part) / parts as f64;
                if !self.still && !self.walk.free.is_empty() {
                    copy(&self.walk.x, &mut next);
                    self.go_halfway(k, share(0.5), &here, &next);
                    self.linearise(k, share(0.5), MIDDLE);
                    copy(&next, &mut self.walk.x);
                }
                self.linearise(k, share(1.0), NEXT);
                if !self.still {
                    self.step(&here.z);
                }
                for pass in self.states.iter_mut().chain(self.parameters.iter_mut().map(|f| &mut f.pass)) {
                    pass.rows.swap(HERE, NEXT);
                }
            }
            self.store();
        }
    }

    // The time of a part of a step.
    fn part_time(&self) -> f64 {
        self.walk.record.scales.step() / self.walk.freedom.parts as f64
    }

    // The state halfway through a part of a step: the cubic of springs, the exponential of own states.
    fn go_halfway(&mut self, k: usize, share: f64, here: &LinkState<f64>, next: &LinkState<f64>) {
        let h = self.part_time();
        self.walk.motor_between(k, share);
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
        let is_end = instant != MIDDLE;
        if is_end {
            walk.motor_between(k, share);
        }
        let motor = walk.freedom.motion(&walk.acceleration, &walk.link_acceleration);
        if *still {
            walk.dynamics.imposed_torque(&walk.x, motor, &mut at.out);
        } else {
            walk.dynamics.imposed_at(&walk.x, motor, at);
        }
        for pass in states.iter_mut().chain(parameters.iter_mut().map(|f| &mut f.pass)) {
            if is_end || !pass.quiet {
                pass.linearise(walk, at, live, (k, share), instant);
            }
        }
        if is_end {
            for forced in parameters {
                forced.pass.dynamics.actuation(&forced.pass.x, &mut forced.actuation);
            }
        }
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

    // One step of δq, δq̇ and δz, from the rows of three instants; z: the own states at its start.
    fn step(&mut self, z: &[f64]) {
        let h = self.part_time();
        let Self { walk, live, states, parameters, .. } = self;
        let n = walk.free.len();
        let target = n + 3 * walk.acceleration.len();
        let implicit = implicit_step(states, n, h);
        for forced in parameters.iter_mut().filter(|f| !f.pass.quiet || !f.pass.remembers.is_empty()) {
            let changes = |forced: &Forced, instant: usize| -> Vec<[Row; 2]> {
                let of = |s: usize| {
                    [target + s, target + live.len() + s]
                        .map(|row| total(states, forced, &forced.y, row, instant))
                };
                (0..live.len()).map(of).collect()
            };
            let here = changes(forced, HERE);
            let relaxed_by = |share: f64, s: usize, y: &Row| {
                let state = live[s];
                relaxed_change(z[state], walk.relax[0][state], y, &here[s], share * h)
            };
            match &implicit {
                Some(lu) => implicit_springs(lu, states, forced, n, h),
                None => runge_kutta(states, forced, n, h, relaxed_by),
            }
            let next = changes(forced, NEXT);
            for (s, &state) in live.iter().enumerate() {
                let mut middle = [[0.0; DIRECTIONS]; 2];
                for (m, (a, b)) in middle.iter_mut().zip(here[s].iter().zip(&next[s])) {
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
        let (n, nv) = (walk.free.len(), walk.acceleration.len());
        for forced in parameters {
            for i in 0..nv {
                forced.pass.out.tau_m[i].derivative = total(states, forced, &forced.y, n + i, HERE);
                forced.pass.out.tau_j[i].derivative = total(states, forced, &forced.y, n + nv + i, HERE);
                forced.pass.out.tau_l[i].derivative = total(states, forced, &forced.y, n + 2 * nv + i, HERE);
            }
            for (&i, y) in walk.free.iter().zip(&forced.y) {
                forced.pass.x.q[i].derivative = *y;
            }
            let Forced { pass, series, actuation, .. } = forced;
            series.store(&pass.dynamics, &pass.x, walk.freedom, &pass.out, actuation);
            // The state of a pass along parameters is a constant again.
            for &i in &walk.free {
                forced.pass.x.q[i].derivative = [0.0; DIRECTIONS];
            }
        }
    }

    fn rows(self, count: usize) -> Vec<Vec<f64>> {
        let (record, step) = (self.walk.record, self.walk.record.scales.step());
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(count);
        for forced in self.parameters {
            let logged = forced.series.logged(&forced.pass.dynamics, step);
            rows.extend(record.channel_rows_along(&logged, count - rows.len()));
        }
        rows
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

// δq and δq̇ by Runge–Kutta; `relaxed` is δz a share of the step after its start.
fn runge_kutta(
    states: &[Pass],
    forced: &mut Forced,
    n: usize,
    h: f64,
    relaxed: impl Fn(f64, usize, &Row) -> Row,
) {
    let mut stage = forced.y.clone();
    let mut slope = vec![[0.0; DIRECTIONS]; 2 * n];
    let mut sum = slope.clone();
    for (share, weight, instant) in
        [(0.0, 1.0, HERE), (0.5, 2.0, MIDDLE), (0.5, 2.0, MIDDLE), (1.0, 1.0, NEXT)]
    {
        stage.copy_from_slice(&forced.y);
        for i in 0..2 * n {
            add(&mut stage[i], share * h, &slope[i]);
        }
        for s in 2 * n..stage.len() {
            stage[s] = relaxed(share, s - 2 * n, &forced.y[s]);
        }
        for i in 0..n {
            slope[i] = stage[n + i];
            slope[n + i] = total(states, forced, &stage, i, instant);
        }
        for i in 0..2 * n {
            add(&mut sum[i], weight, &slope[i]);
        }
    }
    for i in 0..2 * n {
        add(&mut forced.y[i], h / 6.0, &sum[i]);
    }
}

// (1 − h A) y' = y + h b,  own states held
fn implicit_springs(lu: &PartialPivLu<f64>, states: &[Pass], forced: &mut Forced, n: usize, h: f64) {
    let mut held = forced.y.clone();
    held[..2 * n].fill([0.0; DIRECTIONS]);
    let right = Mat::from_fn(2 * n, DIRECTIONS, |i, d| {
        let b = if i < n { 0.0 } else { total(states, forced, &held, i - n, NEXT)[d] };
        forced.y[i][d] + h * b
    });
    let y = lu.solve(&right);
    for i in 0..2 * n {
        forced.y[i] = std::array::from_fn(|d| y[(i, d)]);
    }
}

fn copy(from: &LinkState<f64>, to: &mut LinkState<f64>) {
    to.q.copy_from_slice(&from.q);
    to.qd.copy_from_slice(&from.qd);
    to.theta.copy_from_slice(&from.theta);
    to.thetad.copy_from_slice(&from.thetad);
    to.thetad_sweep.copy_from_slice(&from.thetad_sweep);
    to.qd_sweep.copy_from_slice(&from.qd_sweep);
    to.temperature.copy_from_slice(&from.temperature);
    to.z.copy_from_slice(&from.z);
}

fn copy_motion(from: &ImposedOut<f64>, to: &mut ImposedOut<f64>) {
    to.qdd.copy_from_slice(&from.qdd);
    to.tau_j.copy_from_slice(&from.tau_j);
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
mod tests;
