//! A linear model from sample to sample, with inputs held between.

use faer::Mat;
use nalgebra::DMatrix;

use crate::poles::balance;
use crate::{LinearError, StateSpace};

/// The system that a computer sees: inputs held over each sample time, outputs read at its start.
///
/// ```text
/// [Φ Γ; 0 1] = exp([A B; 0 0] h),   x⁺ = Φ x + Γ u,   y = C x + D u
/// ```
///
/// Exact for inputs that are held, as drives hold them. Dead times, whole samples or not, become states of their
/// own, `motor_torque.J[-k]` (the input k samples ago) and `QUANTITY.J[-k]` (a reading that waits).
///
/// # Errors
/// If the sample time is not positive, the system is of discrete time already, or a dead time is negative.
///
/// # Example
/// A free mass of 1/2 kg: Γ = [h²/2, h]/m:
/// ```
/// use sinew_model::{Robot, Vector3, samples::hanging_link};
/// use sinew_plant::Plant;
/// let robot = Robot::rigid(hanging_link(0.5, 2.0, 0.4).with_gravity(Vector3::ZERO));
/// let plant = Plant::new(&robot, &sinew_effects::CATALOGUE).unwrap();
/// let linear = sinew_linear::linearize(&plant, &[], &[0.0]).unwrap();
/// let sampled = sinew_linear::discretize(&linear, 0.1).unwrap();
/// assert!((sampled.B[(0, 0)] - 0.1 * 0.1 / 2.0 / 0.5).abs() < 1e-15);
/// assert!((sampled.B[(1, 0)] - 0.1 / 0.5).abs() < 1e-15);
/// ```
/// Source: Van Loan, *Computing integrals involving the matrix exponential*, IEEE Trans. Automatic Control 23(3), 1978;
/// Åström, Wittenmark, *Computer-Controlled Systems*, 3rd ed., Prentice Hall 1997, section 3.2 (dead times).
pub fn discretize(linear: &StateSpace, sample_time: f64) -> Result<StateSpace, LinearError> {
    let delays = linear.input_delay.iter().chain(&linear.output_delay);
    if !(sample_time > 0.0 && sample_time.is_finite()) || linear.sample_time.is_some() {
        let already = linear.sample_time.is_some();
        return Err(LinearError::SampleTime { got: sample_time, already });
    }
    if let Some(delay) = delays.clone().find(|d| **d < 0.0) {
        return Err(LinearError::NegativeDelay { delay: *delay });
    }
    let h = sample_time;
    let split = |delay: &f64| {
        // Whole samples and the rest; a rest of a rounding is none.
        let whole = (delay / h + 1e-9).floor();
        let rest = (delay - whole * h).max(0.0);
        (whole as usize, if rest < 1e-9 * h { 0.0 } else { rest })
    };
    let inputs: Vec<(usize, f64)> = linear.input_delay.iter().map(split).collect();
    let outputs: Vec<(usize, f64)> = linear.output_delay.iter().map(split).collect();
    let mut sampled = Sampled::new(linear, h, inputs);
    sampled.inputs_wait();
    sampled.readings(&outputs);
    Ok(sampled.system)
}

// A system under construction: first the states of the continuous one, then what waits.
struct Sampled<'a> {
    linear: &'a StateSpace,
    h: f64,
    inputs: Vec<(usize, f64)>,
    system: StateSpace,
    /// For each input the row of coefficients that gives the held input now in force, and the one before.
    held: Vec<[Source; 2]>,
}

// An input as it was some samples ago.
#[derive(Clone, Copy)]
enum Source {
    Input(usize),
    State(usize),
}

impl<'a> Sampled<'a> {
    fn new(linear: &'a StateSpace, h: f64, inputs: Vec<(usize, f64)>) -> Self {
        let n = linear.A.nrows();
        let m = inputs.len();
        let waiting: usize = inputs.iter().map(|&(whole, rest)| whole + usize::from(rest > 0.0)).sum();
        let states = n + waiting;
        let (p, system) = (linear.C.nrows(), linear.clone());
        let system = StateSpace {
            A: Mat::zeros(states, states),
            B: Mat::zeros(states, m),
            C: Mat::zeros(p, states),
            D: Mat::zeros(p, m),
            input_delay: vec![0.0; m],
            output_delay: vec![0.0; p],
            sample_time: Some(h),
            ..system
        };
        Self { linear, h, inputs, system, held: Vec::new() }
    }

    // u[k−1], u[k−2], … as states, and with them the motion over a sample.
    fn inputs_wait(&mut self) {
        let n = self.linear.A.nrows();
        let mut next = n;
        for (j, &(whole, rest)) in self.inputs.iter().enumerate() {
            let length = whole + usize::from(rest > 0.0);
            for k in 0..length {
                let name = format!("{}[-{}]", self.linear.inputs[j], k + 1);
                self.system.states.push(name);
                match k {
                    0 => self.system.B[(next, j)] = 1.0,
                    k => self.system.A[(next + k, next + k - 1)] = 1.0,
                }
            }
            // Over a sample the input of `whole` samples ago follows on that of one more.
            let ago = |k: usize| if k == 0 { Source::Input(j) } else { Source::State(next + k - 1) };
            self.held.push([ago(whole), ago(length)]);
            next += length;
        }
        let (state, by_input) = self.advance(self.h);
        for i in 0..n {
            for k in 0..n {
                self.system.A[(i, k)] = state[(i, k)];
            }
            for (j, gains) in by_input.iter().enumerate() {
                for which in 0..2 {
                    self.add(Row::State(i), self.held[j][which], gains[which][i]);
                }
            }
        }
    }

    // Outputs read at the sample, or some time before.
    fn readings(&mut self, outputs: &[(usize, f64)]) {
        let (n, linear) = (self.linear.A.nrows(), self.linear);
        for (row, &(whole, rest)) in outputs.iter().enumerate() {
            if whole == 0 && rest == 0.0 {
                for k in 0..n {
                    self.system.C[(row, k)] = linear.C[(row, k)];
                }
                for j in 0..linear.B.ncols() {
                    // The input in force just after the sample.
                    let now = usize::from(self.inputs[j].1 > 0.0);
                    self.add(Row::Output(row), self.held[j][now], linear.D[(row, j)]);
                }
                continue;
            }
            // The reading is due a while after the sample before: it is known then, and waits.
            let (wait, after) = if rest > 0.0 { (whole + 1, self.h - rest) } else { (whole, 0.0) };
            let first = self.system.A.nrows();
            self.grow(wait);
            for k in 0..wait {
                self.system.states.push(format!("{}[-{}]", linear.outputs[row], k + 1));
                if k > 0 {
                    self.system.A[(first + k, first + k - 1)] = 1.0;
                }
            }
            let (state, by_input) = self.advance(after);
            for k in 0..n {
                let sum = (0..n).map(|i| linear.C[(row, i)] * state[(i, k)]).sum();
                self.system.A[(first, k)] = sum;
            }
            for j in 0..linear.B.ncols() {
                for which in 0..2 {
                    let moved: f64 = (0..n).map(|i| linear.C[(row, i)] * by_input[j][which][i]).sum();
                    // Which of the two inputs is in force at that instant.
                    let old = after < self.inputs[j].1;
                    let direct = if (which == 1) == old { linear.D[(row, j)] } else { 0.0 };
                    self.add(Row::State(first), self.held[j][which], moved + direct);
                }
            }
            self.system.C[(row, first + wait - 1)] = 1.0;
        }
    }

    fn grow(&mut self, by: usize) {
        let system = &mut self.system;
        let (old, m, p) = (system.A.nrows(), system.B.ncols(), system.C.nrows());
        let resized = |matrix: &Mat<f64>, rows: usize, columns: usize| {
            let inside = |i, j| i < matrix.nrows() && j < matrix.ncols();
            Mat::from_fn(rows, columns, |i, j| if inside(i, j) { matrix[(i, j)] } else { 0.0 })
        };
        system.A = resized(&system.A, old + by, old + by);
        system.B = resized(&system.B, old + by, m);
        system.C = resized(&system.C, p, old + by);
    }

    fn add(&mut self, row: Row, source: Source, value: f64) {
        let system = &mut self.system;
        let slot = match (row, source) {
            (Row::State(i), Source::State(k)) => &mut system.A[(i, k)],
            (Row::State(i), Source::Input(j)) => &mut system.B[(i, j)],
            (Row::Output(i), Source::State(k)) => &mut system.C[(i, k)],
            (Row::Output(i), Source::Input(j)) => &mut system.D[(i, j)],
        };
        *slot += value;
    }

    // Where the continuous states are a time `s ≤ h` after a sample: Φ(s), and of each input what the one in force now
    // and the one in force before its switch do.
    fn advance(&self, s: f64) -> (Mat<f64>, Vec<[Vec<f64>; 2]>) {
        let (A, B) = (&self.linear.A, &self.linear.B);
        let n = A.nrows();
        let column = |j: usize| Mat::from_fn(n, 1, |i, _| B[(i, j)]);
        let (state, _) = held_over(A, B, s);
        let by_input = self.inputs.iter().enumerate().map(|(j, &(_, rest))| {
            let b = column(j);
            let before = rest.min(s);
            // x(s) = Φ(s − r) Γ(r) u₋ + Γ(s − r) u₀
            let (after_switch, new) = held_over(A, &b, s - before);
            let (_, old) = held_over(A, &b, before);
            let old = &after_switch * old;
            let listed = |m: &Mat<f64>| (0..n).map(|i| m[(i, 0)]).collect::<Vec<f64>>();
            [listed(&new), listed(&old)]
        });
        (state, by_input.collect())
    }
}

#[derive(Clone, Copy)]
enum Row {
    State(usize),
    Output(usize),
}

// [Φ Γ; 0 1] = exp([A B; 0 0] s), of balanced A, so that few squarings are needed.
fn held_over(A: &Mat<f64>, B: &Mat<f64>, s: f64) -> (Mat<f64>, Mat<f64>) {
    let (n, m) = (A.nrows(), B.ncols());
    let scale = balance(A);
    // Inputs are scaled to the size of the states, which keeps the norm that of A.
    let by_rate = |j: usize| (0..n).map(|i| (B[(i, j)] / scale[i]).abs()).fold(0.0, f64::max);
    let largest = A.norm_max().max(f64::MIN_POSITIVE);
    let input: Vec<f64> = (0..m)
        .map(|j| {
            let size = by_rate(j);
            if size > 0.0 { (largest / size).log2().round().exp2() } else { 1.0 }
        })
        .collect();
    let whole = DMatrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => A[(i, j)] * scale[j] / scale[i] * s,
        (true, false) => B[(i, j - n)] * input[j - n] / scale[i] * s,
        _ => 0.0,
    })
    .exp();
    let state = Mat::from_fn(n, n, |i, j| whole[(i, j)] * scale[i] / scale[j]);
    let by_input = Mat::from_fn(n, m, |i, j| whole[(i, n + j)] * scale[i] / input[j]);
    (state, by_input)
}
