//! The transfer function between two signals: response by frequency, resonances, antiresonances.

use core::f64::consts::{PI, SQRT_2, TAU};

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};

use crate::poles::{ORDINARY, Poles, settled};
use crate::zeros::zeros;
use crate::{LinearError, StateSpace};

/// How one signal answers to another.
///
/// ```text
/// G(s) = k Π(s − z)/Π(s − p) · e^(−s T)
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// The signal that is imposed.
    pub from: String,
    /// The signal that answers.
    pub to: String,
    /// p, rad/s, in the order of their size; without those that a zero cancels, exactly zero where nothing holds the motion.
    pub poles: Vec<c64>,
    /// z, rad/s.
    pub zeros: Vec<c64>,
    /// k.
    pub gain: f64,
    /// T, s.
    pub delay: f64,
    // y = numerator/denominator of channels of one system; one without a denominator.
    numerator: Channel,
    denominator: Option<Channel>,
}

/// A lightly damped pair of poles (resonance) or of zeros (antiresonance).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Its natural frequency |s|, rad/s.
    pub omega: f64,
    /// The same, Hz.
    pub frequency: f64,
    /// −Re s/|s|; negative for an unstable pole, or for a zero that delays more than its magnitude tells.
    pub damping_ratio: f64,
    /// |G(i ω)| there.
    pub magnitude: f64,
}

/// Points of a frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct Bode {
    /// Hz.
    pub frequency: Vec<f64>,
    /// |G|, in the unit of `to` by that of `from`.
    pub magnitude: Vec<f64>,
    /// arg G, rad, without jumps of 2π.
    pub phase: Vec<f64>,
}

// b and c of one input and one output.
#[derive(Debug, Clone, PartialEq)]
struct Channel {
    A: Mat<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: f64,
}

// A pole and a zero nearer to each other than this share of their size cancel.
const CANCELLED: f64 = 1e-7;
// A pair with more damping has no peak: 1/√2.
const NO_PEAK: f64 = SQRT_2 / 2.0;
// Points of a grid by decade, and about each peak, in widths of it.
const BY_DECADE: f64 = 120.0;
const ABOUT: [f64; 9] = [0.0, 0.2, 0.5, 1.0, 1.5, 2.5, 4.0, 7.0, 12.0];

impl Transfer {
    /// The transfer function of `linear` from the signal called `from` to the output called `to`.
    ///
    /// `from` is an input, or an output: then the torque of the same joint is whatever makes that signal move as told,
    /// and all other torques rest. From `motor_position.J` the motor of J is held, so that the poles are those of the
    /// arm with that motor locked.
    ///
    /// # Errors
    /// If there is no such signal, the one does not reach the other, or eigenvalues do not check.
    ///
    /// # Panics
    /// If `linear` is of discrete time.
    ///
    /// # Example
    /// A hanging link of J = 0.5 kg·m² without gravity answers to torque as 1/(J s²):
    /// ```
    /// use sinew_model::{Robot, Vector3, samples::hanging_link};
    /// use sinew_plant::Plant;
    /// let robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO));
    /// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
    /// let linear = sinew_linear::linearize(&plant, &[], &[0.0]).unwrap();
    /// let g = sinew_linear::Transfer::new(&linear, "motor_torque.joint", "joint_position.joint").unwrap();
    /// assert!((g.at(3.0).re + 1.0 / (0.5 * 9.0)).abs() < 1e-14);
    /// assert_eq!((g.poles.len(), g.zeros.len()), (2, 0));
    /// ```
    pub fn new(linear: &StateSpace, from: &str, to: &str) -> Result<Self, LinearError> {
        assert!(linear.sample_time.is_none(), "linear: a system of continuous time");
        let output = |name: &str| linear.outputs.iter().position(|n| n == name);
        let Some(row) = output(to) else {
            return Err(no_signal(to, &linear.outputs));
        };
        let channel = |row: usize, input: usize| Channel {
            A: linear.A.clone(),
            b: (0..linear.A.nrows()).map(|i| linear.B[(i, input)]).collect(),
            c: (0..linear.A.nrows()).map(|j| linear.C[(row, j)]).collect(),
            d: linear.D[(row, input)],
        };
        let unreached = || LinearError::NotReached { from: from.to_owned(), to: to.to_owned() };
        let read_late = linear.output_delay[row];
        let poles = Poles::of(&linear.A)?.values;
        let fastest = poles.iter().map(|p| p.norm()).fold(ORDINARY, f64::max);
        if let Some(input) = linear.inputs.iter().position(|n| n == from) {
            let numerator = channel(row, input);
            let found = numerator.zeros()?;
            if found.gain == 0.0 {
                return Err(unreached());
            }
            let (poles, zeros) = reduced(settled(&poles, fastest), settled(&found.zeros, fastest));
            let delay = linear.input_delay[input] + read_late;
            let (from, to) = (from.to_owned(), to.to_owned());
            return Ok(Self {
                from,
                to,
                poles,
                zeros,
                gain: found.gain,
                delay,
                numerator,
                denominator: None,
            });
        }
        let known = || [linear.inputs.clone(), linear.outputs.clone()].concat();
        let Some(imposed) = output(from) else { return Err(no_signal(from, &known())) };
        let joint = from.split_once('.').map_or("", |(_, joint)| joint);
        let input = linear.inputs.iter().position(|n| n.split_once('.').is_some_and(|(_, j)| j == joint));
        let input = input.ok_or_else(|| no_signal(from, &known()))?;
        let (numerator, denominator) = (channel(row, input), channel(imposed, input));
        let (above, below) = (numerator.zeros()?, denominator.zeros()?);
        if above.gain == 0.0 || below.gain == 0.0 {
            return Err(unreached());
        }
        let (poles, zeros) = reduced(settled(&below.zeros, fastest), settled(&above.zeros, fastest));
        Ok(Self {
            from: from.to_owned(),
            to: to.to_owned(),
            poles,
            zeros,
            gain: above.gain / below.gain,
            delay: read_late - linear.output_delay[imposed],
            numerator,
            denominator: Some(denominator),
        })
    }

    /// G(i ω), ω in rad/s.
    pub fn at(&self, omega: f64) -> c64 {
        let above = self.numerator.at(omega);
        let ratio = self.denominator.as_ref().map_or(above, |below| above / below.at(omega));
        ratio * c64::new(0.0, -omega * self.delay).exp()
    }

    /// |G| and arg G at `frequency`, Hz. The phase has no jumps of 2π, however far apart the frequencies are: it is
    /// followed along poles and zeros from ω = 0.
    pub fn bode(&self, frequency: &[f64]) -> Bode {
        let point = |f: &f64| {
            let omega = TAU * f;
            let g = self.at(omega);
            // Σ arg(iω − z) − Σ arg(iω − p) − ω T says which turn; the number itself says the rest.
            let turn = self.continuous_phase(omega);
            let phase = g.arg() + TAU * ((turn - g.arg()) / TAU).round();
            // On an undamped root the number itself is rounding.
            (g.norm(), if (phase - turn).abs() > 0.5 { turn } else { phase })
        };
        let (magnitude, phase) = frequency.iter().map(point).unzip();
        Bode { frequency: frequency.to_vec(), magnitude, phase }
    }

    fn continuous_phase(&self, omega: f64) -> f64 {
        let arg = |root: &c64| {
            // A root on the imaginary axis counts as just left of it; one at zero turns by a quarter.
            let from = c64::new(0.0 - root.re, omega - root.im);
            if from.re >= 0.0 { from.im.atan2(from.re) } else { PI - from.im.atan2(-from.re) }
        };
        let of = |roots: &[c64]| roots.iter().map(arg).sum::<f64>();
        let sign = if self.gain < 0.0 { -PI } else { 0.0 };
        sign + of(&self.zeros) - of(&self.poles) - omega * self.delay
    }

    /// Lightly damped poles, slowest first.
    pub fn resonances(&self) -> Vec<Peak> {
        self.peaks(&self.poles)
    }

    /// Lightly damped zeros, slowest first: where the output stands almost still.
    pub fn antiresonances(&self) -> Vec<Peak> {
        self.peaks(&self.zeros)
    }

    fn peaks(&self, roots: &[c64]) -> Vec<Peak> {
        let peak = |s: &c64| {
            let omega = s.norm();
            let (frequency, damping_ratio) = (omega / TAU, -s.re / omega);
            Peak { omega, frequency, damping_ratio, magnitude: self.at(omega).norm() }
        };
        let oscillates = |s: &&c64| s.im > 0.0 && s.re.abs() < NO_PEAK * s.norm();
        roots.iter().filter(oscillates).map(peak).collect()
    }

    /// The least frequency of a grid, Hz: a turn in thirty years.
    pub const SLOWEST: f64 = 1e-9;
    /// The highest frequency of a grid, Hz: far above all that rigid bodies do.
    pub const FASTEST: f64 = 1e9;

    /// Frequencies that show everything, Hz: by decades from a tenth of the slowest to ten times the fastest pole or
    /// zero, dense about every peak; from 0.1 to 100 Hz if no pole or zero is anywhere but at zero.
    pub fn grid(&self) -> Vec<f64> {
        let roots = self.poles.iter().chain(&self.zeros).map(|s| s.norm() / TAU);
        let largest = roots.clone().fold(0.0, f64::max);
        let moving = roots.filter(|f| *f > 1e-6 * largest);
        let (low, high) = moving.fold((f64::INFINITY, 0.0f64), |(l, h), f| (l.min(f), h.max(f)));
        let (low, high) = if low.is_finite() { (0.1 * low, 10.0 * high) } else { (0.1, 100.0) };
        let low = low.clamp(Self::SLOWEST, 1e-2 * Self::FASTEST);
        let high = high.clamp(10.0 * low, Self::FASTEST);
        self.grid_between(low, high)
    }

    /// [`Transfer::grid`] between two frequencies, Hz.
    ///
    /// # Panics
    /// Unless [`SLOWEST`](Self::SLOWEST) ≤ `low` < `high` ≤ [`FASTEST`](Self::FASTEST).
    pub fn grid_between(&self, low: f64, high: f64) -> Vec<f64> {
        let within = Self::SLOWEST..=Self::FASTEST;
        assert!(
            within.contains(&low) && within.contains(&high) && low < high,
            "low, high: a range of frequencies"
        );
        let count = ((high / low).log10() * BY_DECADE).ceil().max(1.0);
        let mut grid: Vec<f64> =
            (0..=count as usize).map(|k| low * (high / low).powf(k as f64 / count)).collect();
        for peak in self.resonances().iter().chain(&self.antiresonances()) {
            let width = peak.damping_ratio.abs().clamp(1e-4, 0.3) * peak.frequency;
            grid.extend(ABOUT.iter().flat_map(|k| [peak.frequency - k * width, peak.frequency + k * width]));
        }
        grid.retain(|f| (low..=high).contains(f));
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        grid
    }
}

impl Channel {
    fn zeros(&self) -> Result<crate::zeros::Zeros, LinearError> {
        zeros(&self.A, &self.b, &self.c, self.d)
    }

    // c (iω − A)⁻¹ b + d
    fn at(&self, omega: f64) -> c64 {
        let n = self.A.nrows();
        let pencil = Mat::from_fn(n, n, |i, j| c64::new(-self.A[(i, j)], if i == j { omega } else { 0.0 }));
        let b = Mat::from_fn(n, 1, |i, _| c64::new(self.b[i], 0.0));
        let x = pencil.partial_piv_lu().solve(&b);
        (0..n).map(|j| x[(j, 0)] * self.c[j]).sum::<c64>() + self.d
    }
}

// Poles and zeros without the pairs that cancel.
fn reduced(mut poles: Vec<c64>, zeros: Vec<c64>) -> (Vec<c64>, Vec<c64>) {
    let largest = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let mut kept = Vec::new();
    for zero in zeros {
        let near = |p: &c64| (*p - zero).norm() <= CANCELLED * zero.norm().max(1e-3 * largest);
        match poles.iter().position(near) {
            Some(place) => drop(poles.remove(place)),
            None => kept.push(zero),
        }
    }
    (poles, kept)
}

pub(crate) fn no_signal(name: &str, known: &[String]) -> LinearError {
    LinearError::NoSignal {
        name: name.to_owned(),
        meant: sinew_model::nearest(name, known).map(str::to_owned),
        known: known.to_vec(),
    }
}
