//! Rows of a run: predicted and measured signals through the deviation filters of its joints.

use sinew_effect::{DIRECTIONS, Derivative};

use super::filter::Filters;
use super::motion::{Even, Motion, at_sample, in_hold};
use crate::series::Predicted;

/// The frozen filters of a run, and the channels that they take in and give out: the innovation of a motor stands in the
/// place of its torque, that of a link in the place of its position.
#[derive(Debug, Clone)]
pub(crate) struct Innovations {
    pub(super) filters: Filters,
    /// By joint of the filters.
    pub(super) joints: Vec<JointChannels>,
    pub(super) channels: usize,
}

impl Innovations {
    /// Rows of what is predicted at the middles of the holds; channel after channel.
    pub fn rows(&self, predicted: &Predicted<f64>) -> Vec<f64> {
        let sets = self.through(predicted, |series, k| [series[k]]);
        sets.into_iter().flatten().map(|[x]| x).collect()
    }

    /// The same of derivatives, given there or at every second sample, for the first `count` directions.
    pub fn rows_along(
        &self,
        predicted: &Predicted<Derivative>,
        count: usize,
        thinned: bool,
    ) -> Vec<Vec<f64>> {
        let between = |series: &[Derivative], k| in_hold(series.len(), k, |m| series[m].derivative);
        let sets = if thinned {
            self.through(predicted, between)
        } else {
            self.through(predicted, |series, k| series[k].derivative)
        };
        let sets: Vec<[f64; DIRECTIONS]> = sets.into_iter().flatten().collect();
        (0..count.min(DIRECTIONS)).map(|d| sets.iter().map(|row| row[d]).collect()).collect()
    }

    // `of` takes from a series in the middle of a hold.
    fn through<S, const W: usize>(
        &self,
        predicted: &Predicted<S>,
        of: impl Fn(&[S], usize) -> [f64; W],
    ) -> Vec<Vec<[f64; W]>> {
        let Predicted { channels, links } = predicted;
        let holds = self.filters.system.len();
        let input = |joint: usize, k: usize| {
            let JointChannels { dof, torque, position } = self.joints[joint];
            let on_link = links.get(dof).filter(|series| !series.is_empty());
            let torques = [of(&channels[torque], k), on_link.map_or([0.0; W], |series| of(series, k))];
            let link = position.map_or([0.0; W], |c| at_sample(holds, k, |hold| of(&channels[c], hold)));
            [torques, [[0.0; W], link]]
        };
        self.by_channel(self.filters.rows(input))
    }

    /// Rows of what was measured along a reference; `means`: what the mean torque of a hold differs from that in its
    /// middle.
    pub(super) fn measured(&self, even: &Even, motion: &Motion, means: &[Vec<f64>]) -> Vec<f64> {
        let input = |joint: usize, k: usize| {
            let [torque, motor, link] = deviation_inputs(even, motion, means, self.joints[joint], k);
            [[[torque], [0.0]], [[motor], [link]]]
        };
        let rows = self.by_channel(self.filters.rows(input));
        rows.into_iter().flatten().map(|[x]| x).collect()
    }

    /// Rows of a channel that each of several torques along the run would give: on the motor in the rows of the motor, on
    /// the link in those of the link.
    pub fn of_torques(&self, channel: usize, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let is = |j: &JointChannels| j.torque == channel || j.position == Some(channel);
        let Some(joint) = self.joints.iter().position(is) else { return vec![Vec::new(); series.len()] };
        let of_motor = self.joints[joint].torque == channel;
        let mut out = Vec::with_capacity(series.len());
        for part in series.chunks(DIRECTIONS) {
            let torques = |k: usize| {
                let sets = std::array::from_fn(|w| part.get(w).map_or(0.0, |s| s[k]));
                if of_motor { [sets, [0.0; DIRECTIONS]] } else { [[0.0; DIRECTIONS], sets] }
            };
            let [motor, link]: [Vec<[f64; DIRECTIONS]>; 2] = self.filters.rows_alone(joint, torques);
            let rows = if of_motor { motor } else { link };
            out.extend((0..part.len()).map(|w| rows.iter().map(|row| row[w]).collect()));
        }
        out
    }

    fn by_channel<const W: usize>(&self, rows: Vec<[Vec<[f64; W]>; 2]>) -> Vec<Vec<[f64; W]>> {
        let mut out = vec![Vec::new(); self.channels];
        for (joint, [motor, link]) in self.joints.iter().zip(rows) {
            out[joint.torque] = motor;
            if let Some(c) = joint.position {
                out[c] = link;
            }
        }
        out
    }
}

/// A joint with its channels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointChannels {
    pub dof: usize,
    pub torque: usize,
    pub position: Option<usize>,
}

/// Torque in the middle of the hold, motor and link position as measured, seen from the reference; the link's with the
/// same error of interpolation between holds that a prediction has.
pub(super) fn deviation_inputs(
    even: &Even,
    motion: &Motion,
    means: &[Vec<f64>],
    joint: JointChannels,
    k: usize,
) -> [f64; 3] {
    let JointChannels { dof, torque, position } = joint;
    let theta = motion.theta[dof][k];
    let link = position.map_or(0.0, |c| {
        let holds = motion.theta[dof].len() - 1;
        let [between] = at_sample(holds, k, |hold| [motion.middle(dof, hold, even.scales.period)]);
        even.link[c][k] + between - theta
    });
    [even.torque[torque][k] - means[dof][k], even.theta[dof][k] - theta, link]
}
