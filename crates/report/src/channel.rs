//! One channel of a comparison, all runs together: its residual with what it is drawn against.

use sinew_data::Quantity;
use sinew_identify::{Comparison, SignalError, Trace};
use sinew_model::JointKind;

use crate::ReportInput;
use crate::bins::quantile;

/// The residual of one sensor of one joint, over all runs.
pub(crate) struct Channel {
    pub residual: Vec<f64>,
    pub speed: Vec<f64>,
    pub position: Vec<f64>,
    /// Share of its run that has passed, 0 … 1.
    pub progress: Vec<f64>,
    /// The run of each sample.
    pub run: Vec<usize>,
}

/// The channel that tells most: of the joint where something is missing, if that is known, the one with the largest
/// error as a share of its signal.
pub(crate) fn most_telling<'a>(input: &ReportInput<'a>) -> Option<&'a SignalError> {
    let all = || input.before.signals.iter();
    let joint = input.diagnosis.accepted.iter().map(|a| &a.place).find(|p| all().any(|s| s.joint == **p));
    let share = |s: &&SignalError| s.rms_error / s.rms_measured.max(f64::MIN_POSITIVE);
    let eligible = all().filter(|s| joint.is_none_or(|j| s.joint == *j));
    eligible.max_by(|a, b| share(a).total_cmp(&share(b)))
}

/// The traces of one channel, in the order of the runs.
pub(crate) fn traces<'a>(comparison: &'a Comparison, of: &SignalError) -> Vec<&'a Trace> {
    comparison.traces.iter().filter(|t| t.signal == of.signal && t.joint == of.joint).collect()
}

/// The unit of a joint's position: rad, or m if it slides.
pub(crate) fn position_unit(input: &ReportInput, joint: &str) -> &'static str {
    let model = &input.robot.model;
    let kind = model.joint(joint).map(|j| &model.joints[j.0].kind);
    let sliding = matches!(kind, Some(JointKind::Prismatic { .. }));
    Quantity::MotorPosition.unit(sliding)
}

impl Channel {
    /// Gathers the channel from every run.
    pub fn of(comparison: &Comparison, signal: &SignalError) -> Self {
        let mut channel = Self {
            residual: Vec::new(),
            speed: Vec::new(),
            position: Vec::new(),
            progress: Vec::new(),
            run: Vec::new(),
        };
        for (k, trace) in traces(comparison, signal).into_iter().enumerate() {
            let n = trace.time.len();
            channel.residual.extend(residual(trace));
            channel.speed.extend(&trace.speed);
            channel.position.extend(&trace.position);
            channel.progress.extend((0..n).map(|i| i as f64 / n as f64));
            channel.run.resize(channel.residual.len(), k);
        }
        channel
    }

    /// The residual where `take` holds, as root mean square; none for fewer than 20 samples.
    pub fn rms_where(&self, take: impl Fn(usize) -> bool) -> Option<f64> {
        let squares: Vec<f64> =
            (0..self.residual.len()).filter(|k| take(*k)).map(|k| self.residual[k].powi(2)).collect();
        (squares.len() >= 20).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }
}

/// Measured minus predicted.
pub(crate) fn residual(trace: &Trace) -> Vec<f64> {
    trace.measured.iter().zip(&trace.predicted).map(|(m, p)| m - p).collect()
}

/// Symmetric limits that hold all but one per cent of the values.
pub(crate) fn limits<'a>(sets: impl IntoIterator<Item = &'a [f64]>) -> (f64, f64) {
    let edge = |values: &[f64]| {
        let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        quantile(&sizes, 0.99)
    };
    let size = sets.into_iter().map(edge).fold(0.0, f64::max).max(1e-12) * 1.15;
    (-size, size)
}

/// The smallest and the largest value.
pub(crate) fn extent(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)))
}
