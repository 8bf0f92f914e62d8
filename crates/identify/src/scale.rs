//! Time scales of the method, chosen by the sample rate of the log and whether there are springs.

use sinew_data::{Quantity, Run, Signal, Uniform, resample};
use sinew_model::Robot;
use sinew_rigid::mass_matrix;

use crate::Options;
use crate::record::noise_of;

/// Widths and strides, in parts of a sample period or in steps of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scales {
    /// Sample period of the log, s.
    pub period: f64,
    /// Parts into which a sample period is divided before all else, one in fast logs: springs swing, and joints turn round,
    /// between the samples of a slow one.
    pub parts: usize,
    /// Half width of the smoothing kernel h, parts.
    pub smooth: usize,
    /// Half width of the wider kernel that shows where the sign of a velocity is uncertain, parts.
    pub wide: usize,
    /// Parts a grid step.
    pub stride: usize,
    /// Half width of the residual kernel φ, grid steps.
    pub kernel: usize,
    /// Grid steps a residual row.
    pub every: usize,
    /// True if the logged torque is held until the next sample.
    pub held: bool,
    /// True if an encoder is so coarse that a fast log's motion needs much smoothing.
    pub coarse: bool,
    /// By how much a logged torque acts before the middle of its hold, s: where not every command is logged it is that of a
    /// moment.
    pub early: f64,
    /// True if all of a logged torque passes drives with a lag or a dead time, not what a model foretells of it.
    pub whole: bool,
}

impl Scales {
    /// The scales for runs of one robot: those of the fastest log.
    pub fn of(robot: &Robot, runs: &[Run], options: &Options) -> Self {
        let period = runs.iter().map(Run::period).fold(f64::INFINITY, f64::min);
        let rate = 1.0 / period;
        let reaches = |least: f64| rate > CLOCK * least;
        // The motion is smoothed as little as the encoders allow, since the sign of a smoothed velocity is not the
        // smoothed sign: what is left of the noise is φ's to take away, from measurement and prediction alike.
        let fast = if reaches(200.0) { narrowest(runs, period, &FAST, 2e-4) } else { 0.0 };
        let (kernel, every) = if reaches(500.0) {
            (0.024, 0.016)
        } else if reaches(200.0) {
            (0.050, 0.024)
        } else if reaches(80.0) {
            (0.100, 0.050)
        } else {
            (4.0 * period, 2.0 * period)
        };
        let turn = fastest_turn(robot, period);
        // Springs swing between the samples of a slow log, and rigid joints turn round there.
        let (is_slow, part) = if turn > 0.0 {
            let is_near = turn < MOST_TURN || !reaches(200.0);
            (reaches(SLOWEST_SWING) && !reaches(FASTEST_IN_PARTS) && is_near, PART)
        } else {
            (reaches(80.0) && !reaches(200.0), PART_OF_RIGID)
        };
        let parts = if is_slow { (period / part).ceil() as usize } else { 1 };
        let smooth = if is_slow {
            between_samples(runs, period)
        } else if reaches(500.0) {
            fast
        } else if reaches(200.0) {
            0.016
        } else {
            5.0 * period
        };
        let smooth = options.smoothing.unwrap_or(smooth);
        let samples = |seconds: f64, step: f64| ((seconds / step).round() as usize).max(1);
        let part = period / parts as f64;
        let stride = samples(0.002, part);
        let step = part * stride as f64;
        Self {
            period,
            parts,
            smooth: samples(smooth, part).max(2),
            wide: samples(1.5 * smooth, part).max(4),
            stride,
            kernel: samples(kernel, step).max(2),
            every: samples(every, step),
            held: reaches(400.0),
            coarse: fast > COARSE,
            early: 0.0,
            whole: false,
        }
    }

    /// The same of smoothed channels whose logged torques act so much before the middles of their holds, s. A channel that is
    /// not centred takes a torque for that of its instant, half a sample period before.
    pub fn taking(self, early: f64) -> Self {
        Self { early: early - if self.held { 0.0 } else { 0.5 * self.period }, ..self }
    }

    /// The same in whole samples.
    pub fn of_samples(self) -> Self {
        let whole = |parts: usize, least: usize| parts.div_ceil(self.parts).max(least);
        Self { parts: 1, smooth: whole(self.smooth, 2), wide: whole(self.wide, 4), ..self }
    }

    /// Length of a part of a sample period, s.
    pub fn part(&self) -> f64 {
        self.period / self.parts as f64
    }

    /// Grid step, s.
    pub fn step(&self) -> f64 {
        self.part() * self.stride as f64
    }
}

// Share of a rate that counts as the rate: the stamps of a log are rounded, its clock is not quite that of its joints.
const CLOCK: f64 = 0.99;
// Rates, Hz, from which a log knows of its springs' swinging, and from which its samples are near enough; the longest part of
// a sample period between them, s.
const SLOWEST_SWING: f64 = 15.0;
const FASTEST_IN_PARTS: f64 = 400.0;
const PART: f64 = 0.003;
// The same of rigid robots.
const PART_OF_RIGID: f64 = 0.005;
// Where springs turn by more than this, rad, from one sample to the next, and torques may be held as long, their kinks lie
// between the samples: a log that is fast enough is filtered as held or of moments.
const MOST_TURN: f64 = 0.7;
// Half width of the smoothing, s, that tells a coarse encoder.
const COARSE: f64 = 0.013;
// Half widths tried on logs of 500 Hz and more, which tell coarse encoders from 200 Hz on, s.
const FAST: [f64; 5] = [0.006, 0.008, 0.012, 0.016, 0.024];

// Half widths, sample periods, tried on logs in parts: what swings fast turns the links about by its mean square, of which a wide
// kernel takes away most, and friction turns round within a sample.
const NARROW: [f64; 2] = [1.2, 2.0];
const WIDE: [f64; 4] = [3.0, 5.0, 8.0, 11.0];

fn between_samples(runs: &[Run], period: f64) -> f64 {
    let seconds = |widths: &[f64]| widths.iter().map(|w| w * period).collect::<Vec<_>>();
    let narrow = narrow(runs, period, &seconds(&NARROW), 2e-4);
    narrow.unwrap_or_else(|| narrowest(runs, period, &seconds(&WIDE), 2e-3))
}

// By how much the fastest spring against its own link turns in this time, rad; zero without springs.
fn fastest_turn(robot: &Robot, seconds: f64) -> f64 {
    let mass = mass_matrix(&robot.model, &vec![0.0; robot.model.nv]);
    let of = |(dof, stiffness): (usize, f64)| (stiffness / mass[(dof, dof)].max(1e-12)).sqrt() * seconds;
    let springs = robot.joints.iter().enumerate().filter_map(|(dof, joint)| Some((dof, joint.stiffness?)));
    springs.map(of).fold(0.0, f64::max)
}

// The narrowest half width that keeps the noise of every joint's velocity below a share of its top speed, or else the widest.
fn narrowest(runs: &[Run], period: f64, widths: &[f64], share: f64) -> f64 {
    narrow(runs, period, widths, share).unwrap_or(widths[widths.len() - 1])
}

fn narrow(runs: &[Run], period: f64, widths: &[f64], share: f64) -> Option<f64> {
    let motions: Vec<(f64, f64)> = runs.iter().flat_map(|run| motions(run, period)).collect();
    let quiet = |seconds: &&f64| {
        let w = **seconds / period;
        // σ ‖ḣ‖
        motions.iter().all(|(noise, top)| noise * 1.9 / (w * w.sqrt() * period) <= share * top)
    };
    widths.iter().find(quiet).copied()
}

// Noise and top speed of every joint's position, the motor's where there is one.
fn motions(run: &Run, period: f64) -> Vec<(f64, f64)> {
    let position = |joint: &str| {
        let of = |quantity| run.signal(quantity, joint);
        of(Quantity::MotorPosition).or_else(|| of(Quantity::JointPosition))
    };
    let motion = |signal: &Signal| {
        let even = resample(&run.time, &signal.values, &Uniform::within(&run.time, period));
        let slopes = signal.values.windows(2).zip(run.time.windows(2));
        let top = slopes.map(|(x, t)| ((x[1] - x[0]) / (t[1] - t[0])).abs()).fold(0.0, f64::max);
        (noise_of(signal, &even), top)
    };
    run.joints().into_iter().filter_map(position).map(motion).collect()
}
