//! The predicted channels along a run, from the evaluations at its grid steps.

use sinew_effect::{Actuation, Kind, Reading, Sensor, Wide};
use sinew_model::Scalar;
use sinew_plant::{Dynamics, ImposedOut, LinkState};

use crate::freedom::Freedom;
use crate::record::{Channel, Record};

/// What a plant predicts along a run, grid step by grid step.
pub(crate) struct Predicted<S> {
    /// The channels as their sensors log them.
    pub channels: Vec<Vec<S>>,
    /// The torque that a given link asks for besides, by degree of freedom; empty of others.
    pub links: Vec<Vec<S>>,
}

/// One of the series of a prediction.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Which {
    /// A channel, by its number.
    Channel(usize),
    /// The torque on a given link, by degree of freedom.
    Link(usize),
}

impl<S> Predicted<S> {
    /// A series.
    pub fn series(&self, which: Which) -> &[S] {
        match which {
            Which::Channel(channel) => &self.channels[channel],
            Which::Link(dof) => &self.links[dof],
        }
    }
    /// True if the link of a degree of freedom moves as given.
    pub fn has_links(&self, dof: usize) -> bool {
        self.links.get(dof).is_some_and(|series| !series.is_empty())
    }
}

/// What each channel's sensor would see, before drive and sensor delay it; filled in grid step by grid step.
pub(crate) struct Series<'c, S> {
    channels: &'c [Channel],
    raw: Vec<Vec<S>>,
    // Torque that given links ask for besides, by degree of freedom.
    links: Vec<Vec<S>>,
    actuation: Vec<Actuation<S>>,
    drives: Vec<S>,
    record: &'c Record,
}

impl<'c, S: Kind> Series<'c, S> {
    /// Room for the grid steps of a record of a plant of `nv` degrees of freedom.
    pub fn new(channels: &'c [Channel], nv: usize, record: &'c Record) -> Self {
        Self {
            channels,
            raw: channels.iter().map(|_| Vec::with_capacity(record.len())).collect(),
            links: vec![Vec::new(); record.theta.len()],
            actuation: vec![Actuation::default(); nv],
            drives: vec![S::ZERO; nv],
            record,
        }
    }

    /// The next grid step: state, torques and drives of a plant that was just evaluated.
    ///
    /// û = ((1 + κ)⁻¹ τ_m) / gain + (û − clamp û);   q̂ = q where the spring is simulated, θ + e − τ_j/K ∓ gap where it follows its load
    pub fn store(
        &mut self,
        dynamics: &Dynamics<S>,
        x: &LinkState<S>,
        freedom: &Freedom,
        out: &ImposedOut<S>,
        actuation: &[Actuation<S>],
    ) {
        dynamics.of_drives(&out.tau_m, &mut self.drives);
        for ((raw, channel), logged) in self.raw.iter_mut().zip(self.channels).zip(&self.record.measured) {
            let i = dynamics.plant().joints()[channel.dof];
            raw.push(match channel.sensor {
                Sensor::MotorTorque => {
                    self.drives[i] / actuation[i].gain + actuation[i].excess(logged[raw.len()])
                }
                Sensor::JointTorque => out.tau_j[i],
                Sensor::JointPosition if freedom.imposed[i] && !freedom.given[i] => {
                    let (load, gear) = (out.tau_j[i], dynamics.gears()[i]);
                    let gap = S::select(load.lt(S::ZERO), -gear.half_gap, gear.half_gap);
                    x.theta[i] + gear.shift - dynamics.coefficients().compliance[i] * load - gap
                }
                Sensor::JointPosition => x.q[i],
            });
        }
        for (links, &i) in self.links.iter_mut().zip(dynamics.plant().joints()) {
            if freedom.given[i] {
                links.push(out.tau_l[i]);
            }
        }
        self.actuation.copy_from_slice(actuation);
    }

    /// The torques of the motors as they act, and as their sensors would log them without lag and dead time; empty of other
    /// channels.
    pub fn acting(&self, dynamics: &Dynamics<S>) -> Vec<Vec<S>> {
        let reading = dynamics.reading(Sensor::MotorTorque);
        let of = |(raw, c): (&Vec<S>, &Channel)| {
            if c.sensor != Sensor::MotorTorque {
                return Vec::new();
            }
            let reading = reading[dynamics.plant().joints()[c.dof]];
            raw.iter().map(|x| *x * reading.gain + reading.offset).collect()
        };
        self.raw.iter().zip(self.channels).map(of).collect()
    }

    /// The channels as their sensors log them, on the grid. `dynamics` is that of the same parameters.
    pub fn logged(self, dynamics: &Dynamics<S>, step: f64) -> Predicted<S> {
        let Self { channels, raw, links, actuation, record, .. } = self;
        let of = |((raw, c), measured): ((Vec<S>, &Channel), &Vec<f64>)| {
            let dof = dynamics.plant().joints()[c.dof];
            let is_torque = c.sensor == Sensor::MotorTorque;
            let early = if is_torque { record.scales.early } else { 0.0 };
            if is_torque && record.scales.whole {
                return passed(raw, measured, &actuation[dof], dynamics.reading(c.sensor)[dof], step);
            }
            logged(raw, (c.sensor, dof), &actuation[dof], dynamics, early, step)
        };
        let channels = raw.into_iter().zip(channels).zip(&record.measured).map(of).collect();
        Predicted { channels, links }
    }
}

impl<'c> Series<'c, Wide> {
    /// One lane of several. Delays differ from lane to lane, so each is logged by itself.
    pub fn lane(&self, k: usize) -> Series<'c, f64> {
        let lanes = |all: &Vec<Vec<Wide>>| all.iter().map(|r| r.iter().map(|x| x.0[k]).collect()).collect();
        let (raw, links) = (lanes(&self.raw), lanes(&self.links));
        let drive = |a: &Actuation<Wide>| Actuation {
            gain: a.gain.0[k],
            lag: a.lag.0[k],
            delay: a.delay.0[k],
            limit: a.limit.0[k],
        };
        Series {
            channels: self.channels,
            raw,
            links,
            actuation: self.actuation.iter().map(drive).collect(),
            drives: self.drives.iter().map(|x| x.0[k]).collect(),
            record: self.record,
        }
    }
}

fn logged<S: Kind>(
    raw: Vec<S>,
    (sensor, dof): (Sensor, usize),
    drive: &Actuation<S>,
    dynamics: &Dynamics<S>,
    early: f64,
    step: f64,
) -> Vec<S> {
    // logged torque = u(t + d − a) + T u̇: the inverse of lag and delay, on the noise-free prediction
    let reading = dynamics.reading(sensor)[dof];
    let mut series = match sensor {
        Sensor::MotorTorque => ahead(led(raw, drive.lag, step), drive.delay - reading.delay - early, step),
        _ if reading.delay == S::ZERO => raw,
        _ => shifted(&raw, reading.delay, step),
    };
    for x in &mut series {
        *x = *x * reading.gain + reading.offset;
    }
    series
}

// The logged torque less what of it acts, once the drive has let all of it pass, and is more than the model asks for.
//
// û = u − g (ū − y),   ū what the drive makes of (u − o)/g
fn passed<S: Kind>(
    acting: Vec<S>,
    logged: &[f64],
    drive: &Actuation<S>,
    reading: Reading<S>,
    step: f64,
) -> Vec<S> {
    let told = logged.iter().map(|u| (S::constant(*u) - reading.offset) / reading.gain).collect();
    let through = driven(told, drive, step);
    let of = |((y, through), u): ((S, S), &f64)| S::constant(*u) - reading.gain * (through - y);
    acting.into_iter().zip(through).zip(logged).map(of).collect()
}

/// What of a held logged torque acts in each hold, for a drive with lag and dead time: the inverse of what the channel of a
/// prediction goes through; `acting`: what the model says that acts, smooth; `early`: by how much a logged torque acts before
/// the middle of its hold, s. The log comes late by whole samples, so that
/// its noise is neither averaged nor coloured, which would make every such drive likelier; of the rest the model tells.
///
/// u(t_k − m h) − (û − y),   û(t_k) = y(t) + T ẏ(t),   t = t_k + d − a − m h,   m the whole samples nearest to d + T,   y what acts
pub(crate) fn delivered(
    logged: &[f64],
    acting: &[f64],
    drive: &Actuation<f64>,
    early: f64,
    step: f64,
) -> Vec<f64> {
    let whole = whole_samples(drive, step);
    let rest = drive.delay - early - whole as f64 * step;
    let ahead = ahead(led(acting.to_vec(), drive.lag, step), rest, step);
    let late = |k: usize| logged[k.saturating_sub(whole)];
    ahead.iter().zip(acting).enumerate().map(|(k, (ahead, y))| late(k) - (ahead - y)).collect()
}

/// The whole samples nearest to what a drive delays.
pub(crate) fn whole_samples(drive: &Actuation<f64>, step: f64) -> usize {
    ((drive.delay + drive.lag) / step).round() as usize
}

/// The mean over each hold of what a drive with lag and dead time makes of held torques, exactly.
///
/// ```text
/// v_k = (1 − f) u_{k−m} + f u_{k−m−1},   d = (m + f) h
/// ȳ_k = v_k + (y_k − v_k) (1 − e^(−h/T)) T/h,   y_{k+1} = v_k + (y_k − v_k) e^(−h/T)
/// ```
pub(crate) fn driven<S: Scalar>(logged: Vec<S>, drive: &Actuation<S>, step: f64) -> Vec<S> {
    let whole = (drive.delay.value() / step).floor().max(0.0);
    let share = drive.delay / step - whole;
    let late = |k: usize, by: usize| logged[k.saturating_sub(whole as usize + by)];
    let held = (0..logged.len()).map(|k| late(k, 0) + share * (late(k, 1) - late(k, 0)));
    if drive.lag == S::ZERO {
        return held.collect();
    }
    // A lag that is to begin, too, has a slope.
    let lag = drive.lag + LEAST_LAG * step;
    let decay = (-(lag / step).recip()).exp();
    let mean = (-decay + 1.0) * lag / step;
    let mut y = logged.first().copied().unwrap_or(S::ZERO);
    held.map(|v| {
        let of_hold = v + (y - v) * mean;
        y = v + (y - v) * decay;
        of_hold
    })
    .collect()
}

// Share of a hold.
const LEAST_LAG: f64 = 1e-9;

/// A series as faded as a lag of this time fades it, and no later: one exponential forwards and one backwards, each of T/√2.
///
/// 1/(1 + ω² T²/2)
pub(crate) fn balanced(x: &[f64], time: f64, step: f64) -> Vec<f64> {
    let mut x = x.to_vec();
    if time == 0.0 {
        return x;
    }
    let decay = (-step * std::f64::consts::SQRT_2 / time).exp();
    for _ in 0..2 {
        let mut y = x.first().copied().unwrap_or(0.0);
        for x in &mut x {
            y = *x + (y - *x) * decay;
            *x = y;
        }
        x.reverse();
    }
    x
}

// x + T ẋ, the slope by what was before: what comes after is a controller's answer to the noise of now. The slope from one
// hold to the next is that where they meet, half a hold ago.
//
// h ẋ_k = Δ_k + ½ (Δ_k − Δ_{k−1}),   Δ_k = x_k − x_{k−1}
fn led<S: Scalar>(x: Vec<S>, lag: S, step: f64) -> Vec<S> {
    if lag == S::ZERO {
        return x;
    }
    let change = |k: usize| x[k] - x[k.saturating_sub(1)];
    let slope = |k: usize| change(k) * 1.5 - change(k.saturating_sub(1)) * 0.5;
    (0..x.len()).map(|k| x[k] + lag / step * slope(k)).collect()
}

// x(t + d), by no more of what comes after than it must be.
fn ahead<S: Scalar>(x: Vec<S>, time: S, step: f64) -> Vec<S> {
    if time == S::ZERO {
        return x;
    }
    if time.value() < 0.0 {
        return shifted(&x, -time, step);
    }
    let last = x.len() - 1;
    let whole = (time.value() / step).round();
    // −½ ≤ f ≤ ½ from sample k + whole on
    let f = time / step - whole;
    let at = |k: usize| x[(k + whole as usize).min(last)];
    let before = |k: usize| x[(k + whole as usize).saturating_sub(1).min(last)];
    (0..x.len()).map(|k| at(k) + f * (at(k) - before(k))).collect()
}

// x(t − d) by the cubic through four neighbours
fn shifted<S: Scalar>(x: &[S], delay: S, step: f64) -> Vec<S> {
    let last = x.len() as isize - 1;
    let whole = (delay.value() / step).floor();
    // 0 ≤ f < 1 counts back from sample k − whole
    let f = delay / step - whole;
    let at = |k: isize| x[k.clamp(0, last) as usize];
    (0..x.len() as isize)
        .map(|k| {
            let k = k - whole as isize;
            let (a, b, c, d) = (at(k + 1), at(k), at(k - 1), at(k - 2));
            // Lagrange through f = −1, 0, 1, 2
            let (m, p, g) = (f - 1.0, f + 1.0, f - 2.0);
            -a * (f * m * g) / 6.0 + b * (p * m * g) / 2.0 - c * (p * f * g) / 2.0 + d * (p * f * m) / 6.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // u = sin 2π2t, logged by a drive with d = 3.4 ms, T = 5 ms:  what of it acts is u.
    #[test]
    fn what_acts_is_what_the_log_was_made_of() {
        let step = 1e-3;
        let torque: Vec<f64> =
            (0..2000).map(|k| (4.0 * std::f64::consts::PI * k as f64 * step).sin()).collect();
        let drive = Actuation { delay: 3.4e-3, lag: 5e-3, ..Actuation::default() };
        let logged = shifted(&led(torque.clone(), drive.lag, step), -drive.delay, step);
        let acting = delivered(&logged, &torque, &drive, 0.0, step);
        let off = |x: &[f64]| (100..1900).map(|k| (x[k] - torque[k]).abs()).fold(0.0, f64::max);
        assert!(off(&acting) < 2e-4 && off(&logged) > 0.1, "{} {}", off(&acting), off(&logged));
    }

    // y = t²:  u = t² + 2 T t in the middle of every hold, whatever the step.
    #[test]
    fn the_slope_of_a_lag_is_that_in_the_middle_of_its_hold() {
        let (step, lag) = (4e-3, 5e-3);
        let at = |k: usize| k as f64 * step;
        let led = led((0..10).map(|k| at(k).powi(2)).collect(), lag, step);
        for (k, u) in led.iter().enumerate().skip(2) {
            assert!((u - at(k).powi(2) - 2.0 * lag * at(k)).abs() < 1e-15, "{k}: {u}");
        }
    }

    // What acts is logged 1.5 ms before the middles of the holds.
    #[test]
    fn a_torque_of_a_moment_acts_in_the_middle_of_its_hold() {
        let step = 4e-3;
        let torque = |t: f64| (4.0 * std::f64::consts::PI * t).sin();
        let at = |shift: f64| -> Vec<f64> { (0..500).map(|k| torque(k as f64 * step + shift)).collect() };
        let acting = delivered(&at(-1.5e-3), &at(0.0), &Actuation::default(), 1.5e-3, step);
        let off = |x: &[f64]| (10..490).map(|k| (x[k] - at(0.0)[k]).abs()).fold(0.0, f64::max);
        assert!(off(&acting) < 1e-6 && off(&at(-1.5e-3)) > 0.01, "{}", off(&acting));
    }

    // A step of one that is held from sample 3 on, d = 1.25 h, T = 2 h:  1 − e^(−t/T) from 4.25 h on, its means by hand.
    #[test]
    fn a_drive_lets_through_what_its_law_says() {
        let step = 1e-3;
        let logged: Vec<f64> = (0..40).map(|k| f64::from(u8::from(k >= 3))).collect();
        let late = Actuation { delay: 1.25 * step, ..Actuation::default() };
        assert_eq!(driven(logged.clone(), &late, step)[3..6], [0.0, 0.75, 1.0]);
        let lag = Actuation { lag: 2.0 * step, ..Actuation::default() };
        let through = driven(logged, &lag, step);
        let mean = |k: f64| 1.0 + 2.0 * ((-0.5 * (k + 1.0)).exp() - (-0.5 * k).exp());
        for k in 3..40 {
            assert!((through[k] - mean(k as f64 - 3.0)).abs() < 1e-9, "{k}: {}", through[k]);
        }
    }

    // A sine of ω T = 0.3 is faded by 4 % and comes when it came.
    #[test]
    fn what_is_balanced_comes_no_later() {
        let (step, time, omega) = (1e-4, 5e-3, 60.0);
        let x: Vec<f64> = (0..20_000).map(|k| (omega * k as f64 * step).sin()).collect();
        let faded = balanced(&x, time, step);
        let gain = 1.0 / (1.0 + (omega * time).powi(2) / 2.0);
        for k in 5000..15_000 {
            assert!((faded[k] - gain * x[k]).abs() < 1e-3, "{k}");
        }
        assert_eq!(balanced(&x, 0.0, step), x);
    }

    // Noise is as large after lag and dead time as before, and as white.
    #[test]
    fn a_drive_takes_no_noise_away() {
        let noise: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let drive = Actuation { delay: 3.5e-3, lag: 2e-3, ..Actuation::default() };
        let late = delivered(&noise, &[0.0; 1000], &drive, 0.0, 1e-3);
        assert!(late.iter().all(|x| x.abs() == 1.0) && late[6..] == noise[..994]);
    }
}
