//! Rows of a run: predicted and measured signals through the deviation filters of its joints.

use std::ops::Range;

use sinew_effect::{DIRECTIONS, Derivative, LANES};

use super::filter::{Filters, Inputs, SensorRows, one_by_one};
use super::held::Held;
use super::motion::{Even, Motion, at_sample, holds_around, in_hold, met, met_around};
use super::system::{GEAR, SENSORS};
use crate::least_squares::add;
use crate::series::{Predicted, Which};

/// The frozen filters of a run, and the channels that they take in and give out: the innovation of a motor's position stands
/// in the place of its torque, those of a link's position and of a torque behind the gear in their own.
#[derive(Debug, Clone)]
pub(crate) struct Innovations {
    pub(super) filters: Filters,
    /// By joint of the filters; hinges, which have none, stand behind.
    pub(super) joints: Vec<JointChannels>,
    pub(super) channels: usize,
    /// Samples by which what is behind the gears is read late, by degree of freedom.
    pub(super) late: Vec<[isize; 2]>,
    /// How the logged torque of a motor comes to act, by degree of freedom.
    pub(super) arrivals: Vec<Arrival>,
    /// True if a prediction of a motor's torque has what was logged in it, hold by hold.
    pub(super) is_whole: bool,
}

/// How a logged torque comes to act.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// Whole samples by which it comes late.
    pub late: usize,
    /// True if it steps from hold to hold as it was logged; behind a lag it does not.
    pub is_held: bool,
}

impl Arrival {
    /// A series of holds where hold k begins.
    pub fn begun<const W: usize>(&self, holds: usize, k: usize, of: impl Fn(usize) -> [f64; W]) -> [f64; W] {
        if self.is_held { of(k) } else { at_sample(holds, k, of) }
    }
}

impl Innovations {
    /// Rows of what is predicted at the middles of the holds; channel after channel.
    pub fn rows(&self, predicted: &Predicted<f64>) -> Vec<f64> {
        let fetch = |which: Which, range: Range<usize>, out: &mut Vec<[f64; 1]>| {
            out.extend(predicted.series(which)[range].iter().map(|x| [*x]));
        };
        let sets = self.through(|dof| predicted.has_links(dof), false, fetch);
        sets.into_iter().flatten().map(|[x]| x).collect()
    }

    /// The same of several predictions of one walk, given there or at every second sample.
    pub fn rows_of_each(&self, predicted: &[Predicted<f64>], thinned: bool) -> Vec<Vec<f64>> {
        match predicted {
            [one] if !thinned => vec![self.rows(one)],
            _ => predicted.chunks(LANES).flat_map(|sets| self.rows_of_few(sets, thinned)).collect(),
        }
    }

    fn rows_of_few(&self, sets: &[Predicted<f64>], thinned: bool) -> Vec<Vec<f64>> {
        let last = sets.len() - 1;
        let fetch = |which: Which, range: Range<usize>, out: &mut Vec<[f64; LANES]>| {
            let series: [&[f64]; LANES] =
                std::array::from_fn(|w| &sets[w.min(last)].series(which)[range.clone()]);
            out.extend((0..range.len()).map(|k| series.map(|s| s[k])));
        };
        let has_links = |dof| sets[0].has_links(dof);
        turned(&self.through(has_links, thinned, fetch), sets.len())
    }

    /// The same of derivatives, given there or at every second sample, for the first `count` directions.
    pub fn rows_along(
        &self,
        predicted: &Predicted<Derivative>,
        count: usize,
        thinned: bool,
    ) -> Vec<Vec<f64>> {
        let fetch = |which: Which, range: Range<usize>, out: &mut Vec<[f64; DIRECTIONS]>| {
            out.extend(predicted.series(which)[range].iter().map(|x| x.derivative));
        };
        let has_links = |dof| predicted.has_links(dof);
        turned(&self.through(has_links, thinned, fetch), count.min(DIRECTIONS))
    }

    // `fetch` appends part of a series, given in the middles of the holds or at every second sample.
    fn through<const W: usize>(
        &self,
        has_links: impl Fn(usize) -> bool,
        thinned: bool,
        fetch: impl Fn(Which, Range<usize>, &mut Vec<[f64; W]>),
    ) -> Vec<Vec<[f64; W]>> {
        let holds = self.filters.system.len();
        let on_link: Vec<bool> = self.joints.iter().map(|j| has_links(j.dof)).collect();
        let (mut part, mut samples) = (Vec::new(), Vec::new());
        // The series in the middles of these holds.
        let mut in_holds = move |which: Which, range: Range<usize>, part: &mut Vec<[f64; W]>| {
            part.clear();
            if !thinned {
                return fetch(which, range, part);
            }
            samples.clear();
            let reach = met_around(range.clone(), holds);
            fetch(which, reach.clone(), &mut samples);
            part.extend(range.map(|k| in_hold(met(holds), k, |m| samples[m - reach.start])));
        };
        let fill = |joint: usize, first: usize, inputs: &mut [Inputs<W>]| {
            let Some(&JointChannels { dof, torque, position, gear, .. }) = self.joints.get(joint) else {
                return;
            };
            let range = first..first + inputs.len();
            in_holds(Which::Channel(torque), range.clone(), &mut part);
            inputs.iter_mut().zip(&part).for_each(|((torques, _), x)| torques[0] = *x);
            if on_link[joint] {
                in_holds(Which::Link(dof), range.clone(), &mut part);
                inputs.iter_mut().zip(&part).for_each(|((torques, _), x)| torques[1] = *x);
            }
            for (sensor, (channel, late)) in [position, gear].into_iter().zip(self.late[dof]).enumerate() {
                let Some(c) = channel else { continue };
                let shown = |k| read_at(k, late, holds - 1);
                let reach = holds_around(shown(range.start)..shown(range.end - 1) + 1, holds);
                in_holds(Which::Channel(c), reach.clone(), &mut part);
                for ((_, read), k) in inputs.iter_mut().zip(range.clone()) {
                    read[sensor + 1] = at_sample(holds, shown(k), |hold| part[hold - reach.start]);
                }
            }
            let body = &self.filters.system.joints[joint];
            for (j, other) in self.joints.iter().enumerate() {
                if !body.at_once(first).get(j).is_some_and(|weight| *weight != 0.0) {
                    continue;
                }
                let arrival = self.arrivals[other.dof];
                let acts = |k: usize| k.saturating_sub(arrival.late);
                let reach = holds_around(acts(range.start)..acts(range.end - 1) + 1, holds);
                in_holds(Which::Channel(other.torque), reach.clone(), &mut part);
                for ((_, read), k) in inputs.iter_mut().zip(range.clone()) {
                    let of_hold = |hold| part[hold - reach.start];
                    let torque = if self.is_whole {
                        arrival.begun(holds, acts(k), of_hold)
                    } else {
                        at_sample(holds, acts(k), of_hold)
                    };
                    add(&mut read[GEAR], -body.at_once(k)[j], &torque);
                }
            }
        };
        self.by_channel(self.filters.rows(fill))
    }

    /// Rows of what was measured along a reference; `means`: what the mean torque of a hold differs from that in its
    /// middle; `steps`: what the torque in its middle differs from that where it begins.
    pub(super) fn measured(
        &self,
        even: &Even,
        motion: &Motion,
        means: &[Vec<f64>],
        steps: &[Vec<f64>],
    ) -> Vec<f64> {
        let input = |joint: usize, k: usize| {
            let Some(&channels) = self.joints.get(joint) else { return ([[0.0]; 2], [[0.0]; SENSORS]) };
            let JointChannels { dof, torque, .. } = channels;
            let mut read = deviation_readings(even, motion, channels, self.late[dof], k);
            let acts = |joint: &JointChannels| {
                let (torque, arrival) = (&even.torque[joint.torque], self.arrivals[joint.dof]);
                let [logged] =
                    arrival.begun(torque.len(), k.saturating_sub(arrival.late), |hold| [torque[hold]]);
                logged - steps.get(joint.dof).and_then(|of_joint| of_joint.get(k)).unwrap_or(&0.0)
            };
            let at_once = self.filters.system.joints[joint].at_once(k).iter().zip(&self.joints);
            read[GEAR] -= at_once.map(|(weight, joint)| weight * acts(joint)).sum::<f64>();
            ([[even.torque[torque][k] - means[dof][k]], [0.0]], read.map(|x| [x]))
        };
        let rows = self.by_channel(self.filters.rows(one_by_one(input)));
        rows.into_iter().flatten().map(|[x]| x).collect()
    }

    /// What makes rows of a channel of torques that are held for so many samples: on the motor those of the motor, on the link
    /// those of what is behind the gear; none of a channel that no joint has.
    pub fn of_torques(&self, channel: usize, hold: usize) -> Option<Held> {
        let which = |j: &JointChannels| j.by_sensor().iter().position(|c| *c == Some(channel));
        let (joint, sensor) =
            self.joints.iter().enumerate().find_map(|(joint, j)| Some((joint, which(j)?)))?;
        Some(Held::new(&self.filters, joint, sensor, hold))
    }

    fn by_channel<const W: usize>(&self, rows: Vec<SensorRows<W>>) -> Vec<Vec<[f64; W]>> {
        let mut out = vec![Vec::new(); self.channels];
        for (joint, rows) in self.joints.iter().zip(rows) {
            for (channel, rows) in joint.by_sensor().into_iter().zip(rows) {
                if let Some(c) = channel {
                    out[c] = rows;
                }
            }
        }
        out
    }
}

// Channels of rows of several sets as one vector a set, for the first `count`.
fn turned<const W: usize>(channels: &[Vec<[f64; W]>], count: usize) -> Vec<Vec<f64>> {
    (0..count).map(|w| channels.iter().flatten().map(|row| row[w]).collect()).collect()
}

/// A joint with its channels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointChannels {
    pub dof: usize,
    pub torque: usize,
    pub position: Option<usize>,
    pub gear: Option<usize>,
    /// True if no spring is between them.
    pub is_rigid: bool,
}

impl JointChannels {
    // The channels in which the rows of its sensors stand.
    fn by_sensor(&self) -> [Option<usize>; SENSORS] {
        [Some(self.torque), self.position, self.gear]
    }
}

// The sample in which a sensor that is so much late shows sample k, among those up to `last`, that at which the last hold
// begins: a prediction at the middles of the holds reaches no further.
fn read_at(k: usize, late: isize, last: usize) -> usize {
    k.saturating_add_signed(late).min(last)
}

/// What a series at the middles of the holds is when a sensor that is so much late shows sample k.
pub(super) fn read_late<const W: usize>(
    holds: usize,
    k: usize,
    late: isize,
    of: impl Fn(usize) -> [f64; W],
) -> [f64; W] {
    at_sample(holds, read_at(k, late, holds - 1), of)
}

/// What the sensors show, seen from the reference; the link's position with the same error of interpolation between holds
/// that a prediction has, the torque behind the gear as it was read. What is read late is taken when it is read.
pub(super) fn deviation_readings(
    even: &Even,
    motion: &Motion,
    joint: JointChannels,
    [of_link, of_gear]: [isize; 2],
    k: usize,
) -> [f64; SENSORS] {
    let JointChannels { dof, position, gear, .. } = joint;
    let theta = motion.theta[dof][k];
    let read = |c: usize, late| even.read[c][read_at(k, late, even.read[c].len() - 2)];
    let link = position.map_or(0.0, |c| {
        let holds = motion.theta[dof].len() - 1;
        let [between] = at_sample(holds, k, |hold| [motion.middle(dof, hold, even.scales.period)]);
        read(c, of_link) + between - theta
    });
    let gear = gear.map_or(0.0, |c| read(c, of_gear));
    [even.theta[dof][k] - theta, link, gear]
}
