//! One measured run: time stamps and signals.

use crate::error::DataError;
use crate::note::{Note, Severity};
use crate::quantity::{Quantity, SignalName};
use crate::statistics::median;

/// One measured signal, a value for each time stamp of its run.
#[derive(Debug, Clone)]
pub struct Signal {
    /// What is measured.
    pub quantity: Quantity,
    /// Where: the name of a joint, `x|y|z`, or `LINK.x|y|z`.
    pub place: String,
    /// The readings, SI, link side.
    pub values: Vec<f64>,
    /// Standard deviation of the sensor's noise, if stated beside the run.
    pub std: Option<f64>,
    /// Step between two readings of the sensor, if stated beside the run.
    pub resolution: Option<f64>,
}

/// Samples that a recording in a file of several has at least.
const SHORTEST: usize = 20;

/// What no sensor reads: sums of the squares of more might be no numbers.
const LARGEST: f64 = 1e100;

/// One measured run: strictly increasing time stamps, and signals of the same length, all finite.
#[derive(Debug, Clone)]
pub struct Run {
    /// Stem of the file, with the window if there is one: `log`, `log@0..12`.
    pub name: String,
    /// Time stamps as logged, s.
    pub time: Vec<f64>,
    /// The signals, in the order of their columns.
    pub signals: Vec<Signal>,
    /// What the reader had to tell.
    pub notes: Vec<Note>,
    /// Windows, s, in which something acts that is no part of the robot: nothing is fitted to them.
    pub left_out: Vec<[f64; 2]>,
    pub(crate) origin: Option<Origin>,
}

/// The file a run was read from.
#[derive(Debug, Clone)]
pub(crate) struct Origin {
    pub file: String,
    pub mark: Mark,
    /// Line or row of each sample in the file.
    pub numbers: Vec<u64>,
}

/// What the samples of a file are counted by.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Mark {
    /// Lines of a text, its header the first.
    Line,
    /// Rows of a table, from 1.
    #[cfg(feature = "parquet")]
    Row,
}

impl Signal {
    /// A signal of which neither noise nor resolution is known.
    pub fn new(quantity: Quantity, place: impl Into<String>, values: Vec<f64>) -> Signal {
        Signal { quantity, place: place.into(), values, std: None, resolution: None }
    }

    /// `QUANTITY.PLACE`.
    pub fn name(&self) -> SignalName {
        SignalName { quantity: self.quantity, place: self.place.clone() }
    }
}

// Share of the rows, one of so many, without a number from which a sensor may be slower than its log.
const SLOWER: usize = 4;
const DROP_ROW: &str = "drop the row, or use a window of the run without it: FILE@FROM..TO";
// A gap: more periods than these, and more seconds.
const MOST_PERIODS: f64 = 20.0;
const LONGEST_STEP: f64 = 0.1;
// Seconds of the shortest stretch between gaps that is worth a run.
const SHORTEST_PIECE: f64 = 1.9;

impl Run {
    /// A run from its parts.
    ///
    /// # Errors
    /// If a signal has not one value for each time stamp, a value is not finite or beyond 10¹⁰⁰, time does not strictly
    /// increase, or there are fewer than two samples.
    ///
    /// # Example
    /// ```
    /// use sinew_data::{Quantity, Run, Signal};
    /// let q = Signal::new(Quantity::JointPosition, "elbow", vec![0.0, 0.1, 0.2]);
    /// let run = Run::new("demo".into(), vec![5.0, 5.5, 6.0], vec![q]).unwrap();
    /// assert_eq!((run.duration(), run.period()), (1.0, 0.5));
    /// assert_eq!(run.joints(), ["elbow"]);
    /// ```
    pub fn new(name: String, time: Vec<f64>, signals: Vec<Signal>) -> Result<Run, DataError> {
        let run = Run { name, time, signals, notes: Vec::new(), left_out: Vec::new(), origin: None };
        run.validate(|signal| signal.to_string(), "time")?;
        Ok(run)
    }

    /// The same run, with a folder before its name and that of its file, for files of one name in several folders.
    pub fn in_folder(mut self, folder: &str) -> Run {
        self.name = format!("{folder}/{}", self.name);
        if let Some(origin) = &mut self.origin {
            origin.file = format!("{folder}/{}", origin.file);
        }
        self
    }

    /// The signal of a quantity at a place, if it was measured.
    pub fn signal(&self, quantity: Quantity, place: &str) -> Option<&Signal> {
        self.signals.iter().find(|s| s.quantity == quantity && s.place == place)
    }

    /// The joints of which anything was measured, in the order of their first column.
    pub fn joints(&self) -> Vec<&str> {
        let mut joints: Vec<&str> = Vec::new();
        for signal in self.signals.iter().filter(|s| s.quantity.is_of_joint()) {
            if !joints.contains(&signal.place.as_str()) {
                joints.push(&signal.place);
            }
        }
        joints
    }

    /// Time from the first to the last sample, s.
    pub fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// Sample period, s: the duration by the number of periods in it.
    ///
    /// ```text
    /// T = (t_N − t_0) / Σ_k round((t_{k+1} − t_k)/T̃)        T̃: median of the time steps
    /// ```
    ///
    /// Stamps of a clock that counts from 1970 are rounded to 0.24 µs, and so is T̃: at 500 Hz a grid of it is a fifth of a
    /// sample off after twelve seconds. Where time steps are no whole numbers of T̃, so that T is more than a hundredth off, it is T̃.
    ///
    /// # Example
    /// ```
    /// use sinew_data::{Quantity, Run, Signal};
    /// let time: Vec<f64> = (0..10_001).map(|k| 1.7e9 + 0.002 * f64::from(k)).collect();
    /// let torque = Signal::new(Quantity::MotorTorque, "elbow", vec![0.0; time.len()]);
    /// let run = Run::new("log".into(), time, vec![torque])?;
    /// assert!((run.period() - 0.002).abs() < 1e-10);
    /// # Ok::<(), sinew_data::DataError>(())
    /// ```
    pub fn period(&self) -> f64 {
        let steps = || self.time.windows(2).map(|t| t[1] - t[0]);
        let typical = median(steps().collect());
        let periods: f64 = steps().map(|step| (step / typical).round()).sum();
        let mean = self.duration() / periods;
        if (mean / typical - 1.0).abs() < 0.01 { mean } else { typical }
    }

    /// True if so long passed before sample k that nothing between it and the one before is known: more than twenty periods
    /// and a tenth of a second.
    ///
    /// # Panics
    /// If k is zero or no sample.
    pub fn is_gap(&self, k: usize) -> bool {
        self.is_longer_gap(k, self.period())
    }

    fn is_longer_gap(&self, k: usize, period: f64) -> bool {
        self.time[k] - self.time[k - 1] > (MOST_PERIODS * period).max(LONGEST_STEP)
    }

    /// The stretches between gaps, each as a window of this run with a note that says so; pieces of less than 1.9 s are
    /// left out, but for the longest where all are shorter. The run itself where it has no gap.
    ///
    /// # Example
    /// ```
    /// use sinew_data::{Quantity, Run, Signal};
    /// let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k) + if k < 400 { 0.0 } else { 1.5 }).collect();
    /// let q = Signal::new(Quantity::JointPosition, "elbow", vec![0.0; 1000]);
    /// let pieces = Run::new("log".into(), time, vec![q])?.pieces();
    /// let names: Vec<&str> = pieces.iter().map(|run| run.name.as_str()).collect();
    /// assert_eq!(names, ["log@0..4", "log@5.5.."]);
    /// # Ok::<(), sinew_data::DataError>(())
    /// ```
    pub fn pieces(self) -> Vec<Run> {
        let period = self.period();
        let gaps: Vec<usize> = (1..self.time.len()).filter(|&k| self.is_longer_gap(k, period)).collect();
        let Some(&first) = gaps.first() else { return vec![self] };
        // Whole milliseconds: from no later than the first sample to a period after the last.
        let since = |t: f64| 1e3 * (t - self.time[0]);
        let begins = gaps.iter().map(|&k| (since(self.time[k]) + 1e-6).floor() / 1e3);
        let ends = gaps.iter().map(|&k| (since(self.time[k - 1] + period) - 1e-6).ceil() / 1e3);
        let windows = std::iter::once(0.0).chain(begins).zip(ends.chain([f64::INFINITY]));
        let mut pieces: Vec<Run> = windows.filter_map(|(from, to)| self.window(from, to).ok()).collect();
        let longest = pieces.iter().map(Run::duration).fold(0.0, f64::max);
        pieces.retain(|piece| piece.duration() >= SHORTEST_PIECE.min(longest));
        let names: Vec<&str> = pieces.iter().map(|piece| piece.name.as_str()).collect();
        let rest = if names.len() == gaps.len() + 1 { "" } else { "; what is shorter than that is left out" };
        let long = self.time[first] - self.time[first - 1];
        let note = Note {
            severity: Severity::Warning,
            place: self.place_of(first),
            statement: format!("{long:.3} s are missing: taken as {}{rest}", names.join(" and ")),
            help: "name the windows that you want: FILE@FROM..TO".into(),
        };
        // What was told of the reading is told once.
        let Some((first, others)) = pieces.split_first_mut() else { return vec![self] };
        first.notes.push(note);
        others.iter_mut().for_each(|piece| piece.notes.clear());
        pieces
    }

    /// The samples with `from ≤ t − t₀ < to`, in s after the first time stamp t₀ of this run.
    ///
    /// `..a` and `a..` share no sample. Time stamps are kept as logged.
    ///
    /// # Errors
    /// If fewer than two samples are inside.
    pub fn window(&self, from: f64, to: f64) -> Result<Run, DataError> {
        let start = self.time[0];
        let first = self.time.partition_point(|t| t - start < from);
        let end = self.time.partition_point(|t| t - start < to).max(first);
        if end - first < 2 {
            return Err(DataError::Window {
                run: self.name.clone(),
                from,
                to,
                got: end - first,
                duration: self.duration(),
            });
        }
        let signals =
            self.signals.iter().map(|s| Signal { values: s.values[first..end].to_vec(), ..s.clone() });
        Ok(Run {
            name: window_name(&self.name, from, to),
            time: self.time[first..end].to_vec(),
            signals: signals.collect(),
            notes: self.notes.clone(),
            left_out: self.left_out.clone(),
            origin: self.origin.as_ref().map(|o| Origin {
                numbers: o.numbers[first..end].to_vec(),
                file: o.file.clone(),
                ..*o
            }),
        })
    }

    /// Leaves only the samples of one recording; a new one begins where time runs backwards.
    ///
    /// Without a number the samples must be one recording. Shuffled rows are no recordings: those of several
    /// have at least [`SHORTEST`] samples each.
    pub(crate) fn pick(&mut self, number: Option<usize>) -> Result<(), DataError> {
        let (t, n) = (&self.time, self.time.len());
        // One stamp that is late, or the one before it early, starts nothing: without it the clock runs on.
        let is_alone = |k: usize| (k + 1 < n && t[k + 1] > t[k - 1]) || (k > 1 && t[k] > t[k - 2]);
        let mut starts: Vec<usize> = (1..n).filter(|&k| t[k] < t[k - 1] && !is_alone(k)).collect();
        starts.insert(0, 0);
        let end = |i: usize| starts.get(i + 1).copied().unwrap_or(n);
        let recordings = starts.len();
        if number.is_none() && recordings > 1 && (0..recordings).all(|i| end(i) - starts[i] >= SHORTEST) {
            return Err(DataError::Recordings {
                place: self.place_of(starts[1]),
                got: self.time[starts[1]],
                previous: self.time[starts[1] - 1],
                file: self.origin.as_ref().map_or(&self.name, |o| &o.file).clone(),
                recordings,
            });
        }
        let Some(number) = number else { return Ok(()) };
        if number > recordings {
            return Err(DataError::NoRecording { run: self.name.clone(), got: number, recordings });
        }
        let kept: Vec<usize> = (starts[number - 1]..end(number - 1)).collect();
        self.keep(&kept);
        self.name = format!("{}#{number}", self.name);
        Ok(())
    }

    /// Leaves only the samples of these numbers, which increase.
    pub(crate) fn keep(&mut self, kept: &[usize]) {
        fn of<T: Copy>(values: &mut Vec<T>, kept: &[usize]) {
            *values = kept.iter().map(|&k| values[k]).collect();
        }
        of(&mut self.time, kept);
        self.signals.iter_mut().for_each(|s| of(&mut s.values, kept));
        if let Some(origin) = &mut self.origin {
            of(&mut origin.numbers, kept);
        }
    }

    /// True if a sample was read from this line of the file.
    pub(crate) fn has_line(&self, line: u64) -> bool {
        self.origin.as_ref().is_some_and(|origin| origin.numbers.binary_search(&line).is_ok())
    }

    /// Where a sample is: `run.csv:1042` or `run.parquet, row 1041` for a run from a file, else the run and the number of the
    /// sample.
    pub fn place_of(&self, sample: usize) -> String {
        match self.origin.as_ref().and_then(|o| Some((o, o.numbers.get(sample)?))) {
            Some((Origin { file, mark: Mark::Line, .. }, line)) => format!("{file}:{line}"),
            #[cfg(feature = "parquet")]
            Some((Origin { file, mark: Mark::Row, .. }, row)) => format!("{file}, row {row}"),
            None => format!("{}, sample {}", self.name, sample + 1),
        }
    }

    /// Refuses what cannot be a run. `column` gives the column in which a signal was logged.
    pub(crate) fn validate(
        &self,
        column: impl Fn(&SignalName) -> String,
        time_column: &str,
    ) -> Result<(), DataError> {
        let n = self.time.len();
        if let Some(signal) = self.signals.iter().find(|s| s.values.len() != n) {
            return Err(DataError::Length {
                run: self.name.clone(),
                signal: signal.name().to_string(),
                got: signal.values.len(),
                expected: n,
            });
        }
        if n < 2 {
            return Err(DataError::TooShort {
                place: self.origin.as_ref().map_or(&self.name, |o| &o.file).clone(),
                got: n,
            });
        }
        self.validate_time(time_column)?;
        for signal in &self.signals {
            self.refuse_non_finite(&signal.values, || column(&signal.name()))?;
            if let Some(k) = signal.values.iter().position(|v| v.abs() > LARGEST) {
                let (place, column, got) = (self.place_of(k), column(&signal.name()), signal.values[k]);
                return Err(DataError::TooLarge { place, column, got, most: LARGEST });
            }
        }
        Ok(())
    }

    /// Refuses a clock that does not go on.
    pub(crate) fn validate_time(&self, time_column: &str) -> Result<(), DataError> {
        self.refuse_non_finite(&self.time, || time_column.into())?;
        match (1..self.time.len()).find(|&k| self.time[k] <= self.time[k - 1]) {
            None => Ok(()),
            Some(k) => {
                let (place, got, previous) = (self.place_of(k), self.time[k], self.time[k - 1]);
                Err(if got == previous {
                    DataError::TimeRepeats { place, got }
                } else {
                    DataError::TimeBackwards { place, got, previous }
                })
            }
        }
    }

    fn refuse_non_finite(&self, values: &[f64], column: impl Fn() -> String) -> Result<(), DataError> {
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(k) => {
                let (all, wrong) = (values.len(), values.iter().filter(|v| !v.is_finite()).count());
                let (more, help) = match wrong {
                    1 => (String::new(), DROP_ROW),
                    _ if wrong == all => (", as all of its rows".to_owned(), "leave the column out"),
                    _ if SLOWER * wrong >= all => (
                        format!(", as {wrong} of its {all} rows"),
                        "a sensor slower than the log? Fill in between its readings, or leave the column out",
                    ),
                    _ => (format!(", as {wrong} of its {all} rows"), DROP_ROW),
                };
                let (place, help) = (self.place_of(k), help.to_owned());
                Err(DataError::NotFinite { place, column: column(), got: values[k], more, help })
            }
        }
    }
}

// FILE@FROM..TO; of a window of a window the times of the file: "log@2..9" from 1 on is "log@3..9".
fn window_name(name: &str, from: f64, to: f64) -> String {
    let number = |x: f64| if x.is_finite() { ((x * 1e6).round() / 1e6).to_string() } else { String::new() };
    let inner = name.rsplit_once('@').and_then(|(file, window)| {
        let (first, last) = window.split_once("..")?;
        let last = if last.is_empty() { f64::INFINITY } else { last.parse::<f64>().ok()? };
        Some((file, if first.is_empty() { 0.0 } else { first.parse::<f64>().ok()? }, last))
    });
    let (file, first, last) = inner.unwrap_or((name, 0.0, f64::INFINITY));
    format!("{file}@{}..{}", number(first + from), number((first + to).min(last)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(n: usize) -> Run {
        let time: Vec<f64> = (0..n).map(|k| 100.0 + k as f64).collect();
        let q = Signal::new(Quantity::JointPosition, "elbow", (0..n).map(|k| k as f64).collect());
        Run::new("ramp".into(), time, vec![q]).unwrap()
    }

    #[test]
    fn two_halves_of_a_run_share_no_sample_and_lose_none() {
        let run = ramp(10);
        let (a, b) = (run.window(0.0, 4.0).unwrap(), run.window(4.0, f64::INFINITY).unwrap());
        assert_eq!((a.name.as_str(), b.name.as_str()), ("ramp@0..4", "ramp@4.."));
        assert_eq!([a.time, b.time].concat(), run.time);
        assert_eq!(b.signals[0].values[0], 4.0);
    }

    #[test]
    fn a_window_without_samples_is_refused_with_the_duration() {
        let message = ramp(10).window(20.0, 30.0).unwrap_err().to_string();
        assert!(message.starts_with("ramp: window 20..30 s holds 0 samples (at least 2; the run lasts 9 s)"));
        assert!(ramp(10).window(5.0, 1.0).is_err());
    }

    #[test]
    fn a_run_in_memory_is_checked_like_a_file() {
        let q = |values| vec![Signal::new(Quantity::JointPosition, "elbow", values)];
        let message = |time: &[f64], values: &[f64]| {
            Run::new("r".into(), time.to_vec(), q(values.to_vec())).unwrap_err().to_string()
        };
        assert!(message(&[0.0, 1.0], &[0.0]).starts_with("r: joint_position.elbow has 1 values, time has 2"));
        assert!(message(&[0.0], &[0.0]).starts_with("r: too few samples (got 1, at least 2)"));
        assert!(message(&[0.0, 0.0], &[0.0, 0.0]).starts_with("r, sample 2: time stamp 0 s is the same"));
        assert!(message(&[1.0, 0.5], &[0.0, 0.0]).starts_with("r, sample 2: time runs backwards (got 0.5 s"));
        assert!(
            message(&[0.0, 1.0], &[0.0, f64::NAN])
                .starts_with("r, sample 2: column \"joint_position.elbow\" is not finite (got NaN)")
        );
        assert!(message(&[0.0, 1.0], &[0.0, -1e300]).contains("no sensor reads that much (got -1e300"));
    }

    #[test]
    fn a_window_of_a_window_has_the_times_of_the_file() {
        assert_eq!(window_name("log", 2.0, 9.0), "log@2..9");
        assert_eq!(window_name("log@2..9", 1.0, f64::INFINITY), "log@3..9");
        assert_eq!(window_name("log@2..", 0.0, 1.5), "log@2..3.5");
        assert_eq!(window_name("a@b", 1.0, f64::INFINITY), "a@b@1..");
    }
}
