//! Residual rows: what is left of each channel after the prediction, and how it changes with each parameter.

use std::sync::Arc;

use rayon::prelude::*;

use sinew_effect::{DIRECTIONS, LANES};
use sinew_plant::Plant;

use crate::freedom::{Freedom, Springs};
use crate::imposed::{predict, predict_lanes};
use crate::innovation::Reference;
use crate::record::{Channel, Record};
use crate::tangent::{by_work, tangent_rows};

/// A way to turn runs into residual rows. The rows of one form can be compared with each other only.
pub(crate) trait ResidualForm: Sync {
    /// Where the rows are and which of them count.
    fn layout(&self) -> &Layout;
    /// Measured minus predicted, all rows.
    fn residual(&self, plant: &Plant, p: &[f64]) -> Vec<f64>;
    /// The same of one plant at several sets of parameters; links may be taken to be where a reference has them.
    fn residuals(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs, grid: Grid) -> Vec<Vec<f64>>;
    /// True if there is a coarse grid and every spring of a plant is slow enough for it at these parameters.
    fn holds_on_coarse(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs) -> bool;
    /// ∂ predicted / ∂ p, one column for each of `positions`; about links where a reference has them or where they are.
    fn columns(&self, plant: &Plant, p: &[f64], positions: &[usize], springs: Springs) -> Vec<Vec<f64>>;
    /// Residual rows that the noise of the imposed positions causes, for one realisation of it a seed.
    fn position_noise(&self, plant: &Plant, p: &[f64], seeds: &[u64]) -> Vec<Vec<f64>>;
    /// True if noise alone leaves rows of unit variance that do not depend on each other.
    fn is_white(&self) -> bool {
        false
    }
    /// Takes the motion about which the rows are formed anew from this model; rows from before do not belong to rows
    /// from after.
    fn renew(&self, _plant: &Plant, _p: &[f64], _from: Start) {}
    /// What the rows are formed about, to come back to it.
    fn reference(&self) -> Option<Arc<Reference>> {
        None
    }
    /// Measured minus predicted about the present reference if logged torques acted so much earlier, s, than they are taken to.
    fn residual_taking(&self, _early: f64, plant: &Plant, p: &[f64]) -> Vec<f64> {
        self.residual(plant, p)
    }
    /// Measured minus predicted with logged torques taken so; rows that know of them themselves are as they are.
    fn residual_told(&self, _torques: LoggedTorques, plant: &Plant, p: &[f64]) -> Vec<f64> {
        self.residual(plant, p)
    }
    /// Forgets the rows of the reference, for a new one in which logged torques are taken so.
    fn begin_anew(&self, _torques: LoggedTorques) {}
    /// Begins with the kernel's motion of every run, torques taken as about a reference, and their noise as it was read, at most
    /// what was left there.
    fn begin_as_read(&self, _reference: &Reference) {}
    /// Comes back to a reference.
    fn adopt(&self, _reference: &Arc<Reference>) {}
    /// Noise of the readings of motor torque of every joint that moves, in the noisiest run, as far as neighbouring samples tell it;
    /// empty where it is not asked.
    fn read_noise(&self) -> Vec<f64> {
        Vec::new()
    }
    /// −2 log likelihood of what was measured in these samples by a model about the motion of a reference, under torque noise of
    /// this size; none where there is no reference.
    fn misfit(
        &self,
        _samples: Samples,
        _about: &Reference,
        _torque_noise: &[f64],
        _plant: &Plant,
        _p: &[f64],
    ) -> Option<f64> {
        None
    }
}

/// How logged torques are taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct LoggedTorques {
    /// By how much they act before the middles of their holds, s.
    pub early: f64,
    /// True if derivatives are taken along the motion that they would make without the torque noise, not along that which was
    /// made with it.
    pub move_without_noise: bool,
    /// What passes drives with a lag or a dead time.
    pub passing: Passing,
    /// True if they move a joint near rest within a hold in a way that no model of whole holds follows, so that friction over a hold
    /// is as unsure as its change.
    pub unsure_friction: bool,
}

impl LoggedTorques {
    /// True if all of them passes drives with a lag or a dead time.
    pub fn is_whole(&self) -> bool {
        self.passing != Passing::Foretold
    }
}

/// What of the logged torques passes drives with a lag or a dead time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) enum Passing {
    /// What a model foretells; the rest comes late, as fast as it was.
    #[default]
    Foretold,
    /// All of it, as the drive lets it, smoothed over a time before, s, with as much before an instant as after it.
    Whole { smoothed: f64 },
}

/// Samples of which a likelihood is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Samples {
    All,
    /// Those whose rows of motor torque count.
    OfRows,
}

/// The motion that a new reference is led from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// That of the smoothing kernel, not led on: for a model that is to be fitted first. A motion that another model has made
    /// rough, and the noise that it was found to have, would confirm each other.
    Kernel,
    /// The present reference: for a model whose parameters have changed a little.
    Reference,
    /// The same with its noise, and not led on: for what is read of a motion in another way.
    Same,
}

/// The instants of a run at which a model is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grid {
    /// Those of the residual.
    Fine,
    /// Those on which derivatives are taken.
    Coarse,
}

/// The rows of one channel in one run.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    pub record: usize,
    pub channel: usize,
    pub first: usize,
    pub len: usize,
}

/// Where the rows of a residual are: segment by segment.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub channels: Vec<Channel>,
    pub segments: Vec<Segment>,
    /// Rows in all.
    pub len: usize,
    /// False for rows that carry no information: rest, start.
    pub keep: Vec<bool>,
    /// How uncertain the sign of the velocity is, 0 … 1.
    pub reversal: Vec<f64>,
    /// One-second block of each row, numbered through all runs; the same for all channels of a run.
    pub block: Vec<usize>,
    /// Contiguous fold of each row, numbered through all runs.
    pub fold: Vec<usize>,
    pub blocks: usize,
    pub folds: usize,
    /// Sample period of the log, s.
    pub period: f64,
}

// Contiguous folds of a run.
const FOLDS: usize = 8;
// Seconds of a block.
const BLOCK: f64 = 1.0;
// Share of the top speed below which, at most, a velocity may be taken for rest because it is not known well.
const MOST_UNSURE: f64 = 0.03;
// Rows in which the joint rests for more than this share of the kernel say nothing about friction.
const REST_SHARE: f64 = 0.3;

// Mean square of whitened rows from which much is left.
const MUCH: f64 = 4.0;

impl Layout {
    /// The rows of these records from `start` s on; `unsure`: the speed up to which a degree of freedom may rest in a run.
    pub fn of(
        records: &[Record],
        channels: &[Channel],
        start: f64,
        unsure: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let mut layout = Self {
            channels: channels.to_vec(),
            segments: Vec::new(),
            len: 0,
            keep: Vec::new(),
            reversal: Vec::new(),
            block: Vec::new(),
            fold: Vec::new(),
            blocks: 0,
            folds: 0,
            period: records.iter().map(|r| r.scales.period).fold(0.0, f64::max),
        };
        for (r, record) in records.iter().enumerate() {
            let mut rows = 0;
            for (c, channel) in channels.iter().enumerate() {
                let reversal = reversal_weight(record, channel.dof);
                let rest = rest_share(record, channel.dof, unsure(r, channel.dof));
                rows = reversal.len();
                layout.segments.push(Segment { record: r, channel: c, first: layout.len, len: rows });
                layout.len += rows;
                for k in 0..rows {
                    let stamp = record.stamp(k);
                    let time = stamp - record.time[0];
                    let rests = channel.signal() == "motor_torque" && rest[k] > REST_SHARE;
                    layout.keep.push(time >= start && !rests && !record.leaves_out(stamp));
                    layout.reversal.push(reversal[k]);
                    layout.block.push(layout.blocks + (time / BLOCK) as usize);
                    layout.fold.push(layout.folds + (k * FOLDS / rows.max(1)).min(FOLDS - 1));
                }
            }
            let last = record.stamp(rows.max(1) - 1) - record.time[0];
            layout.blocks += (last / BLOCK) as usize + 1;
            layout.folds += FOLDS;
        }
        layout
    }

    /// Leaves out of a channel what is left out of another.
    pub fn leave_out_with(&mut self, other: usize, channel: usize) {
        let first = |c: usize| self.of_channel(c).map(|s| (s.first, s.len)).collect::<Vec<_>>();
        for ((from, _), (to, len)) in first(other).into_iter().zip(first(channel)) {
            (0..len).for_each(|k| self.keep[to + k] &= self.keep[from + k]);
        }
    }

    /// Rows that count.
    pub fn counted(&self) -> f64 {
        self.keep.iter().filter(|k| **k).count() as f64
    }

    /// True if a squared length of whitened rows says that much more is left than noise: a fit may have ended in a wrong
    /// valley, no gain is small, and runs differ for reasons of their own.
    pub fn is_much(&self, objective: f64) -> bool {
        objective >= MUCH * self.counted()
    }

    /// The segments of one channel.
    pub fn of_channel(&self, channel: usize) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |s| s.channel == channel)
    }
}

// W = φ ∗ [½ |tanh(θ̇₁/3v) − tanh(θ̇₂/3v)| + 0.3 e^{−(θ̇/4v)²}],  v = 10⁻³ of the unit or of the noise of θ̇
fn reversal_weight(record: &Record, dof: usize) -> Vec<f64> {
    let v = velocity_scale(record, dof);
    let both = record.thetad[dof].iter().zip(&record.thetad_wide[dof]);
    let weight = |(a, b): (&f64, &f64)| {
        0.5 * ((a / (3.0 * v)).tanh() - (b / (3.0 * v)).tanh()).abs() + 0.3 * (-(a / (4.0 * v)).powi(2)).exp()
    };
    let series: Vec<f64> = both.map(weight).collect();
    record.rows(&series)
}

fn rest_share(record: &Record, dof: usize, unsure: f64) -> Vec<f64> {
    let top = record.thetad[dof].iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let threshold = (3.0 * velocity_noise(record, dof)).max(1e-3 * top).max(unsure.min(MOST_UNSURE * top));
    let resting: Vec<f64> =
        record.thetad[dof].iter().map(|v| if v.abs() < threshold { 1.0 } else { 0.0 }).collect();
    record.rows(&resting)
}

// Standard deviation of the smoothed velocity, from that of the position: σ ‖ḣ‖, ‖ḣ‖ ≈ 1.9/(w √w) samples⁻¹.
fn velocity_noise(record: &Record, dof: usize) -> f64 {
    let w = record.scales.smooth as f64;
    record.position_noise[dof] * 1.9 / (w * w.sqrt() * record.scales.part())
}

fn velocity_scale(record: &Record, dof: usize) -> f64 {
    let top = record.thetad[dof].iter().fold(0.0f64, |m, v| m.max(v.abs()));
    velocity_noise(record, dof).max(1e-3 * top.min(1.0)).max(1e-9)
}

/// Prediction, residual and derivatives along records, whatever makes rows of their series.
pub(crate) struct Rows<'a> {
    pub records: &'a [Record],
    /// The same runs on the grid on which derivatives are taken.
    pub smooth: &'a [Record],
    pub channels: &'a [Channel],
    /// Rows of what was measured.
    pub measured: &'a [f64],
}

// Fewest and most parameters whose derivatives are carried along a run together: the motion is walked and its equations
// linearised for all of them once, but what each predicts is kept until the end of it.
const TOGETHER: (usize, usize) = (16, 48);
// Numbers that all of them together may keep of a channel, where that is more than the fewest need.
const KEPT: usize = 480_000;

impl Rows<'_> {
    /// Rows of the prediction.
    pub fn predicted(&self, plant: &Plant, p: &[f64], records: &[Record]) -> Vec<f64> {
        let of = |record: &Record| {
            let freedom = Freedom::of(plant, p, record, Springs::Simulated);
            record.channel_rows(&predict(plant, p, record, self.channels, &freedom))
        };
        records.par_iter().map(of).collect::<Vec<_>>().concat()
    }

    /// Measured minus predicted.
    pub fn residual(&self, plant: &Plant, p: &[f64]) -> Vec<f64> {
        let predicted = self.predicted(plant, p, self.records);
        self.measured.iter().zip(predicted).map(|(m, u)| m - u).collect()
    }

    /// The same at several sets of parameters.
    pub fn residuals(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs, grid: Grid) -> Vec<Vec<f64>> {
        let records = match grid {
            Grid::Fine => self.records,
            Grid::Coarse => self.smooth,
        };
        let jobs: Vec<(&[Vec<f64>], &Record)> =
            sets.chunks(LANES).flat_map(|lanes| records.iter().map(move |r| (lanes, r))).collect();
        let parts: Vec<Vec<Vec<f64>>> = jobs
            .par_iter()
            .map(|(lanes, record)| self.predicted_in_lanes(plant, lanes, record, springs))
            .collect();
        let runs = self.records.len();
        (0..sets.len())
            .map(|k| {
                let of_set = &parts[k / LANES * runs..(k / LANES + 1) * runs];
                let predicted = of_set.iter().flat_map(|part| &part[k % LANES]);
                self.measured.iter().zip(predicted).map(|(m, u)| m - u).collect()
            })
            .collect()
    }

    /// True if the same springs are simulated on both grids.
    pub fn holds_on_coarse(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs) -> bool {
        let alike = |(fine, coarse): (&Record, &Record)| {
            let freedom = |p: &[f64], record: &Record| Freedom::of(plant, p, record, springs);
            sets.iter().all(|p| freedom(p, fine) == freedom(p, coarse))
        };
        self.records.iter().zip(self.smooth).all(alike)
    }

    // Rows of one record for up to LANES sets of parameters, in one walk where the same joints are simulated.
    fn predicted_in_lanes(
        &self,
        plant: &Plant,
        sets: &[Vec<f64>],
        record: &Record,
        springs: Springs,
    ) -> Vec<Vec<f64>> {
        let freedom: Vec<Freedom> = sets.iter().map(|p| Freedom::of(plant, p, record, springs)).collect();
        let alike = |p: &Vec<f64>| p.iter().zip(&sets[0]).all(|(a, b)| (*a == 0.0) == (*b == 0.0));
        if sets.len() == 1 || freedom.iter().any(|f| *f != freedom[0]) || !sets.iter().all(alike) {
            let one = |(p, freedom): (&Vec<f64>, &Freedom)| {
                record.channel_rows(&predict(plant, p, record, self.channels, freedom))
            };
            return sets.iter().zip(&freedom).map(one).collect();
        }
        record.channel_rows_of_each(&predict_lanes(plant, sets, record, self.channels, &freedom[0]))
    }

    /// ∂ predicted / ∂ p, one column for each of `positions`.
    pub fn columns(&self, plant: &Plant, p: &[f64], positions: &[usize], springs: Springs) -> Vec<Vec<f64>> {
        let order = by_work(plant, positions);
        let ordered: Vec<usize> = order.iter().map(|&k| positions[k]).collect();
        let longest = self.smooth.iter().map(Record::len).max().unwrap_or(0);
        let most = (KEPT / longest.max(1)).clamp(TOGETHER.0, TOGETHER.1);
        // A single run keeps two threads busy, too.
        let groups = positions.len().div_ceil(most).max(if self.records.len() == 1 { 2 } else { 1 });
        let together = positions.len().div_ceil(groups).next_multiple_of(DIRECTIONS).max(DIRECTIONS);
        let groups: Vec<&[usize]> = ordered.chunks(together).collect();
        let jobs: Vec<(usize, usize)> =
            (0..groups.len()).flat_map(|g| (0..self.records.len()).map(move |r| (g, r))).collect();
        let parts: Vec<Vec<Vec<f64>>> = jobs
            .par_iter()
            .map(|&(g, r)| {
                let mut record = &self.smooth[r];
                let mut freedom = Freedom::of(plant, p, record, springs);
                let exact = Freedom::of(plant, p, &self.records[r], springs);
                if freedom != exact {
                    // Some spring is too stiff for the coarser grid.
                    (record, freedom) = (&self.records[r], exact);
                }
                tangent_rows(plant, p, record, self.channels, &freedom, groups[g])
            })
            .collect();
        let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(self.measured.len()); positions.len()];
        for (&(g, _), part) in jobs.iter().zip(parts) {
            for (k, rows) in part.into_iter().enumerate() {
                columns[order[g * together + k]].extend(rows);
            }
        }
        columns
    }
}

/// The residual with imposed motor motion: θ, θ̇, θ̈ are given, every other sensor is predicted.
pub(crate) struct Imposed<'a> {
    records: &'a [Record],
    layout: Layout,
    measured: Vec<f64>,
    nv: usize,
}

/// A simulated spring forgets its unknown start within this time, s.
pub(crate) const TRANSIENT: f64 = 0.8;
// Logs of a coarser grid than this, s, show no spring.
const SPRING_STEP: f64 = 0.005;

impl<'a> Imposed<'a> {
    /// The rows of these records, with the start left out where a spring may be simulated.
    pub fn new(records: &'a [Record], channels: &[Channel], nv: usize) -> Self {
        let fast = records.iter().all(|r| r.scales.step() <= SPRING_STEP);
        let layout = Layout::of(records, channels, if fast { TRANSIENT } else { 0.0 }, |_, _| 0.0);
        let measured = records.iter().flat_map(|r| r.measured.iter().flat_map(|s| r.rows(s))).collect();
        Self { records, layout, measured, nv }
    }

    fn rows(&self) -> Rows<'_> {
        let (records, channels) = (self.records, &self.layout.channels);
        Rows { records, smooth: records, channels, measured: &self.measured }
    }
}

impl ResidualForm for Imposed<'_> {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn residual(&self, plant: &Plant, p: &[f64]) -> Vec<f64> {
        self.rows().residual(plant, p)
    }
    fn residuals(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs, grid: Grid) -> Vec<Vec<f64>> {
        self.rows().residuals(plant, sets, springs, grid)
    }
    fn holds_on_coarse(&self, _plant: &Plant, _sets: &[Vec<f64>], _springs: Springs) -> bool {
        false
    }
    fn columns(&self, plant: &Plant, p: &[f64], positions: &[usize], springs: Springs) -> Vec<Vec<f64>> {
        self.rows().columns(plant, p, positions, springs)
    }

    fn residual_told(&self, torques: LoggedTorques, plant: &Plant, p: &[f64]) -> Vec<f64> {
        let mut records = self.records.to_vec();
        records.iter_mut().for_each(|record| record.scales = record.scales.taking(torques.early));
        Rows { records: &records, ..self.rows() }.residual(plant, p)
    }

    fn position_noise(&self, plant: &Plant, p: &[f64], seeds: &[u64]) -> Vec<Vec<f64>> {
        let rows = self.rows();
        let clean = rows.predicted(plant, p, self.records);
        let of = |seed: &u64| -> Vec<f64> {
            let records = self.records.iter().enumerate();
            let noisy: Vec<Record> = records
                .map(|(k, record)| with_position_noise(record, self.nv, seed.wrapping_add(k as u64)))
                .collect();
            let shaken = rows.predicted(plant, p, &noisy);
            shaken.iter().zip(&clean).map(|(a, b)| a - b).collect()
        };
        seeds.par_iter().map(of).collect()
    }
}

// White noise of the raw position, smoothed and differentiated like the position itself, added to the motion.
fn with_position_noise(record: &Record, nv: usize, seed: u64) -> Record {
    use rand::{Rng, SeedableRng, rngs::SmallRng};
    let mut random = SmallRng::seed_from_u64(seed);
    let s = &record.scales;
    let smoother = sinew_data::Smoother::new(s.smooth, s.part());
    let mut noisy = record.clone();
    for dof in 0..nv {
        let std = record.position_noise[dof];
        if std == 0.0 {
            continue;
        }
        let raw: Vec<f64> = (0..record.len() * s.stride + 2 * s.smooth)
            .map(|_| {
                // Box–Muller
                let (a, b): (f64, f64) = (1.0 - random.random::<f64>(), random.random());
                std * (-2.0 * a.ln()).sqrt() * (2.0 * std::f64::consts::PI * b).cos()
            })
            .collect();
        let shaken = [smoother.value(&raw), smoother.rate(&raw), smoother.second_rate(&raw)];
        let series = [&mut noisy.theta[dof], &mut noisy.thetad[dof], &mut noisy.thetadd[dof]];
        for (series, noise) in series.into_iter().zip(&shaken) {
            add(series, noise.iter().step_by(s.stride));
        }
        for (series, noise) in noisy.middle.iter_mut().flatten().zip(&shaken) {
            add(&mut series[dof], noise.iter().skip(s.stride / 2).step_by(s.stride));
        }
    }
    noisy
}

fn add<'n>(series: &mut [f64], noise: impl Iterator<Item = &'n f64>) {
    for (x, n) in series.iter_mut().zip(noise) {
        *x += n;
    }
}
